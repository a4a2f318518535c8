# SPDX-License-Identifier: BSD-3-Clause
"""gtsam's own estimators on the log of a car that its package installs, beside those of the demo car_log.

The same measurements, samples, start, noise and held out fixes: nodes at the fixes, inertial samples preintegrated
between them, a walk of the biases, a position factor at each fix that is used. ISAM2 answers causally and a few fixes
later; Levenberg-Marquardt answers for the whole flight.

    python3 car_log_gtsam.py [<directory of the log>] [<set of noises>...]

A set is five numbers, comma between them: factors on the metadata's densities of gyro and force noise, standard
deviations of a fix, horizontal and vertical, m, and 1 for a coarse start, of no velocity and a heading 150 degrees off; the demo prints those that it used.
"""
import os
import statistics
import sys
import time

import gtsam
import numpy as np
from gtsam.symbol_shorthand import B, V, X

FIRST = 2  # the fix to start at: there is a gap before the one before it
LAGS = (2, 5, 10)
GRAVITY = 9.8


def read(directory):
    """Samples as (time, dt, force, rate), each the mean of its two ends; fixes; the metadata's numbers."""
    load = lambda name, **how: np.loadtxt(os.path.join(directory, name), skiprows=1, **how)
    inertial = load("KittiEquivBiasedImu.txt")
    fixes = load("KittiGps_converted.txt", delimiter=",")
    meta = load("KittiEquivBiasedImu_metadata.txt")
    means = (inertial[1:, 2:] + inertial[:-1, 2:]) / 2
    times = inertial[1:, 0]
    return times, np.diff(inertial[:, 0]), means[:, :3], means[:, 3:], fixes, meta


def held_out(index):
    return index > FIRST and index % 5 == 0


class Problem:
    """The factors and guesses of one fix at a time."""

    def __init__(self, log, gyro_factor, force_factor, horizontal, vertical, coarse):
        self.times, self.dts, self.forces, self.rates, self.fixes, meta = log
        self.walk = np.repeat([meta[9], meta[10]], 3) / np.sqrt(meta[11])  # per root second
        self.fix_noise = gtsam.noiseModel.Diagonal.Sigmas(np.array([horizontal, horizontal, vertical]))
        self.params = gtsam.PreintegrationParams.MakeSharedU(GRAVITY)
        self.params.setAccelerometerCovariance(np.eye(3) * (meta[6] * force_factor)**2)
        self.params.setGyroscopeCovariance(np.eye(3) * (meta[7] * gyro_factor)**2)
        self.params.setIntegrationCovariance(np.eye(3) * 1e-12)
        before, start = self.fixes[FIRST - 1], self.fixes[FIRST]
        velocity = (start[1:] - before[1:]) / (start[0] - before[0])
        heading = np.arctan2(velocity[1], velocity[0]) + np.radians(150 if coarse else 0)
        self.pose = gtsam.Pose3(gtsam.Rot3.Yaw(heading), start[1:])
        self.velocity = np.zeros(3) if coarse else velocity
        self.bias = gtsam.imuBias.ConstantBias()
        degree = np.pi / 180
        sigmas = gtsam.noiseModel.Diagonal.Sigmas
        self.priors = (
            gtsam.PriorFactorPose3(
                X(FIRST), self.pose,
                sigmas(np.array([5 * degree, 5 * degree, (100 if coarse else 5) * degree, 1, 1, 1]))),
            gtsam.PriorFactorVector(V(FIRST), self.velocity, sigmas(np.full(3, 10.0 if coarse else 1.0))),
            gtsam.PriorFactorConstantBias(B(FIRST), self.bias, sigmas(np.repeat([0.1, 5e-5], 3))),
        )

    def preintegrated(self, index, bias):
        """Of the samples after the fix before, up to this fix."""
        begin, end = self.fixes[index - 1, 0], self.fixes[index, 0]
        first = np.searchsorted(self.times, begin + 1e-6)
        last = np.searchsorted(self.times, end + 1e-6)
        out = gtsam.PreintegratedImuMeasurements(self.params, bias)
        for k in range(first, last):
            out.integrateMeasurement(self.forces[k], self.rates[k], self.dts[k])
        return out

    def factors(self, index, bias):
        """Of a step to this fix, and the preintegrated samples."""
        samples = self.preintegrated(index, bias)
        i = index - 1
        out = [
            gtsam.ImuFactor(X(i), V(i), X(index), V(index), B(i), samples),
            gtsam.BetweenFactorConstantBias(
                B(i), B(index), gtsam.imuBias.ConstantBias(),
                gtsam.noiseModel.Diagonal.Sigmas(self.walk * np.sqrt(samples.deltaTij()))),
        ]
        if not held_out(index):
            out.append(gtsam.GPSFactor(X(index), self.fixes[index, 1:], self.fix_noise))
        return out, samples


class Errors:
    def __init__(self):
        self.horizontal, self.all = [], []

    def add(self, position, fix):
        off = position - fix[1:]
        self.horizontal.append(float(np.hypot(off[0], off[1])))
        self.all.append(float(np.linalg.norm(off)))

    def text(self):
        if not self.all:
            return "      -       -       -       -"
        rmse = lambda e: float(np.sqrt(np.mean(np.square(e))))
        return " ".join(f"{value:7.3f}" for value in (rmse(self.horizontal), statistics.median(self.horizontal),
                                                      rmse(self.all), statistics.median(self.all)))


def incremental(problem, updates):
    """ISAM2, every fix added at once, and `updates` of its iterations at each."""
    params = gtsam.ISAM2Params()
    params.relinearizeSkip = 1
    isam = gtsam.ISAM2(params)
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for prior in problem.priors:
        graph.add(prior)
    values.insert(X(FIRST), problem.pose)
    values.insert(V(FIRST), problem.velocity)
    values.insert(B(FIRST), problem.bias)
    isam.update(graph, values)
    pose, velocity, bias = problem.pose, problem.velocity, problem.bias
    causal, later, durations = Errors(), {lag: Errors() for lag in LAGS}, []
    for index in range(FIRST + 1, len(problem.fixes)):
        begin = time.perf_counter()
        factors, samples = problem.factors(index, bias)
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        for factor in factors:
            graph.add(factor)
        there = samples.predict(gtsam.NavState(pose, velocity), bias)
        values.insert(X(index), there.pose())
        values.insert(V(index), there.velocity())
        values.insert(B(index), bias)
        isam.update(graph, values)
        for _ in range(updates - 1):
            isam.update()
        pose = isam.calculateEstimatePose3(X(index))
        velocity = isam.calculateEstimateVector(V(index))
        bias = isam.calculateEstimateConstantBias(B(index))
        durations.append(time.perf_counter() - begin)
        if held_out(index):
            causal.add(pose.translation(), problem.fixes[index])
        for lag in LAGS:
            if held_out(index - lag):
                later[lag].add(isam.calculateEstimatePose3(X(index - lag)).translation(), problem.fixes[index - lag])
    whole = Errors()
    result = isam.calculateEstimate()
    for index in range(FIRST + 1, len(problem.fixes)):
        if held_out(index):
            whole.add(result.atPose3(X(index)).translation(), problem.fixes[index])
    return causal, later, whole, statistics.median(durations)


def batch(problem):
    """Levenberg-Marquardt on the whole flight, from the prediction by the samples and the fixes that are used."""
    graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
    for prior in problem.priors:
        graph.add(prior)
    values.insert(X(FIRST), problem.pose)
    values.insert(V(FIRST), problem.velocity)
    values.insert(B(FIRST), problem.bias)
    begin = time.perf_counter()
    pose, velocity = problem.pose, problem.velocity
    for index in range(FIRST + 1, len(problem.fixes)):
        factors, samples = problem.factors(index, problem.bias)
        for factor in factors:
            graph.add(factor)
        there = samples.predict(gtsam.NavState(pose, velocity), problem.bias)
        pose, velocity = there.pose(), there.velocity()
        if not held_out(index):
            pose = gtsam.Pose3(pose.rotation(), problem.fixes[index, 1:])
            step = problem.fixes[index] - problem.fixes[index - 1]
            velocity = step[1:] / step[0] if not held_out(index - 1) else velocity
        values.insert(X(index), pose)
        values.insert(V(index), velocity)
        values.insert(B(index), problem.bias)
    params = gtsam.LevenbergMarquardtParams()
    params.setRelativeErrorTol(1e-10)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, params)
    result = optimizer.optimize()
    passed = time.perf_counter() - begin
    errors = Errors()
    for index in range(FIRST + 1, len(problem.fixes)):
        if held_out(index):
            errors.add(result.atPose3(X(index)).translation(), problem.fixes[index])
    return errors, passed, optimizer.iterations(), graph.error(result)


def main():
    given = sys.argv[1:]
    directory = given.pop(0) if given and os.path.isdir(given[0]) else os.path.join(gtsam.__path__[0], "Data")
    log = read(directory)
    for text in given or ["1,1,0.2646,0.2646,0"]:
        numbers = [float(number) for number in text.split(",")]
        problem = Problem(log, *numbers[:4], coarse=numbers[4] != 0)
        print(f"\ngyro noise x {numbers[0]:g}, force noise x {numbers[1]:g}, fixes {numbers[2]:g} and "
              f"{numbers[3]:g} m, {'coarse' if numbers[4] else 'fine'} start")
        print(f"{'':38} {'horizontal':>15} {'3D':>15}")
        print(f"{'errors at the fixes held out, m':38} {'RMSE':>7} {'median':>7} {'RMSE':>7} {'median':>7} {'ms':>9}")
        for updates in (1, 3):
            causal, later, whole, passed = incremental(problem, updates)
            name = f"ISAM2, {updates} updates a fix" if updates > 1 else "ISAM2"
            print(f"{name + ', causal':38} {causal.text()} {1e3 * passed:9.2f}")
            for lag in LAGS:
                print(f"{name + f', {lag} fixes later':38} {later[lag].text()}")
            print(f"{name + ', whole flight':38} {whole.text()}")
        whole, passed, iterations, cost = batch(problem)
        print(f"{f'whole flight, {iterations} iterations':38} {whole.text()} {1e3 * passed:9.0f}   cost {cost:.2f}")


if __name__ == "__main__":
    main()
