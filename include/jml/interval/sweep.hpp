// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The two passes of one Gauss-Newton step on the criterion J (Rusnak 2015, eq. (5)): backward for the
/// feedback law (interval/costate.hpp), forward along the model itself.
///
/// The forward pass applies b = b̃ + k + K (x - x̃) to the nonlinear f, so that every trajectory is one the
/// model can follow and its J is exact, and the feedback keeps a long or unstable interval together. Time and
/// memory are linear in the number of steps.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/diagnose.hpp>
#include <jml/interval/linearised.hpp>
#include <jml/interval/record_terms.hpp>
#include <jml/model/hessian.hpp>

namespace jml::detail {

template <IntervalStore Store>
class Sweep {
  using D = typename Store::Dynamics;
  using Scalar = typename Store::Number;
  static constexpr int n = states_of<D>, q = DynamicsTraits<D>::disturbances;
  using X = Vector<Scalar, n>;
  static constexpr bool by_digits = DynamicsTraits<D>::linear && requires(const Store& s) { s.start(); };

 public:
  explicit Sweep(Store& store, const Loss& loss) : store_(store), loss_(loss) {}

  /// Backward from the last node: fills every law, and `sums`. `infeasible`: the nominal states are a guess
  /// that no disturbance needs to lead along; b̃ is zero, and sums.cost means nothing. False where a number is
  /// not finite or the quadratic model has no minimum.
  template <Curvature curvature = Curvature::none>
  [[nodiscard]] bool backward(bool infeasible, Scalar damping, PassSums<Scalar>& total) {
    if constexpr (curvature == Curvature::none) {
      if (infeasible) return pass<Curvature::none, true>(damping, total);
    }
    return pass<curvature, false>(damping, total);
  }

  /// Where the last backward pass in the digits of Scalar ended, and Λ there: node 0 is the prior.
  struct Stop {
    int node = 0;
    Matrix<Scalar, n, n> information;
  };
  [[nodiscard]] const Stop& stop() const { return stop_; }

  /// The same in twice the digits, without second derivatives.
  JML_RARE bool backward_in_two(bool infeasible, Scalar damping, PassSums<Scalar>& total) {
    const int now = store_.now();
    InformationMemory<Scalar, n, q, most_rows<typename Store::List>> memory;
    InformationInTwo<Scalar> information(memory);
    PassSums<Scalar> sums;
    if (const Terminal<Scalar, n>* end = store_.terminal()) {
      const X off = store_.node(store_.last()).x[now] - end->target, slope = end->weight * off;
      if (!information.begin(end->weight.data(), slope.data())) return false;
      sums.cost = kernel::dot(off, slope) / Scalar(2);
    }
    pass_in_two(
        store_, loss_, infeasible, false, damping, -1, information, sums,
        [&](int j) { by_two_ = by_two_ || AllDigits<D, Scalar>::told_later(store_, j, information); },
        [&](int j, const Feedback<Scalar, n, q>& law) { store_.node(j).law = law; });
    auto& prior = store_.prior();
    const X a = infeasible ? X(kernel::zeros<X>()) : prior.a[now];
    const X off = follows_exactly(infeasible) ? X(-(prior.L * a)) : X(prior.x - store_.node(0).x[now]);
    total = sums;
    return information.at_prior(prior.L.data(), prior.weight.data(), a.data(), off.data(), damping,
                                prior.law.data(), total) &&
           std::isfinite(total.decrease);
  }

  /// Forward along the law into the other trajectory. Returns its J; NaN where a number is not finite.
  [[nodiscard]] Scalar forward(bool infeasible) {
    if constexpr (by_digits) {
      if (by_two_ || AllDigits<D, Scalar>::known(store_.start())) return forward_in_two(infeasible);
    }
    return forward_by<false>(infeasible);
  }

  /// The trajectory without disturbances from x̂_0, into the other one. Returns its J as forward() does.
  [[nodiscard]] JML_RARE Scalar predict() {
    kernel::set_zero(store_.prior().law);
    X x = store_.prior().x;
    for (int j = 0; j <= store_.last(); ++j) {
      auto& node = store_.node(j);
      if (j > 0) x = dynamics(store_.dynamics(), x, node.at()) + store_.root(j).mean_effect;
      node.x[store_.now()] = x;
      node.law = {};
    }
    return forward(true);
  }

  /// |∇J|, 2-norm over the whitened unknowns: the costate, backward along the nominal.
  [[nodiscard]] Scalar gradient() {
    const int now = store_.now();
    CostToGo<Scalar, n> v;
    PassSums<Scalar> unused;
    const Loss loss = loss_;
    if (const Terminal<Scalar, n>* end = store_.terminal())
      v.slope = end->weight * (store_.node(store_.last()).x[now] - end->target);
    Scalar sum = 0;
    for (int j = store_.last();; --j) {
      auto& node = store_.node(j);
      X x, slope;
      kernel::assign(x, node.x[now]);
      store_.visit(j, [&](const auto& record) JML_INLINE {
        add_record<Curvature::none, false>(record, loss, x, end_of(node.at()), unused, v);
      });
      if (j == 0) break;
      Vector<Scalar, q> g;
      kernel::add_transposed_product<1>(node.b[now], store_.root(j).B, v.slope, g);
      if constexpr (WeighsDisturbances<Store>) g += store_.disturbance_term(j, node.b[now]).slope;
      sum += kernel::squared_norm(g);
      kernel::assign(slope, v.slope);
      kernel::transposed_product(step_jacobian(store_, j), slope, v.slope);
    }
    auto& prior = store_.prior();
    sum += kernel::squared_norm(prior.weighted(now) + kernel::transposed(prior.L) * v.slope);
    return std::isfinite(sum) ? std::sqrt(sum) : std::numeric_limits<Scalar>::infinity();
  }

  [[nodiscard]] Status diagnose() { return why_not_linear(store_); }  ///< why the nominal is not linearised

 private:
  /// One backward pass; see backward().
  template <Curvature curvature, bool infeasible>
  [[nodiscard]] bool pass(Scalar damping, PassSums<Scalar>& total) {
    constexpr auto rounding = curvature == Curvature::full ? Rounding::ignored
                              : infeasible                 ? Rounding::counted
                                                           : Rounding::bounded;
    const int now = store_.now();
    const Loss loss = loss_;
    PassSums<Scalar> sums;  // a local one, which stays in registers
    CostToGo<Scalar, n> v;
    if (const Terminal<Scalar, n>* end = store_.terminal()) {
      const X off = store_.node(store_.last()).x[now] - end->target;
      const X slope = end->weight * off;
      kernel::assign(v.information, end->weight);  // entry by entry, as all of v: it stays in registers
      kernel::assign(v.slope, slope);
      sums.cost = kernel::dot(off, slope) / Scalar(2);
    }
    bool valid = true;
    for (int j = store_.last();; --j) {
      auto& node = store_.node(j);
      X x;
      kernel::assign(x, node.x[now]);
      store_.visit(j, [&](const auto& record) JML_INLINE {
        add_record<curvature, curvature == Curvature::full>(record, loss, x, end_of(node.at()), sums, v);
      });
      if (j == 0) break;
      X previous;
      kernel::assign(previous, store_.node(j - 1).x[now]);
      const auto& root = store_.root(j);
      if constexpr (rounding == Rounding::bounded && !NoiseRoot<Scalar, D>::constant) note_inputs(root.B);
      Matrix<Scalar, n, n> A, bend;
      if constexpr (bends<curvature, DynamicsTraits<D>>)
        dynamics_jacobian_and_hessian(store_.dynamics(), previous, v.slope, node.at(), A, bend);
      else
        kernel::assign(A, dynamics_jacobian(store_.dynamics(), previous, node.at()));
      Vector<Scalar, q> b = kernel::zeros<Vector<Scalar, q>>();
      if constexpr (infeasible) {
        X defect;
        kernel::assign(defect, dynamics(store_.dynamics(), previous, node.at()));
        if constexpr (NoiseRoot<Scalar, D>::has_mean) defect += root.mean_effect;
        kernel::add_scaled(defect, defect, Scalar(-1), x);
        kernel::add_product<1>(v.slope, v.information, defect, v.slope);  // λ + Λ (f + G w̄ - x)
      } else {
        kernel::assign(b, node.b[now]);
      }
      if constexpr (curvature == Curvature::full) {
        const auto pass = [&](const auto& B, const auto& nominal)
                              JML_INLINE { return pass_dynamics(A, B, nominal, damping, v, node.law, sums); };
        if (!through_step(store_, j, b, node.law, sums, pass)) return stop_at(j, v), false;
        if constexpr (bends<curvature, DynamicsTraits<D>>) add_symmetric(v.information, bend);
      } else {
        valid &=
            through_step(store_, j, b, node.law, sums, [&](const auto& B, const auto& nominal) JML_INLINE {
              return pass_dynamics<rounding>(A, B, nominal, damping, v, node.law, sums);
            });
      }
    }
    if constexpr (rounding == Rounding::bounded && NoiseRoot<Scalar, D>::constant)
      note_inputs(store_.root(0).B);
    total = sums;
    return valid && at_prior(infeasible, curvature == Curvature::full, damping, v, total);
  }

  /// `in_two`: the states in twice the digits.
  template <bool in_two>
  [[nodiscard]] JML_INLINE Scalar forward_by(bool infeasible) {
    const int now = store_.now(), next = store_.next();
    const Loss loss = loss_;
    auto& prior = store_.prior();
    prior.a[next] = infeasible ? prior.law : X(prior.a[now] + prior.law);
    Scalar cost = prior.squared_norm(next) / Scalar(2), squares = 0;  // Σ |b|²
    X x, off;
    kernel::add_product<1>(prior.x, prior.L, prior.a[next], x);  // x_0 = x̂_0 + L a
    [[maybe_unused]] std::conditional_t<in_two, BothInDigits<D, Scalar>, NotInDigits> both(store_);
    if constexpr (in_two) both.begin(prior, now, next, !follows_exactly(infeasible), x);
    for (int j = 0;; ++j) {
      auto& node = store_.node(j);
      kernel::assign(node.x[next], x);
      store_.visit(
          j, [&](const auto& record) JML_INLINE { cost += record_cost(record, loss, x, end_of(node.at())); });
      if (j == store_.last()) break;
      auto& following = store_.node(j + 1);
      kernel::add_scaled(off, x, Scalar(-1), node.x[now]);
      if constexpr (in_two) both.off(x, off);
      // b̃ + k first: it does not wait for x.
      Vector<Scalar, q> nominal = kernel::zeros<Vector<Scalar, q>>(), start, b;
      if (!infeasible) kernel::assign(nominal, following.b[now]);
      kernel::add_scaled(start, nominal, Scalar(1), following.law.offset);
      kernel::add_product<1>(start, following.law.gain, off, b);  // b = b̃ + k + K (x - x̃)
      kernel::assign(following.b[next], b);
      squares += kernel::squared_norm(b);
      if constexpr (WeighsDisturbances<Store>) cost += store_.disturbance_term(j + 1, b).cost;
      const auto& root = store_.root(j + 1);
      X f;
      kernel::assign(f, dynamics(store_.dynamics(), x, following.at()));
      if constexpr (NoiseRoot<Scalar, D>::has_mean) f += root.mean_effect;
      kernel::add_product<1>(f, root.B, b, x);  // x⁺ = f + G w̄ + B b
      if constexpr (in_two) both.move(store_, j + 1, b, nominal, node.x[next], x);
    }
    if (const Terminal<Scalar, n>* end = store_.terminal()) {
      off = x - end->target;
      cost += kernel::dot(off, X(end->weight * off)) / Scalar(2);
    }
    return all_finite(x) ? cost + squares / Scalar(2) : std::numeric_limits<Scalar>::quiet_NaN();
  }

  JML_RARE Scalar forward_in_two(bool by) { return led_[store_.next()] = true, forward_by<true>(by); }
  /// The nominal was led along in twice the digits. Dynamics that expand lead away from any other.
  [[nodiscard]] bool follows_exactly(bool infeasible) const {
    if constexpr (by_digits)
      return !infeasible && (led_[store_.now()] || AllDigits<D, Scalar>::known(store_.start()));
    return false;
  }
  JML_INLINE void stop_at(int node, const CostToGo<Scalar, n>& v) {
    stop_.node = node;
    kernel::assign(stop_.information, v.information);
  }

  JML_NOINLINE bool at_prior(bool infeasible, bool bent, Scalar damping, const CostToGo<Scalar, n> v,
                             PassSums<Scalar>& sums) {
    auto& prior = store_.prior();
    stop_at(0, v);
    if (prior.diffuse && !bent) return false;
    const int now = store_.now();
    const X a = infeasible ? X(kernel::zeros<X>()) : prior.a[now];
    // x_0 need not be x̂_0 + L a, whose J this is: a guess, rounding in deviations of a singular P_0.
    const X off = follows_exactly(infeasible) ? X(kernel::zeros<X>())
                                              : X(prior.x + prior.L * a - store_.node(0).x[now]);
    const X slope = v.slope + v.information * off;
    Matrix<Scalar, n, n> C = kernel::transposed(prior.L) * v.information * prior.L;
    C = kernel::symmetric_part(C);
    for (int i = 0; i < n; ++i) C(i, i) += prior.weight(i) + damping;
    kernel::SymmetricFactor<Scalar, n> factor;
    if (!factor.factor(C)) return false;
    const X weighted = infeasible ? a : prior.weighted(now);
    const X g = weighted + kernel::transposed(prior.L) * slope;
    prior.law = -factor.solve(g);
    sums.decrease -= kernel::dot(g, prior.law) / Scalar(2);
    sums.cost += (kernel::dot(a, weighted) + kernel::dot(X(v.slope + slope), off)) / Scalar(2);
    const bool finite = all_finite(prior.law) && std::isfinite(sums.decrease);
    if (infeasible) {
      sums.noise = prior_noise(prior, v, sums.noise, std::numeric_limits<Scalar>::infinity());
      return finite;
    }
    Matrix<Scalar, n, n> half, scaled, right;
    factor.right_solve(prior.L, half, scaled, right);  // P_0 given all data: L C⁻¹ Lᵀ
    Scalar reached = 0;
    for (int i = 0; i < n; ++i) {
      Scalar variance = 0;
      for (int j = 0; j < n; ++j) variance += half(i, j) * scaled(i, j);
      reached += (v.noise(i) + std::sqrt(v.information(i, i))) * std::sqrt(variance);
    }
    // Of every step at most what the largest B and the largest error make of it.
    sums.noise = Scalar(4) * reached * reached;
    for (int i = 0; i < n && q > 0; ++i)
      sums.noise += Scalar(4 * n) * Scalar(store_.last()) * inputs_(i) * v.peak(i) * v.peak(i);
    return finite;
  }

  /// The largest (B Bᵀ)_ii.
  void note_inputs(const Matrix<Scalar, n, q>& B) {
    X sizes = kernel::zeros<X>();
    for (int c = 0; c < n * q; ++c) sizes(c % n) += B.data()[c] * B.data()[c];
    for (int i = 0; i < n; ++i) inputs_(i) = std::max(inputs_(i), sizes(i));
  }

  Store& store_;
  Loss loss_;
  Stop stop_{};
  X inputs_ = kernel::zeros<X>();
  bool by_two_ = false, led_[3] = {};  // the states are led along in twice the digits; a trajectory was
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
