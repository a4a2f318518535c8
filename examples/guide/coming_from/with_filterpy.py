# SPDX-License-Identifier: BSD-3-Clause
# The tracker of coming_from.md by FilterPy. Printed by FilterPy 2.0.0 on NumPy 2.4.6; the suite does not run it.
import numpy as np

from measurements import P0, Q, R, dt, x0, ys

# [filter]
from filterpy.kalman import ExtendedKalmanFilter


def h(x):
    return np.array([np.hypot(x[0], x[1]), np.arctan2(x[1], x[0])])


def H(x):
    r = np.hypot(x[0], x[1])
    return np.array([[x[0] / r, x[1] / r, 0, 0], [-x[1] / r**2, x[0] / r**2, 0, 0]])


ekf = ExtendedKalmanFilter(dim_x=4, dim_z=2)
ekf.x, ekf.P, ekf.Q, ekf.R = x0, P0, Q, R
ekf.F = np.array([[1, 0, dt, 0], [0, 1, 0, dt], [0, 0, 1, 0], [0, 0, 0, 1]])
for y in ys:
    ekf.predict()
    ekf.update(y, HJacobian=H, Hx=h)
# [/filter]

print("x", *(f"{value:.12f}" for value in ekf.x))
print("P", *(f"{value:.12f}" for value in np.diag(ekf.P)))
