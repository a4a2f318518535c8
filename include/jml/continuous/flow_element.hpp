// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One Runge-Kutta step of a continuous filter as a step of a discrete one, whose covariance can be kept in
/// factors.
///
/// The optimal estimate over a step whose noises are constants of each of the four stages, with the stages'
/// weights h b_i for time (all positive), is a discrete problem: disturbances w_i of covariance Q/(h b_i),
/// measurements z_i of covariance R/(h b_i). Its solution converges with the fourth order of the method (W.
/// W. Hager, Numer. Math. 87 (2000) 247-282, section 6), and is P ← Φ (P⁻¹ + Λ)⁻¹ Φᵀ + Γ with Λ and Γ
/// positive semidefinite however long the step is.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/riccati/differential.hpp>
#include <jml/riccati/gain_rule.hpp>
#include <jml/solve/runge_kutta.hpp>

namespace jml::detail {

/// Λ = rowsᵀ diag(1/row_variances) rows, then Φ, and Γ = noise diag(variances) noiseᵀ.
template <typename Scalar, int n, int q, int p>
struct FlowElement {
  Matrix<Scalar, p, n> rows = kernel::zeros<Matrix<Scalar, p, n>>();
  Vector<Scalar, p> row_variances = kernel::zeros<Vector<Scalar, p>>();
  Matrix<Scalar, n, n> transition = kernel::zeros<Matrix<Scalar, n, n>>();
  Matrix<Scalar, n, q> noise = kernel::zeros<Matrix<Scalar, n, q>>();
  Vector<Scalar, q> variances = kernel::zeros<Vector<Scalar, q>>();

  [[nodiscard]] bool finite() const {
    return all_finite(rows) && all_finite(row_variances) && all_finite(transition) && all_finite(noise) &&
           all_finite(variances);
  }

  /// The element of x⁺ = T x + N w and z = H x + M w + v, w and v of unit covariance. False where they are
  /// not finite.
  [[nodiscard]] bool form(const Matrix<Scalar, n, n>& T, const Matrix<Scalar, n, q>& N,
                          const Matrix<Scalar, p, n>& H, const Matrix<Scalar, p, q>& M) {
    transition = T;
    noise = N;
    for (int k = 0; k < q; ++k) variances(k) = Scalar(1);
    if constexpr (p > 0) {
      rows = H;
      for (int i = 0; i < p; ++i) row_variances(i) = Scalar(1);
    }
    if constexpr (p > 0 && q > 0) {
      // I + M Mᵀ = L D Lᵀ is the covariance of z given x: rows L⁻¹ H of variance D.
      kernel::SymmetricFactor<Scalar, p> rest;
      kernel::SymmetricFactor<Scalar, q> left;
      const Matrix<Scalar, q, p> Mt = kernel::transposed(M);
      const Matrix<Scalar, p, p> S = kernel::identity<Matrix<Scalar, p, p>>() + M * Mt;
      const Matrix<Scalar, q, q> I = kernel::identity<Matrix<Scalar, q, q>>() + Mt * M;
      if (!rest.factor(S) || !left.factor(I)) return false;
      Matrix<Scalar, p, q> Z = M;
      for (int i = 0; i < p; ++i) {
        row_variances(i) = Scalar(1) / rest.inverse_diagonal(i);
        for (int k = 0; k < i; ++k) {
          for (int j = 0; j < n; ++j) rows(i, j) -= rest.lower(i, k) * rows(k, j);
          for (int j = 0; j < q; ++j) Z(i, j) -= rest.lower(i, k) * Z(k, j);
        }
      }
      for (int i = 0; i < p; ++i) {  // Φ = T - N Mᵀ (I + M Mᵀ)⁻¹ H
        for (int j = 0; j < q; ++j) Z(i, j) *= rest.inverse_diagonal(i);
      }
      const Matrix<Scalar, q, n> seen = kernel::transposed(Z) * rows;
      transition = T - N * seen;
      // (I + Mᵀ M)⁻¹ = L⁻ᵀ D⁻¹ L⁻¹ is that of w given x and z: columns N L⁻ᵀ of variance 1/D.
      for (int j = 0; j < q; ++j) {
        for (int k = 0; k < j; ++k) kernel::subtract_column(noise, k, left.lower(j, k), noise, j);
        variances(j) = left.inverse_diagonal(j);
      }
    }
    return finite();
  }
};

template <typename Scalar, int n>
[[nodiscard]] Matrix<Scalar, n, n> diagonal_of(const Vector<Scalar, n>& entries) {
  Matrix<Scalar, n, n> out = kernel::zeros<Matrix<Scalar, n, n>>();
  for (int i = 0; i < n; ++i) out(i, i) = entries(i);
  return out;
}

/// The motion of an element as dynamics; x is moved elsewhere.
template <typename Scalar, int n, int q, int p>
struct ElementDynamics {
  static constexpr int states = n, disturbances = q;
  const FlowElement<Scalar, n, q, p>& element;
  const Vector<Scalar, n>& x;

  template <typename T>
  Vector<T, n> dynamics(const Vector<T, n>&) const {
    return kernel::cast<T>(x);
  }
  Matrix<Scalar, n, n> dynamics_jacobian(const Vector<Scalar, n>&) const { return element.transition; }
  Matrix<Scalar, n, q> disturbance_input() const
    requires(q > 0)
  {
    return element.noise;
  }
  Matrix<Scalar, q, q> disturbance_covariance() const
    requires(q > 0)
  {
    return diagonal_of(element.variances);
  }
};

/// The rows of an element as a sensor whose innovation is zero: x is corrected elsewhere.
template <typename Scalar, int n, int q, int p>
struct ElementRows {
  static constexpr int measurements = p;
  const FlowElement<Scalar, n, q, p>& element;

  template <typename T>
  Vector<T, p> measurement(const Vector<T, n>&) const {
    return kernel::zeros<Vector<T, p>>();
  }
  Matrix<Scalar, p, n> measurement_jacobian(const Vector<Scalar, n>&) const { return element.rows; }
  Matrix<Scalar, p, p> noise_covariance() const { return diagonal_of(element.row_variances); }
};

/// One step of length h of (x, P) from `time`, x in place; P, a dense one, is what the gains of the stages
/// are made of. `element` is what P is moved by.
template <typename Rule, typename F, typename D, typename S, typename Scalar, int n, int q, int p>
[[nodiscard]] Status walk(const Rule& rule, F& flow, const D& dynamics, const S& sensor, double time,
                          Scalar h, Vector<Scalar, n>& x, const Matrix<Scalar, n, n>& P,
                          FlowElement<Scalar, n, q, p>& element, typename F::Report* record) {
  constexpr int columns = n + q, each_q = q / 4, each_p = p / 4;
  using Columns = Matrix<Scalar, n, columns>;  // of x at the start, and of the disturbances of each stage
  const RungeKuttaStages<Scalar> stages(h);
  Vector<Scalar, n> at_x = x, sum_x = x, slope_x;
  Matrix<Scalar, n, n> at_P = P, slope_P;
  Columns start = kernel::zeros<Columns>(), slope;
  for (int i = 0; i < n; ++i) start(i, i) = Scalar(1);
  Columns at = start, sum = start;
  Matrix<Scalar, p, columns> seen = kernel::zeros<Matrix<Scalar, p, columns>>();
  for (int i = 0; i < 4; ++i) {
    if (i > 0) {
      kernel::add_scaled(at_x, x, stages.node[i], slope_x);
      kernel::add_scaled(at_P, P, stages.node[i], slope_P);
      kernel::add_scaled(at, start, stages.node[i], slope);
    }
    const double now = time + static_cast<double>(stages.node[i]);
    Status status = flow.derivative(now, at_x, at_P, slope_x, slope_P, i == 0 ? record : nullptr);
    if (status == Status::ok && i == 0) status = flow.permits(h);
    if (status != Status::ok) return status;
    const Matrix<Scalar, n, n> A = dynamics_slot<Rule::A>(rule, dynamics, at_x, at_x, flow.at(now));
    kernel::product(A, at, slope);
    if constexpr (q > 0) {
      const Matrix<Scalar, each_q, each_q> Q = disturbance_spectral_density(dynamics, at_x, flow.at(now));
      if (!is_covariance(Q)) return Status::invalid_disturbance_covariance;
      const Matrix<Scalar, each_q, each_q> root = kernel::SemidefiniteFactor<Scalar, each_q>(Q).L;
      const Matrix<Scalar, n, each_q> B = disturbance_input(dynamics, at_x, flow.at(now)) * root;
      const Scalar density = Scalar(1) / std::sqrt(stages.weight[i]);
      for (int k = 0; k < each_q; ++k)
        kernel::subtract_column(B, k, -density, slope, n + i * each_q + k);  // + w_i / √(h b_i)
    }
    if constexpr (p > 0) {  // √(h b_i) L⁻¹ D of R = L Lᵀ
      const Matrix<Scalar, each_p, n> slot = sensor_slot<Rule::D>(rule, sensor, at_x, at_x, flow.at(now));
      const Matrix<Scalar, each_p, columns> row = slot * at;
      kernel::SymmetricFactor<Scalar, each_p> noise;
      if (!noise.factor(flow.R())) return Status::invalid_noise_covariance;
      for (int l = 0; l < each_p; ++l) {
        for (int c = 0; c < columns; ++c) {
          Scalar entry = row(l, c);
          for (int k = 0; k < l; ++k) entry -= noise.lower(l, k) * seen(i * each_p + k, c);
          seen(i * each_p + l, c) = entry;
        }
      }
      for (int l = 0; l < each_p; ++l) {
        const Scalar weight = std::sqrt(stages.weight[i] * noise.inverse_diagonal(l));
        for (int c = 0; c < columns; ++c) seen(i * each_p + l, c) *= weight;
      }
    }
    kernel::add_scaled(sum_x, sum_x, stages.weight[i], slope_x);
    kernel::add_scaled(sum, sum, stages.weight[i], slope);
  }
  kernel::assign(x, sum_x);
  Matrix<Scalar, n, n> T;
  Matrix<Scalar, n, q> N;
  Matrix<Scalar, p, n> H;
  Matrix<Scalar, p, q> M;
  for (int c = 0; c < columns; ++c) {
    for (int i = 0; i < n; ++i) (c < n ? T(i, c < n ? c : 0) : N(i, c - n)) = sum(i, c);
    for (int i = 0; i < p; ++i) (c < n ? H(i, c < n ? c : 0) : M(i, c - n)) = seen(i, c);
  }
  return element.form(T, N, H, M) && all_finite(x) ? Status::ok : Status::dynamics_not_finite;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
