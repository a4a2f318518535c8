#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The runner on made-up contenders: who differs or fails is listed and not timed, who is missing is skipped by name with the
reason, a part that is measured anew leaves the rows of the others. And the page of such results."""
import json
import os
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import page
import run

SCRIPT = """import json, sys
kind, data, steps, repeat = sys.argv[1:]
if kind == "broken":
    sys.exit("a fault of its own")
x = [1.0, 2.0 if kind != "off" else 2.001]
ns = {"slow": 300.0}.get(kind, 100.0)
print(json.dumps({"contender": kind, "steps": int(steps), "ns_per_step": ns, "allocations_per_step": 0, "peak_kb": 10,
                  "state_bytes": 8, "cost": 5.1 if kind == "dear" else 5.0, "usable": kind != "unusable", "x": x, "P_diagonal": [1.0]}))
"""
CONFIG = {"name": "g++ -O2", "compiler": "g++", "flags": "-O2", "level": "O2", "directory": "gpp-O2"}


def contest(name, script, kinds):
    return {"name": name, "title": "Made up", "steps": None, "check_steps": 4, "tolerance_of": {"cost": 1e-3}, "contenders": [
        {"name": kind, "group": "EKF", "what": kind, "tolerance": 1e-9, "code": "unknown",
         "run": [sys.executable if kind != "absent" else "/no/such/program", script, kind]} for kind in kinds]}


class Measuring(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.TemporaryDirectory()
        self.script = os.path.join(self.directory.name, "contender.py")
        with open(self.script, "w") as file:
            file.write(SCRIPT)
        self.runner = run.Runner(self.directory.name)
        run.ROUNDS = 3
        run.say = lambda text: None

    def tearDown(self):
        self.directory.cleanup()

    def rows(self, kinds):
        return {row["contender"]: row for row in self.runner.measure(CONFIG, contest("made_up", self.script, kinds))}

    def test_only_the_same_result_is_timed(self):
        self.runner.reasons["named"] = "it was not installed"
        rows = self.rows(["unusable", "plain", "slow", "off", "dear", "broken", "absent", "named"])
        self.assertEqual({name: row["status"] for name, row in rows.items()},
                         {"unusable": "failed", "plain": "timed", "slow": "timed", "off": "different result", "dear": "different result", "broken": "failed",
                          "absent": "skipped", "named": "skipped"})
        self.assertEqual(rows["named"]["why"], "it was not installed")
        self.assertIn("a fault of its own", rows["broken"]["why"])
        self.assertIn("such/program", rows["absent"]["why"])
        self.assertEqual(rows["plain"]["reference"], "plain", "one that has failed is no reference")
        self.assertEqual(rows["slow"]["ratio"], [3.0, 3.0, 3.0])
        self.assertEqual(len(rows["slow"]["rounds"]), 3)
        self.assertEqual(rows["dear"]["why"], "cost 5.1 where plain has 5.0")
        for name in ("off", "dear", "broken", "unusable", "absent"):
            self.assertNotIn("rounds", rows[name])

    def test_a_part_anew_leaves_the_others(self):
        one, other = (contest(name, self.script, ["plain"]) for name in ("one", "other"))
        self.runner.contests = [one, other]
        results = {"rows": [], "runs": {}}
        for part in (other, one):
            results = run.merged(results, self.runner, part, self.runner.measure(CONFIG, part), 1.0)
        self.assertEqual([row["contest"] for row in results["rows"]], ["one", "other"])
        results["rows"][0]["ns_per_step"], results["rows"][1]["ns_per_step"] = 1.0, 2.0
        results = run.merged(results, self.runner, one, self.runner.measure(CONFIG, one), 1.0)
        self.assertEqual([row["ns_per_step"] for row in results["rows"]], [100.0, 2.0])

    def test_the_page_names_what_is_missed_and_what_is_left_out(self):
        part = contest("n2", self.script, ["slow", "plain", "off"])
        names = {"slow": "jml_ekf", "plain": "loops_ekf", "off": "other"}
        rows = self.runner.measure(CONFIG, part)
        for row in rows:
            row.pop("command", None)
            row["contender"] = names[row["contender"]]
            row["reference"] = "loops_ekf"
        results = run.merged({"rows": [], "runs": {}}, type("Of", (), {"contests": [part]}), part, rows, 1.0)
        results.update(contests=[part], configs=[CONFIG], not_measured=["The moon."], notes=["A note."], versions=[("made", "up")])
        guide = os.path.join(self.directory.name, "guide")
        page.write(json.loads(json.dumps(results)), guide)
        with open(os.path.join(guide, "peers.md")) as file:
            text = file.read()
        self.assertIn("**missed** in 1 of 1 cases (n2, g++ -O2)", text)
        self.assertIn("| n2 | g++ -O2 | `loops_ekf` | 3.00 [3.00, 3.00] |", text)
        self.assertIn("- `other`: different result: ", text)
        self.assertIn("**not measured**", text)
        self.assertIn("- The moon.", text)
        for line in text.splitlines():
            if line.startswith("|"):
                self.assertLessEqual(max(len(cell.strip()) for cell in line.split("|")), 120, line)
        with open(os.path.join(guide, "results", "peers.csv")) as file:
            stored = file.read().splitlines()
        self.assertEqual(stored[0], "name,value,unit")
        self.assertIn("n2/gpp-O2/jml_ekf.ns_per_step,300,ns", stored)
        self.assertFalse([line for line in stored if "/other." in line])

    def test_targets_name_contests_and_contenders_that_are_there(self):
        there = {page.key(part): {entry["name"] for entry in part["contenders"]} for part in run.Runner(self.directory.name).contests}
        for what, contests, name, others, _, _ in page.TARGETS:
            for at in contests:
                self.assertIn(at, there, what)
                for contender in [name, *(others or [])]:
                    self.assertIn(contender, there[at], what)

    def test_met_is_by_the_median(self):
        self.assertEqual(page.verdict([1.05, 1.0, 1.08], 1.1, "most"), "met")
        self.assertEqual(page.verdict([1.15, 1.05, 1.2], 1.1, "most"), "**missed**, within its scatter")
        self.assertEqual(page.verdict([24, 23, 24.5], 25, "least"), "**missed**")
        self.assertEqual(page.verdict([26, 24, 28], 25, "least"), "met, within its scatter")


if __name__ == "__main__":
    unittest.main()
