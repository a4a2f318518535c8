// SPDX-License-Identifier: BSD-3-Clause
#include <tracking.hpp>

int main() { return tracking::fuse(jml::Vector<double, 1>(1), 3)(0) == 2 ? 0 : 1; }
