# SPDX-License-Identifier: BSD-3-Clause
# The whole flight of coming_from.md by gtsam. Printed by the package gtsam 4.3.0; the suite does not run it.
import numpy as np

from measurements import P0, Q, R, dt, x0, ys

# [graph]
import gtsam

F = np.array([[1, 0, dt, 0], [0, 1, 0, dt], [0, 0, 1, 0], [0, 0, 0, 1]])


def motion(factor, values, jacobians):
    a, b = (values.atVector(key) for key in factor.keys())
    if jacobians is not None:
        jacobians[0], jacobians[1] = -F, np.eye(4)
    return b - F @ a


def radar(y):
    def error(factor, values, jacobians):
        x = values.atVector(factor.keys()[0])
        r = np.hypot(x[0], x[1])
        if jacobians is not None:
            jacobians[0] = np.array([[x[0] / r, x[1] / r, 0, 0], [-x[1] / r**2, x[0] / r**2, 0, 0]])
        return np.array([r, np.arctan2(x[1], x[0])]) - y

    return error


noise = gtsam.noiseModel.Gaussian.Covariance
graph, guess = gtsam.NonlinearFactorGraph(), gtsam.Values()
graph.add(gtsam.PriorFactorVector(0, x0, noise(P0)))
guess.insert(0, x0)
for k, y in enumerate(ys, start=1):
    graph.add(gtsam.CustomFactor(noise(Q), [k - 1, k], motion))
    graph.add(gtsam.CustomFactor(noise(R), [k], radar(y)))
    guess.insert(k, F @ guess.atVector(k - 1))
answer = gtsam.LevenbergMarquardtOptimizer(graph, guess).optimize()
P = gtsam.Marginals(graph, answer).marginalCovariance(0)
# [/graph]

# The default tolerances are loose; from there Gauss-Newton to the end.
tight = gtsam.GaussNewtonParams()
tight.setRelativeErrorTol(0)
tight.setAbsoluteErrorTol(1e-13)
answer = gtsam.GaussNewtonOptimizer(graph, answer, tight).optimize()
print("J", f"{graph.error(answer):.12f}")
for k in (0, 8):
    print(f"x_{k}", *(f"{value:.12f}" for value in answer.atVector(k)))
print("P_0", *(f"{value:.12f}" for value in np.diag(gtsam.Marginals(graph, answer).marginalCovariance(0))))
