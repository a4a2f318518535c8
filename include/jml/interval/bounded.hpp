// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// FixedLag with bounds of states and disturbances.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/fixed_lag.hpp>
#include <jml/interval/minimise_within.hpp>

namespace jml {

namespace detail {

/// The memory of a FixedLag whose states keep within bounds.
///
/// A bound of a node that has left the window goes on acting by its multiplier, as a term μᵀx of the arrival
/// cost: that moves its mean by -P μ and leaves P as it is. On a linear system this is the Lagrangian
/// relaxation of the bounds that have left: never above the exact arrival cost, and equal to it at the
/// answer (the condition of Rao, Rawlings and Lee 2001).
template <int length, int measurements, typename D, typename List, typename Scalar, typename Box>
class BoundedWindow : public WindowMemory<length, measurements, D, List, Scalar> {
  static_assert(require_bounds<Box, Scalar, D>());
  using Base = WindowMemory<length, measurements, D, List, Scalar>;
  static constexpr int n = states_of<D>, q = Box::disturbances;
  using View = AugmentedStore<Base, Box>;
  using All = std::array<NodeMultipliers<Scalar, n, q>, static_cast<std::size_t>(length) + 2>;

 public:
  explicit BoundedWindow(D dynamics) : Base(std::move(dynamics)) {}

  [[nodiscard]] Vector<Scalar, n> x(int age = 0) const {
    const int j = this->last() - age;
    Vector<Scalar, n> out = Base::x(age);
    for (int i = 0; i < n; ++i) out(i) = at(j).x.held(i, out(i), bounds_.lower(i), bounds_.upper(i));
    return out;
  }
  /// Of the bounds of a state, positive at an upper one: what J would fall by, per unit that it gives way.
  [[nodiscard]] const Vector<Scalar, n>& multiplier(int age = 0) const {
    return at(this->last() - age).x.value;
  }
  [[nodiscard]] const Box& bounds() const { return bounds_; }
  void bound_by(const Box& bounds, int most) {
    bounds_ = bounds;
    most_ = most;
  }

  template <typename Given>
  Status reset(const Given& given, double time) {
    const Status status = Base::reset(given, time);
    if (status == Status::ok) all_ = {};
    return status;
  }
  bool slide(const Loss& loss) {
    slid_ = all_;
    const bool full = this->depth() == length;
    const auto leave = [this](int j, FactoredBelief<Scalar, n>& arrival) {
      if (j == 0)
        shift(arrival);
      else if constexpr (q > 0)
        arrival.x -= this->root(1).B * (kernel::transposed(at(1).root) * at(1).w.value);
    };
    if (!Base::slide(loss, leave)) return false;
    for (int j = 0; full && j < length; ++j) at(j) = at(j + 1);
    return true;
  }
  template <typename At>
  Status append(const At& step) {
    const Status status = Base::append(step);
    enter(this->last());
    return status;
  }
  void take_back() {
    all_ = slid_;
    Base::take_back();
  }
  void keep() {
    kept_ = all_;
    Base::keep();
  }
  void restore() {
    all_ = kept_;
    Base::restore();
  }
  void insert(int j, double ahead) {
    Base::insert(j, ahead);
    for (int k = this->last(); k > j + 1; --k) at(k) = at(k - 1);
    enter(j + 1);
    if constexpr (q > 0) {
      const auto x_multipliers = at(j + 2).x;
      enter(j + 2);
      at(j + 2).x = x_multipliers;
    }
  }
  auto each_part(auto&& f) {
    return f(static_cast<Base&>(*this), bounds_, in_range(most_, 0, std::numeric_limits<int>::max()), all_);
  }
  [[nodiscard]] BatchReport<Scalar> minimise(const BatchOptions& how) {
    View view(*this, bounds_, all_.data());
    return minimise_within(view, how, true, true, std::max(most_, how.max_iterations));
  }

 private:
  [[nodiscard]] auto& at(int j) { return all_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] const auto& at(int j) const { return all_[static_cast<std::size_t>(j)]; }

  /// A node, and the step to it, at which no bound acts.
  void enter(int j) {
    at(j) = {};
    View(*this, bounds_, all_.data()).take_root(j);
  }
  /// x - P μ of node 0; not along what nothing is known of.
  void shift(FactoredBelief<Scalar, n>& arrival) const {
    const Vector<Scalar, n>& mu = at(0).x.value;
    Vector<Scalar, n> x = arrival.x;
    for (int k = 0; k < n; ++k) {
      Scalar along = mu(k);
      for (int i = 0; i < k; ++i) along += arrival.U(i, k) * mu(i);
      if (std::isinf(arrival.D(k)) || !(arrival.D(k) > Scalar(0))) continue;
      for (int i = 0; i < k; ++i) x(i) -= arrival.U(i, k) * arrival.D(k) * along;
      x(k) -= arrival.D(k) * along;
    }
    arrival.x = x;
  }

  Box bounds_{};
  int most_ = 0;
  All all_{}, slid_{}, kept_{};
};

}  // namespace detail

/// A method whose states and disturbances keep within bounds.
///
///     jml::Bounds<2> bounds;
///     bounds.lower << 0, -jml::Bounds<2>::infinite;
///     jml::Filter tank{jml::Bounded{jml::FixedLag<20>{}, bounds}, Tank{}, jml::sensors<Level>, estimate};
template <typename Method, typename Box>
struct Bounded {
  static_assert(!sizeof(Method*), "jml: Bounded{…} takes a FixedLag; for a batch there is BoundedBatch");
};
/// Types from the arguments.
template <typename Method, typename Box>
Bounded(Method, Box) -> Bounded<Method, Box>;

/// FixedLag within bounds: x(age) of every node of the window is exactly within them, and J is least among
/// the trajectories that are. Where no bound acts it is FixedLag, sweep by sweep; where one does, it sweeps
/// to its tolerance, `most` times at most (accepted_at_limit: and was within 1e-3 deviations of it). P is
/// that of the problem without bounds: bounds that hold make the true one smaller, not larger (Brascamp and
/// Lieb 1976). invalid_option: bounds that are none. no_feasible_point: no trajectory of the model in the
/// window is within them; the filter is as before.
template <int length, int measurements, typename List, typename Box>
struct Bounded<FixedLag<length, measurements, List>, Box> : FixedLag<length, measurements, List> {
  /// What filter/method.hpp asks of a method.
  /// @{
  using Base = FixedLag<length, measurements, List>;
  static constexpr bool optimal_on_linear = false;
  template <typename Sensors>
  using With = Bounded<FixedLag<length, measurements, Sensors>, Box>;
  template <typename Scalar, typename D>
  using Belief = detail::BoundedWindow<length, measurements, D, List, Scalar, Box>;

  Bounded(const Base& of, const Box& by) : Base(of), bounds(by) {}  ///< `by`: jml::Bounds
  template <typename Other>
  explicit Bounded(const Bounded<FixedLag<length, measurements, Other>, Box>& other)
      : Base(static_cast<const FixedLag<length, measurements, Other>&>(other)),
        bounds(other.bounds),
        most(other.most) {}

  Box bounds;      ///< of all nodes of the window; may be changed between two steps
  int most = 100;  ///< backward passes of a step where a bound acts; their usual number: 4 to 20

  template <typename D>
  static consteval bool accepts() {
    static_assert(!detail::runs_locally<Bounded, D>(),
                  "jml: bounds are of states in ℝⁿ with additive disturbances");
    return detail::require_bounds<Box, typename Box::Scalar, D>() && Base::template accepts<D>();
  }
  template <typename Belief, typename Given>
  [[nodiscard]] Status start(Belief& window, const Given& given, double time) const {
    window.bound_by(bounds.valid() ? bounds : Box{}, most);
    return Base::start(window, given, time);
  }
  template <typename Belief, typename At>
  [[nodiscard]] Status predict(Belief& window, const At& at) const {
    return with_bounds(window, [&] { return Base::predict(window, at); });
  }
  template <typename Belief, typename Sample, typename Report>
  void correct(Belief& window, const Sample& sample, Report& report) const {
    report.status = with_bounds(window, [&] { return Base::correct(window, sample, report), report.status; });
  }
  template <typename Belief, typename Sample, typename Report>
  void step(Belief& window, const Sample& sample, Report& report) const {
    report.status = with_bounds(window, [&] { return Base::step(window, sample, report), report.status; });
  }
  template <typename Belief, typename S, typename Y, typename Report>
  void correct_late(Belief& window, const S& sensor, const Y& y, const Lateness& late, Report& report) const {
    report.status = with_bounds(
        window, [&] { return Base::correct_late(window, sensor, y, late, report), report.status; });
  }
  /// @}

 private:
  /// The bounds of before come back with everything else where verb() refuses.
  template <typename Belief, typename Verb>
  [[nodiscard]] Status with_bounds(Belief& window, const Verb& verb) const {
    if (!bounds.valid() || most < 1) return Status::invalid_option;
    const Box before = window.bounds();
    window.bound_by(bounds, most);
    const Status status = verb();
    if (!usable(status)) window.bound_by(before, most);
    return status;
  }
};

template <int length, int measurements, typename List, typename Box>
struct PartsOf<Bounded<FixedLag<length, measurements, List>, Box>> {
  static auto each(auto& method, auto&& f) { return f(method.options, method.bounds, method.most); }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
