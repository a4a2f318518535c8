// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The memory of a FixedLag: the last L steps in a ring of fixed size, with an arrival cost at the first
/// node.
///
/// When the window slides, the arrival cost is the filtered mean and covariance of the second node, from one
/// Kalman step linearised about the smoothed trajectory; it has then absorbed that node's measurements. Its
/// covariance is kept in factors U D Uᵀ.
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <cstdint>
#include <jml/interval/frozen_points.hpp>
#include <jml/interval/linearised.hpp>
#include <jml/interval/local_record.hpp>
#include <jml/interval/roll_out.hpp>
#include <jml/interval/window_parts.hpp>

namespace jml {
namespace detail {

/// `length` steps, and room for `measurements` of each sensor type at each node.
template <int length, int measurements, typename D, typename List, typename Scalar>
class WindowMemory;

/// A store of interval/sweep.hpp.
template <int length, int measurements, typename D, typename... S, typename Scalar_>
class WindowMemory<length, measurements, D, Sensors<S...>, Scalar_> {
  static_assert(length >= 1 && measurements >= 1, "jml: a lag is at least one step with one measurement");
  static_assert(measurements <= 255,
                "jml: a node of a lag has room for at most 255 measurements of a sensor");

 public:
  using List = Sensors<S...>;
  using Scalar = Scalar_;

 private:
  static constexpr int n = states_of<D>;
  static constexpr int size = length + 2;  // one more than a full window: a step may be taken back
  using X = Vector<Scalar, n>;
  using Covariance = Matrix<Scalar, n, n>;
  using Root = NoiseRoot<Scalar, D>;
  using At = typename Root::At;
  template <typename Sensor>
  using Slots = std::array<Record<Scalar, n, Sensor, At>, static_cast<std::size_t>(measurements)>;
  static constexpr bool in_charts = requires(At& at) { at.from; };

 public:
  using Dynamics = D;
  using Number = Scalar;
  static constexpr int longest = length;
  static constexpr bool reads_contexts = keeps_context<Scalar, D, List>;

  explicit WindowMemory(D dynamics) : dynamics_(std::move(dynamics)) {}

  // The belief, as Filter shows it; ages count steps back from the newest state.
  [[nodiscard]] const X& x(int age = 0) const { return node(last_ - age).x[now_]; }
  /// What x() lacks where the window is followed in twice the digits; else zero.
  [[nodiscard]] X x_low() const {
    X low = kernel::zeros<X>();
    if (AllDigits<D, Scalar>::known(arrival_))
      static_cast<void>(AllDigits<D, Scalar>::last(*this, prior_, &low));
    return low;
  }
  /// To first order about the window's trajectory (Laplace); NaN where it is lost. A pass through the window.
  [[nodiscard]] Covariance P(int age = 0) const {
    return linearised_covariance(*this, arrival_, last_ - age, loss_);
  }
  [[nodiscard]] double time(int age = 0) const { return time_of(last_ - age); }  ///< s
  [[nodiscard]] int depth() const { return last_; }                              ///< steps in the window
  void weigh_by(const Loss& loss) { loss_ = loss; }

  template <typename Given>
  Status reset(const Given& given, double time) {
    FactoredBelief<Scalar, n> arrival{};
    Status status = std::isfinite(time) ? start_factors(given, arrival) : Status::invalid_time_step;
    if constexpr (Root::constant) {
      if (!root_.form(dynamics_, kernel::zeros<X>(), At{}) && status == Status::ok)
        status = Status::invalid_disturbance_covariance;
    }
    if (status != Status::ok) return status;
    arrival_ = arrival;
    first_ = last_ = now_ = kept_ = 0;
    clear(node(0), {});
    node(0).x[0] = given.x;
    node(0).context.time = time;
    arrive();
    return status;
  }
  /// The control of the last step, for a sensor that reads it.
  [[nodiscard]] auto& last_control() { return node(last_).context.control; }

  /// Other dynamics, for a reset() that follows; or why they are none.
  Status replace(const D& dynamics) {
    if constexpr (Root::constant) {
      Root other = root_;
      if (!other.form(dynamics, kernel::zeros<X>(), At{})) return Status::invalid_disturbance_covariance;
    }
    dynamics_ = dynamics;
    return Status::ok;
  }

  /// Makes room for a node, sliding if the window is full. False where the arrival cost would be lost.
  /// `leave(j, arrival)`: at node 0 before it moves, and at node 1 after it has.
  template <typename Leave = Nothing>
  bool slide(const Loss& loss, [[maybe_unused]] const Leave& leave = {}) {
    saved_.first = first_, saved_.last = last_;
    slid_ = last_ == length;
    if (!slid_) return true;
    saved_.prior = prior_;
    saved_.count = node(1).count;
    commit(saved_.arrival, arrival_);
    if constexpr (!std::is_same_v<Leave, Nothing>) leave(0, arrival_);
    bool valid = linearised_correction(*this, 0, loss, arrival_) && linearised_step(*this, 1, arrival_);
    if constexpr (!std::is_same_v<Leave, Nothing>) leave(1, arrival_);
    valid = valid && linearised_correction(*this, 1, loss, arrival_);
    if (!valid) {
      commit(arrival_, saved_.arrival);
      return slid_ = false;
    }
    first_ = place(1);
    --last_;
    node(0).count = {};
    arrive();
    if (AllDigits<D, Scalar>::known(arrival_))
      prior_.a[now_] = AllDigits<D, Scalar>::arrived(*this, saved_.arrival, saved_.prior, prior_.L);
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
    if (AllDigits<D, Scalar>::known(arrival_)) fresh.x[now_] = AllDigits<D, Scalar>::last(*this, prior_);
    return all_finite(fresh.x[now_]) && all_finite(step_jacobian(*this, last_)) ? Status::ok
                                                                                : Status::dynamics_not_finite;
  }
  /// Undoes slide() and append().
  void take_back() {
    if (slid_) {
      first_ = saved_.first;
      prior_ = saved_.prior;
      commit(arrival_, saved_.arrival);
      node(1).count = saved_.count;
    }
    last_ = saved_.last;
  }
  /// Keeps the trajectory, and in charts what its models are linearised about, whatever a minimisation makes
  /// of it; restore() takes it back.
  void keep() {
    kept_ = now_;
    if constexpr (in_charts) {
      for (int j = 0; j <= last_; ++j) frozen_[static_cast<std::size_t>(j)].take(node(j));
    }
  }
  void restore() {
    now_ = kept_;
    if constexpr (in_charts) {
      for (int j = 0; j <= last_; ++j) frozen_[static_cast<std::size_t>(j)].give(node(j));
    }
  }

  /// A node `ahead` seconds after node j, within the step to the next: that step becomes two. The states
  /// after it are rolled out again. Only where the noise of a step follows its dt.
  void insert(int j, double ahead) {
    split_ = node(j + 1);
    for (int k = last_; k > j; --k) node(k + 1) = node(k);
    ++last_;
    At first = split_.at(), second = first;
    first.dt = static_cast<Scalar>(ahead);
    second.time += ahead;
    second.dt = split_.at().dt - first.dt;
    split_step(dynamics_, node(j).x[now_], first, second);
    clear(node(j + 1), first);
    node(j + 2).context = second;
  }
  /// Undoes insert(j); before restore(), which counts the nodes as keep() did.
  void join(int j) {
    for (int k = j + 1; k < last_; ++k) node(k) = node(k + 1);
    --last_;
    node(j + 1) = split_;
  }

  /// memory_full, invalid_noise_covariance, or ok and the measurement is stored.
  template <typename Sensor>
  Status add(int j, const Sensor& sensor, const Vector<Scalar, measurements_of<Sensor>>& y) {
    constexpr auto type = static_cast<std::size_t>(List::template index_of<Sensor>());
    auto& where = node(j);
    if (where.count[type] >= measurements) return Status::memory_full;
    Record<Scalar, n, Sensor, At> record{sensor, y};
    if (!record.freeze(where.x[now_], end_of(where.at()))) return Status::invalid_noise_covariance;
    std::get<type>(where.slots)[where.count[type]++] = record;
    return Status::ok;
  }
  template <typename Sensor>
  void remove_newest(int j) {
    --node(j).count[static_cast<std::size_t>(List::template index_of<Sensor>())];
  }

  /// What the next step starts from: of the copies of a trajectory the nominal, of the prior its factors.
  auto each_part(auto&& f) {
    return f(in_range(first_, 0, size - 1), in_range(last_, 0, length), in_range(now_, 0, 2), arrival_, loss_,
             part_series<1>([this](int) -> X& { return prior_.a[now_]; }),
             part_series<length + 1>([this](int j) {
               return part_if([this, j] { return j <= last_; },
                              WindowNodeParts<measurements, WindowNode>{node(j), now_, j > 0});
             }));
  }
  void restored() { prior_.set(arrival_); }

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
  /// The prior, by factors.
  [[nodiscard]] const FactoredBelief<Scalar, n>& start() const { return arrival_; }
  [[nodiscard]] static constexpr const Terminal<Scalar, n>* terminal() { return nullptr; }
  [[nodiscard]] JML_INLINE int now() const { return now_; }
  /// The copy that is neither the nominal nor kept.
  [[nodiscard]] JML_INLINE int next() const { return now_ == kept_ ? (now_ + 1) % 3 : 3 - now_ - kept_; }
  void flip() {
    before_ = now_;
    now_ = next();
  }
  void flip_back() { now_ = before_; }
  [[nodiscard]] double time_of(int j) const { return end_of(node(j).at()).time; }
  template <typename Use>
  JML_INLINE void visit(int j, const Use& use) {
    visit_each(node(j), use, std::make_index_sequence<sizeof...(S)>{});
  }
  template <typename Use>
  void visit(int j, const Use& use) const {
    visit_each(node(j), use, std::make_index_sequence<sizeof...(S)>{});
  }
  /// Node j has a measurement.
  [[nodiscard]] bool measured(int j) const {
    bool any = false;
    for (const auto count : node(j).count) any = any || count > 0;
    return any;
  }

 private:
  using PlainNode = IntervalNode<Scalar, D, true, 3>;
  struct WindowNode : PlainNode {
    std::tuple<Slots<S>...> slots{};
    std::array<std::uint8_t, sizeof...(S)> count{};
  };

  [[nodiscard]] JML_INLINE int place(int j) const {
    const int at = first_ + j;
    return at < size ? at : at - size;
  }
  template <typename SomeNode, typename Use, std::size_t... type>
  JML_INLINE static void visit_each(SomeNode& where, const Use& use, std::index_sequence<type...>) {
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
  void arrive() {
    prior_.set(arrival_);
    prior_.a[now_] = prior_.coordinates(node(0).x[now_] - arrival_.x);
  }

  D dynamics_;
  Root root_;  // where it is constant
  Prior<Scalar, n, 3> prior_;
  FactoredBelief<Scalar, n> arrival_{};  // the prior, by factors
  int first_ = 0, last_ = 0, now_ = 0, kept_ = 0, before_ = 0;
  std::array<WindowNode, static_cast<std::size_t>(size)> nodes_{};
  struct Saved {
    Prior<Scalar, n, 3> prior;
    FactoredBelief<Scalar, n> arrival;
    int first, last;
    std::array<std::uint8_t, sizeof...(S)> count;
  };
  Saved saved_{};
  bool slid_ = false;
  WindowNode split_{};
  [[no_unique_address]] typename FrozenNodes<in_charts, size, PlainNode, Slots<S>...>::type frozen_{};
  Loss loss_{};
};

}  // namespace detail
}  // namespace jml
#include <jml/warnings_end.hpp>
