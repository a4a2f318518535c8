// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The memory of a Batch: nodes and measurements in arrays that are reserved once.
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <cstdint>
#include <jml/interval/linearised.hpp>
#include <jml/interval/room.hpp>
#include <vector>

namespace jml {

/// Memory of a Batch, reserved when it is built.
struct Capacity {
  int steps;              ///< nodes after the first
  int measurements = -1;  ///< of each sensor type; -1: one a node
};

namespace detail {

template <typename D, typename List, typename Scalar>
class Recording;

/// A store of interval/sweep.hpp.
template <typename D, typename... S, typename Scalar>
class Recording<D, Sensors<S...>, Scalar> {
  static constexpr int n = states_of<D>;
  using X = Vector<Scalar, n>;
  using Root = NoiseRoot<Scalar, D>;
  using At = typename Root::At;

 public:
  using List = Sensors<S...>;
  using Dynamics = D;
  using Number = Scalar;
  static constexpr bool reads_contexts = keeps_context<Scalar, D, List>;

  explicit Recording(D dynamics) : dynamics_(std::move(dynamics)) {}

  /// Reserves the memory, and begins with node 0.
  template <typename Given>
  Status start(const Given& given, double time, Capacity capacity) {
    status_ = std::isfinite(time) ? start_factors(given, start_) : Status::invalid_time_step;
    if constexpr (Root::constant) {
      if (!root_.form(dynamics_, kernel::zeros<X>(), At{}) && status_ == Status::ok)
        status_ = Status::invalid_disturbance_covariance;
    }
    const bool sensible = capacity.steps >= 0 && capacity.steps <= most_nodes && capacity.measurements >= -1;
    if (capacity.measurements < 0 && sensible) capacity.measurements = capacity.steps + 1;
    if (!sensible || !has_room_for(capacity)) {
      capacity = {0, 0};
      status_ = Status::invalid_option;
    }
    const auto nodes = static_cast<std::size_t>(capacity.steps) + 1;
    steps_ = capacity.steps;
    measurements_ = static_cast<std::size_t>(capacity.measurements);
    nodes_.clear();
    nodes_.reserve(nodes);
    later_.assign(nodes, kernel::zeros<Matrix<Scalar, n, n>>());
    times_.clear();
    times_.reserve(nodes);
    (std::get<vector_of<S>>(records_).clear(), ...);
    (std::get<vector_of<S>>(records_).reserve(measurements_), ...);
    last_ = now_ = 0;
    times_.push_back(time);
    nodes_.emplace_back();
    nodes_[0].x[0] = given.x;
    if constexpr (reads_contexts) nodes_[0].context.time = time;
    if (status_ == Status::ok) prior_.set(start_);
    prior_.a = copies_of<2, X>();
    return status_;
  }
  [[nodiscard]] const X& x() const { return node(last_).x[now_]; }

  /// A node after the last; its state starts as that of the node before.
  Status append(const At& at) {
    if (status_ != Status::ok) return status_;
    if (const Status status = check_context(at); status != Status::ok) return status;
    if (last() >= steps_) return Status::memory_full;
    times_.push_back(end_of(at).time);
    nodes_.emplace_back();
    ++last_;
    auto& node = nodes_.back();
    if constexpr (reads_contexts) node.context = at;
    node.x[now_] = nodes_[nodes_.size() - 2].x[now_];
    node.first = node.end = {static_cast<std::uint32_t>(std::get<vector_of<S>>(records_).size())...};
    return Status::ok;
  }
  /// What append() of this measurement would answer.
  template <typename Sensor>
  Status check(const Sensor& sensor, const Vector<Scalar, measurements_of<Sensor>>& y, const At& at) const {
    if (status_ != Status::ok) return status_;
    if (!all_finite(y)) return Status::invalid_measurement;
    // A sensor that is no number at some states is not to be refused for one of them.
    if (!all_finite(measurement(sensor, x(), at)) && !all_finite(measurement(sensor, start_.x, at)))
      return Status::sensor_not_finite;
    if (std::get<vector_of<Sensor>>(records_).size() >= measurements_) return Status::memory_full;
    Record<Scalar, n, Sensor, At> record{sensor, y};
    if constexpr (!Record<Scalar, n, Sensor, At>::varies) {
      if (!record.freeze(kernel::zeros<X>(), At{})) return Status::invalid_noise_covariance;
    }
    return Status::ok;
  }
  /// A measurement of the last node.
  template <typename Sensor>
  Status append(const Sensor& sensor, const Vector<Scalar, measurements_of<Sensor>>& y, const At& at) {
    if (const Status status = check(sensor, y, at); status != Status::ok) return status;
    auto& records = std::get<vector_of<Sensor>>(records_);
    records.push_back(Record<Scalar, n, Sensor, At>{sensor, y});
    nodes_.back().end = {static_cast<std::uint32_t>(std::get<vector_of<S>>(records_).size())...};
    if constexpr (!Record<Scalar, n, Sensor, At>::varies)
      (void)records.back().freeze(kernel::zeros<X>(), At{});
    return Status::ok;
  }

  [[nodiscard]] Status status() const { return status_; }
  [[nodiscard]] const D& dynamics() const { return dynamics_; }
  /// The prior, by factors.
  [[nodiscard]] const FactoredBelief<Scalar, n>& start() const { return start_; }
  [[nodiscard]] Estimate<Scalar, n> estimate() const { return {start_.x, start_.P()}; }
  [[nodiscard]] JML_INLINE int last() const { return last_; }
  [[nodiscard]] JML_INLINE auto& node(int j) { return nodes_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] JML_INLINE const auto& node(int j) const { return nodes_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] JML_INLINE const Root& root([[maybe_unused]] int j) const {
    if constexpr (Root::constant)
      return root_;
    else
      return node(j).noise;
  }
  /// What the measurements after node j say, as rows: see InformationInTwo::store(). For covariances() alone.
  [[nodiscard]] Matrix<Scalar, n, n>& later(int j) { return later_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] auto& prior() { return prior_; }
  [[nodiscard]] const Terminal<Scalar, n>* terminal() const { return has_terminal_ ? &terminal_ : nullptr; }
  void end_near(const Terminal<Scalar, n>& terminal) {
    terminal_ = terminal;
    has_terminal_ = true;
  }
  void end_anywhere() { has_terminal_ = false; }
  [[nodiscard]] int now() const { return now_; }
  [[nodiscard]] int next() const { return 1 - now_; }
  void flip() { now_ = next(); }
  void flip_back() { now_ = 1 - now_; }
  [[nodiscard]] double time_of(int j) const { return times_[static_cast<std::size_t>(j)]; }

  /// use(record) for the measurements of node j, in the order of the sensor types.
  template <typename Use>
  JML_INLINE void visit(int j, const Use& use) {
    visit_each(j, use, std::make_index_sequence<sizeof...(S)>{});
  }

 private:
  template <typename Sensor>
  using vector_of = std::vector<Record<Scalar, n, Sensor, At>>;
  struct RecordedNode : IntervalNode<Scalar, D, reads_contexts> {
    std::array<std::uint32_t, sizeof...(S)> first{}, end{};  // of this node, in the records of each type
  };

  /// Not asked again where there is room already.
  [[nodiscard]] bool has_room_for(const Capacity& capacity) const {
    const auto count = [](int number) { return static_cast<std::size_t>(number); };
    if (count(capacity.steps) < nodes_.capacity() && count(capacity.measurements) <= measurements_)
      return true;
    const double a_node = sizeof(RecordedNode) + sizeof(Matrix<Scalar, n, n>) + sizeof(double),
                 one_of_each = (0.0 + ... + static_cast<double>(sizeof(typename vector_of<S>::value_type)));
    return has_room(a_node * (capacity.steps + 1.0) + one_of_each * capacity.measurements);
  }
  template <typename Use, std::size_t... type>
  JML_INLINE void visit_each(int j, const Use& use, std::index_sequence<type...>) {
    const auto visit_type = [&](auto& records, std::size_t t) JML_INLINE {
      auto* const all = records.data();
      for (std::size_t i = node(j).first[t], end = node(j).end[t]; i < end; ++i) use(all[i]);
    };
    (visit_type(std::get<type>(records_), type), ...);
  }

  D dynamics_;
  Root root_;  // where it is constant
  FactoredBelief<Scalar, n> start_{};
  Prior<Scalar, n> prior_;
  Terminal<Scalar, n> terminal_;
  bool has_terminal_ = false;
  int steps_ = 0, last_ = 0, now_ = 0;
  std::size_t measurements_ = 0;
  std::vector<RecordedNode> nodes_;
  std::vector<double> times_;
  std::vector<Matrix<Scalar, n, n>> later_;
  std::tuple<vector_of<S>...> records_;
  Status status_ = Status::ok;
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
