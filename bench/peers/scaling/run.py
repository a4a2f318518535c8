#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""How the cost of each estimator grows: with states, measurements, lag, length of a flight, threads and ranks.

run.py --build DIRECTORY --guide DIRECTORY    (Python's standard library alone)
JML_PEERS_QUICK=1    5 rounds in place of 21, g++ -O2 alone, flights to 10^5 steps; the page stays in the build directory
JML_PEERS_BUILD=1    builds and measures nothing
JML_PEERS_CONTESTS=scaling_lag,scaling_batch    these parts alone; the others keep the rows of earlier runs
"""
import argparse
import concurrent.futures
import csv
import fnmatch
import json
import os
import shutil
import statistics
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(1, os.path.dirname(HERE))  # ratios.py

import growth
import growth_page
import ratios

QUICK = os.environ.get("JML_PEERS_QUICK", "") not in ("", "0")
ROUNDS = 5 if QUICK else 21
BUILD_ALONE = os.environ.get("JML_PEERS_BUILD", "") not in ("", "0")
ONLY = [name for name in os.environ.get("JML_PEERS_CONTESTS", "").split(",") if name]
LEVELS = growth.LEVELS[:1] if QUICK else growth.LEVELS
PARTS = {"filters": ("n", "p", "n30"), "lag": ("lag",), "batch": ("batch",), "memory": ("memory",), "campaign": ("campaign",)}


def say(text):
    print(text, flush=True)


def output(command, timeout=1800):
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=timeout)
    if done.returncode != 0:
        raise RuntimeError(f"{os.path.basename(command[0])} ended with {done.returncode}: {done.stderr.strip()[:200]}")
    return done.stdout.splitlines()


class Study:
    def __init__(self, build, earlier):
        self.build, self.rows, self.facts, self.runs = build, earlier["rows"], earlier["facts"], earlier["runs"]

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
            try:
                output(["ninja", "-C", where, "-k", "0", "-j", str(os.cpu_count() or 2)] + [t for t in targets if t in known], 3600)
            except RuntimeError as error:
                say(f"scaling: not all was built: {error}")

    def add(self, study, flags, series, x, y, unit, **more):
        self.rows.append({"study": study, "flags": flags, "series": series, "x": x, "y": y, "unit": unit, **more})

    def measure(self, part):
        """A part anew: its rows and facts take the place of earlier ones."""
        self.rows = [row for row in self.rows if row["study"] not in PARTS[part]]
        begin = time.monotonic()
        try:
            getattr(self, part)()
            self.facts.setdefault("not_measured", {}).pop(part, None)
        except (RuntimeError, OSError, TypeError, subprocess.TimeoutExpired) as error:  # TypeError: a program that is not there
            self.facts.setdefault("not_measured", {})[part] = str(error)
            say(f"scaling: {part} was not measured: {error}")
        self.runs[part] = {"rounds": ROUNDS, "quick": QUICK, "seconds": time.monotonic() - begin,
                           "date": time.strftime("%Y-%m-%d", time.gmtime())}
        say(f"scaling: {part} took {self.runs[part]['seconds']:.0f} s")

    def as_json(self):
        return {"rows": self.rows, "facts": self.facts, "runs": self.runs}

    def sizes(self, name, study_of, steps=1):
        """Time in interleaved rounds and instructions of a step, of every point of a program."""
        say(f"scaling: {name}, instructions")
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:  # before anything is timed
            counts = list(pool.map(lambda level: self.count(level[1], self.program(level[1], name), steps), LEVELS))
        for (flags, directory), counted in zip(LEVELS, counts):
            program = self.program(directory, name)
            say(f"scaling: {name}, g++ {flags}")
            listed = [line.split(",") for line in output([program, "list"])]
            for unit, lines in (("ns", output([program, "time", str(ROUNDS)])),
                                ("instructions", counted)):
                for (series, size, n, p), line in zip(listed, lines):
                    rounds = [float(value) for value in str(line).split(",")]
                    self.add(study_of(series), flags, series, float(size), statistics.median(rounds), unit, n=int(n), p=int(p),
                             **({"rounds": rounds} if unit == "ns" else {}))

    def count(self, directory, program, steps):
        try:
            counter = self.program(directory, "count_instructions")
            return [float(line) / steps for line in output([counter, program, "count", str(steps)], 900)]
        except (RuntimeError, subprocess.TimeoutExpired) as error:
            say(f"scaling: instructions were not counted: {error}")
            return []

    def filters(self):
        self.sizes("scaling_steps", lambda series: series.rsplit("by_", 1)[1] if "n30" not in series else "n30")

    def lag(self):
        self.sizes("scaling_lag", lambda series: "lag", steps=2)

    def batch(self):
        program = self.program("gpp-O2", "scaling_batch")
        largest = 5 if QUICK else 7
        self.facts.pop("batch_skipped", None)
        for power in range(3, largest + 1):
            steps = 10**power
            available = int(next(line.split()[1] for line in open("/proc/meminfo") if line.startswith("MemAvailable")))
            if steps * 0.5 > available:  # kB; it takes about 0.25 a step
                say(f"scaling: 10^{power} steps skipped: too little memory")
                self.facts["batch_skipped"] = steps
                break
            say(f"scaling: batch of 10^{power} steps")
            runs = [[float(v) for v in output([program, str(steps)])[0].split(",")]
                    for _ in range(ROUNDS if power < 6 else 3 if power > 6 or QUICK else 7)]
            self.add("batch", "-O2", "batch_time", steps, statistics.median(run[0] for run in runs) * steps, "ns of a pass",
                     iterations=runs[0][2], rounds=[run[0] for run in runs])
            self.add("batch", "-O2", "batch_memory", steps, runs[0][3] * steps, "bytes", peak_kb=max(run[4] for run in runs))

    def memory(self):
        program = self.program("gpp-O2", "scaling_memory")
        for steps in (10**5, 10**6 if QUICK else 10**7):
            say(f"scaling: memory of a fixed lag, {steps} steps")
            peak, own, asked = (int(v) for v in output([program, str(steps)])[0].split(","))
            self.add("memory", "-O2", "lag_memory", steps, own, "kB", peak_kb=peak, allocations=asked)

    def campaign(self):
        runs = "2048" if QUICK else "8192"
        self.facts.pop("gain_threads", None)
        self.facts.pop("gain_ranks", None)
        alone = self.program("gpp-O2", "scaling_campaign")
        ranks = self.program("gpp-O2", "scaling_campaign_mpi")
        cases = []
        if alone:
            cases += [("threads", t, [alone, runs, str(t)]) for t in (1, 2)]
        if ranks and shutil.which("mpirun"):
            root = ["--allow-run-as-root"] if os.getuid() == 0 else []
            cases += [("ranks", r, ["mpirun", *root, "--oversubscribe", "-n", str(r), ranks, runs, "1"]) for r in (1, 2)]
        times = {(what, count): [] for what, count, _ in cases}
        for _ in range(3 if QUICK else ROUNDS):
            for what, count, command in cases:
                times[what, count].append(float(output(command)[-1]))
        for (what, count), all_times in times.items():
            self.add("campaign", "-O2", what, count, statistics.median(all_times), "s")
        for what in ("threads", "ranks"):
            if times.get((what, 1)):
                self.facts["gain_" + what] = ratios.quartiles(times[what, 1], times[what, 2])

    def write_csv(self):
        columns = ["study", "flags", "series", "x", "y", "unit", "n", "p", "iterations", "peak_kb", "allocations"]
        with open(os.path.join(self.build, "scaling.csv"), "w", newline="") as file:
            writer = csv.DictWriter(file, columns, lineterminator="\n")
            writer.writeheader()
            for row in self.rows:
                writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in row.items() if k in columns})


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True)
    parser.add_argument("--guide", required=True, help="the page, figures/ and results/ go there")
    parser.add_argument("--page-alone", action="store_true", help="from the last run's scaling.json")
    arguments = parser.parse_args()
    build = os.path.abspath(arguments.build)
    guide = os.path.join(build, "quick") if QUICK else os.path.abspath(arguments.guide)
    dump = os.path.join(build, "quick_scaling.json" if QUICK else "scaling.json")
    parts = [part for part in PARTS if not ONLY or any(fnmatch.fnmatchcase("scaling_" + part, pattern) for pattern in ONLY)]
    earlier = {"rows": [], "facts": {}, "runs": {}}
    if os.path.exists(dump) and (ONLY or arguments.page_alone):
        with open(dump) as file:
            earlier = json.load(file)
    study = Study(build, earlier)
    if parts and not arguments.page_alone:
        study.make()
        if BUILD_ALONE:
            return 0
        for part in parts:
            study.measure(part)
            study.write_csv()
            with open(dump + ".new", "w") as file:  # what is measured is kept, whatever happens to the rest
                json.dump(study.as_json(), file, indent=1)
            os.replace(dump + ".new", dump)
    if study.rows:
        growth_page.write(study.as_json(), guide)
        say(f"scaling: {build}/scaling.csv, {guide}/scaling.md, {guide}/figures, {guide}/results/scaling.csv")
    return 0


if __name__ == "__main__":
    sys.exit(main())
