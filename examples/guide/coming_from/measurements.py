# SPDX-License-Identifier: BSD-3-Clause
# The numbers of coming_from.md, for the Python programs: those of examples/coming_from.cpp.
import numpy as np

dt = 1.0  # s
x0 = np.array([100.0, 50.0, -6.0, 4.0])  # m, m/s
P0 = np.diag([25.0, 25.0, 4.0, 4.0])
q = 0.16  # m²/s³, spectral density of the acceleration
Q = q * np.kron([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]], np.eye(2))
R = np.diag([4.0, 1e-4])  # m², rad²
ys = np.array([[107.64, 0.5243], [103.65, 0.5701], [102.81, 0.6276], [100.98, 0.6927],
               [98.04, 0.7793], [98.27, 0.8544], [94.97, 0.9369], [96.2, 1.0203]])  # m, rad
