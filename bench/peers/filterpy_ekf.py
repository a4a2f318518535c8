# SPDX-License-Identifier: BSD-3-Clause
"""FilterPy's ExtendedKalmanFilter, with the models of tests/models in NumPy: Python throughout, as its users write it."""
import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

import harness


class VanDerPol:
    def __init__(self, data):
        self.dt, self.c, self.k = data.number("dt"), data.number("c"), data.number("k")

    def dynamics(self, x):
        acceleration = -self.k * x[0] - 2 * self.c * (x[0] * x[0] - 1.0) * x[1]
        return np.array([x[0] + self.dt * x[1], x[1] + self.dt * acceleration])

    def dynamics_jacobian(self, x):
        dt, c = self.dt, self.c
        return np.array([[1.0, dt],
                         [-dt * (self.k + 4 * c * x[0] * x[1]), 1.0 - dt * 2 * c * (x[0] * x[0] - 1.0)]])

    def measurement(self, x):
        return np.array([x[0] / np.sqrt(1.0 + x[0] * x[0])])

    def measurement_jacobian(self, x):
        s = 1.0 + x[0] * x[0]
        return np.array([[1.0 / (s * np.sqrt(s)), 0.0]])


class Radar:
    def __init__(self, data):
        self.dt, self.drag, self.gravity = data.number("dt"), data.number("drag"), data.number("gravity")

    def dynamics(self, x):
        keep = 1.0 - self.dt * self.drag * np.sqrt(x[3:] @ x[3:])
        out = np.concatenate([x[:3] + self.dt * x[3:], keep * x[3:]])
        out[5] -= self.dt * self.gravity
        return out

    def dynamics_jacobian(self, x):
        speed = np.sqrt(x[3:] @ x[3:])
        out = np.eye(6)
        out[:3, 3:] = self.dt * np.eye(3)
        out[3:, 3:] = (1.0 - self.dt * self.drag * speed) * np.eye(3)
        out[3:, 3:] -= self.dt * self.drag / speed * np.outer(x[3:], x[3:])
        return out

    def measurement(self, x):
        ground = x[0] * x[0] + x[1] * x[1]
        return np.array([np.sqrt(ground + x[2] * x[2]), np.arctan2(x[1], x[0]), np.arctan2(x[2], np.sqrt(ground))])

    def measurement_jacobian(self, x):
        ground = x[0] * x[0] + x[1] * x[1]
        squared = ground + x[2] * x[2]
        distance = np.sqrt(ground)
        climb = x[2] / (squared * distance)
        out = np.zeros((3, 6))
        out[0, :3] = x[:3] / np.sqrt(squared)
        out[1, :2] = -x[1] / ground, x[0] / ground
        out[2, :3] = -x[0] * climb, -x[1] * climb, distance / squared
        return out


class Dense:
    def __init__(self, data):
        self.A = np.array(data.row("A")).reshape(15, 15)
        self.H = np.array(data.row("H")).reshape(6, 15)
        self.bend_dynamics, self.bend_sensor = data.number("bend_dynamics"), data.number("bend_sensor")

    def dynamics(self, x):
        return self.A @ x + self.bend_dynamics * x**3

    def dynamics_jacobian(self, x):
        return self.A + np.diag(3 * self.bend_dynamics * x * x)

    def measurement(self, x):
        z = self.H @ x
        return z + self.bend_sensor * z**3

    def measurement_jacobian(self, x):
        z = self.H @ x
        return self.H * (1 + 3 * self.bend_sensor * z * z)[:, None]


class Filter(ExtendedKalmanFilter):
    def __init__(self, model, n, p):
        super().__init__(dim_x=n, dim_z=p)
        self.model = model

    def predict_x(self, u=0):
        self.x = self.model.dynamics(self.x)


class Job:
    def __init__(self, data, steps):
        n, p, model = {"n2": (2, 1, VanDerPol), "n6": (6, 3, Radar), "n15": (15, 6, Dense)}[data.contest]
        self.steps, self.y = steps, [np.array(row) for row in data.rows("y")]
        self.filter = Filter(model(data), n, p)
        self.filter.x = np.array(data.row("x0"))
        for name, key, size in (("P", "P0", n), ("Q", "Q", n), ("R", "R", p)):
            setattr(self.filter, name, np.array(data.row(key)).reshape(size, size))

    def run(self):
        filter_, model, y = self.filter, self.filter.model, self.y
        for i in range(self.steps):
            filter_.F = model.dynamics_jacobian(filter_.x)
            filter_.predict()
            filter_.update(y[i % len(y)], model.measurement_jacobian, model.measurement)

    def result(self):
        return {"x": self.filter.x.tolist(), "P_diagonal": np.diag(self.filter.P).tolist()}


harness.run("filterpy_ekf", Job)
