# SPDX-License-Identifier: BSD-3-Clause
"""Figures, stored numbers and the page examples/guide/peers.md from the results of run.py."""
import os
import platform
import shutil
import subprocess

from ratios import quartiles

CELL = 120  # characters of a table's cell, at most
SETS = {"g++ -O2": "gpp-O2", "g++ -O3 -march=native": "gpp-O3-native", "clang++-19 -O2": "clangpp-19-O2",
        "clang++-19 -O3 -march=native": "clangpp-19-O3-native"}  # as the stored names have them

# What is aimed at: a title, then (contests with steps, contender of jml, the other contenders or None for the best of its
# group, and the ratio: at most (time of jml / time of the other), or at least (time of the other / time of jml).
TARGETS = [
    ("EKF: at most 1.1 × the best of all contenders, the plain loops among them",
     ["n2", "n6", "n15", "strapdown/6000"], "jml_ekf", None, "most", 1.1),
    ("JML in one pass: at most 1.1 × its limit in plain loops", ["n2", "n6", "n15"], "jml_one_pass", ["loops_jml"], "most", 1.1),
    ("JML with the exact step, n = 2: at most 8 × the library's EKF", ["n2"], "jml_iterated", ["jml_ekf"], "most", 8),
    ("JML with the exact step, n = 6: at most 6 × the library's EKF", ["n6"], "jml_iterated", ["jml_ekf"], "most", 6),
    ("Whole flight of 10⁴ steps: at least 25 times as fast as Ceres at its best",
     ["batch_van_der_pol/10000", "batch_robot/10000", "batch_cart/10000"], "jml_batch", ["ceres"], "least", 25),
    ("Whole flight of 10⁴ steps: at least 25 times as fast as gtsam's batch",
     ["batch_robot/10000", "batch_cart/10000"], "jml_batch", ["gtsam"], "least", 25),
    ("Fixed lag of 20: at least 80 times as fast as each of gtsam's",
     ["lag_robot/1000", "lag_cart/1000"], "jml_lag", ["gtsam_lag", "gtsam_lag_batch"], "least", 80),
]


def output(command):
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, timeout=60)
        return done.stdout.strip() if done.returncode == 0 else ""
    except (OSError, subprocess.TimeoutExpired):
        return ""


def processor():
    cpu = [line.split(":", 1)[1].strip() for line in output(["lscpu"]).splitlines() if line.startswith("Model name")]
    return cpu[0] if cpu else platform.machine()


def jml():
    """Version and commit of what is measured."""
    here = os.path.dirname(os.path.abspath(__file__))
    with open(os.path.join(here, "..", "..", "CMakeLists.txt")) as file:
        text = file.read()
    version = text.split("project(", 1)[1].split("VERSION ", 1)[-1].split()[0]
    commit = output(["git", "-C", here, "log", "-1", "--format=%h"])
    return version + (f", commit {commit}" if commit else "")


def key(contest):
    """Name and, where it is run at several, number of steps."""
    return contest["name"] + (f"/{contest['steps']}" if contest["steps"] else "")


def key_of(row):
    return row["contest"] + (f"/{row['steps']}" if row["steps"] else "")


def versions(runner):
    """(what, version) of machine, compilers and packages."""
    found = []
    found.append(("jml", jml()))
    found.append(("processor", f"{processor()}, {os.cpu_count()} of its cores"))
    memory = output(["free", "-g"]).split()
    found.append(("memory", f"{memory[7]} GB" if len(memory) > 7 else "unknown"))
    found.append(("kernel", platform.release().split("-")[0]))
    for compiler in sorted({config["compiler"] for config in runner.configs}):
        found.append((compiler, output([compiler, "--version"]).splitlines()[0]))
    if shutil.which("rustc"):
        found.append(("rustc", output(["rustc", "--version"])))
    wanted = {"libeigen3-dev": "dpkg"}
    for contest in runner.contests:
        for contender in contest["contenders"]:
            for kind, name in contender.get("version", {}).items():
                wanted[name] = kind
    pips = dict(line.split("==", 1) for line in
                output([runner.python, "-m", "pip", "freeze"]).splitlines() if "==" in line)
    for name, kind in wanted.items():
        if kind == "dpkg":
            version = output(["dpkg-query", "--show", "--showformat=${Version}", name])
        elif kind == "pip":
            version = pips.get(name, "")
        else:  # a crate: of the lock file beside the sources
            version = crate(name)
        found.append((f"{name} ({'Debian' if kind == 'dpkg' else kind})", version or "not installed"))
    return found


def crate(name):
    path = os.path.join(os.path.dirname(os.path.abspath(__file__)), "rust", "Cargo.lock")
    if not os.path.exists(path):
        return ""
    with open(path) as file:
        lines = file.read().splitlines()
    for i, line in enumerate(lines):
        if line == f'name = "{name}"':
            return lines[i + 1].split('"')[1]
    return ""


def number(value, digits=3):
    """Three digits and more, never a blank for a zero."""
    if value is None or value == "":
        return ""
    if value != 0 and (abs(value) >= 1e6 or abs(value) < 1e-3):
        return f"{value:.{digits - 1}e}"
    if isinstance(value, float) and abs(value) < 100:
        return f"{value:.{digits}g}"
    return f"{value:.0f}"


def spread(ratio):
    """Median and quartiles: two decimals, or three digits."""
    if not ratio:
        return ""
    places = 2 if ratio[0] < 20 else 1 if ratio[0] < 100 else 0
    digits = (lambda v: f"{v:.{places}f}") if ratio[0] > 0.095 else lambda v: f"{v:.3g}"
    return f"{digits(ratio[0])} [{digits(ratio[1])}, {digits(ratio[2])}]"


def title(contest):
    return contest["title"] + (f", {contest['steps']} steps" if contest["steps"] else "")


def table(head, rows):
    """A table without its empty columns."""
    kept = [i for i in range(len(head)) if i == 0 or any(str(row[i]) != "" for row in rows)]
    line = lambda cells: "| " + " | ".join(str(cells[i])[:CELL] for i in kept) + " |"
    return ["", line(head), "|---|" + "---|" * (len(kept) - 1)] + [line(row) for row in rows]


def contest_tables(contest, rows, configs):
    """A table for each group: contenders down, sets of flags across."""
    lines = []
    for group in dict.fromkeys(row["group"] for row in rows):
        members = [row for row in rows if row["group"] == group]
        first = next((row.get("against") or row.get("reference") for row in members if row["status"] == "timed"), None)
        lines += ["", f"**{group[0].upper() + group[1:]}**" + (f": time of a step over that of `{first}`." if first else ": nothing was timed.")]
        body = []
        for name in dict.fromkeys(row["contender"] for row in members):
            cells = [f"`{name}`", next(row["what"] for row in members if row["contender"] == name)]
            for config in configs:
                cells.append(cell(next((r for r in members if r["contender"] == name and r["config"] == config["name"]), None)))
            body.append(cells)
        lines += table(["contender", "what it is"] + [config["name"] for config in configs], body)
    return lines


def cell(row):
    if row is None:
        return "-"
    if row["status"] != "timed":
        return row["status"]
    text = spread(row.get("ratio"))
    if row.get("instructions_per_step"):
        text += f"; {row['instructions_per_step']:.0f}"
    return text


def resources_table(rows, config, shown):
    columns = [("ns a step", "ns_per_step"), ("allocations a step", "allocations_per_step"), ("code, bytes", "code_bytes"),
               ("state, bytes", "state_bytes"), ("peak of the process, kB", "peak_kb"),
               ("x from the first", "difference_x"), ("P from the first", "difference_P_diagonal")]
    columns += [(name.replace("_", " "), name) for name in shown]
    chosen = [row for row in rows if row["config"] == config and row["status"] in ("timed", "different result")]
    if not chosen:
        return []

    def text(row, name):
        value = row.get(name)
        if name == "state_bytes" and not value:
            return ""
        return number(value)
    return ["", f"With {config}:"] + table(["contender"] + [head for head, _ in columns],
                                           [[f"`{row['contender']}`"] + [text(row, name) for _, name in columns] for row in chosen])


def targets(rows, configs):
    """(title, [(contest, flags, other contender, ratio with quartiles, instructions, met)])"""
    found = []
    for what, contests, name, others, kind, limit in TARGETS:
        lines = []
        for at in contests:
            for config in configs:
                members = {row["contender"]: row for row in rows if key_of(row) == at and row["config"] == config["name"]
                           and row["status"] == "timed" and row.get("rounds")}
                own = members.get(name)
                if own is None:
                    continue
                if others is None:
                    rivals = [row for row in members.values() if row["group"] == own["group"] and not row["contender"].startswith("jml")]
                    rivals = [min(rivals, key=lambda row: row["ns_per_step"])] if rivals else []
                else:
                    rivals = [members[other] for other in others if other in members]
                    if not rivals:  # what is packaged takes part with one set of flags: there alone
                        continue
                for rival in rivals:
                    up, down = (own, rival) if kind == "most" else (rival, own)
                    ratio = quartiles(up["rounds"], down["rounds"])
                    met = verdict(ratio, limit, kind)
                    counts = [row.get("instructions_per_step") for row in (up, down)]
                    lines.append((at, config["name"], rival["contender"], ratio,
                                  f"{counts[0]:.0f} / {counts[1]:.0f} = {counts[0] / counts[1]:.2f}" if all(counts) else "", met))
        found.append((what, name, lines))
    return found


def kind_of(what):
    return next(kind for title_, _, _, _, kind, _ in TARGETS if title_ == what)


def verdict(ratio, limit, kind):
    """By the median; and whether the quartiles lie on both sides."""
    met = ratio[0] <= limit if kind == "most" else ratio[0] >= limit
    return ("met" if met else "**missed**") + (", within its scatter" if ratio[1] < limit < ratio[2] else "")


def targets_section(rows, configs):
    found = targets(rows, configs)
    lines = ["", "## What was aimed at", "",
             "Each ratio is the median over the rounds, with quartiles; a target is met where the median keeps it. Other targets "
             "(memory of a long run, n = 30, growth) stand in [how the cost grows](scaling.md#what-was-aimed-at).", ""]
    for what, _, measured in found:
        missed = [f"{at}, {flags}" + (f", {other}" if len({line[2] for line in measured if line[0] == at}) > 1 and kind_of(what) == "least" else "")
                  for at, flags, other, _, _, met in measured if "missed" in met]
        summary = ("**not measured**" if not measured else f"met in all {len(measured)} cases" if not missed else
                   f"**missed** in {len(missed)} of {len(measured)} cases ({'; '.join(missed)})")
        lines.append(f"- {what}: {summary}.")
    for what, name, measured in found:
        if measured:
            lines += ["", what + f" (`{name}`):"]
            lines += table(["contest", "flags", "the other", "ratio [quartiles]", "instructions", ""],
                           [[at, flags, f"`{other}`", spread(ratio), counts, met] for at, flags, other, ratio, counts, met in measured])
    return lines


def figure(guide, name, contests, rows, configs):
    """Ratios of the contests of one name as an SVG; its path from the page, or nothing where gnuplot is missing."""
    chosen = [row for row in rows if row["contest"] == name and row["status"] == "timed" and row.get("ratio")]
    if not chosen or shutil.which("gnuplot") is None:
        return None
    several = len({row["steps"] for row in chosen}) > 1
    label = lambda row: row["contender"] + (f", {row['steps']}" if several else "")
    names = list(dict.fromkeys(label(row) for row in chosen))
    low, high = min(row["ratio"][1] for row in chosen), max(row["ratio"][2] for row in chosen)
    path = f"figures/peers_{name}.svg"
    os.makedirs(os.path.join(guide, "figures"), exist_ok=True)
    script = [f'set terminal svg size 900,{190 + 30 * len(names)} font "sans,13" background "white"',
              f'set output "{os.path.join(guide, path)}"', f'set title "{{/={11 if len(contests[0]["title"]) > 50 else 13} {contests[0]["title"]}}}\\n{{/=11 time of a step over that of the first of its group; bars: quartiles}}"',
              "set logscale x",
              f"set xrange [{low / 1.3:.3g}:{high * 1.3:.3g}]",
              "set grid xtics", "set key below horizontal noenhanced", f"set yrange [{len(names) - 0.4}:-0.6]", 'set format x "%g"',
              "set ytics (" + ", ".join(f'"{n}" {i}' for i, n in enumerate(names)) + ") noenhanced",
              "set arrow from 1, graph 0 to 1, graph 1 nohead dt 2"]
    if high / low < 8:
        script.append("set xtics add (0.5, 0.7, 1.5, 2, 3, 4, 5)")
    plots, blocks = [], []
    for k, config in enumerate(configs):
        points = [row for row in chosen if row["config"] == config["name"]]
        if not points:
            continue
        blocks.append(f"$points{k} << END\n" + "\n".join(
            f"{row['ratio'][0]:.5g} {names.index(label(row)) + 0.15 * (k - 1.5):.4g} {row['ratio'][1]:.5g} {row['ratio'][2]:.5g}"
            for row in points) + "\nEND")
        plots.append(f'$points{k} using 1:2:3:4 with xerrorbars pt 7 ps 0.6 lw 1.5 title "{config["name"]}"')
    script += blocks + ["plot " + ", ".join(plots)]
    done = subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, stderr=subprocess.PIPE)
    if done.returncode != 0:
        print("peers: gnuplot: " + done.stderr.strip())
        return None
    return path


def store(rows, path):
    """All numbers as name,value,unit, for other pages to quote."""
    units = {"ns_per_step": "ns", "instructions_per_step": "-", "allocations_per_step": "-", "code_bytes": "B", "state_bytes": "B",
             "peak_kb": "kB", "difference_x": "-", "difference_P_diagonal": "-"}
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        file.write("name,value,unit\n")
        for row in rows:
            name = f"{key_of(row)}/{SETS.get(row['config'], row['config'].replace(' ', ''))}/{row['contender']}"
            numbers = [(what, row.get(what), unit) for what, unit in units.items()]
            for ratio in ("ratio", "ratio_best"):
                if row.get(ratio):
                    numbers += [(ratio + end, value, "-") for end, value in zip(("", "_q1", "_q3"), row[ratio])]
            if row["status"] != "timed":
                continue
            for what, value, unit in numbers:
                if isinstance(value, (int, float)):
                    file.write(f"{name}.{what},{value:.6g},{unit}\n")


def left_out(rows, results):
    lines = []
    found = {}
    for row in rows:
        if row["status"] != "timed":
            found.setdefault((row["contender"], row["status"], row["why"]), []).append(f"{key_of(row)}, {row['config']}")
    for (name, status, why), where in found.items():
        lines.append(f"- `{name}`: {status}: {why.rstrip('.')} ({'; '.join(where[:4])}{f'; {len(where) - 4} more' if len(where) > 4 else ''}).")
    return lines + ["- " + text for text in results["not_measured"]]


def write(results, guide):
    """The page guide/peers.md, guide/figures/peers_*.svg and guide/results/peers.csv."""
    rows, configs, runs = results["rows"], results["configs"], results["runs"]
    measured = [contest for contest in results["contests"] if key(contest) in runs]
    rounds = sorted({run["rounds"] for run in runs.values()})
    processors, states = {run["processor"] for run in runs.values()}, {run.get("jml", "") for run in runs.values()}
    lines = ["# Measured against the field", ""]
    if any(run["quick"] for run in runs.values()):
        lines += ["**A quick run, to try the programs: its numbers are not for quoting.**", ""]
    lines += ["The same data, the same machine, the same run: jml beside plain loops, other libraries and what one writes by hand. "
              "`cmake --workflow --preset peers` writes this page; [how it measures](../../bench/peers/README.md).", "",
              "- A **contest** is a task with its data. The contenders of one **group** compute the same thing: their results are "
              "compared first, and one that differs by more than its tolerance is listed as *different result*, and not timed. n: states, "
              "p: measurements, J: the cost of a whole flight.",
              f"- Then come {' or '.join(str(r) for r in rounds)} **rounds**: in each, every contender runs once, another one first. A ratio is that of two times "
              "of the same round, so that what the machine does besides cancels. Written is **median [quartiles] over these pairs**; "
              "below 1 is faster than the first of the group.",
              "- Behind the semicolon: **instructions** of a step, counted one by one by the processor's single-step mode; they do not scatter.",
              "- Code is the size of the program less that of the same harness around nothing. Peak is that of the whole process "
              "with its libraries. A blank means that it was not measured: [why](#not-measured).", ""]
    lines += table(["contest", "what is done", "steps", "who takes part"],
                   [[f"`{name}`", next(c["title"] for c in measured if c["name"] == name),
                     ", ".join(str(c["steps"]) for c in measured if c["name"] == name and c["steps"]) or "as many as take 4 ms",
                     who(rows, name)] for name in dict.fromkeys(c["name"] for c in measured)])[1:]
    lines += targets_section(rows, configs)
    for name in dict.fromkeys(contest["name"] for contest in measured):
        contests = [contest for contest in measured if contest["name"] == name]
        lines += ["", f"## `{name}`: {contests[0]['title']}"]
        if contests[0].get("text"):
            lines += ["", contests[0]["text"]]
        picture = figure(guide, name, contests, rows, configs)
        if picture:
            lines += ["", f"![Ratios of {name}]({picture})"]
        for contest in contests:
            of_it = [row for row in rows if key_of(row) == key(contest)]
            used = [config for config in configs if any(row["config"] == config["name"] for row in of_it)]
            if not used:
                continue
            if len(contests) > 1:
                lines += ["", f"### {name}, {contest['steps']} steps"]
            run = runs[key(contest)]
            if len(processors) > 1 or len(rounds) > 1 or len(states) > 1:
                lines += ["", f"{run['rounds']} rounds, {run['processor']}, {run['date']}, jml {run.get('jml', '')}."]
            lines += contest_tables(contest, of_it, used)
            lines += resources_table(of_it, used[0]["name"], contest.get("show", []))
    lines += ["", "## Notes", ""] + ["- " + text for text in results["notes"]]
    lines += ["", "## Not measured", ""] + left_out(rows, results)
    lines += ["", "## Machine and versions"] + table(["what", "version"], results["versions"])
    lines += ["", "C++ with `-std=c++20 -DNDEBUG` and the flags named. Python packages as they are distributed."]
    lines += ["", "## Commands", "", "```sh", "cmake --workflow --preset peers                               # all of it, on a quiet machine",
              "JML_PEERS_CONTESTS='n15,lag_*' cmake --workflow --preset peers  # these anew, the others as they were",
              "```", ""]
    lines.append(f"Measured {' and '.join(sorted({run['date'] for run in runs.values()}))}, in "
                 f"{sum(run['seconds'] for run in runs.values()) / 60:.0f} min without building. All numbers: [results/peers.csv](results/peers.csv).")
    os.makedirs(guide, exist_ok=True)
    store(rows, os.path.join(guide, "results", "peers.csv"))
    with open(os.path.join(guide, "peers.md"), "w") as file:
        file.write("\n".join(lines) + "\n")


def who(rows, name):
    """Contenders of a contest that were timed, jml's as one."""
    names = dict.fromkeys(row["contender"] for row in rows if row["contest"] == name and row["status"] == "timed")
    of_jml = sum(n.startswith("jml") for n in names)
    return ", ".join([n for n in names if not n.startswith("jml")] + [f"{of_jml} of jml"] * (of_jml > 0))
