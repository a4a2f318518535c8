// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How much the models of an exact step bend where its criterion (11) asks.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/iterated/joint_step.hpp>

namespace jml::detail {

/// The second derivatives of a step's models at a point.
template <typename Step>
struct Bend {
  using X = typename Step::X;
  using Scalar = typename X::Scalar;
  static constexpr int n = static_cast<int>(X::RowsAtCompileTime), p = Step::p;
  using Square = Matrix<Scalar, n, n>;
  static constexpr bool of_m = !SensorTraits<std::remove_cvref_t<decltype(Step::sensor)>>::linear,
                        of_f = !DynamicsTraits<std::remove_cvref_t<decltype(Step::dynamics_model)>>::linear;

  Square m = kernel::zeros<Square>(), f = m;  // Σ ν_k ∇²m_k, Λ
  bool finite = true;

  JML_RARE Bend(const Step& step, const typename Step::Z& z, const typename Step::Visit& at) {
    if constexpr (of_m)
      m = measurement_hessian(step.sensor, Step::next(z), at.weighted_innovation, step.at_y);
    if constexpr (of_f) {
      X e;
      kernel::product(kernel::transposed(at.m_x), at.weighted_innovation, e);  // e = m_xᵀ ν
      f = dynamics_hessian(step.dynamics_model, Step::smoothed(z), e, step.at);
    }
    finite = all_finite(m) && all_finite(f);
  }

  /// They are too small for anything but a minimum: |Bᵀ m B| + … ≤ Σ |m_ij| √(N_ii N_jj) + Σ |Λ_ij| √(P_ii
  /// P_jj).
  [[nodiscard]] JML_RARE bool is_slight(const Step& step, const typename Step::Visit& at) const {
    Square fP, N;
    kernel::product(at.f_x, step.prior.P, fP);
    kernel::add_symmetric_product<1>(step.noise, fP, at.f_x, N);  // N = f_x P f_xᵀ + C
    Scalar sum = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        sum += std::abs(m(i, j)) * std::sqrt(std::abs(N(i, i) * N(j, j)));
        if constexpr (of_f)
          sum += std::abs(f(i, j)) * std::sqrt(std::abs(step.prior.P(i, i) * step.prior.P(j, j)));
      }
    }
    return sum < Scalar(1);
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
