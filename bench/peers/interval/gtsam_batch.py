# SPDX-License-Identifier: BSD-3-Clause
"""gtsam, a whole flight: factors that the package has in C++, variables eliminated one after the other along time, which on a
chain is the fastest of its ways. Nonlinear: Gauss-Newton. Linear: one system."""
import gtsam
import numpy as np

from contender import batch_result, main, model_of, timed


def noise(covariance):
    return gtsam.noiseModel.Gaussian.Covariance(covariance)


def along_time(steps):
    ordering = gtsam.Ordering()
    for k in range(steps + 1):
        ordering.push_back(k)
    return ordering


def robot(data, steps):
    """J of peers::RobotProblem but for the logarithm in the residual of a step, see there."""
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    pose = lambda x: gtsam.Pose2(x[0], x[1], x[2])
    graph.add(gtsam.PriorFactorPose2(0, pose(data["x0"]), noise(data["P0"])))
    walk, fix = noise(data["Q"]), noise(data["R"])
    for k in range(steps):
        graph.add(gtsam.BetweenFactorPose2(k, k + 1, pose(data["control"][k]), walk))
        graph.add(gtsam.PoseTranslationPrior2D(k + 1, data["y"][k], fix))
    for k in range(steps + 1):
        values.insert(k, pose(data["start"][k]))
    return graph, values


def states(values, steps):
    poses = [values.atPose2(k) for k in range(steps + 1)]
    x = np.array([[p.x(), p.y(), p.theta()] for p in poses])
    x[:, 2] = np.unwrap(x[:, 2])
    return x


def gradient(graph, values, steps):
    """Of the graph's own error: the largest entry."""
    of = graph.linearize(values).gradientAtZero()
    return max(np.abs(of.at(k)).max() for k in range(steps + 1))


def make_nonlinear(data, contest, steps):
    graph, start = robot(data, steps)
    params = gtsam.GaussNewtonParams()
    params.setMaxIterations(2)  # the fewest that reach the gradient that is asked of all: see usable
    params.setRelativeErrorTol(0)
    params.setAbsoluteErrorTol(0)
    params.setOrdering(along_time(steps))
    params.setLinearSolverType("SEQUENTIAL_CHOLESKY")  # on a chain faster than MULTIFRONTAL_CHOLESKY
    steepest = gradient(graph, start, steps)

    def run():
        optimizer = gtsam.GaussNewtonOptimizer(graph, start, params)
        answer, took = timed(optimizer.optimize)
        result = batch_result(data, contest, states(answer, steps), optimizer.iterations())
        part = gradient(graph, answer, steps) / steepest
        return took, {**result, "gradient": part, "usable": bool(part <= model_of(contest).gradient)}
    return run


def make_linear(data, contest, steps):
    """One linear system: the factors, whitened, in a GaussianFactorGraph."""
    F = np.array([[1, 0.1], [0, 1]])
    graph = gtsam.GaussianFactorGraph()
    whiten = lambda C: np.linalg.inv(np.linalg.cholesky(C))
    W, V, U = whiten(data["Q"]), whiten(data["R"]), whiten(data["P0"])
    unit = {m: gtsam.noiseModel.Unit.Create(m) for m in (1, 2)}
    graph.push_back(gtsam.JacobianFactor(0, U, U @ data["x0"], unit[2]))
    for k in range(steps):
        graph.push_back(gtsam.JacobianFactor(k, -W @ F, k + 1, W, np.zeros(2), unit[2]))
        graph.push_back(gtsam.JacobianFactor(k + 1, V @ np.array([[1.0, 0]]), V @ data["y"][k], unit[1]))
    ordering = along_time(steps)

    def run():
        answer, took = timed(lambda: graph.eliminateSequential(ordering).optimize())
        x = np.array([answer.at(k) for k in range(steps + 1)])
        return took, batch_result(data, contest, x, 1)
    return run


def make(data, contest, steps):
    return make_linear(data, contest, steps) if "cart" in contest else make_nonlinear(data, contest, steps)


if __name__ == "__main__":
    main("gtsam", make)
