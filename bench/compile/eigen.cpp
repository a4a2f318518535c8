// SPDX-License-Identifier: BSD-3-Clause
#include <Eigen/Dense>
