// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// State-dependent-coefficient (SDC) matrices F(x; r): F(x; r)(x - r) = f(x) - f(r). They exist about any
/// reference r, are not unique, and the JML and SDDRE gains depend on the choice.
///
/// Derived form: F(x; r) = ∫₀¹ f_x(r + s(x - r)) ds by Gauss-Legendre nodes, exact for polynomials; what is
/// left, ρ = f(x) - f(r) - F d with d = x - r, is removed by the rank-one term ρ dᵀ/(dᵀd): exact for every f.
#pragma once

#include <array>
#include <cmath>
#include <jml/linear_algebra.hpp>
#include <limits>

namespace jml {

/// The reference point of the SDC matrices: x = 0, as printed in the papers. A model's own SDC is used.
struct AboutOrigin {};
/// The reference point is fixed and named.
template <typename Scalar, int n>
struct AboutPoint {
  Vector<Scalar, n> point;
};
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

/// F(x; reference), rows×n. `jacobian(x)` gives rows×n; `change` is f(x) - f(reference), rows, and `size` the
/// size of the two numbers it is the difference of.
template <int rows, typename Scalar, int n, typename Jacobian>
Matrix<Scalar, rows, n> derive_sdc(const Jacobian& jacobian, const Vector<Scalar, rows>& change,
                                   const Vector<Scalar, rows>& size, const Vector<Scalar, n>& x,
                                   const Vector<Scalar, n>& reference) {
  const Vector<Scalar, n> d = x - reference;
  const Scalar squared = d.squaredNorm();
  if (!(squared > Scalar(0))) return jacobian(x);
  Matrix<Scalar, rows, n> out = Matrix<Scalar, rows, n>::Zero();
  for (const auto& node : detail::gauss_legendre) {
    const Vector<Scalar, n> between = reference + Scalar(node.position) * d;
    out += Scalar(node.weight) * jacobian(between);
  }
  const Vector<Scalar, rows> remainder = change - out * d;
  for (int i = 0; i < rows;
       ++i) {  // below rounding of its terms it would only carry noise, amplified by 1/|d|
    const Scalar rounding = Scalar(4) * std::numeric_limits<Scalar>::epsilon() *
                            (size(i) + out.row(i).transpose().cwiseAbs().dot(d.cwiseAbs()));
    if (!(std::abs(remainder(i)) <= rounding)) out.row(i) += (remainder(i) / squared) * d.transpose();
  }
  return out;
}

}  // namespace jml
