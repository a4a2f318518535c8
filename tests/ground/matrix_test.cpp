// SPDX-License-Identifier: BSD-3-Clause
// Sums and products as values, on both sides of every size at which the loops change: with whole numbers, so that any
// order of summing gives the same double, against Eigen's own expressions in matrices of run-time size.
#include <gtest/gtest.h>

#include <jml/linear_algebra.hpp>
#include <limits>

namespace {

using namespace jml::operators;
using Big = Eigen::MatrixXd;

template <int rows, int cols>
jml::Matrix<double, rows, cols> numbers(int seed) {
  jml::Matrix<double, rows, cols> a;
  for (int i = 0; i < rows * cols; ++i) a.data()[i] = (i * 37 + seed * 11) % 23 - 9;
  return a;
}

template <int rows, int inner, int cols>
void expect_products() {
  const auto a = numbers<rows, inner>(1);
  const auto b = numbers<inner, cols>(2);
  const jml::Matrix<double, rows, cols> product = a * b;
  EXPECT_EQ(Big(product), Big(Big(a) * Big(b))) << rows << inner << cols;
}
TEST(Matrix, Products) {
  expect_products<1, 1, 1>();
  expect_products<2, 3, 4>();
  expect_products<3, 3, 3>();
  expect_products<4, 3, 2>();
  expect_products<3, 4, 3>();
  expect_products<5, 7, 2>();
  expect_products<10, 1, 10>();
}

template <int rows, int cols>
void expect_by_entry() {
  const jml::Matrix<double, rows, cols> a = numbers<rows, cols>(3), b = numbers<rows, cols>(4);
  EXPECT_EQ(Big(a + b), Big(Big(a) + Big(b)));
  EXPECT_EQ(Big(a - b), Big(Big(a) - Big(b)));
  EXPECT_EQ(Big(-a), Big(-Big(a)));
  EXPECT_EQ(Big(3.0 * a), Big(3 * Big(a)));
  EXPECT_EQ(Big(a * 3.0), Big(3 * Big(a)));
  EXPECT_EQ(Big(a / 2.0), Big(Big(a) / 2));
  EXPECT_EQ(Big(jml::kernel::transposed(a)), Big(Big(a).transpose()));
  EXPECT_EQ(Big(jml::kernel::row_sums(a)), Big(Big(a).cwiseAbs().rowwise().sum()));
  EXPECT_EQ(jml::kernel::largest_column_sum(a), Big(a).cwiseAbs().colwise().sum().maxCoeff());
  EXPECT_EQ(jml::kernel::squared_norm(a), Big(a).squaredNorm());
  jml::Matrix<double, rows, cols> c = a;
  c += b;
  EXPECT_EQ(Big(c), Big(Big(a) + Big(b)));
  c -= a;
  EXPECT_EQ(Big(c), Big(b));
  // The largest, and what is not finite, in every place.
  for (int i = 0; i < rows * cols; ++i) {
    c = b;
    c.data()[i] = -100;
    EXPECT_EQ(jml::kernel::largest(c), 100) << i;
    c.data()[i] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(std::isfinite(jml::kernel::largest(c))) << i;
  }
}
TEST(Matrix, ByEntry) {
  expect_by_entry<1, 1>();
  expect_by_entry<3, 3>();
  expect_by_entry<2, 5>();
  expect_by_entry<4, 4>();
  expect_by_entry<3, 7>();
  expect_by_entry<5, 5>();
}

TEST(Matrix, DotAndBlocks) {
  const auto a = numbers<19, 1>(5), b = numbers<19, 1>(6);
  EXPECT_EQ(jml::kernel::dot(a, b), (Big(a).transpose() * Big(b))(0, 0));
  const auto m = numbers<4, 5>(7);
  EXPECT_EQ(Big((jml::kernel::block<2, 3>(m, 1, 2))), Big(Big(m).block(1, 2, 2, 3)));
  jml::Matrix<double, 4, 5> filled = jml::kernel::zeros<jml::Matrix<double, 4, 5>>();
  jml::kernel::set_block(filled, 2, 1, numbers<2, 3>(8));
  Big expected = Big::Zero(4, 5);
  expected.block(2, 1, 2, 3) = Big(numbers<2, 3>(8));
  EXPECT_EQ(Big(filled), expected);
}

}  // namespace
