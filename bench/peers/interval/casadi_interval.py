# SPDX-License-Identifier: BSD-3-Clause
"""CasADi and IPOPT on the Van der Pol oscillator: a whole flight, or with --lag the window of a fixed lag of 20 at each
step, started from the last one shifted. Functions and exact derivatives are C code that CasADi generates and gcc compiles, once;
timed is the solver's call.

The lag has jml::FixedLag's arrival cost: the filtered mean and covariance of the window's first node, linearised about the
smoothed states."""
import os
import shutil
import subprocess
import sys
import time

import casadi as ca
import numpy as np

from contender import VanDerPol, batch_result, main, timed

LAG = 20
TOLERANCE = 1e-6  # IPOPT's, of a gradient that it scales to 100 at the start
MODEL = VanDerPol()


def dynamics(x):
    return ca.vertcat(x[0] + MODEL.dt * x[1],
                      x[1] + MODEL.dt * (-MODEL.k * x[0] - 2 * MODEL.c * (x[0]**2 - 1) * x[1]))


def sensor(x):
    return x[0] / ca.sqrt(1 + x[0]**2)


def whitener(C):
    return np.linalg.inv(np.linalg.cholesky(C))


def problem(data, steps):
    """min J over the states of all nodes. Parameters: mean and whitener of the prior, the measurements."""
    a, b, y = ca.SX.sym("a", 2), ca.SX.sym("b", 2), ca.SX.sym("y")
    w, v = whitener(data["Q"]) @ (b - dynamics(a)), whitener(data["R"])[0, 0] * (y - sensor(b))
    stage = ca.Function("stage", [a, b, y], [(ca.dot(w, w) + v * v) / 2])
    x, p = ca.MX.sym("x", 2, steps + 1), ca.MX.sym("p", 6 + steps)
    first = ca.reshape(p[2:6], 2, 2) @ (x[:, 0] - p[:2])
    cost = ca.dot(first, first) / 2 + ca.sum2(stage.map(steps)(x[:, :-1], x[:, 1:], p[6:].T))
    return {"x": ca.vec(x), "p": p, "f": cost}


def solver(data, steps, directory, tolerance):
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": tolerance, "max_iter": 100}}
    nlp = problem(data, steps)
    if directory is None:
        return ca.nlpsol("solver", "ipopt", nlp, options)
    library = os.path.join(directory, f"casadi_{steps}.so")
    if not os.path.exists(library):
        work = library + f".{os.getpid()}"
        os.makedirs(work)
        here = os.getcwd()
        os.chdir(work)  # CasADi writes into the working directory alone
        ca.nlpsol("solver", "ipopt", nlp, options).generate_dependencies("functions.c")
        os.chdir(here)
        subprocess.run(["gcc", "-O2", "-shared", "-fPIC", os.path.join(work, "functions.c"), "-o", work + "/functions.so"],
                       check=True)
        os.replace(work + "/functions.so", library)
        shutil.rmtree(work)
    return ca.nlpsol("solver", "ipopt", library, options)


def parameters(mean, covariance, y):
    return np.concatenate([mean, whitener(covariance).ravel(order="F"), y])


def make_batch(data, contest, steps, directory):
    solve = solver(data, steps, directory, TOLERANCE)
    p = parameters(data["x0"], data["P0"], data["y"][:steps, 0])
    start = data["start"][:steps + 1].ravel()

    def run():
        answer, took = timed(lambda: solve(x0=start, p=p))
        x = np.array(answer["x"]).reshape(-1, 2)
        result = batch_result(data, contest, x, solve.stats()["iter_count"])
        return took, result
    return run


def correct(x, P, y, R, at):
    """The measurement absorbed, linearised at `at`."""
    H = MODEL.measure_jacobian(at[None])[0]
    r = y - MODEL.measure(at[None])[0] - H @ (x - at)
    K = P @ H.T / (H @ P @ H.T + R)
    return x + K @ r, (P - K @ H @ P + (P - K @ H @ P).T) / 2


def slide(x, P, data, y, nodes):
    """From the arrival of node 0 to that of node 1."""
    A = MODEL.step_jacobian(nodes[:1], None)[0]
    x, P = MODEL.step(nodes[:1], None)[0] + A @ (x - nodes[0]), A @ P @ A.T + data["Q"]
    return correct(x, P, y, data["R"], nodes[1])


def make_lag(data, contest, steps, directory):
    solvers = {k: solver(data, k, directory if k == LAG else None, TOLERANCE) for k in range(1, LAG + 1)}

    def run():
        mean, P = data["x0"], data["P0"]
        nodes, out, took, iterations = data["x0"][None], [], 0.0, 0
        for k in range(steps):
            if len(nodes) == LAG + 1:
                mean, P = slide(mean, P, data, data["y"][k - LAG], nodes)
                nodes = nodes[1:]
            depth = len(nodes)
            guess = np.vstack([nodes, MODEL.step(nodes[-1:], None)]).ravel()
            p = parameters(mean, P, data["y"][k - depth + 1:k + 1, 0])
            solve = solvers[depth]
            begin = time.perf_counter()
            answer = solve(x0=guess, p=p)
            if depth == LAG:
                took += time.perf_counter() - begin
            iterations += solve.stats()["iter_count"]
            nodes = np.array(answer["x"]).reshape(-1, 2)
            out.append(nodes[-1])
        x = np.array(out)
        rmse = np.sqrt(np.mean(np.sum((x - data["truth"][1:steps + 1])**2, 1)))
        return took * steps / (steps - LAG + 1), {
            "usable": True, "iterations": iterations / steps, "rmse": float(rmse),
            "x": [float(v) for v in x[steps // 2 - 1::max(1, steps // 32)].ravel()], "P_diagonal": []}
    return run


def make(data, contest, steps):
    path = next(argument for argument in sys.argv[1:] if not argument.startswith("--"))
    directory = os.path.dirname(os.path.abspath(path))
    return (make_lag if "--lag" in sys.argv else make_batch)(data, contest, steps, directory)


if __name__ == "__main__":
    main("casadi_ipopt", make)
