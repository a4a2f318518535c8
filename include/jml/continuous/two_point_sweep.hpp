// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The passes of interval/minimise.hpp over the memory of a TwoPoint: those of interval/sweep.hpp with an
/// interval of continuous/collocation.hpp in the place of a step.
///
/// Backward, with v(δ) = ½ δᵀ Λ δ + λᵀ δ of the later intervals and S_i, s_i the curvature and the slope of a
/// stage's measurement, ½ h b_i (y - m)ᵀ R⁻¹ (y - m):
///   C = (1 + μ) I + Bᵀ Λ B + Σ XB_iᵀ S_i XB_i,  U = Bᵀ Λ A + Σ XB_iᵀ S_i XA_i,  g = β + Bᵀ λ + Σ XB_iᵀ s_i,
///   δβ = -C⁻¹ (g + U δ),  λ ← Aᵀ λ + Σ XA_iᵀ s_i - Uᵀ C⁻¹ g,  Λ ← Aᵀ Λ A + Σ XA_iᵀ S_i XA_i - Uᵀ C⁻¹ U.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/two_point_record.hpp>

namespace jml::detail {

template <typename D, typename S, typename Scalar>
class Sweep<TwoPointRecord<D, S, Scalar>> {
  using Store = TwoPointRecord<D, S, Scalar>;
  static constexpr int n = Store::n, q = Store::q, m = Store::m, p = Store::p;
  using X = Vector<Scalar, n>;
  using Square = Matrix<Scalar, n, n>;
  using Whitened = Vector<Scalar, m>;
  using Unknowns = Matrix<Scalar, m, m>;
  using Node = typename Store::Node;

 public:
  Sweep(Store& store, const Loss&) : store_(store) {}

  /// As Sweep::backward() of an interval of samples.
  template <Curvature curvature = Curvature::none>
  [[nodiscard]] bool backward(bool infeasible, Scalar damping, PassSums<Scalar>& total) {
    const auto now = std::size_t(store_.now());
    const auto step = store_.step();
    PassSums<Scalar> sums;
    CostToGo<Scalar, n> v;
    begin(v, sums);
    for (int j = store_.last(); j > 0; --j) {
      Node& node = store_.node(j);
      const X& x = store_.node(j - 1).x[now];
      const Whitened b = infeasible ? Whitened(kernel::zeros<Whitened>()) : node.b[now];
      if (infeasible) {
        X end;
        node.stages[now] = {x, x, x};
        if (!step.solve(x, b, node.at, node.stages[now], end)) return false;
        v.slope += v.information * (end - node.x[now]);
      }
      CollocatedInterval<Scalar, n, m> interval;
      if (!step.linearise(node.stages[now], node.at, interval)) return false;
      Square S_i[3];
      X s[3], weights[3], unused;
      measure<curvature>(node, sums, S_i, s);
      if constexpr (curvature == Curvature::full) {
        if (!step.adjoint(interval, node.at, v.slope, s, weights, unused)) return false;
        for (int i = 0; i < 3; ++i)
          S_i[i] += dynamics_hessian(store_.dynamics(), node.stages[now][std::size_t(i)], weights[i],
                                     stage_of(node.at, i));
      }
      sums.cost += kernel::squared_norm(b) / Scalar(2);
      Unknowns C = kernel::transposed(interval.B) * (v.information * interval.B);
      Matrix<Scalar, m, n> U = kernel::transposed(interval.B) * (v.information * interval.A);
      Whitened g = b + kernel::transposed(interval.B) * v.slope;
      Square information = kernel::transposed(interval.A) * (v.information * interval.A);
      X slope = kernel::transposed(interval.A) * v.slope;
      Whitened rounding = C.diagonal();
      for (int i = 0; i < 3; ++i) {
        const Matrix<Scalar, m, n> XBS = kernel::transposed(interval.XB[i]) * S_i[i];
        const Matrix<Scalar, m, m> part = XBS * interval.XB[i];
        C += part;
        for (int c = 0; c < m; ++c) rounding(c) = std::abs(rounding(c)) + std::abs(part(c, c));
        U += XBS * interval.XA[i];
        g += kernel::transposed(interval.XB[i]) * s[i];
        information += kernel::transposed(interval.XA[i]) * (S_i[i] * interval.XA[i]);
        slope += kernel::transposed(interval.XA[i]) * s[i];
      }
      C = kernel::symmetric_part(C);
      kernel::add_to_diagonal(C, Scalar(1) + damping);
      kernel::SymmetricFactor<Scalar, m> factor;
      if (!factor.factor(C)) {
        if constexpr (curvature == Curvature::full) stop_ = {j, C, rounding, v.information};
        return false;
      }
      const Whitened Cg = factor.solve(g);
      node.law.offset = -Cg;
      for (int c = 0; c < n; ++c)
        kernel::set_column(node.law.gain, c, Whitened(-factor.solve(kernel::column_of(U, c))));
      sums.decrease += kernel::dot(g, Cg) / Scalar(2);
      if (keeps_covariances) {
        node.closed = interval.A + interval.B * node.law.gain;
        const Matrix<Scalar, m, n> BT = kernel::transposed(interval.B);
        Matrix<Scalar, m, n> CB;
        for (int c = 0; c < n; ++c) kernel::set_column(CB, c, factor.solve(kernel::column_of(BT, c)));
        node.spread = kernel::symmetric_part(Square(interval.B * CB));
      }
      v.slope = slope - kernel::transposed(U) * Cg;
      v.information = kernel::symmetric_part(Square(information + kernel::transposed(U) * node.law.gain));
    }
    total = sums;
    return at_prior(infeasible, damping, v, total);
  }
  /// There are none.
  [[nodiscard]] static bool backward_in_two(bool, Scalar, PassSums<Scalar>&) { return false; }

  /// backward() leaves what covariances() goes forward by.
  bool keeps_covariances = false;

  struct Stop {
    int node = 0;
    Unknowns C = kernel::zeros<Unknowns>();
    Whitened rounding = kernel::zeros<Whitened>();
    Square information = kernel::zeros<Square>();
  };
  [[nodiscard]] const Stop& stop() const { return stop_; }

  /// As Sweep::forward().
  [[nodiscard]] Scalar forward(bool infeasible) {
    const auto now = std::size_t(store_.now()), next = std::size_t(store_.next());
    const auto step = store_.step();
    auto& prior = store_.prior();
    prior.a[next] = infeasible ? prior.law : X(prior.a[now] + prior.law);
    PassSums<Scalar> sums;
    sums.cost = prior.squared_norm(store_.next()) / Scalar(2);
    X x = prior.x + prior.L * prior.a[next];
    store_.node(0).x[next] = x;
    for (int j = 1; j <= store_.last(); ++j) {
      Node& node = store_.node(j);
      const X off = x - store_.node(j - 1).x[now];
      const Whitened change = node.law.offset + node.law.gain * off;
      node.b[next] = infeasible ? change : Whitened(node.b[now] + change);
      sums.cost += kernel::squared_norm(node.b[next]) / Scalar(2);
      for (std::size_t i = 0; i < 3; ++i) node.stages[next][i] = node.stages[now][i] + off;
      X end;
      if (!step.solve(x, node.b[next], node.at, node.stages[next], end))
        return std::numeric_limits<Scalar>::quiet_NaN();
      store_.flip();  // measure() is of the nominal
      measure_cost(node, sums);
      store_.flip_back();
      kernel::assign(x, end);
      node.x[next] = x;
    }
    if (const Terminal<Scalar, n>* end = store_.terminal()) {
      const X off = x - end->target;
      sums.cost += kernel::dot(off, X(end->weight * off)) / Scalar(2);
    }
    return all_finite(x) ? sums.cost : std::numeric_limits<Scalar>::quiet_NaN();
  }

  /// As Sweep::predict().
  [[nodiscard]] Scalar predict() {
    const auto now = std::size_t(store_.now());
    const auto step = store_.step();
    kernel::set_zero(store_.prior().law);
    X x = store_.prior().x;
    store_.node(0).x[now] = x;
    for (int j = 1; j <= store_.last(); ++j) {
      Node& node = store_.node(j);
      X end;
      node.stages[now] = {x, x, x};
      node.law = {};
      if (!step.solve(x, kernel::zeros<Whitened>(), node.at, node.stages[now], end))
        return std::numeric_limits<Scalar>::quiet_NaN();
      node.x[now] = x = end;
    }
    return forward(true);
  }

  /// |∇J| over the whitened unknowns; leaves the costate λ of (12) in every node.
  [[nodiscard]] Scalar gradient() {
    const auto now = std::size_t(store_.now());
    const auto step = store_.step();
    PassSums<Scalar> unused;
    CostToGo<Scalar, n> v;
    begin(v, unused);
    Scalar sum = 0;
    store_.node(store_.last()).costate = -v.slope;
    for (int j = store_.last(); j > 0; --j) {
      Node& node = store_.node(j);
      CollocatedInterval<Scalar, n, m> interval;
      Square S_i[3];
      X s[3], weights[3], start;
      measure<Curvature::none>(node, unused, S_i, s);
      if (!step.linearise(node.stages[now], node.at, interval) ||
          !step.adjoint(interval, node.at, v.slope, s, weights, start))
        return std::numeric_limits<Scalar>::infinity();
      for (int i = 0; i < 3; ++i) {
        const Vector<Scalar, q> part =
            kernel::transposed(store_.root(j).B) * weights[i] / step.root(node.at, i);
        for (int c = 0; c < q; ++c) {
          const Scalar slope = node.b[now](i * q + c) + part(c);
          sum += slope * slope;
        }
      }
      v.slope = start;
      store_.node(j - 1).costate = -start;
    }
    auto& prior = store_.prior();
    sum += kernel::squared_norm(prior.a[now] + kernel::transposed(prior.L) * v.slope);
    const Scalar norm = std::sqrt(sum);
    return std::isfinite(norm) ? norm : std::numeric_limits<Scalar>::infinity();
  }

  /// Why the nominal cannot be linearised, in the order of time.
  [[nodiscard]] JML_RARE Status diagnose() const {
    const auto now = std::size_t(store_.now());
    for (int j = 1; j <= store_.last(); ++j) {
      const Node& node = store_.node(j);
      for (int i = 0; i < 3; ++i) {
        const X& x = node.stages[now][std::size_t(i)];
        const auto at = stage_of(node.at, i);
        if (!all_finite(x) || !all_finite(dynamics_jacobian(store_.dynamics(), x, at)) ||
            !all_finite(predicted_state(store_.dynamics(), x, at)))
          return Status::dynamics_not_finite;
        if (node.measured && (!all_finite(measurement(store_.sensor(), x, at)) ||
                              !all_finite(measurement_jacobian(store_.sensor(), x, at))))
          return Status::sensor_not_finite;
      }
    }
    return Status::not_converged;
  }

 private:
  void begin(CostToGo<Scalar, n>& v, PassSums<Scalar>& sums) const {
    if (const Terminal<Scalar, n>* end = store_.terminal()) {
      const X off = store_.node(store_.last()).x[std::size_t(store_.now())] - end->target;
      v.information = end->weight;
      v.slope = end->weight * off;
      sums.cost += kernel::dot(off, v.slope) / Scalar(2);
    }
  }
  [[nodiscard]] Vector<Scalar, p> residual(const Node& node, int i, const X& x) const {
    return measurement_residual(store_.sensor(), node.y[std::size_t(i)],
                                measurement(store_.sensor(), x, stage_of(node.at, i)));
  }
  void measure_cost(const Node& node, PassSums<Scalar>& sums) const {
    for (int i = 0; i < 3 && node.measured; ++i) {
      const X& x = node.stages[std::size_t(store_.now())][std::size_t(i)];
      sums.cost += store_.step().hb(node.at, i) * store_.R().squared_norm(residual(node, i, x)) / Scalar(2);
    }
  }
  /// S_i and s_i of the nominal, and their share of J.
  template <Curvature curvature>
  void measure(const Node& node, PassSums<Scalar>& sums, Square (&S_i)[3], X (&s)[3]) const {
    measure_cost(node, sums);
    for (int i = 0; i < 3; ++i) {
      kernel::set_zero(S_i[i]);
      kernel::set_zero(s[i]);
      if (!node.measured) continue;
      const X& x = node.stages[std::size_t(store_.now())][std::size_t(i)];
      const auto at = stage_of(node.at, i);
      const Scalar weight = store_.step().hb(node.at, i);
      const Vector<Scalar, p> r = residual(node, i, x);
      CostToGo<Scalar, n> one;
      add_measurement(Matrix<Scalar, p, n>(measurement_jacobian(store_.sensor(), x, at)), store_.R(), r, one);
      S_i[i] = weight * one.information;
      s[i] = weight * one.slope;
      if constexpr (curvature == Curvature::full)
        S_i[i] +=
            measurement_hessian(store_.sensor(), x, Vector<Scalar, p>(store_.R().solve(r) * -weight), at);
    }
  }
  bool at_prior(bool infeasible, Scalar damping, const CostToGo<Scalar, n>& v, PassSums<Scalar>& sums) {
    auto& prior = store_.prior();
    stop_.node = 0;
    stop_.information = v.information;
    const auto now = std::size_t(store_.now());
    const X a = infeasible ? X(kernel::zeros<X>()) : prior.a[now];
    const X off = prior.x + prior.L * a - store_.node(0).x[now];
    const X slope = v.slope + v.information * off;
    Square C = kernel::symmetric_part(Square(kernel::transposed(prior.L) * (v.information * prior.L)));
    kernel::add_to_diagonal(C, Scalar(1) + damping);
    kernel::SymmetricFactor<Scalar, n> factor;
    if (!factor.factor(C)) return false;
    const X g = a + kernel::transposed(prior.L) * slope;
    prior.law = -factor.solve(g);
    sums.decrease -= kernel::dot(g, prior.law) / Scalar(2);
    sums.cost += (kernel::squared_norm(a) + kernel::dot(X(v.slope + slope), off)) / Scalar(2);
    if (keeps_covariances) {
      Matrix<Scalar, n, n> half, scaled, right;
      factor.right_solve(prior.L, half, scaled, right);
      store_.node(0).P = kernel::symmetric_part(Square(right * kernel::transposed(prior.L)));  // L C⁻¹ Lᵀ
    }
    return all_finite(prior.law) && std::isfinite(sums.decrease);
  }

  Store& store_;
  Stop stop_{};
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
