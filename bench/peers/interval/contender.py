# SPDX-License-Identifier: BSD-3-Clause
"""What the interval contenders in Python share: data file, judge, clock, the line they print.

Python builds the problem; what is timed is one call of compiled code (a batch) or one a step (a lag), and no peer
calls back into Python.
"""
import json
import resource
import statistics
import sys
import time

import numpy as np


def read(path):
    """The rows of a data file by name, and the contest's name."""
    rows = {}
    with open(path) as file:
        for line in file:
            name, *numbers = line.rstrip("\n").split(",")
            rows.setdefault(name, []).append(numbers)
    data = {name: np.array(values, dtype=float) for name, values in rows.items()}
    n, p = data["x0"].shape[1], data["y"].shape[1]
    data["P0"], data["Q"], data["R"] = (data[k].reshape(m, m) for k, m in (("P0", n), ("Q", n), ("R", p)))
    data["x0"] = data["x0"][0]
    return data, path.rsplit("/", 1)[-1].rsplit(".", 1)[0]


class VanDerPol:
    """models::VanDerPolWhite and models::SaturatingPosition."""
    gradient = 1e-8  # to be reached, as a part of that at the start
    dt, c, k = 0.05, 0.1, 1.0

    def step(self, x, u):
        return np.stack([x[:, 0] + self.dt * x[:, 1],
                         x[:, 1] + self.dt * (-self.k * x[:, 0] - 2 * self.c * (x[:, 0]**2 - 1) * x[:, 1])], 1)

    def step_jacobian(self, x, u):
        one = np.ones(len(x))
        return np.stack([np.stack([one, self.dt * one], 1),
                         np.stack([-self.dt * (self.k + 4 * self.c * x[:, 0] * x[:, 1]),
                                   1 - self.dt * 2 * self.c * (x[:, 0]**2 - 1)], 1)], 1)

    def measure(self, x):
        return x[:, :1] / np.sqrt(1 + x[:, :1]**2)

    def measure_jacobian(self, x):
        return np.stack([(1 + x[:, 0]**2)**-1.5, np.zeros(len(x))], 1)[:, None, :]


class Robot:
    """peers::Robot and peers::Fix."""
    gradient = 1e-5  # to be reached, as a part of that at the start

    def step(self, x, u):
        c, s = np.cos(x[:, 2]), np.sin(x[:, 2])
        return x + np.stack([c * u[:, 0] - s * u[:, 1], s * u[:, 0] + c * u[:, 1], u[:, 2]], 1)

    def step_jacobian(self, x, u):
        c, s = np.cos(x[:, 2]), np.sin(x[:, 2])
        J = np.tile(np.eye(3), (len(x), 1, 1))
        J[:, 0, 2] = -s * u[:, 0] - c * u[:, 1]
        J[:, 1, 2] = c * u[:, 0] - s * u[:, 1]
        return J

    def measure(self, x):
        return x[:, :2]

    def measure_jacobian(self, x):
        return np.tile(np.eye(3)[:2], (len(x), 1, 1))


class Cart:
    """peers::Cart and peers::CartPosition."""
    gradient = 1e-8  # to be reached, as a part of that at the start
    F = np.array([[1, 0.1], [0, 1]])

    def step(self, x, u):
        return x @ self.F.T

    def step_jacobian(self, x, u):
        return np.tile(self.F, (len(x), 1, 1))

    def measure(self, x):
        return x[:, :1]

    def measure_jacobian(self, x):
        return np.tile(np.array([[1.0, 0]]), (len(x), 1, 1))


MODELS = {"van_der_pol": VanDerPol, "robot": Robot, "cart": Cart}


def model_of(contest):
    return next(model() for name, model in MODELS.items() if name in contest)


def judge(data, model, x):
    """J and the largest entry of its gradient at the states x, as in contest.hpp."""
    steps = len(x) - 1
    u = data["control"][:steps] if "control" in data else None
    w = x[1:] - model.step(x[:-1], u)
    v = data["y"][:steps] - model.measure(x[1:])
    first = x[0] - data["x0"]
    pull, push, hold = (np.linalg.solve(data[k], of.T).T for k, of in (("Q", w), ("R", v), ("P0", first[None])))
    gradient = np.zeros_like(x)
    gradient[0] += hold[0]
    gradient[1:] += pull - np.einsum("kij,ki->kj", model.measure_jacobian(x[1:]), push)
    gradient[:-1] -= np.einsum("kij,ki->kj", model.step_jacobian(x[:-1], u), pull)
    return (np.sum(w * pull) + np.sum(v * push) + first @ hold[0]) / 2, np.abs(gradient).max()


def batch_result(data, contest, x, iterations):
    """As result_of_batch() in contest.hpp."""
    model = model_of(contest)
    steps = len(x) - 1
    cost, gradient = judge(data, model, x)
    part = gradient / judge(data, model, data["start"][:steps + 1])[1]
    return {"usable": bool(part <= model.gradient), "cost": cost, "gradient": part, "iterations": iterations,
            "x": [float(v) for i in range(17) for v in x[i * steps // 16]], "P_diagonal": []}


def timed(call):
    """What it returns, and its time in s."""
    begin = time.perf_counter()
    out = call()
    return out, time.perf_counter() - begin


def main(name, make):
    """`make(data, contest, steps)`: a function that runs once and returns the seconds in compiled code and the result."""
    path, steps, repeats = (argument for argument in sys.argv[1:] if not argument.startswith("--"))
    steps, repeats = int(steps), int(repeats)
    data, contest = read(path)
    run = make(data, contest, steps)
    seconds, result = [], None
    for _ in range(repeats):
        took, result = run()
        seconds.append(took)
    print(json.dumps({"contender": name, "contest": contest, "compiler": "as packaged", "flags": "as packaged",
                      "steps": steps, "ns_per_step": statistics.median(seconds) / steps * 1e9,
                      "allocations_per_step": None,
                      "peak_kb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, "state_bytes": 0, **result}))
