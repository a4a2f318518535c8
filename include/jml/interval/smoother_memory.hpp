// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The memory of a smoother and its way back, see interval/smoother.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/one_pass.hpp>
#include <jml/interval/smoother_record.hpp>
#include <vector>

namespace jml::detail {

/// U, D of an estimate in twice the digits. False where P is indefinite.
template <typename Scalar, int n>
[[nodiscard]] bool factors_of(const Estimate<Scalar, n>& estimate, FactoredBelief<Scalar, n>& out) {
  ExtendedMemory<Scalar, n, 0, 0> memory;
  ExtendedStep<Scalar> two(memory);
  if (!two.load(estimate.P.data())) return false;
  two.load_state(estimate.x.data(), nullptr);
  return store_extended(two, out) == Status::ok;
}
template <typename Scalar, int n>
[[nodiscard]] bool factors_of(const WatchedEstimate<Scalar, n>& estimate, FactoredBelief<Scalar, n>& out) {
  if (!estimate.extended) return factors_of(static_cast<const Estimate<Scalar, n>&>(estimate), out);
  ExtendedMemory<Scalar, n, 0, 0> memory;
  ExtendedStep<Scalar> two(memory);
  if (!two.load(estimate.P.data(), estimate.low_of_P())) return false;
  two.load_state(estimate.x.data(), estimate.x_low.data());
  return store_extended(two, out) == Status::ok;
}
template <typename Scalar, int n>
[[nodiscard]] bool factors_of(const FactoredBelief<Scalar, n>& belief, FactoredBelief<Scalar, n>& out) {
  commit(out, belief);
  return true;
}

/// x of a belief is one in the digits of Scalar.
template <typename Scalar, int n>
[[nodiscard]] bool rounds_state(const WatchedEstimate<Scalar, n>& estimate) {
  return !estimate.extended;
}
template <typename Scalar, int n>
[[nodiscard]] bool rounds_state(const FactoredBelief<Scalar, n>&) {
  return false;
}
/// What it has in twice as many.
template <typename Scalar, int n>
[[nodiscard]] Vector<Scalar, n> low_of(const WatchedEstimate<Scalar, n>& estimate) {
  return estimate.extended ? estimate.x_low : kernel::zeros<Vector<Scalar, n>>();
}
template <typename Scalar, int n>
[[nodiscard]] const Vector<Scalar, n>& low_of(const FactoredBelief<Scalar, n>& belief) {
  return belief.x_low;
}

/// Where a filter stands, for a smoother that goes on from there.
template <typename Belief>
struct SmootherStart {
  const Belief& belief;
  Status status;
};

/// The forward pass's filter and its records. M: the method of the forward pass.
template <typename Scalar_, typename D, typename M>
class SmootherMemory {
 public:
  using Scalar = Scalar_;
  static constexpr int n = states_of<D>;
  static constexpr bool factored = requires { M::rule; };
  using Record = SmootherRecord<Scalar, D>;
  using Filtered = BeliefOf<M, D, Scalar>;
  struct Node {
    Record record;
    Filtered filtered{};
    Estimate<Scalar, n> smoothed;
    [[no_unique_address]] std::conditional_t<factored, FactoredBelief<Scalar, n>, Nothing> factors{};
    double time = 0;
  };

  explicit SmootherMemory(D dynamics) : model(std::move(dynamics)) {}

  jml::ModelOf<M, D, Scalar> model;
  std::vector<Node> nodes;
  int last = 0;
  bool too_fine = false;       // a measurement asked for more digits than a residual here has
  typename Record::Root root;  // where it is constant

  [[nodiscard]] const D& dynamics() const { return model.dynamics; }
  [[nodiscard]] const Vector<Scalar, n>& x() const { return filtered().x; }
  [[nodiscard]] decltype(auto) P() const {
    if constexpr (factored)
      return filtered().P();
    else
      return (filtered().P);
  }
  [[nodiscard]] Node& node(int k) { return nodes[static_cast<std::size_t>(k)]; }
  [[nodiscard]] const Node& node(int k) const { return nodes[static_cast<std::size_t>(k)]; }
  [[nodiscard]] const Filtered& filtered() const { return node(last).filtered; }
  [[nodiscard]] bool full() const { return nodes.size() == static_cast<std::size_t>(last) + 1; }

  /// Node k is where the filter stands.
  void keep(int k, const Record& record, const Filtered& estimate, double time) {
    Node& to = node(k);
    to.record = record;
    to.filtered = estimate;
    to.time = time;
    keep_filtered(to);
    last = k;
  }
  /// Where a step leads from the present.
  [[nodiscard]] Vector<Scalar, n> predicted(const Record& record) const {
    Extended<Scalar> exact[n];
    Vector<Scalar, n> out;
    record.predict(x(), low_of(filtered()), exact);
    for (int i = 0; i < n; ++i) out(i) = in_two<Scalar>(exact[i]).high;
    return out;
  }
  /// B of a step from the present.
  template <typename At>
  [[nodiscard]] bool form(Record& record, const At& at) {
    if constexpr (!Record::Root::constant) {
      if (!root.form(model.dynamics, x(), at)) return false;
    }
    record.B = root.B;
    return true;
  }

  /// covariance_lost: at some nodes P is NaN, as no matrix of Scalar can hold it; where x is no answer
  /// either, the filter's. accuracy_not_met: all nodes are the filter's.
  [[nodiscard]] Status smooth() {
    keep_filtered(node(last));
    if (too_fine) {
      for (int k = 0; k < last; ++k) keep_filtered(node(k));
      return Status::accuracy_not_met;
    }
    if constexpr (!factored) {
      bool plain = true;
      for (int k = 0; k <= last; ++k) plain = plain && !is_extended(node(k).filtered);
      if (plain && smooth_here()) return Status::ok;
    }
    return smooth_in_two();
  }

 private:
  void keep_filtered(Node& to) {
    to.smoothed.x = to.filtered.x;
    if constexpr (factored) {
      commit(to.factors, to.filtered);
      to.smoothed.P = dense_covariance(to.factors);
    } else {
      to.smoothed.P = to.filtered.P;
    }
  }

  /// In the digits of Scalar; false where they do not suffice. What rounding of Λ changes in any P_s is at
  /// most the sum of tr(ε diag(Λ) P_s) over the later nodes, see count_rounding(); and it is multiplied by P
  /// here. What that of λ changes in any x is, in its deviations, at most the sum of ε |terms of λ|ᵀ
  /// √diag(P_s).
  [[nodiscard]] bool smooth_here() {
    // Less than P asks for: x moves by as many deviations as later measurements say, each of them as wrong.
    constexpr Scalar most = Scalar(4e-4) * most_noise<Scalar> / std::numeric_limits<Scalar>::epsilon();
    constexpr Scalar most_of_x = plain_error<Scalar> / std::numeric_limits<Scalar>::epsilon();
    CostToGo<Scalar, n> v;
    Scalar noise = 0, noise_of_x = 0;
    const auto rounding = [](const auto& weights, const auto& P) {
      Scalar sum = 0;
      for (int i = 0; i < n; ++i) sum += weights(i) * P(i, i);
      return Scalar(4) * sum;
    };
    for (int k = last; k > 0; --k) {
      const Record& record = node(k).record;
      // v is about the filter's estimate here; the record is about its prediction.
      const Vector<Scalar, n> off = node(k).filtered.x - record.prediction;
      const auto count_slope = [&](int i, Scalar terms, const Matrix<Scalar, n, n>& P) {
        noise_of_x += terms * std::sqrt(P(i, i));
      };
      for (int i = 0; i < n; ++i) {
        Scalar terms = std::abs(v.slope(i));
        for (int j = 0; j < n; ++j) terms += std::abs(v.information(i, j) * off(j));
        for (int j = 0; j < record.rows; ++j) terms += std::abs(record.H(i, j) * record.e(j) / record.r(j));
        count_slope(i, terms, node(k).smoothed.P);
      }
      v.slope = v.slope - v.information * off;
      Vector<Scalar, n> sizes = kernel::diagonal(v.information), moved = kernel::zeros<Vector<Scalar, n>>();
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < record.rows; ++j) sizes(i) += record.H(i, j) * record.H(i, j) / record.r(j);
      }
      const Scalar own = rounding(sizes, node(k).smoothed.P);
      const Vector<Scalar, n> unsure = state_sizes(k);
      for (int i = 0; i < n; ++i) noise_of_x += std::sqrt(sizes(i)) * unsure(i);
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) moved(i) += record.transition(j, i) * record.transition(j, i) * sizes(j);
      }
      Node& before = node(k - 1);
      Scalar grown = 1;
      if (!record.pass(v, grown) || !condition(before.filtered.P, v.information, before.smoothed.P))
        return false;
      noise += grown * (own + rounding(moved, before.smoothed.P));
      for (int i = 0; i < n; ++i) count_slope(i, std::abs(v.slope(i)), before.smoothed.P);
      before.smoothed.x = before.filtered.x - before.smoothed.P * v.slope;
      if (!(noise_of_x <= most_of_x)) return false;
      if (!(noise <= most && rounding(v.information.diagonal(), before.filtered.P) <= most)) return false;
      if (!all_finite(before.smoothed.x)) return false;
    }
    return true;
  }

  /// The terms of x̂ at node k, an ε of which nobody knows: as affine dynamics and the filter made it.
  [[nodiscard]] Vector<Scalar, n> state_sizes(int k) const {
    Vector<Scalar, n> sizes = kernel::zeros<Vector<Scalar, n>>();
    if constexpr (Record::affine) {
      const Record& record = node(k).record;
      for (int i = 0; i < n; ++i) {
        sizes(i) = std::abs(node(k).filtered.x(i)) + std::abs(record.constant(i));
        for (int j = 0; j < n; ++j) sizes(i) += std::abs(record.transition(i, j) * node(k - 1).filtered.x(j));
      }
    }
    return sizes;
  }

  JML_NOINLINE Status smooth_in_two() {
    Status answer = all_finite(node(last).smoothed.P) ? Status::ok : Status::covariance_lost;
    InformationMemory<Scalar, n, Record::Root::q, n> memory;
    InformationInTwo<Scalar> information(memory);
    ExtendedMemory<Scalar, n, 0, 1> own;
    PassSums<Scalar> sums;
    const Vector<Scalar, Record::Root::q> none = kernel::zeros<Vector<Scalar, Record::Root::q>>();
    for (int k = last; k > 0; --k) {
      const Record& record = node(k).record;
      Node& before = node(k - 1);
      Extended<Scalar> predicted[n], off[n];
      record.predict(before.filtered.x, low_of(before.filtered), predicted);
      const Vector<Scalar, n> low = low_of(node(k).filtered);
      for (int i = 0; i < n; ++i)
        off[i] = Extended<Scalar>(record.prediction(i)) - as_one(node(k).filtered.x(i), low(i));
      information.move_by(off);  // from x̂ to the prediction
      information.add_rows(record.rows, record.H.data(), record.r.data(), record.e.data(), nullptr,
                           record.H_low.data(), record.e_low.data());
      for (int i = 0; i < n; ++i) off[i] = predicted[i] - Extended<Scalar>(record.prediction(i));
      information.move_by(off);
      information.pass(record.transition.data(), record.B.data(), none.data(), Scalar(0), nullptr, nullptr,
                       sums);
      FactoredBelief<Scalar, n> belief;
      bool held = information.rounding() <= plain_error<Scalar> && factors_of(before.filtered, belief);
      if (held) {
        ExtendedStep<Scalar> two(own);
        two.load(belief.U.data(), belief.D.data(), belief.extended ? belief.U_low.data() : nullptr,
                 belief.extended ? belief.D_low.data() : nullptr);
        two.load_state(belief.x.data(), belief.x_low.data());
        if (k > 1 && rounds_state(before.filtered)) {
          const Vector<Scalar, n> sizes = state_sizes(k - 1);
          const ExtendedUd<Scalar> now{n, own.U, own.D};
          held = std::numeric_limits<Scalar>::epsilon() *
                     std::min(information.deviations_in(sizes.data()),
                              now.magnification(sizes.data(), sizes.data(), own.f)) <=
                 plain_error<Scalar>;
        }
        information.correct(two);
        held = held && store_extended(two, belief) == Status::ok;
      }
      if (!held) {
        keep_filtered(before);
        answer = Status::covariance_lost;
        continue;
      }
      before.smoothed.x = belief.x;
      before.smoothed.P = dense_covariance(belief);
      if constexpr (factored) commit(before.factors, belief);
      if (before.smoothed.P(0, 0) != before.smoothed.P(0, 0)) answer = Status::covariance_lost;
    }
    return answer;
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
