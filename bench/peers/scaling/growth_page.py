# SPDX-License-Identifier: BSD-3-Clause
"""Figures, stored numbers and the page examples/guide/scaling.md from the results of run.py."""
import os
import shutil
import subprocess

from growth import (LEVELS, VECTORS, exponent, instructions_ekf, instructions_jml, products_ekf, products_jml)
from ratios import quartiles

NEAR = 0.1  # how far an exponent may be from the expected one before a reason is asked for
SHORT = {"-O2": "O2", "-O3 -march=native": "O3-native"}
REASONS = {  # by study, what was measured, and the sign of the difference
    ("n", "instructions", "-"): "the count leaves out what small steps have most of: checks, the closed forms of small S, entry and return",
    ("n", "instructions", "+"): "the count leaves out what large steps have most of: registers that do not suffice",
    ("n", "time", "-"): "small steps wait for their chains of divisions, square roots and sums, so that the processor does fewer "
                        "instructions in a ns{rates}",
    ("n", "time", "+"): "at n = 30 P, N and A (22 kB) leave part of the first cache level",
    ("p", "instructions", "-"): "what does not grow with p takes more than the count says",
    ("p", "instructions", "+"): "the count leaves out the factor of S, its short rows, and the checks of the innovation",
    ("p", "time", "-"): "what does not grow with p (prediction, the proof, copies) takes more of the time than of the count",
    ("p", "time", "+"): "divisions and square roots of S, one after the other, cost more than an instruction each",
    ("lag", "instructions", "+"): "the windows of 100 of this flight take passes without second derivatives beside those with them, and tests "
                                  "of rounding: twice the instructions; a pass itself grows with L as the line says",
    ("lag", "time", "-"): "the part of a step that does not grow with L takes more of the time than of the instructions",
    ("lag", "time", "+"): "the same passes without second derivatives in the windows of 100",
    ("batch", "time", "-"): "the part of a solution that does not grow with N",
    ("batch", "time", "+"): "from some 10⁴ steps on the trajectory (200 bytes a step) no longer fits the caches: a pass reads it from memory",
}


def number(value):
    return f"{value:.3g}" if value < 1e3 else f"{value:.0f}" if value < 1e6 else f"{value:.2e}"


def spread(ratio):
    return f"{ratio[0]:.2f} [{ratio[1]:.2f}, {ratio[2]:.2f}]" if ratio else ""


def table(head, rows):
    line = lambda cells: "| " + " | ".join(str(cell) for cell in cells) + " |"
    return ["", line(head), "|---|" + "---|" * (len(head) - 1)] + [line(row) for row in rows]


class Results:
    def __init__(self, study):
        self.rows, self.facts, self.runs = study["rows"], study["facts"], study["runs"]
        self.flags = [flags for flags, _ in LEVELS if any(row["flags"] == flags for row in self.rows)]

    def row(self, series, size, unit, flags):
        return next((r for r in self.rows if (r["series"], r["x"], r["unit"], r["flags"]) == (series, size, unit, flags)), None)

    def points(self, series, unit, flags, least=0, most=1e99):
        return sorted((r["x"], r["y"]) for r in self.rows
                      if (r["series"], r["unit"], r["flags"]) == (series, unit, flags) and least <= r["x"] <= most and r["y"] > 0)

    def ratio(self, of, others, size, flags):
        """Over the fastest of the others, in the same rounds; and of instructions, over the least."""
        own = self.row(of, size, "ns", flags)
        rivals = [row for row in (self.row(other, size, "ns", flags) for other in others) if row]
        if own is None or not rivals:
            return None, None
        best = min(rivals, key=lambda row: row["y"])
        counts = [self.row(name, size, "instructions", flags) for name in (of, *others)]
        return (quartiles(own["rounds"], best["rounds"]),
                counts[0]["y"] / min(count["y"] for count in counts[1:]) if all(counts) else None)


def fits(results):
    """One for each curve: study, what, series, flags, range, expected by products and by the count, measured."""
    found = []

    def add(study, what, series, flags, least, most, expected, units):
        measured, used = {}, []
        for unit in units:
            points = results.points(series, unit, flags, least, most)
            if len(points) > 1:
                measured[unit], used = exponent(points), points
        if used:
            found.append({"study": study, "what": what, "series": series, "flags": flags, "from": used[0][0], "to": used[-1][0],
                          "expected": [exponent([(x, f(int(x))) for x, _ in used]) if f else None for f in expected], "measured": measured})

    for flags in results.flags:
        vectors = VECTORS[flags]
        for series, products, counted in (("ekf", products_ekf, lambda n, p: instructions_ekf(n, p, vectors)),
                                          ("jml", products_jml, lambda n, p: instructions_jml(n, p, vectors))):
            name = {"ekf": "EKF", "jml": "JML, one pass"}[series]
            add("n", f"{name}: states n, p = 2", series + "_by_n", flags, 4, 99, (lambda n, f=products: f(n, 2), lambda n, f=counted: f(n, 2)),
                ("instructions", "ns"))
            add("p", f"{name}: measurements p, n = 15", series + "_by_p", flags, 4, 99,
                (lambda p, f=products: f(15, p), lambda p, f=counted: f(15, p)), ("instructions", "ns"))
        for most in (50, 100):
            line = results.points("lag_by_length", "instructions", flags)[:2]
            slope = (line[1][1] - line[0][1]) / (line[1][0] - line[0][0]) if len(line) > 1 else None
            count = (lambda x: line[0][1] + slope * (x - line[0][0])) if slope else None
            add("lag", f"fixed lag: L to {most}", "lag_by_length", flags, 5, most, (lambda x: x, count), ("instructions", "ns"))
    add("batch", "whole flight: steps N, time of a pass", "batch_time", "-O2", 1e3, 1e99, (lambda x: x, None), ("ns of a pass",))
    add("batch", "whole flight: steps N, memory", "batch_memory", "-O2", 1e3, 1e99, (lambda x: x, None), ("bytes",))
    return found


def rates(results):
    """Instructions a ns of the EKF at n = 4 and 30."""
    at = []
    for flags in results.flags:
        both = [[results.row("ekf_by_n", size, unit, flags) for unit in ("instructions", "ns")] for size in (4, 30)]
        if all(row for pair in both for row in pair):
            at.append(" to ".join(f"{count['y'] / time['y']:.1f}" for count, time in both) + f" with {flags}")
    return f": of the EKF at n = 4 and 30, {'; '.join(at)}" if at else ""


def exponents_section(results, found):
    lines = ["", "## Exponents", "",
             "Least squares of the logarithms. *Products*: the exponent of the multiplications of the textbook's loops "
             "(bench/limit.hpp) and of the model over the same sizes; it tends to 3 for large n, and lower powers still count up to "
             "n = 30. *Counted*: that of the instructions of the library's kernels, counted by hand over the same sizes "
             "(`instructions_ekf`, `instructions_jml` in bench/peers/scaling/growth.py): rows are cut into packets of 2 or 4 numbers, "
             "each row and each loop has a begin and an end, the proof that P is positive takes n³/6 products in short rows, matrices are "
             "copied. For a lag it is the line through the instructions at L = 5 and 10: a step has a part that does not grow. "
             "**Expected is what is counted**, where there is a count, and else the products; for N, 1."]
    rows, used = [], {}
    within = of = 0
    for fit in found:
        expected = fit["expected"][1] if fit["expected"][1] is not None else fit["expected"][0]
        cells = []
        for kind, unit in (("instructions", ("instructions",)), ("time", ("ns", "ns of a pass", "bytes"))):
            value = next((fit["measured"][u] for u in unit if u in fit["measured"]), None)
            if value is None:
                cells.append("")
                continue
            off, mark = value - expected, ""
            of += 1
            if abs(off) > NEAR:
                reason = (fit["study"], kind, "+" if off > 0 else "-")
                mark = f": {off:+.2f}, reason {used.setdefault(reason, len(used) + 1)}"
            else:
                within += 1
            cells.append(f"{value:.2f}{mark}")
        counted = "" if fit["expected"][1] is None else f"{fit['expected'][1]:.2f}"
        rows.append([fit["what"], fit["flags"], f"{fit['from']:g}, {fit['to']:g}", f"{fit['expected'][0]:.2f}", counted, *cells])
    lines += table(["against", "flags", "from, to", "products", "counted", "instructions", "time, or memory"], rows)
    if used:
        lines.append("")
    for reason, k in used.items():
        text = REASONS.get(reason, "not found")
        lines.append(f"- Reason {k}: {text.format(rates=rates(results)) if '{rates}' in text else text}.")
    return lines, within, of


def count_table(results):
    """The count by hand beside the instructions: what the expected exponent rests on."""
    rows = []
    for flags in results.flags:
        for series, counted in (("ekf", instructions_ekf), ("jml", instructions_jml)):
            points = dict(results.points(series + "_by_n", "instructions", flags, 4))
            if points:
                rows.append([series.upper(), flags] + [f"{points[n] / counted(n, 2, VECTORS[flags]):.2f}" if n in points else ""
                                                       for n in (4, 6, 8, 10, 15, 20, 30)])
    if not rows:
        return []
    sizes = [f"n = {n}" for n in (4, 6, 8, 10, 15, 20, 30)]
    return ["", "Instructions measured over those counted by hand, p = 2:"] + table(["", "flags"] + sizes, rows)


def steps_section(results):
    lines = []
    for title, suffix, sizes, head in (
            ("A step against the states, p = 2", "_by_n", (2, 3, 4, 6, 8, 10, 15, 20, 30), "n"),
            ("A step against the measurements, n = 15", "_by_p", (1, 2, 3, 4, 6, 8, 10, 12), "p"),
            ("A step of 30 states", "_n30_by_p", (6, 12), "p")):
        rows = []
        for size in sizes:
            for flags in results.flags:
                cells = []
                for name in ("ekf", "ekf_loops", "ekf_eigen", "jml", "jml_loops"):
                    time, count = (results.row(name + suffix, size, unit, flags) for unit in ("ns", "instructions"))
                    cells.append("" if time is None else number(time["y"]) + (f" ({number(count['y'])})" if count else ""))
                if not cells[0]:
                    continue
                both = [results.ratio("ekf" + suffix, ("ekf_loops" + suffix, "ekf_eigen" + suffix), size, flags),
                        results.ratio("jml" + suffix, ("jml_loops" + suffix,), size, flags)]
                text = [spread(time) + (f"; {count:.2f}" if count else "") for time, count in both]
                rows.append([size, flags, *cells[:3], text[0], *cells[3:], text[1]])
        if rows:
            lines += ["", f"## {title}", "",
                      "ns of a step (instructions). Loops: the same written by hand; Eigen: the EKF as a textbook writes it. Ratio: library "
                      "over the faster of loops and Eigen, median [quartiles] of the rounds; then that of the instructions."]
            stem = {"_by_n": "n", "_by_p": "p"}.get(suffix)
            lines += pictures(results, stem) if stem else []
            lines += table([head, "flags", "EKF", "loops", "Eigen", "ratio", "JML", "loops", "ratio"], rows)
    return lines


def pictures(results, stem):
    return [""] + [f"![Against {stem}, {flags}](figures/scaling_{stem}_{SHORT[flags]}.svg)" for flags in results.flags
                   if (stem, flags) in results.drawn] if any((stem, flags) in results.drawn for flags in results.flags) else []


def interval_section(results):
    lines = ["", "## Fixed lag and whole flight, Van der Pol, n = 2"]
    lines += pictures(results, "lag")
    rows = []
    for size in (5, 10, 20, 50, 100):
        cells = []
        for flags in results.flags:
            time, count = (results.row("lag_by_length", size, unit, flags) for unit in ("ns", "instructions"))
            cells.append("" if time is None else number(time["y"]) + (f" ({number(count['y'])})" if count else ""))
        rows.append([size, *cells])
    lines += table(["L"] + [f"ns (instructions) a step, {flags}" for flags in results.flags], rows)
    lines += pictures(results, "batch")
    rows = []
    for row in results.rows:
        if row["series"] == "batch_time":
            memory = results.row("batch_memory", row["x"], "bytes", row["flags"])
            rows.append([f"{row['x']:.0e}", f"{row['y'] / row['x']:.1f}", f"{row['iterations']:.0f}", f"{memory['y'] / row['x']:.0f}",
                         f"{memory['peak_kb'] / 1024:.0f}", len(row["rounds"])])
    lines += table(["N", "ns a step and pass", "passes", "bytes a step", "peak of the process, MB", "runs"], rows)
    if "batch_skipped" in results.facts:
        lines += ["", f"N = {results.facts['batch_skipped']:.0e} was not measured: too little memory on the machine."]
    return lines


def flat(rows):
    """Whether the memory of a lag does not grow: within 64 kB from the shortest to the longest run, and malloc not called."""
    return max(row["y"] for row in rows) - min(row["y"] for row in rows) <= 64 and all(row["allocations"] == 0 for row in rows)


def targets_section(results, within, of):
    lines = ["", "## What was aimed at", ""]
    rows = []
    for size, suffix, where in ((30, "_by_n", "n = 30, p = 2"), (6, "_n30_by_p", "n = 30, p = 6"), (12, "_n30_by_p", "n = 30, p = 12")):
        for flags in results.flags:
            for name, others in (("ekf", ("ekf_loops", "ekf_eigen")), ("jml", ("jml_loops",))):
                time, count = results.ratio(name + suffix, [other + suffix for other in others], size, flags)
                if time:
                    rows.append([name.upper(), where, flags, spread(time), f"{count:.2f}" if count else "",
                                 ("met" if time[0] <= 1.2 else "**missed**") + (", within its scatter" if time[1] < 1.2 < time[2] else "")])
    missed = sum("missed" in row[-1] for row in rows)
    verdict = "**not measured**" if not rows else f"met in all {len(rows)} cases" if not missed else f"**missed** in {missed} of {len(rows)} cases"
    lines.append(f"- n = 30: at most 1.2 × the limit, the faster of loops and Eigen: {verdict}.")
    lag = [row for row in results.rows if row["study"] == "memory"]
    verdict = "**not measured**" if not lag else ("met" if flat(lag) else "**missed**") + f", to {max(row['x'] for row in lag):.0e} steps"
    lines.append(f"- Memory of a fixed lag of 20 is flat over 10⁷ steps, and malloc is never called: {verdict}.")
    lines.append(f"- Exponents within {NEAR} of the expected: {within} of {of}" + ("." if within == of else "; **the others are not**, and have their reason below."))
    if rows:
        lines += table(["", "size", "flags", "time [quartiles]", "instructions", ""], rows)
    if lag:
        lines += ["", "Memory of `FixedLag<20>`, n = 2: that of the process that is no file's; its peak, with the pages of libraries that "
                  "the system happens to map; calls of malloc after the first step:"]
        lines += table(["steps", "own, kB", "peak, kB", "calls"], [[f"{row['x']:.0e}", row["y"], row["peak_kb"], row["allocations"]] for row in lag])
    return lines


def campaign_section(results):
    gains = [(what, results.facts.get("gain_" + what)) for what in ("threads", "ranks")]
    times = {row["series"] + str(row["x"]): row["y"] for row in results.rows if row["study"] == "campaign"}
    rows = [[what, f"{times[what + '1']:.3g}", f"{times[what + '2']:.3g}", spread(gain)] for what, gain in gains if gain]
    lines = ["", "## A campaign on threads and ranks", "",
             "Wall clock on one over that on two, median [quartiles] of the pairs; two cores give at most 2. Threads of one process; "
             "ranks under `mpirun`, one thread each, whose start is outside the clock."]
    lines += table(["", "s on one", "s on two", "gain"], rows) if rows else ["", "Not measured."]
    missing = [what for what, gain in gains if not gain]
    if rows and missing:
        lines += ["", f"Not measured: {', '.join(missing)} (Boost, JSON, Random123 or MPI was not found)."]
    return lines


def curve(results, stem, flags, x):
    """What is expected of the first curve of a figure, but for a factor."""
    if stem == "n":
        return instructions_ekf(int(x), 2, VECTORS[flags])
    line = results.points("lag_by_length", "instructions", flags)[:2] if stem == "lag" else []
    if len(line) < 2:
        return x
    return line[0][1] + (line[1][1] - line[0][1]) / (line[1][0] - line[0][0]) * (x - line[0][0])


def figure(results, guide, stem, title, axis, unit, names, flags):
    """Time against size, and the slope that is expected."""
    curves = [(name, results.points(name, unit, flags)) for name in names]
    curves = [(name, points) for name, points in curves if len(points) > 1]
    if not curves or shutil.which("gnuplot") is None:
        return False
    os.makedirs(os.path.join(guide, "figures"), exist_ok=True)
    path = os.path.join(guide, "figures", f"scaling_{stem}_{SHORT[flags]}.svg")
    ticks = sorted({x for _, points in curves for x, _ in points})
    script = ['set terminal svg size 800,520 font "sans,13" background "white"', f'set output "{path}"', f'set title "{title}, g++ {flags}" noenhanced',
              "set logscale xy", "set grid", "set key left top noenhanced", f'set xlabel "{axis}"', f'set ylabel "{unit}"', 'set format y "%g"',
              "set xtics (" + ", ".join(f'"{x:g}" {x:g}' for x in ticks) + ")", f"set xrange [{ticks[0] / 1.15:g}:{ticks[-1] * 1.15:g}]"]
    plots = []
    for k, (name, points) in enumerate(curves):
        script.append(f"$p{k} << END\n" + "\n".join(f"{x:g} {y:.6g}" for x, y in points) + "\nEND")
        plots.append(f'$p{k} using 1:2 with linespoints pt 7 ps 0.6 title "{name.split("_by_")[0]}"')
    if stem != "p":  # what is expected, through the last point but those of L = 100
        last = [point for point in curves[0][1] if stem != "lag" or point[0] <= 50][-1]
        shape = [(x, curve(results, stem, flags, x) / curve(results, stem, flags, last[0]) * last[1]) for x in ticks]
        script.append("$expected << END\n" + "\n".join(f"{x:g} {y:.6g}" for x, y in shape if x >= 4) + "\nEND")
        plots.append("$expected using 1:2 with lines dt 2 lw 2 lc 'gray' title 'as expected, through the last'")
    done = subprocess.run(["gnuplot"], input="\n".join(script + ["plot " + ", ".join(plots)]) + "\n", text=True, stderr=subprocess.PIPE)
    if done.returncode != 0:
        print("scaling: gnuplot: " + done.stderr.strip())
    return done.returncode == 0


def store(results, found, path):
    """All numbers as name,value,unit, for other pages to quote."""
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        file.write("name,value,unit\n")
        for row in results.rows:
            name = f"{row['series']}/{row['x']:g}/{SHORT[row['flags']]}".replace("+", "")
            what, unit = {"ns": (".ns", "ns"), "instructions": (".instructions", "-"), "ns of a pass": (".ns_of_a_pass", "ns"),
                          "bytes": (".bytes", "B"), "kB": (".own_kb", "kB"), "s": (".s", "s")}[row["unit"]]
            file.write(f"{name}{what},{row['y']:.6g},{unit}\n")
            for key in ("iterations", "peak_kb", "allocations"):
                if key in row:
                    file.write(f"{name}.{key},{row[key]:.6g},-\n")
            if row["unit"] == "ns" and row["series"].startswith(("ekf_by", "ekf_n30", "jml_by", "jml_n30")):
                method, suffix = row["series"].split("_", 1)
                others = [f"{method}_{other}_{suffix}" for other in (("loops", "eigen") if method == "ekf" else ("loops",))]
                ratio = results.ratio(row["series"], others, row["x"], row["flags"])[0]
                for end, value in zip(("", "_q1", "_q3"), ratio or ()):
                    file.write(f"{name}.ratio{end},{value:.6g},-\n")
        for fit in found:
            for unit, value in fit["measured"].items():
                file.write(f"exponent/{fit['series']}/to{fit['to']:g}/{SHORT[fit['flags']]}/{unit.replace(' ', '_')},{value:.4f},-\n".replace("+", ""))
        for what in ("threads", "ranks"):
            if results.facts.get("gain_" + what):
                file.write(f"gain/{what},{results.facts['gain_' + what][0]:.4f},-\n")


def write(study, guide):
    """The page guide/scaling.md, guide/figures/scaling_*.svg and guide/results/scaling.csv."""
    results = Results(study)
    results.drawn = {(stem, flags) for stem, title, axis, unit, names in (
        ("n", "A step against the states, p = 2", "n", "ns", ["ekf_by_n", "ekf_loops_by_n", "ekf_eigen_by_n", "jml_by_n", "jml_loops_by_n"]),
        ("p", "A step against the measurements, n = 15", "p", "ns", ["ekf_by_p", "ekf_loops_by_p", "ekf_eigen_by_p", "jml_by_p", "jml_loops_by_p"]),
        ("lag", "A step of a fixed lag, n = 2", "L", "ns", ["lag_by_length"]),
        ("batch", "A pass of a batch, n = 2", "N", "ns of a pass", ["batch_time"]))
        for flags in results.flags if figure(results, guide, stem, title, axis, unit, names, flags)}
    found = fits(results)
    section, within, of = exponents_section(results, found)
    runs = study["runs"]
    rounds = sorted({run["rounds"] for run in runs.values()})
    lines = ["# How the cost grows", ""]
    if any(run["quick"] for run in runs.values()):
        lines += ["**A quick run, to try the programs: its numbers are not for quoting.**", ""]
    lines += ["How much a step takes with more states, measurements, lag, steps of a flight, threads and ranks. `cmake --workflow "
              "--preset peers` writes this page, on the machine and with the versions named in [peers](peers.md#machine-and-versions); "
              "[how it measures](../../bench/peers/README.md).", "",
              f"Time is of the processor, the median of {' or '.join(str(r) for r in rounds)} rounds in which all sizes take turns, those of one "
              "size next to each other. Instructions are counted one by one, and do not scatter. All numbers: "
              "[results/scaling.csv](results/scaling.csv)."]
    lines += targets_section(results, within, of) + section + count_table(results)
    lines += steps_section(results) + interval_section(results) + campaign_section(results)
    lines += ["", "## Not measured", "", "- Anything with clang++; other models than the dense one by n and p, and Van der Pol by L and N.",
              "- Instructions of a batch; more than two threads or ranks."]
    lines += [f"- {part}: {why}." for part, why in study["facts"].get("not_measured", {}).items()]
    lines += ["", "## Commands", "", "```sh", "cmake --workflow --preset peers                                      # with all of peers.md",
              "JML_PEERS_CONTESTS='scaling_*' cmake --workflow --preset peers         # this page alone",
              "JML_PEERS_CONTESTS=scaling_batch cmake --workflow --preset peers       # or scaling_filters, _lag, _memory, _campaign",
              "```", "", f"Measured {' and '.join(sorted({run['date'] for run in runs.values()}))}, in "
              f"{sum(run['seconds'] for run in runs.values()) / 60:.0f} min without building."]
    os.makedirs(guide, exist_ok=True)
    store(results, found, os.path.join(guide, "results", "scaling.csv"))
    with open(os.path.join(guide, "scaling.md"), "w") as file:
        file.write("\n".join(lines) + "\n")
