// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the linearised filter of an interval does with its factors in twice the digits, and what of them a
/// dense matrix can hold.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/dense_rounding.hpp>
#include <jml/filter/factored.hpp>
#include <jml/interval/record_rows.hpp>

namespace jml::detail {

/// A P Aᵀ + B Bᵀ in twice the digits, and x. False where even these do not suffice.
template <typename Scalar, int n, int q>
JML_NOINLINE bool move_in_two(const Matrix<Scalar, n, n>& A, const Matrix<Scalar, n, q>& B,
                              const Vector<Scalar, n>& x, FactoredBelief<Scalar, n>& belief) {
  ExtendedMemory<Scalar, n, q, 0> memory;
  ExtendedStep<Scalar> two(memory);
  two.load(belief.U.data(), belief.D.data(), belief.extended ? belief.U_low.data() : nullptr,
           belief.extended ? belief.D_low.data() : nullptr);
  two.load_state(belief.x.data(), belief.x_low.data());
  const Matrix<Scalar, q, q> unit = kernel::identity<Matrix<Scalar, q, q>>();
  return two.move(A.data(), B.data(), unit.data(), x.data()) && store_extended(two, belief) == Status::ok;
}

/// Independent rows into a belief in twice the digits; `off` = x - x̃. False where even these do not suffice.
template <typename Scalar, int n, int p>
JML_NOINLINE bool rows_in_two(const RecordRows<Scalar, n, p>& rows, const Vector<Scalar, n>& nominal,
                              FactoredBelief<Scalar, n>& belief) {
  using T = Extended<Scalar>;
  ExtendedMemory<Scalar, n, 0, p> memory;
  ExtendedStep<Scalar> two(memory);
  two.load(belief.U.data(), belief.D.data(), belief.extended ? belief.U_low.data() : nullptr,
           belief.extended ? belief.D_low.data() : nullptr);
  two.load_state(belief.x.data(), belief.x_low.data());
  Matrix<Scalar, p, n> H = kernel::transposed(rows.H);
  Matrix<Scalar, p, p> R = kernel::identity<Matrix<Scalar, p, p>>();
  Vector<Scalar, p> e = kernel::zeros<Vector<Scalar, p>>(), sizes = e;
  for (int i = 0; i < p; ++i) {
    if (!(rows.r(i) <= std::numeric_limits<Scalar>::max())) {  // it says nothing
      for (int j = 0; j < n; ++j) H(i, j) = Scalar(0);
      continue;
    }
    R(i, i) = rows.r(i);
    T innovation(rows.e(i));
    for (int j = 0; j < n; ++j) innovation = innovation - T(H(i, j)) * (T(belief.x(j)) - T(nominal(j)));
    e(i) = in_two<Scalar>(innovation).high;
  }
  if (two.correct(H.data(), R.data(), e.data(), false, sizes.data(), nullptr).status != Status::ok)
    return false;
  if (rows.pulls) {  // x + P⁺ pull
    Vector<Scalar, n> high, low;
    for (int i = 0; i < n; ++i) {
      T sum = two.x(i);
      for (int j = 0; j < n; ++j) sum = sum + two.P(i, j) * T(rows.pull(j));
      high(i) = in_two<Scalar>(sum).high;
      low(i) = in_two<Scalar>(sum).low;
    }
    two.load_state(high.data(), low.data());
  }
  return store_extended(two, belief) == Status::ok;
}

/// P of a belief as a dense matrix. NaN where that cannot hold it: rounding to Scalar changes P by more than
/// 1e-3 (float: 1 %) in some direction.
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE Matrix<Scalar, n, n> dense_covariance(const FactoredBelief<Scalar, n>& belief) {
  constexpr Scalar most = std::is_same_v<Scalar, float> ? Scalar(1e-2) : Scalar(1e-3);
  ExtendedMemory<Scalar, n, 0, 0> memory;
  ExtendedStep<Scalar> two(memory);
  two.load(belief.U.data(), belief.D.data(), belief.extended ? belief.U_low.data() : nullptr,
           belief.extended ? belief.D_low.data() : nullptr);
  const Scalar magnification = two.magnification_of_now();  // at most what rounding could make of it
  const bool held =
      magnification * magnification <= Scalar(2) * most / std::numeric_limits<Scalar>::epsilon() ||
      (!two.combines() && dense_rounding<n>(two) <= Scalar(0.8) * most);
  return held ? belief.P() : kernel::filled<Matrix<Scalar, n, n>>(std::numeric_limits<Scalar>::quiet_NaN());
}

/// `belief` given later data too: rows of InformationInTwo::store(); x stays. False where the digits do not
/// suffice.
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE bool condition_in_two(const Matrix<Scalar, n, n>& later,
                                                 FactoredBelief<Scalar, n>& belief) {
  RecordRows<Scalar, n, n> rows;
  for (int k = 0; k < n; ++k) {
    for (int i = 0; i < n; ++i) rows.H(i, k) = i < k ? later(i, k) : Scalar(i == k);
    rows.r(k) = Scalar(1) / later(k, k);
    rows.e(k) = Scalar(0);
  }
  return rows_in_two(rows, belief.x, belief);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
