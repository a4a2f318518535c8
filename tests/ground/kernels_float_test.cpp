// SPDX-License-Identifier: BSD-3-Clause
#include "kernel_check.hpp"

namespace {

TEST(Kernels, FloatOfOneToSeventeenRows) {
  kernel_test::check_sizes<float, 1>(std::make_integer_sequence<int, 17>{});
}

}  // namespace
