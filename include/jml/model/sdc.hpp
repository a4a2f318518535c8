// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// State-dependent-coefficient (SDC) matrices F(x; r): F(x; r)(x - r) = f(x) - f(r). They exist about any
/// reference r, are not unique, and the JML and SDDRE gains depend on the choice.
///
/// Derived form: F(x; r) = ∫₀¹ f_x(r + s(x - r)) ds by Gauss-Legendre nodes, exact for polynomials; what is
/// left, ρ = f(x) - f(r) - F d with d = x - r, is removed by the rank-one term ρ dᵀ/(dᵀd): exact for every f.
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <cmath>
#include <jml/linear_algebra.hpp>
#include <jml/model/dual.hpp>
#include <limits>
#include <type_traits>

namespace jml {

/// The reference point of the SDC matrices: x = 0, as printed in the papers. A model's own SDC is used.
struct AboutOrigin {};
/// The reference point is fixed and named.
template <typename Scalar, int n>
struct AboutPoint {
  Vector<Scalar, n> point;  ///< r, n, in the units of x
};
/// Types from the arguments.
template <typename Scalar, int n>
AboutPoint(const Vector<Scalar, n>&) -> AboutPoint<Scalar, n>;
/// The reference is the current estimate: x̂ for the dynamics, the prediction for the sensor. The one-pass
/// SDDRE and JML filters then are the EKF, identically.
struct AboutEstimate {};

namespace detail {
struct Node {
  double position;  // in (0, 1)
  double weight;    // they sum to 1
};
inline constexpr std::array<Node, 8> gauss_legendre{{{0.01985507175123188, 0.05061426814518813},
                                                     {0.1016667612931866, 0.1111905172266872},
                                                     {0.2372337950418355, 0.1568533229389437},
                                                     {0.4082826787521751, 0.1813418916891810},
                                                     {0.5917173212478249, 0.1813418916891810},
                                                     {0.7627662049581645, 0.1568533229389437},
                                                     {0.8983332387068134, 0.1111905172266872},
                                                     {0.9801449282487682, 0.05061426814518813}}};
}  // namespace detail

/// F(x; reference), rows×n. `jacobian(x)` gives rows×n; `left(along)` is f(x) - f(reference) - along, of an
/// `along` next to it (an angle's difference is known to whole turns alone), and `size` the size of the two
/// numbers it is the difference of. Scalar may be a dual number: then the result carries the derivative of F,
/// and that at x = reference too.
template <int rows, typename Scalar, typename Plain, int n, typename Jacobian, typename Left>
  requires std::is_invocable_v<Left, Vector<Scalar, rows>>
Matrix<Scalar, rows, n> derive_sdc(const Jacobian& jacobian, const Left& left,
                                   const Vector<Plain, rows>& size, const Vector<Scalar, n>& x,
                                   const Vector<Scalar, n>& reference) {
  constexpr bool plain = std::is_same_v<Scalar, Plain>;
  Vector<Scalar, n> d;
  Scalar squared(0);
  for (int j = 0; j < n; ++j) {
    d(j) = x(j) - reference(j);
    squared += d(j) * d(j);
  }
  const bool apart = plain_value(squared) > Plain(0);
  if (plain && !apart) return jacobian(x);
  Matrix<Scalar, rows, n> out;
  for (int j = 0; j < rows * n; ++j) out.data()[j] = Scalar(0);
  for (const auto& node : detail::gauss_legendre) {
    Vector<Scalar, n> between;
    for (int j = 0; j < n; ++j) between(j) = reference(j) + Plain(node.position) * d(j);
    const Matrix<Scalar, rows, n> slope = jacobian(between);
    for (int j = 0; j < rows * n; ++j) out.data()[j] += Plain(node.weight) * slope.data()[j];
  }
  if (!apart) return out;
  Vector<Scalar, rows> along;
  for (int i = 0; i < rows; ++i) {
    along(i) = Scalar(0);
    for (int j = 0; j < n; ++j) along(i) += out(i, j) * d(j);
  }
  const Vector<Scalar, rows> rest = left(along);
  for (int i = 0; i < rows; ++i) {
    const Scalar remainder = rest(i);
    Plain terms = size(i);
    for (int j = 0; j < n; ++j) {
      terms += std::abs(plain_value(out(i, j))) * std::abs(plain_value(d(j)));
    }
    // Below the rounding of its terms it would only carry noise, amplified by 1/|d|.
    const Plain rounding = Plain(4) * std::numeric_limits<Plain>::epsilon() * terms;
    if (std::abs(plain_value(remainder)) <= rounding) continue;
    const Scalar factor = remainder / squared;
    for (int j = 0; j < n; ++j) out(i, j) += factor * d(j);
  }
  return out;
}
/// The same of a known difference f(x) - f(reference).
template <int rows, typename Scalar, typename Plain, int n, typename Jacobian>
Matrix<Scalar, rows, n> derive_sdc(const Jacobian& jacobian, const Vector<Scalar, rows>& change,
                                   const Vector<Plain, rows>& size, const Vector<Scalar, n>& x,
                                   const Vector<Scalar, n>& reference) {
  const auto left = [&change](const Vector<Scalar, rows>& along) {
    return Vector<Scalar, rows>(change - along);
  };
  return derive_sdc<rows>(jacobian, left, size, x, reference);
}

namespace detail {
/// |a| + |b| without derivatives, by component: what the rounding of a - b is measured against.
template <typename Scalar, int rows>
auto sizes(const Vector<Scalar, rows>& a, const Vector<Scalar, rows>& b) {
  using Plain = decltype(plain_value(Scalar()));
  Vector<Plain, rows> out;
  for (int i = 0; i < rows; ++i) out(i) = std::abs(plain_value(a(i))) + std::abs(plain_value(b(i)));
  return out;
}
}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
