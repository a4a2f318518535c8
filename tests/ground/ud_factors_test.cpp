// SPDX-License-Identifier: BSD-3-Clause
// Bierman's and Thornton's updates against P - P hᵀ h P / alpha and A P Aᵀ + B d Bᵀ, at sizes of each way
// they are written: in registers, in strips, and with a part of a packet left over.
#include <gtest/gtest.h>

#include <jml/ud_extended.hpp>
#include <jml/ud_factors.hpp>
#include <vector>

namespace {

template <int n>
void expect_right() {
  SCOPED_TRACE(n);
  using Square = jml::Matrix<double, n, n>;
  jml::UdFactors<double, n> factors;
  jml::Vector<double, n> h, gain;
  for (int j = 0; j < n; ++j) {
    factors.U(j, j) = 1;
    factors.D(j) = 1 + 0.1 * j;
    h(j) = std::sin(j + 1.0);
    for (int i = 0; i < j; ++i) factors.U(i, j) = std::cos(3.0 * i + j);
  }
  const auto dense = [&] {
    Square P;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        P(i, j) = 0;
        for (int k = 0; k < n; ++k) P(i, j) += factors.U(i, k) * factors.D(k) * factors.U(j, k);
        EXPECT_TRUE(i <= j || factors.U(i, j) == 0);
      }
    }
    return P;
  };
  const auto expect_near = [](const Square& a, const Square& b) {
    for (int i = 0; i < n * n; ++i) EXPECT_NEAR(a.data()[i], b.data()[i], 1e-12) << i;
  };

  Square P = dense();
  double alpha = 0, right = 0.3;
  jml::Vector<double, n> Ph;
  for (int i = 0; i < n; ++i) {
    Ph(i) = 0;
    for (int j = 0; j < n; ++j) Ph(i) += P(i, j) * h(j);
  }
  for (int i = 0; i < n; ++i) right += h(i) * Ph(i);
  jml::kernel::correct_row(factors, h.data(), 0.3, gain, alpha);
  EXPECT_NEAR(alpha, right, 1e-12);
  for (int i = 0; i < n; ++i) {
    EXPECT_NEAR(gain(i), Ph(i), 1e-12);
    for (int j = 0; j < n; ++j) P(i, j) -= Ph(i) * Ph(j) / right;
  }
  expect_near(dense(), P);

  constexpr int q = 2, m = n + q;
  Square A, moved;
  jml::kernel::Padded<double, n, m> W = jml::kernel::zeros<jml::kernel::Padded<double, n, m>>();
  jml::Vector<double, m> d;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) A(i, j) = std::sin(2.0 * i - j) / n;
    for (int k = 0; k < q; ++k) W(i, k) = std::cos(i + 5.0 * k);
    d(q + i) = factors.D(i);
  }
  d(0) = 0.7;
  d(1) = 0.2;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      moved(i, j) = W(i, 0) * 0.7 * W(j, 0) + W(i, 1) * 0.2 * W(j, 1);
      for (int k = 0; k < n; ++k) {
        for (int l = 0; l < n; ++l) moved(i, j) += A(i, k) * P(k, l) * A(j, l);
      }
    }
  }
  jml::kernel::times_unit_upper<double, n, m>(A, factors.U, W);
  jml::kernel::orthogonalise<false, double, n, m>(W, d, factors);
  expect_near(dense(), moved);
}

TEST(UdFactors, OfEverySizeAndWay) {
  expect_right<1>();
  expect_right<2>();
  expect_right<5>();
  expect_right<9>();
  expect_right<15>();
  expect_right<21>();
}

// U of ones above the diagonal: its inverse has one entry beside the diagonal, but a bound that adds sizes on
// the way doubles with each state. D_0 = 1e-9 beside sums of 29 is far above their rounding.
TEST(UdFactors, SmallPivotOfGivenNumbersStays) {
  constexpr int n = 30;
  using Ud = jml::detail::ExtendedUd<double>;
  std::vector<Ud::T> U(n * n), D(n), row(n);
  std::vector<double> sd(n);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) U[i + j * n] = Ud::T(n - std::max(i, j));
  }
  U[0] = Ud::T(n - 1) + Ud::T(1e-9);
  const Ud ud{n, U.data(), D.data()};
  ASSERT_TRUE(ud.factor(std::numeric_limits<double>::epsilon()));
  EXPECT_NEAR(Ud::upper(D[0]), 1e-9, 1e-15);
  for (int i = 0; i < n; ++i) {
    EXPECT_TRUE(i == 0 || Ud::upper(D[i]) == 1) << i;
    for (int j = 0; j < n; ++j) EXPECT_NEAR(Ud::upper(U[i + j * n]), j >= i ? 1 : 0, 1e-15) << i << j;
  }
  ud.deviations(sd.data());
  // Row 0 of the inverse is (1, -1, 0, …).
  EXPECT_NEAR(ud.magnification(sd.data(), sd.data(), row.data()), (sd[0] + sd[1]) / std::sqrt(1e-9), 1e-3);
}

}  // namespace
