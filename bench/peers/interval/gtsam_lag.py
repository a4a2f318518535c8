# SPDX-License-Identifier: BSD-3-Clause
"""gtsam's fixed-lag smoothers, a step at a time: incremental (ISAM2), or batch (Levenberg-Marquardt over the window) with
--batch. Timed is update() alone, not the making of its factors. Compared are the newest states."""
import sys
import time

import gtsam
import numpy as np

from contender import main

LAG = 20.0
BATCH = "--batch" in sys.argv


def noise(covariance):
    return gtsam.noiseModel.Gaussian.Covariance(covariance)


class Robot:
    @staticmethod
    def value(x):
        return gtsam.Pose2(x[0], x[1], x[2])

    def __init__(self, data):
        self.walk, self.fix = noise(data["Q"]), noise(data["R"])
        self.data = data
        self.x = self.value(data["x0"])

    def prior(self):
        return [gtsam.PriorFactorPose2(0, self.x, noise(self.data["P0"]))]

    def factors(self, k):
        return [gtsam.BetweenFactorPose2(k, k + 1, self.value(self.data["control"][k]), self.walk),
                gtsam.PoseTranslationPrior2D(k + 1, self.data["y"][k], self.fix)]

    def predicted(self, k):
        return self.x.compose(self.value(self.data["control"][k]))

    def insert(self, values, k, x):
        values.insert(k, x)

    def take(self, smoother, k):
        self.x = smoother.calculateEstimatePose2(k)
        return [self.x.x(), self.x.y(), self.x.theta()]


class Cart:
    """Linear factors in containers: gtsam has no factor of this model of its own."""
    F, H = np.array([[1, 0.1], [0, 1]]), np.array([[1.0, 0]])

    def __init__(self, data):
        whiten = lambda C: np.linalg.inv(np.linalg.cholesky(C))
        self.W, self.V, self.U = whiten(data["Q"]), whiten(data["R"]), whiten(data["P0"])
        self.unit = {m: gtsam.noiseModel.Unit.Create(m) for m in (1, 2)}
        self.data, self.x = data, data["x0"]

    def contained(self, factor, keys):
        zero = gtsam.Values()
        for k in keys:
            zero.insert(k, np.zeros(2))
        return gtsam.LinearContainerFactor(factor, zero)

    def prior(self):
        return [self.contained(gtsam.JacobianFactor(0, self.U, self.U @ self.x, self.unit[2]), [0])]

    def factors(self, k):
        return [self.contained(gtsam.JacobianFactor(k, -self.W @ self.F, k + 1, self.W, np.zeros(2), self.unit[2]),
                               [k, k + 1]),
                self.contained(gtsam.JacobianFactor(k + 1, self.V @ self.H, self.V @ self.data["y"][k], self.unit[1]),
                               [k + 1])]

    def predicted(self, k):
        return self.F @ self.x

    def insert(self, values, k, x):
        values.insert(k, x)

    def take(self, smoother, k):
        self.x = smoother.calculateEstimateVector(k)
        return list(self.x)


def smoother():
    if not BATCH:
        return gtsam.IncrementalFixedLagSmoother(LAG, gtsam.ISAM2Params())
    return gtsam.BatchFixedLagSmoother(LAG, gtsam.LevenbergMarquardtParams())


def make(data, contest, steps):
    def run():
        problem = (Cart if "cart" in contest else Robot)(data)
        lag, took, states = smoother(), 0.0, []
        for k in range(-1, steps):
            graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
            for factor in problem.prior() if k < 0 else problem.factors(k):
                graph.add(factor)
            problem.insert(values, k + 1, problem.x if k < 0 else problem.predicted(k))
            when = {k + 1: float(k + 1)}
            begin = time.perf_counter()
            lag.update(graph, values, when)
            took += time.perf_counter() - begin
            states.append(problem.take(lag, k + 1))
        x = np.array(states[1:])
        if "robot" in contest:
            x[:, 2] = np.unwrap(x[:, 2])
        return took, {"usable": True, "x": [float(v) for v in x[steps // 2 - 1::max(1, steps // 32)].ravel()],
                      "rmse": float(np.sqrt(np.mean(np.sum((x - data["truth"][1:steps + 1])[:, :2]**2, 1)))),
                      "P_diagonal": []}
    return run


if __name__ == "__main__":
    main("gtsam_lag_batch" if BATCH else "gtsam_lag", make)
