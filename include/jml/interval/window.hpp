// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The memory of a FixedLag: the last L steps in a ring of fixed size, with an arrival cost at the first
/// node.
///
/// When the window slides, the arrival cost is the filtered mean and covariance of the second node, from one
/// Kalman step linearised about the smoothed trajectory; it has then absorbed that node's measurements.
#pragma once

#include <array>
#include <cstdint>
#include <jml/interval/nodes.hpp>
#include <jml/interval/loss.hpp>

namespace jml {

/// Window of a FixedLag: `length` steps, and room for `measurements` of each sensor type at each node.
template <int length_, int measurements_ = 1>
struct Lag {
  static_assert(length_ >= 1 && measurements_ >= 1, "jml: a lag is at least one step with one measurement");
  static constexpr int length = length_, measurements = measurements_;
};
template <int length, int measurements = 1>
inline constexpr Lag<length, measurements> lag{};

namespace detail {

template <typename Window, typename D, typename List, typename Scalar>
class WindowMemory;

/// A store of interval/sweep.hpp.
template <typename Window, typename D, typename... S, typename Scalar>
class WindowMemory<Window, D, Sensors<S...>, Scalar> {
  using List = Sensors<S...>;
  static constexpr int n = states_of<D>;
  static constexpr int size = Window::length + 2;  // one more than a full window: a step may be taken back
  using X = Vector<Scalar, n>;
  using Covariance = Matrix<Scalar, n, n>;
  using Root = NoiseRoot<Scalar, D>;
  using At = typename Root::At;
  template <typename Sensor>
  using Slots = std::array<Record<Scalar, n, Sensor, At>, static_cast<std::size_t>(Window::measurements)>;

 public:
  using Dynamics = D;
  using Number = Scalar;
  static constexpr bool reads_contexts = keeps_context<Scalar, D, List>;

  explicit WindowMemory(D dynamics) : dynamics_(std::move(dynamics)) {}

  Status reset(const Estimate<Scalar, n>& estimate, double time) {
    first_ = last_ = now_ = 0;
    clear(node(0), {});
    node(0).x[0] = estimate.x;
    node(0).context.time = time;
    Status status = std::isfinite(time) ? check_estimate(Ekf<>{}, estimate) : Status::invalid_time_step;
    if constexpr (Root::constant) {
      if (!root_.form(dynamics_, kernel::zeros<X>(), At{}) && status == Status::ok)
        status = Status::invalid_disturbance_covariance;
    }
    if (status == Status::ok) arrive(estimate);
    return status;
  }

  /// Makes room for a node, sliding if the window is full. False where the arrival cost would be lost.
  bool slide(const Loss& loss) {
    saved_ = {prior_, P_, first_, last_, node(last_ > 0 ? 1 : 0).count};
    slid_ = last_ == Window::length;
    if (!slid_) return true;
    Estimate<Scalar, n> arrival{prior_.x, P_};
    if (!absorb(0, loss, arrival)) return false;
    advance(1, arrival);
    if (!absorb(1, loss, arrival)) return false;
    first_ = place(1);
    --last_;
    node(0).count = {};
    arrive(arrival);
    return true;
  }
  /// A node after the last, at the prediction; or why it would be none.
  Status append(const At& at) {
    ++last_;
    auto& fresh = node(last_);
    clear(fresh, at);
    const X& x = node(last_ - 1).x[now_];
    if constexpr (!Root::constant) {
      if (!fresh.noise.form(dynamics_, x, at)) return Status::invalid_disturbance_covariance;
    }
    fresh.x[now_] = jml::dynamics(dynamics_, x, at) + root(last_).mean_effect;
    return all_finite(fresh.x[now_]) && all_finite(jacobian(last_)) ? Status::ok
                                                                    : Status::dynamics_not_finite;
  }
  /// Undoes slide() and append().
  void take_back() {
    if (slid_) {
      first_ = saved_.first;
      prior_ = saved_.prior;
      P_ = saved_.P;
      node(1).count = saved_.count;
    }
    last_ = saved_.last;
  }
  /// memory_full, invalid_noise_covariance, or ok and the measurement is stored.
  template <typename Sensor>
  Status add(int j, const Sensor& sensor, const Vector<Scalar, measurements_of<Sensor>>& y) {
    constexpr auto type = static_cast<std::size_t>(List::template index_of<Sensor>());
    auto& where = node(j);
    if (where.count[type] >= Window::measurements) return Status::memory_full;
    Record<Scalar, n, Sensor, At> record{sensor, y};
    if (!record.freeze(where.x[now_], at_sample(where.at()))) return Status::invalid_noise_covariance;
    std::get<type>(where.slots)[where.count[type]++] = record;
    return Status::ok;
  }
  template <typename Sensor>
  void remove_newest(int j) {
    --node(j).count[static_cast<std::size_t>(List::template index_of<Sensor>())];
  }

  /// The covariance of node j given all measurements of the window, to first order about the nominal; NaN
  /// where it is lost. Forward to the node by Kalman steps, backward to it by the information of the later
  /// data.
  [[nodiscard]] Covariance covariance(int j, const Loss& loss) const {
    Estimate<Scalar, n> forward{prior_.x, P_};
    bool valid = absorb(0, loss, forward);
    for (int i = 1; i <= j && valid; ++i) {
      advance(i, forward);
      valid = absorb(i, loss, forward);
    }
    if (j < last_ && valid) {
      CostToGo<Scalar, n> later;
      PassSums<Scalar> sums;
      Feedback<Scalar, n, Root::q> law;
      for (int i = last_; i > j && valid; --i) {
        add_measurements(i, loss, later);
        valid = pass_dynamics(jacobian(i), root(i).B, node(i).b[now_], Scalar(0),
                              static_cast<Matrix<Scalar, Root::q, Root::q>*>(nullptr), later, law, sums);
      }
      const Covariance P = forward.P;
      valid = valid && condition(P, later.information, forward.P);
    }
    return valid ? forward.P : kernel::filled<Covariance>(std::numeric_limits<Scalar>::quiet_NaN());
  }

  [[nodiscard]] const D& dynamics() const { return dynamics_; }
  [[nodiscard]] JML_INLINE int last() const { return last_; }
  [[nodiscard]] JML_INLINE auto& node(int j) { return nodes_[static_cast<std::size_t>(place(j))]; }
  [[nodiscard]] JML_INLINE const auto& node(int j) const {
    return nodes_[static_cast<std::size_t>(place(j))];
  }
  [[nodiscard]] JML_INLINE const Root& root([[maybe_unused]] int j) const {
    if constexpr (Root::constant)
      return root_;
    else
      return node(j).noise;
  }
  [[nodiscard]] auto& prior() { return prior_; }
  [[nodiscard]] static constexpr const Terminal<Scalar, n>* terminal() { return nullptr; }
  [[nodiscard]] JML_INLINE int now() const { return now_; }
  void flip() { now_ = 1 - now_; }
  [[nodiscard]] double time_of(int j) const { return at_sample(node(j).at()).time; }
  template <typename Use>
  JML_INLINE void visit(int j, const Use& use) {
    visit_each(node(j), use, std::make_index_sequence<sizeof...(S)>{});
  }

 private:
  struct WindowNode : IntervalNode<Scalar, D, true> {
    std::tuple<Slots<S>...> slots{};
    std::array<std::uint8_t, sizeof...(S)> count{};
  };

  [[nodiscard]] JML_INLINE int place(int j) const {
    const int at = first_ + j;
    return at < size ? at : at - size;
  }
  template <typename SomeNode, typename Use, std::size_t... type>
  JML_INLINE static void visit_each(SomeNode& where, const Use& use,
                                                std::index_sequence<type...>) {
    const auto visit_type = [&](auto& slots, std::size_t t) JML_INLINE {
      for (std::size_t i = 0; i < where.count[t]; ++i) use(slots[i]);
    };
    (visit_type(std::get<type>(where.slots), type), ...);
  }

  void clear(WindowNode& some, const At& at) {
    kernel::set_zero(some.b[now_]);
    some.count = {};
    some.context = at;
  }
  void arrive(const Estimate<Scalar, n>& estimate) {
    const kernel::SemidefiniteFactor<Scalar, n> factor(estimate.P);
    prior_.x = estimate.x;
    prior_.L = factor.L;
    prior_.a[now_] = factor.coordinates(node(0).x[now_] - estimate.x);
    P_ = estimate.P;
  }
  /// f_x of the step that leads to node j.
  [[nodiscard]] Covariance jacobian(int j) const {
    return dynamics_jacobian(dynamics_, node(j - 1).x[now_], node(j).at());
  }
  /// The step that leads to node j, of a filter linearised about the nominal.
  void advance(int j, Estimate<Scalar, n>& estimate) const {
    const X& x = node(j - 1).x[now_];
    const Covariance A = jacobian(j);
    Covariance AP, P = kernel::zeros<Covariance>();
    kernel::product(A, estimate.P, AP);
    kernel::add_symmetric_product<1>(P, root(j).B, root(j).B, P);
    kernel::add_symmetric_product<1>(P, AP, A, estimate.P);
    const X off = estimate.x - x;
    estimate.x = jml::dynamics(dynamics_, x, node(j).at()) + root(j).mean_effect + A * off;
  }
  void add_measurements(int j, const Loss& loss, CostToGo<Scalar, n>& v) const {
    const auto& where = node(j);
    const X& x = where.x[now_];
    const auto at_y = at_sample(where.at());
    visit_each(
        where,
        [&](const auto& record) {
          const auto residual =
              measurement_residual(record.sensor, record.y, measurement(record.sensor, x, at_y));
          const auto m_x = measurement_jacobian(record.sensor, x, at_y);
          const auto value = loss(record.R.squared_norm(residual));
          add_robust_measurement(m_x, record.R, residual, value.slope, value.bend, v);
        },
        std::make_index_sequence<sizeof...(S)>{});
  }
  /// Corrects `estimate` with the measurements of node j, linearised about the nominal.
  [[nodiscard]] bool absorb(int j, const Loss& loss, Estimate<Scalar, n>& estimate) const {
    bool any = false;
    for (const auto count : node(j).count) any = any || count > 0;
    if (!any) return all_finite(estimate.P);
    CostToGo<Scalar, n> data;
    add_measurements(j, loss, data);
    const Covariance P = estimate.P;
    if (!condition(P, data.information, estimate.P)) return false;
    const X off = estimate.x - node(j).x[now_];
    const X slope = data.slope + data.information * off;
    estimate.x -= estimate.P * slope;
    return all_finite(estimate.x);
  }

  D dynamics_;
  Root root_;  // where it is constant
  Prior<Scalar, n> prior_;
  Covariance P_ = kernel::zeros<Covariance>();  // of the prior
  int first_ = 0, last_ = 0, now_ = 0;
  std::array<WindowNode, static_cast<std::size_t>(size)> nodes_{};
  struct Saved {
    Prior<Scalar, n> prior;
    Covariance P;
    int first, last;
    std::array<std::uint8_t, sizeof...(S)> count;
  };
  Saved saved_{};
  bool slid_ = false;
};

}  // namespace detail

}  // namespace jml
