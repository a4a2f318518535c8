// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The RNLS filter made exact over an interval: the differential Riccati equation (19) of Rusnak (2018) with
/// its coefficients along the smoothed trajectory, repeated.
///
/// About a trajectory x̃ the two-point problem (13), (14) is linear; with B = f_x, D = m_x of Table 1:
///   ẋ = f(x̃) + A (x - x̃) + G Q Gᵀ λ,   λ̇ = -Bᵀ λ - Dᵀ R⁻¹ (y - m(x̃) - E (x - x̃)).
/// x = x̂ + P λ solves it: forward the filter (17) with the P of (19), backward λ. At a fixed point x = x̃ this
/// is (12) for any SDC matrices A and E, so the filter's last x̂, where λ = 0, is the exact optimum. The row
/// of the EKF is Gauss-Newton's method without its damping; that of the RNLS filter is the paper's.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/swept_report.hpp>
#include <jml/continuous/two_point.hpp>
#include <jml/riccati/gain_rule.hpp>

namespace jml {

namespace detail {

/// det M > 0.
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE bool keeps_orientation(Matrix<Scalar, n, n> M) {
  bool positive = true;
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i) {
      if (std::abs(M(i, k)) > std::abs(M(best, k))) best = i;
    }
    if (best != k) {
      kernel::swap_rows(M, k, best);
      positive = !positive;
    }
    if (!(std::abs(M(k, k)) > Scalar(0))) return false;
    positive = positive == (M(k, k) > Scalar(0));
    for (int i = k + 1; i < n; ++i) {
      const Scalar factor = M(i, k) / M(k, k);
      for (int j = k + 1; j < n; ++j) M(i, j) -= factor * M(k, j);
    }
  }
  return positive;
}

/// One sweep over the memory of a TwoPoint.
template <typename Rule, typename Store>
class RiccatiSweep {
  using Scalar = typename Store::Number;
  using D = typename Store::Model;
  static constexpr int n = Store::n, p = Store::p;
  using X = Vector<Scalar, n>;
  using Square = Matrix<Scalar, n, n>;
  using Node = typename Store::Node;
  /// (x, λ) at the three stages and at the end, affine in (x, λ) of the start; the last column is constant.
  using Stages = Matrix<Scalar, 6 * n, 2 * n + 1>;
  using End = Matrix<Scalar, 2 * n, 2 * n + 1>;

 public:
  RiccatiSweep(Store& store, const Rule& rule) : store_(store), rule_(rule) {
    const auto& B = store.root(0).B;
    noise_ = B * kernel::transposed(B);
  }

  /// From the nominal into the other trajectory, which becomes the nominal. `filtered`, P of node 0: given.
  [[nodiscard]] Status sweep(SweptReport<Scalar, n>& report) {
    const auto next = std::size_t(store_.next());
    Stages stages;
    End end;
    const Node& first = store_.node(0);
    for (int j = 1; j <= store_.last(); ++j) {
      const Node& before = store_.node(j - 1);
      Node& node = store_.node(j);
      if (!solve(node, stages, end)) return Sweep<Store>(store_, Loss{}).diagnose();
      Square TT = transition(end, before.P);
      const bool follows =
          Rule::symmetric || stays_near(TT) || (keeps_orientation(TT) && damped(node, 0, before.P));
      if (!follows) return Status::riccati_escape;
      Square PT = kernel::transposed(Square(part(end, 0, 0) * before.P + part(end, 0, 1)));
      if (!(kernel::eliminate(TT, PT) > Scalar(0)) || !all_finite(PT)) return Status::riccati_escape;
      node.P = kernel::transposed(PT);  // (Φ11 P + Φ12) (Φ21 P + Φ22)⁻¹
      if (!Rule::symmetric && !stays_near(transition(end, before.P)) && !damped(node, 2, node.P))
        return Status::riccati_escape;
      node.filtered = part(end, 0, 0) * before.filtered + constant(end, 0) -
                      node.P * X(part(end, 1, 0) * before.filtered + constant(end, 1));
    }
    Node& last = store_.node(store_.last());
    last.x[next] = last.filtered;
    kernel::set_zero(last.costate);
    report.cost = 0;
    for (int j = store_.last(); j > 0; --j) {
      Node &node = store_.node(j), &before = store_.node(j - 1);
      (void)solve(node, stages, end);
      Square T = kernel::transposed(transition(end, before.P));
      X costate = node.costate - constant(end, 1) - part(end, 1, 0) * before.filtered;
      (void)kernel::eliminate(T, costate);
      before.costate = costate;
      before.x[next] = before.filtered + before.P * costate;  // x = x̂ + P λ
      Vector<Scalar, 2 * n + 1> start;
      for (int k = 0; k < n; ++k) {
        start(k) = before.x[next](k);
        start(n + k) = costate(k);
      }
      start(2 * n) = 1;
      const Vector<Scalar, 6 * n> inside = stages * start;
      for (int i = 0; i < 3; ++i) {
        X lambda;
        for (int k = 0; k < n; ++k) {
          node.stages[next][std::size_t(i)](k) = inside(i * 2 * n + k);
          lambda(k) = inside(i * 2 * n + n + k);
        }
        report.cost += store_.step().hb(node.at, i) * kernel::dot(lambda, X(noise_ * lambda)) / Scalar(2);
      }
    }
    report.cost += kernel::dot(X(first.x[next] - first.filtered), first.costate) / Scalar(2);
    report.P = last.P;
    report.step = change();
    store_.flip();
    for (int j = 1; j <= store_.last(); ++j) report.cost += measured(store_.node(j));
    return std::isfinite(report.step) ? Status::ok : Status::dynamics_not_finite;
  }

 private:
  static Square part(const End& end, int i, int j) { return kernel::block<n, n>(end, i * n, j * n); }
  static X constant(const End& end, int i) { return kernel::block<n, 1>(end, i * n, 2 * n); }
  /// (Φ21 P + Φ22)ᵀ.
  static Square transition(const End& end, const Square& P) {
    return kernel::transposed(Square(part(end, 1, 0) * P + part(end, 1, 1)));
  }
  /// Within 1 of the identity: no pole of P on the way.
  [[nodiscard]] static bool stays_near(const Square& T) {
    return kernel::largest_column_sum(Square(T - kernel::identity<Square>())) < Scalar(1);
  }
  /// R + 2 h sym(E P Dᵀ) is positive definite at stage i: the quadratic term of (19) has no pole near.
  [[nodiscard]] bool damped(const Node& node, int i, const Square& P) const {
    if (!node.measured) return true;
    const X& x = node.stages[std::size_t(store_.now())][std::size_t(i)];
    const auto at = stage_of(node.at, i);
    const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(rule_, store_.sensor(), x, x, at);
    const Matrix<Scalar, p, n> slot_e = sensor_slot<Rule::E>(rule_, store_.sensor(), x, x, at);
    const Matrix<Scalar, p, p> feedback = slot_e * (P * kernel::transposed(slot_d));
    const Matrix<Scalar, p, p> R = noise_spectral_density(store_.sensor(), x, at);
    kernel::SymmetricFactor<Scalar, p> factor;
    return factor.factor(Matrix<Scalar, p, p>(R + Scalar(2) * node.at.dt * kernel::symmetric_part(feedback)));
  }
  [[nodiscard]] Scalar measured(const Node& node) const {
    Scalar sum = 0;
    for (int i = 0; i < 3 && node.measured; ++i) {
      const X& x = node.stages[std::size_t(store_.now())][std::size_t(i)];
      const Vector<Scalar, p> r = measurement_residual(store_.sensor(), node.y[std::size_t(i)],
                                                       measurement(store_.sensor(), x, stage_of(node.at, i)));
      sum += store_.step().hb(node.at, i) * store_.R().squared_norm(r) / Scalar(2);
    }
    return sum;
  }
  [[nodiscard]] Scalar change() const {
    Scalar most = 0;
    for (int k = 0; k < n; ++k) {
      Scalar size = 0, moved = 0;
      for (int j = 0; j <= store_.last(); ++j) {
        const auto& x = store_.node(j).x;
        if (!std::isfinite(x[std::size_t(store_.next())](k))) return std::numeric_limits<Scalar>::quiet_NaN();
        size = std::max(size, std::abs(x[std::size_t(store_.next())](k)));
        moved = std::max(moved, std::abs(x[0](k) - x[1](k)));
      }
      if (moved > Scalar(0)) most = std::max(most, size > Scalar(0) ? moved / size : Scalar(1));
    }
    return most;
  }

  /// The linear problem of one interval about the nominal, by the same collocation.
  [[nodiscard]] bool solve(const Node& node, Stages& stages, End& end) const {
    using Step = CollocatedStep<Scalar, D>;
    Matrix<Scalar, 2 * n, 2 * n> H[3];
    Vector<Scalar, 2 * n> c[3];
    for (int j = 0; j < 3; ++j) {
      const X& x = node.stages[std::size_t(store_.now())][std::size_t(j)];
      const auto at = stage_of(node.at, j);
      const Square A = dynamics_slot<Rule::A>(rule_, store_.dynamics(), x, x, at);
      const Square B = dynamics_slot<Rule::B>(rule_, store_.dynamics(), x, x, at);
      kernel::set_zero(H[j]);
      kernel::set_zero(c[j]);
      const X drift = predicted_state(store_.dynamics(), x, at) - A * x;
      Square WE = kernel::zeros<Square>();
      X pull = kernel::zeros<X>();
      if (node.measured) {
        const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(rule_, store_.sensor(), x, x, at);
        const Matrix<Scalar, p, n> slot_e = sensor_slot<Rule::E>(rule_, store_.sensor(), x, x, at);
        const Vector<Scalar, p> r = measurement_residual(store_.sensor(), node.y[std::size_t(j)],
                                                         measurement(store_.sensor(), x, at));
        Matrix<Scalar, n, p> DT = kernel::transposed(slot_d), half, scaled, W;
        store_.R().right_solve(DT, half, scaled, W);  // Dᵀ R⁻¹
        WE = W * slot_e;
        pull = W * Vector<Scalar, p>(r + slot_e * x);
      }
      kernel::set_block(H[j], 0, 0, A);
      kernel::set_block(H[j], 0, n, noise_);
      kernel::set_block(H[j], n, 0, WE);
      kernel::set_block(H[j], n, n, Square(-kernel::transposed(B)));
      for (int k = 0; k < n; ++k) {
        c[j](k) = drift(k);
        c[j](n + k) = -pull(k);
      }
    }
    Matrix<Scalar, 6 * n, 6 * n> M = kernel::identity<Matrix<Scalar, 6 * n, 6 * n>>();
    kernel::set_zero(stages);
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 2 * n; ++k) {
        stages(i * 2 * n + k, k) = Scalar(1);
        for (int j = 0; j < 3; ++j) {
          stages(i * 2 * n + k, 2 * n) += Step::ha(node.at, i, j) * c[j](k);
          for (int l = 0; l < 2 * n; ++l)
            M(i * 2 * n + k, j * 2 * n + l) -= Step::ha(node.at, i, j) * H[j](k, l);
        }
      }
    }
    if (!(kernel::eliminate(M, stages) > Scalar(0)) || !all_finite(stages)) return false;
    kernel::set_zero(end);
    for (int k = 0; k < 2 * n; ++k) end(k, k) = Scalar(1);
    for (int j = 0; j < 3; ++j) {
      end += Step::hb(node.at, j) * (H[j] * kernel::block<2 * n, 2 * n + 1>(stages, j * 2 * n, 0));
      for (int k = 0; k < 2 * n; ++k) end(k, 2 * n) += Step::hb(node.at, j) * c[j](k);
    }
    return all_finite(end);
  }

  Store& store_;
  const Rule& rule_;
  Square noise_;  // G Q Gᵀ
};

}  // namespace detail

/// Sweeps the filter of `rule` (Rnls or Ekf) over what `smoother` has recorded, from its start, until the
/// trajectory stays: then smoother.x(k), smoother.costate(k) solve (12), as after smoother.solve(), which
/// also says whether that is a minimum of J. No heap. `each`: called with the report after every sweep.
template <typename Rule, typename D, typename S, typename Scalar, typename Each>
SweptReport<Scalar, DynamicsTraits<D>::states> sweep(TwoPoint<D, S, Scalar>& smoother, const Rule& rule,
                                                     const SweptOptions& options, const Each& each) {
  static_assert(OnePassRule<Rule>, "jml: what is swept is a rule of the continuous filter: Rnls or Ekf");
  static_assert(
      same_slot<Rule::B, Slot::jacobian> && same_slot<Rule::D, Slot::jacobian>,
      "jml: only with Jacobians in the slots B and D do the sweeps end at a solution of (12): take Rnls or "
      "Ekf");
  SweptReport<Scalar, DynamicsTraits<D>::states> report;
  report.status = smoother.status();
  if (report.status == Status::ok && (!options.valid() || smoother.start == Start::several))
    report.status = Status::invalid_option;
  if (report.status != Status::ok) return report;
  smoother.begin();
  auto& store = smoother.recording();
  const auto now = std::size_t(store.now());
  store.node(0).P = store.start().P();
  store.node(0).filtered = store.start().x;
  for (int j = 1; j <= store.last(); ++j) {
    auto& node = store.node(j);
    const Vector<Scalar, DynamicsTraits<D>::states>& x = store.node(j - 1).x[now];
    for (std::size_t i = 0; i < 3; ++i)
      kernel::add_scaled(node.stages[now][i], x, static_cast<Scalar>(detail::Gauss::c[i]), node.x[now] - x);
  }
  const Scalar tolerance =
      options.tolerance > 0 ? static_cast<Scalar>(options.tolerance)
                            : std::max(Scalar(1e-10), Scalar(1e3) * std::numeric_limits<Scalar>::epsilon());
  detail::RiccatiSweep<Rule, typename TwoPoint<D, S, Scalar>::Record> one(store, rule);
  while (report.sweeps < options.max_sweeps) {
    ++report.sweeps;
    report.status = one.sweep(report);
    if (report.status != Status::ok) return report;
    each(report);
    if (report.step <= tolerance) return report;
  }
  report.status = Status::not_converged;
  return report;
}
/// The same, without a look at each sweep.
template <typename Rule, typename D, typename S, typename Scalar>
SweptReport<Scalar, DynamicsTraits<D>::states> sweep(TwoPoint<D, S, Scalar>& smoother, const Rule& rule,
                                                     const SweptOptions& options = {}) {
  return sweep(smoother, rule, options, [](const auto&) {});
}
}  // namespace jml
#include <jml/warnings_end.hpp>
