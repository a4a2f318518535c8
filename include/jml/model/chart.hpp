// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Motion in a space as motion in the chart at a state: with x(t) = base ⊞ z(t) and the tangent velocity ξ at
/// x (x is x ⊞ ξ dt after a short dt), ż = (∂/∂ε) ((base ⊞ z ⊞ ε ξ) ⊟ base) = J(z)⁻¹ ξ, where J is the slope
/// of the chart; dexp⁻¹ of ξ on a group (H. Munthe-Kaas, BIT 38 (1998) 92-111).
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <jml/model/local_context.hpp>
#include <utility>

namespace jml::detail {

/// ż, where x = base ⊞ z moves by ξ.
template <typename On, typename T>
[[nodiscard]] Vector<T, On::tangent> velocity_in_chart(const Vector<T, On::numbers>& base,
                                                       const Vector<T, On::numbers>& x,
                                                       const Vector<T, On::tangent>& velocity) {
  using Along = Dual<T, 1>;
  Vector<Along, On::numbers> wide;
  Vector<Along, On::tangent> ahead;
  for (int i = 0; i < On::numbers; ++i) wide(i) = x(i);
  for (int i = 0; i < On::tangent; ++i) {
    ahead(i) = T(0);
    ahead(i).partial[0] = velocity(i);
  }
  const Matrix<T, On::tangent, 1> moved =
      On::slope_of_minus(Vector<Along, On::numbers>(On::plus(wide, ahead)), base);
  Vector<T, On::tangent> out;
  for (int i = 0; i < On::tangent; ++i) out(i) = moved(i, 0);
  return out;
}
/// J(z)⁻¹ M, for the columns of M in the tangent at x = base ⊞ z.
template <typename On, typename Scalar, int m>
[[nodiscard]] Matrix<Scalar, On::tangent, m> columns_in_chart(const Vector<Scalar, On::numbers>& base,
                                                              const Vector<Scalar, On::numbers>& x,
                                                              const Matrix<Scalar, On::tangent, m>& M) {
  constexpr int at_once = derivatives_at_once(m);
  using Along = Dual<Scalar, at_once>;
  Vector<Along, On::numbers> wide;
  for (int i = 0; i < On::numbers; ++i) wide(i) = x(i);
  Matrix<Scalar, On::tangent, m> out;
  for (int first = 0; first < m; first += at_once) {
    Vector<Along, On::tangent> ahead;
    for (int i = 0; i < On::tangent; ++i) {
      ahead(i) = Scalar(0);
      for (int j = 0; j < at_once && first + j < m; ++j) ahead(i).partial[j] = M(i, first + j);
    }
    const Matrix<Scalar, On::tangent, at_once> columns =
        On::slope_of_minus(Vector<Along, On::numbers>(On::plus(wide, ahead)), base);
    set_columns(out, first, columns);
  }
  return out;
}
/// ξ of a continuous model: f(x, w), or f(x) + G w with G at the value of x.
template <typename T, typename D, int numbers, int q, typename At>
[[nodiscard]] Vector<T, degrees_of<D>> tangent_velocity(const D& d, const Vector<T, numbers>& x,
                                                        const Vector<T, q>& w, const At& at) {
  constexpr int n = degrees_of<D>;
  if constexpr (q > 0 && NoisyDynamicsIn<D, T, numbers, At>) {
    return ask_noisy<hooks::Dynamics>(d, x, w, at);
  } else {
    using Value = std::remove_cvref_t<decltype(ask<hooks::Dynamics>(d, x, at))>;
    static_assert(
        int(Value::RowsAtCompileTime) == n,
        "jml: continuous dynamics in a space answer with a tangent vector, of as many entries as there "
        "are degrees of freedom");
    Vector<T, n> out = ask<hooks::Dynamics>(d, x, at);
    if constexpr (q > 0) {
      const auto G = input_in<n>(d, plain_values(x), at);
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < q; ++j) out(i) += G(i, j) * w(j);
      }
    }
    return out;
  }
}

/// Whether a chart reaches z: the volume |det J(z)| that it gives to one at its centre is a share of it. 0.5
/// is 2.7 rad of a rotation and 1.9 rad of a direction; ℝⁿ has no end. True where z is not finite.
template <typename On, typename Scalar>
[[nodiscard]] bool chart_reaches(const Vector<Scalar, On::numbers>& base,
                                 const Vector<Scalar, On::tangent>& z, Scalar share = Scalar(0.5)) {
  constexpr int n = On::tangent;
  Matrix<Scalar, n, n> J = On::chart_slope(base, z);
  Scalar volume = 1;
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(J(i, k)) > std::abs(J(pivot, k))) pivot = i;
    }
    for (int j = k; j < n; ++j) std::swap(J(k, j), J(pivot, j));
    volume *= std::abs(J(k, k));
    for (int i = k + 1; i < n; ++i) {
      if (J(i, k) == Scalar(0)) continue;
      const Scalar factor = J(i, k) / J(k, k);
      for (int j = k + 1; j < n; ++j) J(i, j) -= factor * J(k, j);
    }
  }
  return !(volume < share);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
