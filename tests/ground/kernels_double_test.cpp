// SPDX-License-Identifier: BSD-3-Clause
#include "kernel_check.hpp"

namespace {

TEST(Kernels, DoubleOfOneToSeventeenRows) {
  kernel_test::check_sizes<double, 1>(std::make_integer_sequence<int, 17>{});
}

// Taller than eight packets: the column is cut into more than one register block.
TEST(Kernels, MoreRowsThanEightPackets) {
  kernel_test::check_rows<double, 37>();
  kernel_test::check_symmetric<double, 35>();
}

TEST(Kernels, NoTermsLeaveTheStart) {
  jml::Matrix<double, 3, 3> start;
  start << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  jml::Matrix<double, 3, 3> out;
  jml::kernel::add_product_transposed<1>(start, jml::Matrix<double, 3, 1>(0, 0, 0),
                                         jml::Matrix<double, 3, 1>(1, 2, 3), out);
  EXPECT_EQ(out, start);
}

}  // namespace
