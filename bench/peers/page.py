# SPDX-License-Identifier: BSD-3-Clause
"""Figures and the page examples/guide/peers.md from the results of run.py."""
import os
import platform
import shutil
import subprocess

LIMIT = 1.1  # what is aimed at against the best other contender


def output(command):
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, timeout=60)
        return done.stdout.strip() if done.returncode == 0 else ""
    except (OSError, subprocess.TimeoutExpired):
        return ""


def versions(runner):
    """(what, version) of machine, compilers and packages."""
    found = []
    cpu = [line.split(":", 1)[1].strip() for line in output(["lscpu"]).splitlines() if line.startswith("Model name")]
    found.append(("processor", f"{cpu[0] if cpu else platform.machine()}, {os.cpu_count()} of its cores"))
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
    if value is None or value == "":
        return ""
    if isinstance(value, float) and value != 0 and (abs(value) >= 1e6 or abs(value) < 1e-3):
        return f"{value:.{digits - 1}e}"
    if isinstance(value, float) and value < 100:
        return f"{value:.{digits}g}"
    return f"{value:.0f}"


def spread(ratio):
    return f"{ratio[0]:.2f} [{ratio[1]:.2f}, {ratio[2]:.2f}]" if ratio else ""


def title(contest):
    return contest["title"] + (f", {contest['steps']} steps" if contest["steps"] else "")


def contest_table(contest, rows, configs):
    """One table a contest: contenders down, sets of flags across."""
    lines = []
    for group in dict.fromkeys(row["group"] for row in rows):
        members = [row for row in rows if row["group"] == group]
        names = list(dict.fromkeys(row["contender"] for row in members))
        lines += ["", "| " + group + " | " + " | ".join(config["name"] for config in configs) + " |",
                  "|---|" + "---|" * len(configs)]
        for name in names:
            cells = []
            for config in configs:
                row = next((r for r in members if r["contender"] == name and r["config"] == config["name"]), None)
                cells.append(cell(row))
            what = next(row["what"] for row in members if row["contender"] == name)
            lines.append(f"| {what} | " + " | ".join(cells) + " |")
    return lines


def cell(row):
    if row is None:
        return "-"
    if row["status"] != "timed":
        return row["status"] + (": " + row["why"] if row["status"] != "skipped" else "")
    text = spread(row.get("ratio"))
    if row.get("instructions_per_step"):
        text += f"; {row['instructions_per_step']:.0f}"
    return text


def resources_table(rows, config, shown):
    columns = [("allocations a step", "allocations_per_step"), ("code, bytes", "code_bytes"),
               ("state, bytes", "state_bytes"), ("peak of the process, kB", "peak_kb"),
               ("x from the reference", "difference_x"), ("P", "difference_P_diagonal")]
    columns += [(key.replace("_", " "), key) for key in shown]
    chosen = [row for row in rows if row["config"] == config and row["status"] in ("timed", "different result")]
    if not chosen:
        return []
    lines = ["", f"With {config}:", "", "| | " + " | ".join(name for name, _ in columns) + " |",
             "|---|" + "---|" * len(columns)]
    for row in chosen:
        lines.append(f"| {row['what']} | " + " | ".join(number(row.get(key)) for _, key in columns) + " |")
    return lines


def aims_table(rows):
    """jml's one-pass contenders against the best of the others of their group, in the same rounds."""
    chosen = [row for row in rows if row["status"] == "timed" and row["contender"] in ("jml_ekf", "jml_one_pass")
              and row.get("ratio_best")]
    if not chosen:
        return []
    by_key = {(row["config"], row["contest"], row["contender"]): row for row in rows}
    lines = ["", f"## Aimed at: at most {LIMIT} × the best other contender", "",
             "| | contest | flags | best other | time | instructions | |", "|---|---|---|---|---|---|---|"]
    for row in sorted(chosen, key=lambda r: r["contender"]):
        best = by_key[(row["config"], row["contest"], row["best"])]
        counts = [row.get("instructions_per_step"), best.get("instructions_per_step")]
        counted = f"{counts[0]:.0f} / {counts[1]:.0f} = {counts[0] / counts[1]:.2f}" if all(counts) else ""
        met = "met" if row["ratio_best"][0] <= LIMIT else "**missed**"
        lines.append(f"| {row['contender']} | {row['contest']} | {row['config']} | {row['best']} | "
                     f"{spread(row['ratio_best'])} | {counted} | {met} |")
    return lines


def figure(build, contest, rows, configs):
    """Ratios of one contest as an SVG; its name, or nothing where gnuplot is missing."""
    chosen = [row for row in rows if row["status"] == "timed" and row.get("ratio")]
    if not chosen or shutil.which("gnuplot") is None:
        return None
    stem = contest["name"] + (f"_{contest['steps']}" if contest["steps"] else "")
    names = list(dict.fromkeys(row["contender"] for row in chosen))
    script = [f'set terminal svg size 900,{120 + 34 * len(names)} font "sans,13"', f'set output "{build}/{stem}.svg"',
              f'set title "{title(contest)}: time of a step over that of the first of its group"', "set logscale x",
              "set grid xtics", "set key outside top center horizontal", f"set yrange [{len(names) - 0.4}:-0.6]",
              "set ytics (" + ", ".join(f'"{name}" {i}' for i, name in enumerate(names)) + ") noenhanced",
              "set arrow from 1, graph 0 to 1, graph 1 nohead dt 2"]
    plots, blocks = [], []
    for k, config in enumerate(configs):
        points = [row for row in chosen if row["config"] == config["name"]]
        if not points:
            continue
        blocks.append(f"$points{k} << END\n" + "\n".join(
            f"{row['ratio'][0]} {names.index(row['contender']) + 0.15 * (k - 1.5)} {row['ratio'][1]} {row['ratio'][2]}"
            for row in points) + "\nEND")
        plots.append(f'$points{k} using 1:2:3:4 with xerrorbars pt 7 ps 0.6 lw 1.5 title "{config["name"]}"')
    script += blocks + ["plot " + ", ".join(plots)]
    done = subprocess.run(["gnuplot"], input="\n".join(script) + "\n", text=True, stderr=subprocess.PIPE)
    if done.returncode != 0:
        print("peers: gnuplot: " + done.stderr.strip())
        return None
    return f"{stem}.svg"


def write(results, build, path):
    rows, configs = results["rows"], results["configs"]
    lines = ["# Measured against the field", "",
             "Written by `cmake --workflow --preset peers` (bench/peers): every number below is of one run on one machine.", "",
             "| | |", "|---|---|"]
    lines += [f"| {name} | {version} |" for name, version in results["versions"]]
    lines += ["", f"Each cell of the tables by contest: time of a step over that of the first row, in the same round: median "
              f"[quartiles] over {results['rounds']} rounds in which the contenders take turns, another one first in each; then the "
              "instructions of a step, counted by single steps of the processor. All read the same data file, and their results "
              "are compared before any time is taken: who differs beyond its tolerance is not timed."]
    lines += aims_table(rows)
    for contest in results["contests"]:
        of_it = [row for row in rows if row["contest"] == contest["name"] and row["steps"] == (contest["steps"] or "")]
        if not of_it:
            continue
        used = [config for config in configs if any(row["config"] == config["name"] for row in of_it)]
        lines += ["", "## " + title(contest)]
        if contest.get("text"):
            lines += ["", contest["text"]]
        lines += contest_table(contest, of_it, used)
        lines += resources_table(of_it, used[0]["name"], contest.get("show", []))
        figure(build, contest, of_it, used)
    lines += ["", "## Notes", ""] + ["- " + text for text in results["notes"]]
    lines += ["", "## Not measured", ""]
    skipped = {}
    for row in rows:
        if row["status"] in ("skipped", "failed"):
            skipped.setdefault((row["contender"], row["status"], row["why"]), []).append(f"{row['contest']}, {row['config']}")
    lines += [f"- {name}: {status}: {why} ({'; '.join(where[:4])}{' …' if len(where) > 4 else ''})."
              for (name, status, why), where in skipped.items()]
    lines += ["- " + text for text in results["not_measured"]]
    lines += ["", "## Commands", "", "```sh", "cmake/install-dependencies.sh && cmake --workflow --preset peers", "```", "",
              f"It took {results['seconds'][0] / 60:.0f} min to build and {results['seconds'][1] / 60:.0f} min to measure. C++ with "
              "`-std=c++20 -DNDEBUG` and the flags named; figures in build/peers/*.svg, every number in build/peers/results.csv."]
    with open(path, "w") as file:
        file.write("\n".join(lines) + "\n")
