// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bounds of states and disturbances, and the terms by which they enter J.
///
/// min J subject to lower ≤ x_j ≤ upper, w_lower ≤ w_j ≤ w_upper, by the method of multipliers (Hestenes and
/// Powell 1969; Rockafellar 1973): with t = v + μ/ρ of a bounded number v, and e = t - min(max(t, lower),
/// upper), J gets ½ ρ e² - μ²/2ρ, which is once differentiable and needs no more than the sweeps that J needs
/// anyway; then μ ← ρ e. Gauss-Newton on it takes e' = 1 where a bound acts and 0 elsewhere, which is the
/// primal-dual active set method (Hintermüller, Ito and Kunisch 2002), made safe by the value of J.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/linearised.hpp>
#include <jml/interval/record_terms.hpp>

namespace jml {

/// lower ≤ x ≤ upper at every node, n; and w_lower ≤ w ≤ w_upper at every step, q, in the units of the model
/// and without its mean w̄ (q = 0: none). Infinite where there is none, as at first; equal ones are a value.
template <int n, int q = 0, typename Scalar_ = double>
struct Bounds {
  using Scalar = Scalar_;                                                      ///< of the bounds
  static constexpr int states = n;                                             ///< n
  static constexpr int disturbances = q;                                       ///< q
  static constexpr Scalar infinite = std::numeric_limits<Scalar>::infinity();  ///< no bound

  Vector<Scalar, n> lower = kernel::filled<Vector<Scalar, n>>(-infinite);    ///< n
  Vector<Scalar, n> upper = kernel::filled<Vector<Scalar, n>>(infinite);     ///< n
  Vector<Scalar, q> w_lower = kernel::filled<Vector<Scalar, q>>(-infinite);  ///< q
  Vector<Scalar, q> w_upper = kernel::filled<Vector<Scalar, q>>(infinite);   ///< q

  /// No NaN, no lower bound above its upper one, and some number between them.
  [[nodiscard]] bool valid() const {
    bool good = true;
    for (int i = 0; i < n; ++i) good = good && is_interval(lower(i), upper(i));
    for (int i = 0; i < q; ++i) good = good && is_interval(w_lower(i), w_upper(i));
    return good;
  }

 private:
  static bool is_interval(Scalar low, Scalar high) {
    return low <= high && low < infinite && high > -infinite;
  }
};

namespace detail {

template <typename Box, typename Scalar, typename D>
consteval bool require_bounds() {
  static_assert(Box::states == states_of<D> &&
                    (Box::disturbances == 0 || Box::disturbances == DynamicsTraits<D>::disturbances),
                "jml: the bounds are of another size than the model: jml::Bounds<states, disturbances>");
  static_assert(std::is_same_v<typename Box::Scalar, Scalar>,
                "jml: the bounds have another scalar than the estimate: jml::Bounds<n, q, float>");
  return true;
}

/// The nearest number between two bounds.
template <typename Scalar>
[[nodiscard]] Scalar within(Scalar value, Scalar lower, Scalar upper) {
  return value > upper ? upper : value < lower ? lower : value;
}

template <typename Box, typename Scalar, int n>
void clip(const Box& bounds, Vector<Scalar, n>& x) {
  for (int i = 0; i < n; ++i) x(i) = within(x(i), bounds.lower(i), bounds.upper(i));
}

/// Multipliers μ, positive at an upper bound, and weights ρ of m numbers; ρ = 0: nothing can move that one.
template <typename Scalar, int m>
struct Multipliers {
  Vector<Scalar, m> value = kernel::zeros<Vector<Scalar, m>>();
  Vector<Scalar, m> weight = kernel::zeros<Vector<Scalar, m>>();

  /// e.
  [[nodiscard]] Scalar excess(int i, Scalar v, Scalar lower, Scalar upper) const {
    if (!(weight(i) > Scalar(0))) return Scalar(0);
    const Scalar t = v + value(i) / weight(i);
    return t - within(t, lower, upper);
  }
  /// ½ ρ e² - μ²/2ρ.
  [[nodiscard]] Scalar cost(int i, Scalar e) const {
    if (!(weight(i) > Scalar(0))) return Scalar(0);
    return (weight(i) * e * e - value(i) * value(i) / weight(i)) / Scalar(2);
  }
  /// `v` within its bounds; at the one that acts.
  [[nodiscard]] Scalar held(int i, Scalar v, Scalar lower, Scalar upper) const {
    if (value(i) > Scalar(0)) return upper;
    return value(i) < Scalar(0) ? lower : within(v, lower, upper);
  }
};

/// Of a node, and of the step to it; root: w = root b.
template <typename Scalar, int n, int q>
struct NodeMultipliers {
  Multipliers<Scalar, n> x;
  Multipliers<Scalar, q> w;
  Matrix<Scalar, q, q> root = kernel::zeros<Matrix<Scalar, q, q>>();
};

/// The bounds of the state of one node: among the measurements of an interval, one of none.
template <typename Scalar, int n>
struct BoundRecord {
  static constexpr int p = n;
  static constexpr bool varies = false;
  const Vector<Scalar, n>& lower;
  const Vector<Scalar, n>& upper;
  const Multipliers<Scalar, n>& multipliers;

  [[nodiscard]] Scalar excess(int i, const Vector<Scalar, n>& x) const {
    return multipliers.excess(i, x(i), lower(i), upper(i));
  }
};

template <typename Scalar, int n, typename At>
[[nodiscard]] Scalar record_cost(const BoundRecord<Scalar, n>& record, const Loss&,
                                 const Vector<Scalar, n>& x, const At&) {
  Scalar sum = 0;
  for (int i = 0; i < n; ++i) sum += record.multipliers.cost(i, record.excess(i, x));
  return sum;
}
template <Curvature curvature, bool bent, typename Scalar, int n, typename At>
void add_record(const BoundRecord<Scalar, n>& record, const Loss& loss, const Vector<Scalar, n>& x,
                const At& at, PassSums<Scalar>& sums, CostToGo<Scalar, n>& v) {
  for (int i = 0; i < n; ++i) {
    const Scalar e = record.excess(i, x), weight = record.multipliers.weight(i);
    if (!(std::abs(e) > Scalar(0))) continue;
    v.information(i, i) += weight;
    v.slope(i) += weight * e;
  }
  sums.cost += record_cost(record, loss, x, at);
}
template <typename Scalar, int n, typename At>
[[nodiscard]] auto rows_of(const BoundRecord<Scalar, n>& record, const Loss& loss, bool,
                           const Vector<Scalar, n>& x, const At& at) {
  RecordRows<Scalar, n, n> rows;
  rows.H = kernel::zeros<Matrix<Scalar, n, n>>();
  for (int i = 0; i < n; ++i) {
    const Scalar e = record.excess(i, x);
    const bool acts = std::abs(e) > Scalar(0);
    rows.H(i, i) = acts ? Scalar(1) : Scalar(0);
    rows.r(i) = acts ? Scalar(1) / record.multipliers.weight(i) : Scalar(1);
    rows.e(i) = -e;
  }
  rows.rho = Scalar(2) * record_cost(record, loss, x, at);
  return rows;
}

/// φ of the bounds of w = L b: ½ ρ e² - μ²/2ρ, Lᵀ ρ e, Lᵀ ρ L of those that act.
template <typename Scalar, int n, int q, typename Box>
[[nodiscard]] DisturbanceTerm<Scalar, q> bounded_disturbance(const Box& bounds,
                                                             const NodeMultipliers<Scalar, n, q>& of,
                                                             const Vector<Scalar, q>& b) {
  DisturbanceTerm<Scalar, q> term;
  const Vector<Scalar, q> w = of.root * b;
  for (int k = 0; k < q; ++k) {
    const Scalar e = of.w.excess(k, w(k), bounds.w_lower(k), bounds.w_upper(k)), weight = of.w.weight(k);
    term.cost += of.w.cost(k, e);
    if (!(std::abs(e) > Scalar(0))) continue;
    term.acts = true;
    for (int i = 0; i < q; ++i) {
      term.slope(i) += of.root(k, i) * weight * e;
      for (int j = 0; j < q; ++j) term.curvature(i, j) += of.root(k, i) * weight * of.root(k, j);
    }
  }
  return term;
}

/// The sensors of an interval, and bounds of n states.
template <typename List, int n>
struct ListWithin {};
template <typename List, int n>
inline constexpr int most_rows<ListWithin<List, n>> = most_rows<List> > n ? most_rows<List> : n;

/// J and the terms of the bounds: a store of interval/sweep.hpp over another, and an entry of `all` for each
/// of its nodes.
template <typename Store, typename Box>
class AugmentedStore {
 public:
  using Dynamics = typename Store::Dynamics;
  using Number = typename Store::Number;
  static constexpr int n = states_of<Dynamics>, q = Box::disturbances;
  using Sensors = typename Store::List;
  using List = ListWithin<Sensors, n>;
  using Multipliers = NodeMultipliers<Number, n, q>;
  static constexpr bool weighs_disturbances = q > 0;

  AugmentedStore(Store& store, const Box& bounds, Multipliers* all)
      : store_(store), bounds_(bounds), all_(all) {}

  [[nodiscard]] Store& inside() { return store_; }
  [[nodiscard]] const Box& bounds() const { return bounds_; }
  [[nodiscard]] Multipliers& multipliers(int j) { return all_[j]; }
  void forget_weights(int j) {
    kernel::set_zero(all_[j].x.weight);
    kernel::set_zero(all_[j].w.weight);
  }
  /// L of the step to node j, w = L b, at the nominal.
  void take_root(int j) {
    if constexpr (q > 0) {
      if (j > 0)
        static_cast<void>(NoiseRoot<Number, Dynamics>::root_of_covariance(
            dynamics(), node(j - 1).x[static_cast<std::size_t>(now())], node(j).at(), all_[j].root));
    }
  }

  [[nodiscard]] const Dynamics& dynamics() const { return store_.dynamics(); }
  [[nodiscard]] int last() const { return store_.last(); }
  [[nodiscard]] auto& node(int j) { return store_.node(j); }
  [[nodiscard]] const auto& node(int j) const { return store_.node(j); }
  [[nodiscard]] const auto& root(int j) const { return store_.root(j); }
  [[nodiscard]] auto& prior() { return store_.prior(); }
  [[nodiscard]] const Terminal<Number, n>* terminal() const { return store_.terminal(); }
  [[nodiscard]] int now() const { return store_.now(); }
  [[nodiscard]] int next() const { return store_.next(); }
  void flip() { store_.flip(); }
  void flip_back() { store_.flip_back(); }
  template <typename Use>
  void visit(int j, const Use& use) {
    store_.visit(j, use);
    BoundRecord<Number, n> record{bounds_.lower, bounds_.upper, all_[j].x};
    use(record);
  }
  [[nodiscard]] DisturbanceTerm<Number, q> disturbance_term(int j, const Vector<Number, q>& b) const
    requires weighs_disturbances
  {
    return bounded_disturbance(bounds_, all_[j], b);
  }

 private:
  Store& store_;
  const Box& bounds_;
  Multipliers* all_;
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
