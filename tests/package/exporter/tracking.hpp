// SPDX-License-Identifier: BSD-3-Clause
#pragma once
#include <jml/matrix.hpp>

namespace tracking {
/// The mean of x and y, each of variance 2: x corrected by y.
jml::Vector<double, 1> fuse(const jml::Vector<double, 1>& x, double y);
}  // namespace tracking
