// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The memory of a TwoPoint: nodes, and between them intervals of continuous/collocation.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/collocation.hpp>
#include <jml/interval/minimise.hpp>
#include <jml/interval/room.hpp>
#include <vector>

namespace jml {

namespace detail {

/// The dynamics as minimise() counts them: three free disturbances an interval.
template <typename D>
struct Collocated {
  static constexpr int states = DynamicsTraits<D>::states, disturbances = 3 * DynamicsTraits<D>::disturbances;
  static constexpr bool linear = DynamicsTraits<D>::linear;
};

/// An IntervalStore.
template <typename D, typename S, typename Scalar>
class TwoPointRecord {
 public:
  using Model = D;
  using Dynamics = Collocated<D>;
  using List = Sensors<S>;
  using Number = Scalar;
  static constexpr int n = DynamicsTraits<D>::states, q = DynamicsTraits<D>::disturbances, m = 3 * q,
                       p = SensorTraits<S>::measurements;
  using X = Vector<Scalar, n>;
  using Y = Vector<Scalar, p>;
  using Step = CollocatedStep<Scalar, D>;
  using At = typename Step::At;

  /// A state and the interval that leads to it; two of what is free, the nominal and the trial.
  struct Node {
    std::array<X, 2> x = copies_of<2, X>();
    std::array<Vector<Scalar, m>, 2> b = copies_of<2, Vector<Scalar, m>>();
    std::array<typename Step::Stages, 2> stages{copies_of<3, X>(), copies_of<3, X>()};
    std::array<Y, 3> y = copies_of<3, Y>();
    Feedback<Scalar, n, m> law{};
    At at{};
    bool measured = false;
    X costate = kernel::zeros<X>(), filtered = kernel::zeros<X>();
    Matrix<Scalar, n, n> closed = kernel::zeros<Matrix<Scalar, n, n>>(), spread = closed, P = closed;
  };
  struct Root {
    Matrix<Scalar, n, q> B;
  };

  TwoPointRecord(D dynamics, S sensor, const Estimate<Scalar, n>& given, int steps, double time)
      : dynamics_(std::move(dynamics)), sensor_(std::move(sensor)) {
    status_ =
        std::isfinite(time) ? Factored<Ekf<>>{}.start(AnyModel{}, given, start_) : Status::invalid_time_step;
    const At at{time, Scalar(0), kernel::zeros<Vector<Scalar, DynamicsTraits<D>::controls>>()};
    const Matrix<Scalar, q, q> Q = disturbance_spectral_density(dynamics_, given.x, at);
    const Matrix<Scalar, p, p> R = noise_spectral_density(sensor_, given.x, at);
    if (status_ == Status::ok && !is_covariance(Q)) status_ = Status::invalid_disturbance_covariance;
    if (status_ == Status::ok && !(is_noise_covariance(R) && factor_precisely(R, R_)))
      status_ = Status::invalid_noise_covariance;
    const Matrix<Scalar, n, q> G = disturbance_input(dynamics_, given.x, at);
    root_.B = G * kernel::SemidefiniteFactor<Scalar, q>(Q).L;
    if (status_ == Status::ok && !all_finite(root_.B)) status_ = Status::invalid_disturbance_covariance;
    const bool sensible = steps >= 0 && steps <= most_nodes && has_room(sizeof(Node) * (steps + 1.0));
    if (!sensible) status_ = Status::invalid_option;
    steps_ = sensible ? steps : 0;
    nodes_.reserve(static_cast<std::size_t>(steps_) + 1);
    nodes_.emplace_back();
    nodes_[0].at = at;
    nodes_[0].x[0] = given.x;
    if (status_ == Status::ok) prior_.set(start_);
  }

  /// An interval after the last; y at its stages, or null.
  Status append(const At& at, const std::array<Y, 3>* y) {
    if (status_ != Status::ok) return status_;
    if (!std::isfinite(at.dt) || !(at.dt > Scalar(0)) || !std::isfinite(at.time))
      return Status::invalid_time_step;
    if (!all_finite(at.control)) return Status::invalid_control;
    for (int i = 0; i < 3; ++i) {
      if (y != nullptr && !all_finite((*y)[std::size_t(i)])) return Status::invalid_measurement;
    }
    if (last() >= steps_) return Status::memory_full;
    nodes_.emplace_back();
    Node& added = nodes_.back();
    added.at = at;
    added.measured = y != nullptr;
    if (y != nullptr) added.y = *y;
    set_state(last(), nodes_[nodes_.size() - 2].x[std::size_t(now_)]);
    return Status::ok;
  }
  /// Forgets node 0: what was filtered at node 1 is where the filter begins.
  void slide() {
    for (std::size_t j = 1; j < nodes_.size(); ++j) nodes_[j - 1] = nodes_[j];
    nodes_.pop_back();
  }
  /// The nodes of another record of the same capacity.
  void copy_nodes(const TwoPointRecord& other) {
    nodes_.assign(other.nodes_.begin(), other.nodes_.end());
    now_ = other.now_;
  }
  /// The nominal of node j, a guess.
  void set_state(int j, const X& x) { node(j).x[std::size_t(now_)] = x; }

  [[nodiscard]] Status status() const { return status_; }
  [[nodiscard]] const D& dynamics() const { return dynamics_; }
  [[nodiscard]] const S& sensor() const { return sensor_; }
  [[nodiscard]] Step step() const { return {dynamics_, root_.B}; }
  [[nodiscard]] const auto& R() const { return R_; }
  [[nodiscard]] const auto& start() const { return start_; }
  [[nodiscard]] int last() const { return static_cast<int>(nodes_.size()) - 1; }
  [[nodiscard]] Node& node(int j) { return nodes_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] const Node& node(int j) const { return nodes_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] const Root& root(int) const { return root_; }
  [[nodiscard]] auto& prior() { return prior_; }
  [[nodiscard]] const Terminal<Scalar, n>* terminal() const { return has_terminal_ ? &terminal_ : nullptr; }
  void end_near(const Terminal<Scalar, n>& terminal) {
    terminal_ = terminal;
    has_terminal_ = true;
  }
  [[nodiscard]] int now() const { return now_; }
  [[nodiscard]] int next() const { return 1 - now_; }
  void flip() { now_ = next(); }
  void flip_back() { now_ = next(); }
  [[nodiscard]] double time_of(int j) const { return end_of(node(j).at).time; }
  /// Samples of a node there are none.
  template <typename Use>
  void visit(int, const Use&) {}

 private:
  D dynamics_;
  S sensor_;
  Root root_;
  kernel::SymmetricFactor<Scalar, p> R_;
  FactoredBelief<Scalar, n> start_{};
  Prior<Scalar, n> prior_;
  Terminal<Scalar, n> terminal_;
  bool has_terminal_ = false;
  int steps_ = 0, now_ = 0;
  std::vector<Node> nodes_;
  Status status_ = Status::ok;
};

/// G, Q and R are constants.
template <typename D, typename S, typename Scalar>
[[nodiscard]] Status freeze(TwoPointRecord<D, S, Scalar>&, Scalar& change) {
  change = 0;
  return Status::ok;
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
