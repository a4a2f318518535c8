// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The pair that every filter carries from sample to sample.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/argument.hpp>
#include <jml/image/parts.hpp>

namespace jml {

/// Says of a belief that what it begins with is written before it is read, and need not be zeros.
struct Scratch {};

/// A state estimate and its Riccati matrix.
///
/// x: n, in the units of the model. P: n×n. For the symmetric rules (Kalman, EKF, SDDRE) P is the
/// covariance of x to first order; for the JML rule it is the nonsymmetric Riccati matrix of eq. (9) and
/// NOT a covariance.
/// `degrees`: of freedom, where the state lives in a space (model/space.hpp) and P in its tangent.
template <typename Scalar_, int n, int degrees = n>
struct Estimate {
  using Scalar = Scalar_;  ///< of x and P
  static_assert(n >= 0,
                "jml: how many states an estimate has must be known at compile time: write "
                "jml::Estimate<double, n>{x, P} where x or P have their size at run time");
  static constexpr int states = n;                           ///< numbers of x, n
  Vector<Scalar, n> x = kernel::zeros<Vector<Scalar, n>>();  ///< n; zeros at first
  /// Degrees×degrees; zeros at first.
  Matrix<Scalar, degrees, degrees> P = kernel::zeros<Matrix<Scalar, degrees, degrees>>();

  Estimate() = default;
  /// Not set, or zeros where they cost nothing.
  explicit Estimate(Scratch) : x(), P() {
    if constexpr (n <= 3) {  // in registers, where a zero costs nothing and clears what was there
      kernel::set_zero(x);
      kernel::set_zero(P);
    }
  }
  explicit Estimate(const Argument<Scalar, n>& state) : x(state) {}  ///< P is zero: x is known exactly
  /// N, and degrees×degrees.
  Estimate(const Argument<Scalar, n>& state, const Argument<Scalar, degrees, degrees>& covariance)
      : x(state), P(covariance) {}
};

template <typename Scalar, int n, int degrees>
struct PartsOf<Estimate<Scalar, n, degrees>> {
  static auto each(auto& estimate, auto&& f) { return f(estimate.x, estimate.P); }
};

/// Types from the arguments.
template <typename Scalar, int n, int degrees>
Estimate(const Vector<Scalar, n>&, const Matrix<Scalar, degrees, degrees>&) -> Estimate<Scalar, n, degrees>;

/// From Eigen expressions: Estimate{x0, 0.1 * Matrix::Identity()}.
template <typename X, typename C>
Estimate(const Eigen::MatrixBase<X>&, const Eigen::MatrixBase<C>&)
    -> Estimate<typename X::Scalar, X::RowsAtCompileTime, C::RowsAtCompileTime>;
/// A number for P, where n = 1.
template <typename X, typename Number>
  requires std::is_arithmetic_v<Number>
Estimate(const Eigen::MatrixBase<X>&, Number) -> Estimate<typename X::Scalar, X::RowsAtCompileTime>;

}  // namespace jml
#include <jml/warnings_end.hpp>
