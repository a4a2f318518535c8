#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Builds the contenders of every contest, compares their results, then times them in interleaved rounds.

run.py --build DIRECTORY --guide DIRECTORY    (Python's standard library alone; the protocol is in README.md)
JML_PEERS_QUICK=1             5 rounds in place of 21, g++ -O2 alone; the page stays in the build directory
JML_PEERS_BUILD=1             builds what is asked for and measures nothing: beforehand, on a busy machine
JML_PEERS_CONTESTS=n2,lag_*   these contests alone; the others keep the rows of earlier runs
JML_PEERS_ROUNDS=n
"""
import argparse
import concurrent.futures
import csv
import fnmatch
import glob
import json
import math
import os
import shutil
import statistics
import subprocess
import sys
import time

import page
import ratios

SOURCE = os.path.dirname(os.path.abspath(__file__))
QUICK = os.environ.get("JML_PEERS_QUICK", "") not in ("", "0")
ROUNDS = int(os.environ.get("JML_PEERS_ROUNDS", "5" if QUICK else "21"))
ONLY = [name for name in os.environ.get("JML_PEERS_CONTESTS", "").split(",") if name]
BUILD_ALONE = os.environ.get("JML_PEERS_BUILD", "") not in ("", "0")
SAMPLE_NS = 4e6  # of one inner repeat of a filter's loop

CONFIGS = [
    {"name": compiler + " " + flags, "compiler": compiler, "flags": flags, "level": level,
     "directory": compiler.replace("+", "p") + "-" + level}
    for compiler in ("g++", "clang++-19")
    for flags, level in (("-O2", "O2"), ("-O3 -march=native", "O3-native"))
]


def say(text):
    print(text, flush=True)


def run(command, timeout=600, **more):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=timeout, **more)


def asked_for(name):
    """Whether JML_PEERS_CONTESTS names it; all is asked for where it is empty. scaling/run.py has names of its own."""
    return not ONLY or any(fnmatch.fnmatchcase(name, pattern) for pattern in ONLY)


class Runner:
    def __init__(self, build):
        self.build = build
        self.data = os.path.join(build, "data")
        self.python = os.path.join(build, "venv", "bin", "python")
        self.skipped = {}  # (config, program) or program -> why
        self.reasons = {}  # contender, or (set of flags, contender) -> why, of install-peers.sh and of the builds
        self.contests, self.asked, self.builds, self.not_measured, self.notes = [], [], [], [], []
        for path in sorted(glob.glob(os.path.join(SOURCE, "*.json"))):
            with open(path) as file:
                content = json.load(file)
            self.builds += content.get("builds", [])
            self.not_measured += content.get("not_measured", [])
            self.notes += content.get("notes", [])
            for contest in content["contests"]:
                steps = contest.get("steps")
                for some in steps if isinstance(steps, list) else [steps]:
                    self.contests.append({**contest, "steps": some})
        self.asked = [contest for contest in self.contests if asked_for(contest["name"])]

    # ---- building ----

    def build_all(self):
        for line in self.lines(os.path.join(self.build, "skipped.txt")):
            name, _, why = line.partition(": ")
            self.reasons[name] = why
        self.configs = []
        for config in CONFIGS:
            if QUICK and config["name"] != "g++ -O2":
                continue
            if shutil.which(config["compiler"]) is None:
                say(f"peers: skipped every measurement with {config['compiler']}: not installed")
                self.not_measured.append(f"Anything with {config['compiler']}: it is not installed.")
                continue
            if self.build_config(config):
                self.configs.append(config)
        running = {entry["name"] for contest in self.asked for entry in contest["contenders"]}
        for entry in self.builds:
            if running.isdisjoint([entry["name"], *entry.get("also", [])]):
                continue
            command = [self.fill(word, {}) for word in entry["command"]]
            if entry["name"] in self.reasons or shutil.which(command[0]) is None:
                for name in [entry["name"], *entry.get("also", [])]:
                    self.reasons.setdefault(name, f"{command[0]} is not installed")
                continue
            environment = {**os.environ, **{k: self.fill(v, {}) for k, v in entry.get("environment", {}).items()}}
            say(f"peers: building {entry['name']}")
            done = run(command, 1800, env=environment, cwd=SOURCE)
            if done.returncode != 0:
                say(f"peers: {entry['name']} was not built: {last_line(done.stderr)}")
                for name in [entry["name"], *entry.get("also", [])]:
                    self.reasons.setdefault(name, "did not build: " + last_line(done.stderr))

    def build_config(self, config):
        directory = os.path.join(self.build, config["directory"])
        say(f"peers: building with {config['name']}")
        done = run(["cmake", "-S", SOURCE, "-B", directory, "-G", "Ninja", "-DCMAKE_CXX_COMPILER=" + config["compiler"],
                    "-DJML_PEER_FLAGS=" + config["flags"]])
        if done.returncode != 0:
            say(done.stdout + done.stderr)
            return False
        contests = [contest for contest in self.asked if config["name"] in contest.get("configs", [config["name"]])]
        targets = sorted({self.program(c, e) for c in contests for e in c["contenders"]
                          if "run" not in e and takes_part(e, config)}
                         | {"nothing-" + c.get("program", c["name"]) for c in contests})
        known = {line.split(":")[0] for line in
                 run(["ninja", "-C", directory, "-t", "targets", "all"]).stdout.splitlines()}
        targets = [t for t in targets if t in known]
        jobs = ["-j", str(os.cpu_count() or 2)]
        done = run(["ninja", "-C", directory, "-k", "0"] + jobs + ["write_data", "count_instructions"] + targets, 3600)
        if done.returncode != 0:
            with open(os.path.join(directory, "build.log"), "w") as log:
                log.write(done.stdout + done.stderr)
            say(f"peers: not all was built, see {directory}/build.log")
        for line in self.lines(os.path.join(directory, "skipped.txt")):
            name, _, why = line.partition(": ")
            self.reasons[config["name"], name] = why
        subprocess.run([os.path.join(directory, "write_data"), self.data], check=True)
        return True

    @staticmethod
    def lines(path):
        if not os.path.exists(path):
            return []
        with open(path) as file:
            return [line.strip() for line in file if line.strip()]

    # ---- programs ----

    @staticmethod
    def program(contest, contender):
        return contender["name"] + "-" + contest.get("program", contest["name"])

    def fill(self, text, config):
        return text.format(build=self.build, source=SOURCE, python=self.python, level=config.get("level", ""))

    def command(self, config, contest, contender):
        """The command without its arguments; None, and the reason, where there is none."""
        if not takes_part(contender, config):
            return None, "takes part with other flags"
        for name in (contender["name"], self.program(contest, contender)):
            for key in (name, (config["name"], name)):
                if key in self.reasons:
                    return None, self.reasons[key]
        if "run" in contender:
            command = [self.fill(word.replace("{contest}", contest["name"]), config) for word in contender["run"]]
        else:
            command = [os.path.join(self.build, config["directory"], self.program(contest, contender))]
        for word in command[:2]:
            if os.path.isabs(word) and not os.path.exists(word):
                return None, f"no {os.path.relpath(word, self.build)}"
        return command, None

    def call(self, command, contest, steps, repeat):
        data = os.path.join(self.data, contest.get("data", contest["name"]).format(steps=contest["steps"]) + ".csv")
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        try:
            done = run(command + [data, str(steps), str(repeat)], env=environment)
        except subprocess.TimeoutExpired:
            return None, "no answer within 10 minutes"
        lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
        if done.returncode != 0 or not lines:
            return None, f"ended with {done.returncode}: {last_line(done.stderr)}"
        return json.loads(lines[-1]), None

    # ---- measuring ----

    def measure(self, config, contest):
        """One row for each contender of a contest with one compiler and set of flags."""
        rows, references = [], {}
        for contender in contest["contenders"]:
            row = {"config": config["name"], "contest": contest["name"], "steps": contest["steps"] or "",
                   "contender": contender["name"], "group": contender["group"], "what": contender["what"], "against": contender.get("against")}
            command, why = self.command(config, contest, contender)
            if command is None:
                if why.startswith("takes part"):
                    continue
                rows.append({**row, "status": "skipped", "why": why})
                continue
            steps = contest["steps"] or contest["check_steps"]
            line, why = self.call(command, contest, steps, 1)
            if line is None:
                rows.append({**row, "status": "failed", "why": why})
                continue
            row.update(command=command, line=line, status="timed", why="")
            if not line.get("usable", True):
                row.update(status="failed", why="reports a failure of its own")
            reference = references.get(contender["group"])
            row["reference"] = contender["name"] if reference is None else reference["contender"]
            if reference is None:
                if row["status"] == "timed":
                    references[contender["group"]] = row
            else:
                for key in ("x", "P_diagonal") if contender.get("tolerance") is not None else ():
                    row["difference_" + key] = difference(line.get(key), reference["line"].get(key))
                worst = max((row["difference_" + key] for key in ("x", "P_diagonal")
                             if row.get("difference_" + key) is not None), default=0)
                if contender.get("tolerance") is not None and not worst <= contender["tolerance"]:
                    row.update(status="different result", why=f"{worst:.2g} from {row['reference']}")
                for key, tolerance in contest.get("tolerance_of", {}).items():
                    a, b = line.get(key), reference["line"].get(key)
                    if a is None or b is None or not abs(a - b) <= tolerance * abs(b):
                        row.update(status="different result", why=f"{key} {a} where {row['reference']} has {b}")
            for key in ("allocations_per_step", "peak_kb", "state_bytes"):
                row[key] = line.get(key)
            for key in contest.get("show", []):
                row[key] = line.get(key)
            row["code_bytes"] = self.code_size(config, contest, command, contender)
            rows.append(row)
            say(f"  {config['name']:<28} {contest['name']:<12} {contender['name']:<20} {row['status']} {row['why']}")
        timed = [row for row in rows if row["status"] == "timed"]
        by_name = {contender["name"]: contender for contender in contest["contenders"]}
        with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:  # before anything is timed
            counts = pool.map(lambda row: self.count(config, contest, by_name[row["contender"]], row["command"]), timed)
            for row, count in zip(timed, counts):
                row["instructions_per_step"] = count
        repeats = {contender["name"]: contender["repeat"] for contender in contest["contenders"] if "repeat" in contender}
        for row in timed:
            rough = max(row["line"]["ns_per_step"], 1)
            row["timed_steps"] = contest["steps"] or max(64, 64 * round(SAMPLE_NS / rough / 64))
            row["repeat"] = repeats.get(row["contender"], contest.get("repeat", 5 if not contest["steps"] else 1))
            row["rounds"] = []
        for i in range(ROUNDS):
            turn = i % max(1, len(timed))
            for row in timed[turn:] + timed[:turn]:  # another one is first in each round
                line, why = self.call(row["command"], contest, row["timed_steps"], row["repeat"])
                if line is None:
                    row.update(status="failed", why=why)
                    continue
                row["rounds"].append(line["ns_per_step"])
        by_name = {row["contender"]: row for row in timed}
        for row in timed:
            if row["status"] != "timed":
                continue
            row["ns_per_step"] = statistics.median(row["rounds"])
            row["ratio"] = ratio(row, by_name.get(row["against"] or row["reference"]))
        self.against_best(rows)
        return rows

    @staticmethod
    def against_best(rows):
        """jml's contender of a group against the best of the others, in the same rounds."""
        for row in rows:
            if row["status"] != "timed" or not row["contender"].startswith("jml"):
                continue
            others = [other for other in rows if other["status"] == "timed" and other["group"] == row["group"]
                      and not other["contender"].startswith("jml")]
            if others:
                best = min(others, key=lambda other: other["ns_per_step"])
                row["best"], row["ratio_best"] = best["contender"], ratio(row, best)

    def code_size(self, config, contest, command, contender):
        """Bytes of code and constants beyond those of the harness around nothing."""
        nothing = os.path.join(self.build, config["directory"], "nothing-" + contest.get("program", contest["name"]))
        if "nothing" in contender:
            nothing = self.fill(contender["nothing"], config)
        if contender.get("code") == "unknown" or not os.path.exists(nothing):
            return None
        sizes = []
        for path in (command[0], nothing):
            fields = run(["size", path]).stdout.splitlines()
            if len(fields) < 2:
                return None
            sizes.append(int(fields[1].split()[0]))
        return sizes[0] - sizes[1]

    def count(self, config, contest, contender, command):
        """Instructions of one step: what some more steps take."""
        steps = contender.get("count_steps", contest.get("count_steps"))
        if not steps or ("count" in contender and contender["count"] is None):
            return None
        counter = os.path.join(self.build, config["directory"], "count_instructions")
        data = os.path.join(self.data, contest.get("data", contest["name"]).format(steps=contest["steps"]) + ".csv")
        try:
            done = run([counter] + command + [data, str(steps), "count"], 300)
            few, many = (int(line) for line in done.stdout.split())
            return (many - few) / (steps - steps // 4)
        except (ValueError, subprocess.TimeoutExpired, OSError):
            return None


def takes_part(contender, config):
    only = contender.get("only", {})
    return all(config[key] in only.get(plural, [config[key]])
               for key, plural in (("name", "configs"), ("compiler", "compilers"), ("level", "levels")))


def last_line(text):
    lines = [line for line in text.splitlines() if line.strip()]
    return lines[-1][:200] if lines else "no message"


def difference(a, b):
    """Largest difference, relative to the norm of b."""
    if not a and not b:
        return None
    if not a or not b or len(a) != len(b):
        return math.inf
    norm = math.sqrt(sum(value * value for value in b))
    return max(abs(u - v) if math.isfinite(u - v) else math.inf for u, v in zip(a, b)) / max(norm, 1e-300)


def ratio(row, other):
    """Median and quartiles of row / other in the same rounds."""
    if other is None or not other.get("rounds") or len(other["rounds"]) != len(row["rounds"]):
        return None
    return ratios.quartiles(row["rounds"], other["rounds"])


def write_csv(path, rows, shown):
    columns = ["config", "contest", "steps", "contender", "group", "reference", "status", "why", "ns_per_step",
               "ratio", "ratio_q1", "ratio_q3", "best", "ratio_best", "ratio_best_q1", "ratio_best_q3",
               "instructions_per_step", "allocations_per_step", "code_bytes", "state_bytes", "peak_kb",
               "difference_x", "difference_P_diagonal"] + shown
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        for row in rows:
            flat = dict(row)
            for key in ("ratio", "ratio_best"):
                if row.get(key):
                    flat[key], flat[key + "_q1"], flat[key + "_q3"] = row[key]
            writer.writerow({key: f"{value:.6g}" if isinstance(value, float) else value
                             for key, value in flat.items() if key in columns})


def merged(earlier, runner, contest, rows, seconds):
    """Earlier results with the rows of a contest that has been measured anew; in the order of the contests."""
    key = page.key(contest)
    earlier["rows"] = [row for row in earlier["rows"] if page.key_of(row) != key] + rows
    place = {page.key(c): i for i, c in enumerate(runner.contests)}
    earlier["rows"] = sorted((row for row in earlier["rows"] if page.key_of(row) in place),
                             key=lambda row: place[page.key_of(row)])  # stable: rows of a contest stay in order
    earlier["runs"][key] = {"rounds": ROUNDS, "seconds": seconds, "processor": page.processor(), "quick": QUICK, "jml": page.jml(),
                            "date": time.strftime("%Y-%m-%d", time.gmtime())}
    return earlier


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", required=True)
    parser.add_argument("--guide", required=True, help="the page, figures/ and results/ go there")
    parser.add_argument("--page-alone", action="store_true", help="from the last run's results.json")
    arguments = parser.parse_args()
    build = os.path.abspath(arguments.build)
    guide = os.path.join(build, "quick") if QUICK else os.path.abspath(arguments.guide)
    os.makedirs(build, exist_ok=True)
    dump = os.path.join(build, "quick.json" if QUICK else "results.json")
    runner = Runner(build)
    wrong = [pattern for pattern in ONLY if not pattern.startswith("scaling")
             and not any(fnmatch.fnmatchcase(contest["name"], pattern) for contest in runner.contests)]
    if wrong:
        names = dict.fromkeys(contest["name"] for contest in runner.contests)
        say(f"peers: no contest {', '.join(wrong)}; there are {', '.join(names)}, scaling_filters, scaling_lag, "
            "scaling_batch, scaling_memory, scaling_campaign")
        return 2
    results = {"rows": [], "runs": {}}
    if os.path.exists(dump) and (ONLY or arguments.page_alone):
        with open(dump) as file:
            results = json.load(file)
    if runner.asked and not arguments.page_alone:
        runner.build_all()
        if BUILD_ALONE:
            return 0
        for contest in runner.asked:
            begin, rows = time.monotonic(), []
            for config in runner.configs:
                only = contest.get("configs")
                if not only or config["name"] in only:
                    rows += runner.measure(config, contest)
            for row in rows:
                row.pop("command", None)
            took = time.monotonic() - begin
            say(f"peers: {page.key(contest)} took {took:.0f} s")
            results = merged(results, runner, contest, rows, took)
            results.update(contests=runner.contests, configs=runner.configs if not ONLY else
                           results.get("configs", runner.configs), not_measured=runner.not_measured,
                           notes=runner.notes, versions=page.versions(runner))
            with open(dump + ".new", "w") as file:  # what is measured is kept, whatever happens to the rest
                json.dump(results, file, indent=1)
            os.replace(dump + ".new", dump)
    if not results["rows"]:
        return 0
    shown = sorted({key for contest in runner.contests for key in contest.get("show", [])})
    write_csv(os.path.join(build, "results.csv"), results["rows"], shown)
    page.write(results, guide)
    say(f"peers: {build}/results.csv, {guide}/peers.md, {guide}/figures, {guide}/results/peers.csv")
    return 0


if __name__ == "__main__":
    sys.exit(main())
