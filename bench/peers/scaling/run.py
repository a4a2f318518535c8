#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How the cost of each estimator grows: with states, measurements, lag, length of a flight, threads and ranks.

run.py --build DIRECTORY --page FILE    (Python's standard library alone)
JML_PEERS_QUICK=1    5 rounds in place of 21, flights to 10^5 steps
"""
import argparse
import csv
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
QUICK = os.environ.get("JML_PEERS_QUICK", "") not in ("", "0")
ROUNDS = 5 if QUICK else 21
LEVELS = [("-O2", "gpp-O2"), ("-O3 -march=native", "gpp-O3-native")]
NEAR = 0.1  # how far an exponent may be from the expected one before a reason is asked for


def say(text):
    print(text, flush=True)


def output(command, timeout=1800):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=timeout)
    if done.returncode != 0:
        raise RuntimeError(f"{os.path.basename(command[0])} ended with {done.returncode}: {done.stderr.strip()[:200]}")
    return done.stdout.splitlines()


def exponent(points):
    """Least squares of log y against log x."""
    logs = [(math.log(x), math.log(y)) for x, y in points]
    mean_x, mean_y = (statistics.fmean(v[i] for v in logs) for i in (0, 1))
    return sum((u - mean_x) * (v - mean_y) for u, v in logs) / sum((u - mean_x)**2 for u, _ in logs)


def polynomial(points, powers=(1, 2, 3)):
    """Least squares, relative, of y by powers of x, each with a coefficient of at least zero: {power: coefficient}."""
    rows = [[x**k / y for k in powers] for x, y in points]
    size = len(powers)
    A = [[sum(r[i] * r[j] for r in rows) for j in range(size)] + [sum(r[i] for r in rows)] for i in range(size)]
    for i in range(size):  # the matrix is positive definite: no exchanges
        for j in range(i + 1, size):
            factor = A[j][i] / A[i][i]
            A[j] = [a - factor * b for a, b in zip(A[j], A[i])]
    found = [0.0] * size
    for i in reversed(range(size)):
        found[i] = (A[i][size] - sum(A[i][j] * found[j] for j in range(i + 1, size))) / A[i][i]
    kept = tuple(k for k, c in zip(powers, found) if c > 0)
    return dict(zip(powers, found)) if len(kept) == size else polynomial(points, kept)


def products_ekf(n, p):
    """Multiplications of the loops of bench/limit.hpp and of the model, tests/models/dense.hpp."""
    model = n * n + 3 * n + 3 * n * p
    prediction = n**3 + n * n * (n + 1) / 2
    correction = p * n * n + n * p * (p + 1) / 2 + p**3 / 6 + n * p * p / 2 + 2 * n * p + p * n * (n + 1) / 2
    return model + prediction + correction


def products_jml(n, p):
    model = n * n + 5 * n + 5 * n * p
    return model + 2 * n**3 + 2 * p * n * n + n * p * p + p**3 / 3 + n * p * p + n * p + p * n * n


class Study:
    def __init__(self, build):
        self.build, self.rows, self.fits, self.facts = build, [], [], {}

    def program(self, directory, name):
        path = os.path.join(self.build, directory, name)
        return path if os.path.exists(path) else None

    def make(self):
        for flags, directory in LEVELS:
            where = os.path.join(self.build, directory)
            say(f"scaling: building with g++ {flags}")
            output(["cmake", "-S", os.path.dirname(HERE), "-B", where, "-G", "Ninja", "-DCMAKE_CXX_COMPILER=g++",
                    "-DJML_PEER_FLAGS=" + flags])
            targets = ["count_instructions", "scaling_steps", "scaling_lag"]
            if flags == "-O2":
                targets += ["scaling_batch", "scaling_memory", "scaling_campaign", "scaling_campaign_mpi"]
            known = {line.split(":")[0] for line in output(["ninja", "-C", where, "-t", "targets", "all"])}
            output(["ninja", "-C", where, "-j", str(os.cpu_count() or 2)] + [t for t in targets if t in known], 3600)

    def add(self, study, flags, series, x, y, unit, **more):
        self.rows.append({"study": study, "flags": flags, "series": series, "x": x, "y": y, "unit": unit, **more})

    def points(self, study, flags, series, unit):
        return sorted((r["x"], r["y"]) for r in self.rows
                      if (r["study"], r["flags"], r["series"], r["unit"]) == (study, flags, series, unit))

    def fit(self, study, flags, series, unit, expected, least, what, most=math.inf):
        points = [(x, y) for x, y in self.points(study, flags, series, unit) if least <= x <= most and y > 0]
        if len(points) >= 2:
            wanted = exponent([(x, expected(x)) for x, _ in points]) if callable(expected) else expected
            self.fits.append({"study": study, "flags": flags, "series": series, "unit": unit, "what": what,
                              "from": points[0][0], "to": points[-1][0], "expected": wanted, "measured": exponent(points)})

    def sizes(self, name, study_of):
        """Time in interleaved rounds and instructions of a step, of every point of a program."""
        for flags, directory in LEVELS:
            program = self.program(directory, name)
            say(f"scaling: {name}, g++ {flags}")
            listed = [line.split(",") for line in output([program, "list"])]
            for unit, lines in (("ns", output([program, "time", str(ROUNDS)])),
                                ("instructions", self.count(directory, program))):
                for (series, size, n, p), value in zip(listed, lines):
                    self.add(study_of(series), flags, series, float(size), float(value), unit, n=int(n), p=int(p))

    def count(self, directory, program, steps=2):
        try:
            counter = self.program(directory, "count_instructions")
            return [float(line) / steps for line in output([counter, program, "count", str(steps)], 900)]
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            say(f"scaling: instructions were not counted: {error}")
            return []

    def filters(self):
        self.sizes("scaling_steps", lambda series: series.rsplit("by_", 1)[1] if "n30" not in series else "n30")
        for flags, _ in LEVELS:
            for unit in ("instructions", "ns"):
                for series, formula in (("ekf", products_ekf), ("ekf_loops", products_ekf), ("ekf_eigen", products_ekf),
                                        ("jml", products_jml), ("jml_loops", products_jml)):
                    self.fit("n", flags, series + "_by_n", unit, lambda n, f=formula: f(n, 2), 10, "states n, p = 2")
                    self.share(flags, series + "_by_n", unit, lambda n, f=formula: f(n, 2))
                    self.fit("p", flags, series + "_by_p", unit, lambda p, f=formula: f(15, p), 4,
                             "measurements p, n = 15")

    def share(self, flags, series, unit, formula):
        """How much of a step grows with n³, at n = 10 and 30: measured, and of the multiplications."""
        points = [(x, y) for x, y in self.points("n", flags, series, unit) if x >= 4]
        if len(points) < 4:
            return
        of = {"series": series, "flags": flags, "unit": unit}
        for name, curve in (("measured", points), ("products", [(x, formula(x)) for x, _ in points])):
            parts = polynomial(curve)
            of[name] = [parts.get(3, 0) * n**3 / sum(c * n**k for k, c in parts.items()) for n in (10, 30)]
        self.facts.setdefault("shares", []).append(of)

    def lag(self):
        self.sizes("scaling_lag", lambda series: "lag")
        for flags, _ in LEVELS:
            for unit in ("instructions", "ns"):
                self.fit("lag", flags, "lag_by_length", unit, 1.0, 5, "lag L")
                self.fit("lag", flags, "lag_by_length", unit, 1.0, 5, "lag L to 50", most=50)

    def batch(self):
        program = self.program("gpp-O2", "scaling_batch")
        largest = 5 if QUICK else 7
        for power in range(3, largest + 1):
            steps = 10**power
            available = int(next(line.split()[1] for line in open("/proc/meminfo") if line.startswith("MemAvailable")))
            if steps * 0.5 > available:  # kB; it takes about 0.25 a step
                say(f"scaling: 10^{power} steps skipped: too little memory")
                self.facts["batch_skipped"] = steps
                break
            say(f"scaling: batch of 10^{power} steps")
            runs = [[float(v) for v in output([program, str(steps)])[0].split(",")] for _ in range(3 if power < 7 else 1)]
            best = min(runs)
            self.add("batch", "-O2", "batch_time", steps, best[0] * steps, "ns of a pass", iterations=best[2])
            self.add("batch", "-O2", "batch_memory", steps, best[3] * steps, "bytes", peak_kb=best[4])
        self.fit("batch", "-O2", "batch_time", "ns of a pass", 1.0, 1e3, "steps N, time of a pass")
        self.fit("batch", "-O2", "batch_memory", "bytes", 1.0, 1e3, "steps N, memory")

    def memory(self):
        program = self.program("gpp-O2", "scaling_memory")
        for steps in (10**5, 10**6 if QUICK else 10**7):
            say(f"scaling: memory of a fixed lag, {steps} steps")
            peak, own, asked = (int(v) for v in output([program, str(steps)])[0].split(","))
            self.add("memory", "-O2", "lag_memory", steps, own, "kB", peak_kb=peak, allocations=asked)

    def campaign(self):
        runs = "512" if QUICK else "4096"
        alone = self.program("gpp-O2", "scaling_campaign")
        ranks = self.program("gpp-O2", "scaling_campaign_mpi")
        cases = []
        if alone:
            cases += [("threads", t, [alone, runs, str(t)]) for t in (1, 2)]
        if ranks and shutil.which("mpirun"):
            root = ["--allow-run-as-root"] if os.getuid() == 0 else []
            cases += [("ranks", r, ["mpirun", *root, "--oversubscribe", "-n", str(r), ranks, runs, "1"]) for r in (1, 2)]
        times = {(what, count): [] for what, count, _ in cases}
        for _ in range(3 if QUICK else 7):
            for what, count, command in cases:
                times[what, count].append(float(output(command)[-1]))
        for (what, count), all_times in times.items():
            self.add("campaign", "-O2", what, count, statistics.median(all_times), "s")
        for what in ("threads", "ranks"):
            if times.get((what, 1)):
                gains = sorted(a / b for a, b in zip(times[what, 1], times[what, 2]))
                self.facts["gain_" + what] = [gains[len(gains) // 2], gains[0], gains[-1]]

    def write_csv(self):
        columns = ["study", "flags", "series", "x", "y", "unit", "n", "p", "iterations", "peak_kb", "allocations"]
        with open(os.path.join(self.build, "scaling.csv"), "w", newline="") as file:
            writer = csv.DictWriter(file, columns, lineterminator="\n")
            writer.writeheader()
            for row in self.rows:
                writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items()})


# ---- the page ----

def figure(build, rows, stem, title, axis, unit, flags):
    chosen = [row for row in rows if row["unit"] == unit and row["flags"] == flags]
    if not chosen or shutil.which("gnuplot") is None:
        return
    names = list(dict.fromkeys(row["series"] for row in chosen))
    script = ['set terminal svg size 800,520 font "sans,13"', f'set output "{build}/scaling_{stem}.svg"',
              f'set title "{title}, g++ {flags}"', "set logscale xy", "set grid", "set key left top",
              f'set xlabel "{axis}"', f'set ylabel "{unit}"']
    plots = []
    for k, name in enumerate(names):
        script.append(f"$p{k} << END\n" + "\n".join(f"{row['x']} {row['y']}" for row in chosen if row["series"] == name) + "\nEND")
        plots.append(f'$p{k} using 1:2 with linespoints pt 7 ps 0.6 title "{name}" noenhanced')
    done = subprocess.run(["gnuplot"], input="\n".join(script + ["plot " + ", ".join(plots)]) + "\n", text=True,
                          stderr=subprocess.PIPE)
    if done.returncode != 0:
        say("scaling: gnuplot: " + done.stderr.strip())


REASONS = {
    ("n", "-"): "what grows with n and n² (rows and columns that begin and end, half-filled vectors, checks) takes a larger part of "
                "a step than of the multiplications; the table below says how much, and it shrinks with n: 3 is not reached "
                "at n = 30",
    ("n", "+"): "a row of up to 4 or 8 numbers is kept in registers, a longer one is not; at n = 30 P, N and A leave the first "
                "cache level in part",
    ("p", "-"): "the parts that do not grow with p (prediction, n³) cost more than their multiplications say",
    ("p", "+"): "division, square root and the short rows of S cost more than their multiplications say; p up to 3 is solved in "
                "closed form",
    ("lag", "-"): "the part of a step that does not depend on L (arrival cost, report)",
    ("lag", "+"): "where the row to 50 is near 1 and that to 100 is not: the windows of 100 of this flight take passes without second "
                  "derivatives beside those with them, and tests of rounding (by the instructions of each function at 100; not counted "
                  "at 50); a pass itself is linear in L",
    ("batch", "-"): "the part of a solution that does not depend on N",
    ("batch", "+"): "from 10⁴ steps on the trajectory (200 bytes a step) no longer fits the caches: a pass reads it from memory",
}


def number(value):
    return f"{value:.3g}" if value < 1e4 else f"{value:.0f}" if value < 1e6 else f"{value:.2e}"


def write_page(study, path):
    lines = [
        "# How the cost grows", "",
        "Written by `cmake --workflow --preset peers` (bench/peers/scaling/run.py) on the machine named in "
        "[peers.md](peers.md). Time: of the processor, the median of "
        f"{study['rounds']} rounds in which all sizes take turns. Instructions: counted one by one, exact. Exponents: least squares of "
        "the logarithms over the sizes named. Expected: that of the multiplications of the textbook's loops "
        "(bench/limit.hpp) and of the model over the same sizes, which tends to 3 for large n and is less up to n = 30; 1 "
        "for a lag and a flight.", "",
        "Every number is in build/peers/scaling.csv, figures are build/peers/scaling_*.svg.", "",
        "## Exponents", "",
        "| against | what | flags | unit | from, to | expected | measured | |", "|---|---|---|---|---|---|---|---|"]
    used = {}
    for fit in study["fits"]:
        off = fit["measured"] - fit["expected"]
        mark = "within 0.1"
        if abs(off) > NEAR:
            key = (fit["study"], "+" if off > 0 else "-")
            used.setdefault(key, len(used) + 1)
            mark = f"{off:+.2f}: reason {used[key]}"
        lines.append(f"| {fit['what']} | {fit['series']} | {fit['flags']} | {fit['unit']} | {fit['from']:g}, {fit['to']:g} | "
                     f"{fit['expected']:.2f} | {fit['measured']:.2f} | {mark} |")
    lines += [""] + [f"Reason {k}: {REASONS[key]}." for key, k in used.items()]
    shares = study["facts"].get("shares", [])
    if shares:
        lines += ["", "The part of a step that grows with n³, by a polynomial without constant fitted to n = 4 … 30 (coefficients at least zero):", "",
                  "| what | flags | unit | at n = 10 | at n = 30 | of the multiplications, 10 | 30 |", "|---|---|---|---|---|---|---|"]
        lines += [f"| {of['series']} | {of['flags']} | {of['unit']} | " + " | ".join(f"{100 * v:.0f} %" for v in of["measured"] + of["products"]) + " |"
                  for of in shares]
    rows = study["rows"]

    def value(series, size, unit, flags):
        return next((r["y"] for r in rows if (r["series"], r["x"], r["unit"], r["flags"]) == (series, size, unit, flags)), None)

    for title, suffix, sizes, head in (
            ("A step against the states, p = 2", "_by_n", (2, 3, 4, 6, 8, 10, 15, 20, 30), "n"),
            ("A step against the measurements, n = 15", "_by_p", (1, 2, 3, 4, 6, 8, 10, 12), "p"),
            ("n = 30", "_n30_by_p", (6, 12), "p")):
        if not any(row["series"] == "ekf" + suffix for row in rows):
            continue
        lines += ["", f"## {title}", "",
                  "ns of a step (instructions). EKF and one-pass JML of the library; loops: the same written by hand; Eigen: the EKF "
                  "as a textbook writes it. Ratio: library over the faster of loops and Eigen, in time and in instructions.", "",
                  f"| {head} | flags | EKF | loops | Eigen | ratio | JML | loops | ratio |", "|---|---|---|---|---|---|---|---|---|"]
        for size in sizes:
            for flags, _ in LEVELS:
                cell = {k: [value(k + suffix, size, unit, flags) for unit in ("ns", "instructions")]
                        for k in ("ekf", "ekf_loops", "ekf_eigen", "jml", "jml_loops")}
                if cell["ekf"][0] is None:
                    continue
                text = lambda k: number(cell[k][0]) + (f" ({number(cell[k][1])})" if cell[k][1] else "")

                def ratio(of, others):
                    both = [cell[of][i] / min(cell[o][i] for o in others)
                            for i in (0, 1) if cell[of][i] and all(cell[o][i] for o in others)]
                    return ", ".join(f"{r:.2f}" for r in both)
                lines.append(f"| {size} | {flags} | {text('ekf')} | {text('ekf_loops')} | {text('ekf_eigen')} | "
                             f"{ratio('ekf', ('ekf_loops', 'ekf_eigen'))} | {text('jml')} | {text('jml_loops')} | "
                             f"{ratio('jml', ('jml_loops',))} |")
    lines += ["", "## Fixed lag and whole flight, Van der Pol, n = 2", "", "| L | " + " | ".join(
        f"ns (instructions) a step, {flags}" for flags, _ in LEVELS) + " |", "|---|---|---|"]
    for size in (5, 10, 20, 50, 100):
        cells = []
        for flags, _ in LEVELS:
            ns, count = (value("lag_by_length", size, unit, flags) for unit in ("ns", "instructions"))
            cells.append("" if ns is None else number(ns) + (f" ({number(count)})" if count else ""))
        lines.append(f"| {size} | " + " | ".join(cells) + " |")
    lines += ["", "Where L = 100 takes more than twice the instructions of L = 50, its windows take passes without second derivatives beside "
              "those with them; the exponent to 100 then is 1 by two errors that cancel, and the one to 50 shows the constant part alone."]
    lines += ["", "| N | ns a step and pass | passes | bytes a step | peak of the process, MB |", "|---|---|---|---|---|"]
    memory = {row["x"]: row for row in rows if row["series"] == "batch_memory"}
    for row in rows:
        if row["series"] == "batch_time":
            lines.append(f"| {row['x']:.0e} | {row['y'] / row['x']:.1f} | {row['iterations']:.0f} | "
                         f"{memory[row['x']]['y'] / row['x']:.0f} | {memory[row['x']]['peak_kb'] / 1024:.0f} |")
    lag = [row for row in rows if row["study"] == "memory"]
    if lag:
        lines += ["", "## Memory of a fixed lag", "",
                  "`FixedLag<20>`, n = 2: memory of the process that is no file's, its peak with the pages of libraries that the system "
                  "happens to map, and calls of malloc after the first step: "
                  + "; ".join(f"{row['x']:.0e} steps: {row['y']} kB, {row['peak_kb']} kB, {row['allocations']} calls" for row in lag) + "."]
    lines += ["", "## A campaign on threads and ranks", "",
              "Wall clock on one over that on two, median (least, largest) of the rounds; two cores give at most 2: "
              + ("; ".join(f"{what} {g[0]:.2f} ({g[1]:.2f}, {g[2]:.2f})" for what, g in
                           ((w, study["facts"].get("gain_" + w)) for w in ("threads", "ranks")) if g) or "not measured") + "."]
    with open(path, "w") as file:
        file.write("\n".join(lines) + "\n")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True)
    parser.add_argument("--page", required=True)
    parser.add_argument("--only", default="", help="some of filters,lag,batch,memory,campaign")
    parser.add_argument("--page-alone", action="store_true", help="from the last run's scaling.json")
    arguments = parser.parse_args()
    build = os.path.abspath(arguments.build)
    dump = os.path.join(build, "scaling.json")
    if not arguments.page_alone:
        study = Study(build)
        begin = time.monotonic()
        study.make()
        built = time.monotonic()
        for part in ("filters", "lag", "batch", "memory", "campaign"):
            if not arguments.only or part in arguments.only.split(","):
                getattr(study, part)()
        study.write_csv()
        with open(dump, "w") as file:
            json.dump({"rows": study.rows, "fits": study.fits, "facts": study.facts, "rounds": ROUNDS,
                       "seconds": [built - begin, time.monotonic() - built]}, file, indent=1)
    with open(dump) as file:
        study = json.load(file)
    for stem, title, axis, unit in (("n", "a step against the states, p = 2", "n", "ns"),
                                    ("p", "a step against the measurements, n = 15", "p", "ns"),
                                    ("lag", "a step of a fixed lag, n = 2", "L", "ns"),
                                    ("batch", "a pass of a batch, n = 2", "N", "ns of a pass")):
        for flags, directory in LEVELS:
            figure(build, [row for row in study["rows"] if row["study"] == stem],
                   f"{stem}_{directory.removeprefix('gpp-')}", title, axis, unit, flags)
    write_page(study, arguments.page)
    say(f"scaling: {build}/scaling.csv, {os.path.abspath(arguments.page)}")


if __name__ == "__main__":
    sys.exit(main())
