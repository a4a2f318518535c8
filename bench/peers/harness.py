# SPDX-License-Identifier: BSD-3-Clause
"""What harness.hpp is for contenders in C++. Allocations are not counted, instructions neither."""
import json
import os
import sys
import time


class Data:
    def __init__(self, path):
        self.contest = os.path.splitext(os.path.basename(path))[0]
        self._rows = {}
        with open(path) as file:
            for line in file:
                name, *cells = line.strip().split(",")
                if name and not name.startswith("#"):
                    self._rows.setdefault(name, []).append([float(cell) for cell in cells])

    def rows(self, name):
        return self._rows[name]

    def row(self, name):
        return self._rows[name][0]

    def number(self, name):
        return self._rows[name][0][0]


def peak_kb():
    with open("/proc/self/status") as file:
        return next((int(line.split()[1]) for line in file if line.startswith("VmHWM:")), 0)


def run(name, make, flags=""):
    """make(data, steps): an object with run() and result(): a dictionary with x and P_diagonal."""
    if len(sys.argv) != 4:
        sys.exit(f"usage: {sys.argv[0]} DATA STEPS REPEAT")
    data, steps, repeats = Data(sys.argv[1]), int(sys.argv[2]), max(1, int(sys.argv[3]))
    times = []
    for _ in range(repeats):
        job = make(data, steps)
        start = time.perf_counter_ns()  # steady
        job.run()
        times.append((time.perf_counter_ns() - start) / steps)
    line = {"contender": name, "contest": data.contest, "compiler": "Python " + sys.version.split()[0], "flags": flags,
            "steps": steps, "ns_per_step": sorted(times)[len(times) // 2], "allocations_per_step": None,
            "peak_kb": peak_kb(), "state_bytes": None, "usable": True, **job.result()}
    print(json.dumps(line))
