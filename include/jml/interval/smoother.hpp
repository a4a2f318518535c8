// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The fixed-interval smoother behind Kalman, Ekf and Sddre: what all measurements say of every past instant.
///
/// Two passes (Fraser and Potter 1969): with P and x̂ of the filter, and with the information Λ and slope λ of
/// all later measurements as a function of x at that instant, the smoothed pair is
///   P_s = (P⁻¹ + Λ)⁻¹ = L (I + LᵀΛL)⁻¹ Lᵀ,   x_s = x̂ - P_s λ,   P = L Lᵀ of any rank.
/// Nothing is subtracted, so that no digit of P_s is lost where the later measurements are much better than
/// P. The backward pass is that of Batch and FixedLag (interval/costate.hpp), about the points and with the
/// matrices that the forward pass used: the model is not asked again. One record per instant, of a size that
/// does not depend on the sensors.
#pragma once

#include <jml/filter/filter.hpp>
#include <jml/filter/one_pass.hpp>
#include <jml/interval/costate.hpp>
#include <jml/interval/noise_root.hpp>
#include <vector>

namespace jml {

namespace detail {

template <typename Rule>
inline constexpr bool is_smoothable = false;
template <OnePassRule Rule>
inline constexpr bool is_smoothable<Rule> = Rule::symmetric;

/// What one instant leaves for the way back: the step that led to it, and its own measurements.
template <typename Scalar, typename D>
struct SmootherRecord {
  static constexpr int n = states_of<D>;
  using Root = NoiseRoot<Scalar, D>;

  Matrix<Scalar, n, n> transition = kernel::zeros<Matrix<Scalar, n, n>>();     // A
  Matrix<Scalar, n, Root::q> B = kernel::zeros<Matrix<Scalar, n, Root::q>>();  // B Bᵀ = G Q Gᵀ
  Vector<Scalar, n> prediction = kernel::zeros<Vector<Scalar, n>>();
  CostToGo<Scalar, n> own{};  // of the measurements, about the prediction
  bool lost = false;          // a correction took a variance below the last digits of what it came from

  template <int p>
  void add(const Vector<Scalar, n>& x, const Matrix<Scalar, p, n>& H, const Matrix<Scalar, p, p>& R,
           const Vector<Scalar, p>& innovation) {
    kernel::SymmetricFactor<Scalar, p> factor;
    static_cast<void>(factor.factor(R));  // it was regular in the step
    const Vector<Scalar, n> off = x - prediction;
    Vector<Scalar, p> residual;
    kernel::add_product<1>(innovation, H, off, residual);  // y - m about the prediction
    add_measurement(H, factor, residual, own);
  }

  /// From the cost to go about the prediction here to that about the estimate of the instant before.
  [[nodiscard]] bool pass(CostToGo<Scalar, n>& v) const {
    Feedback<Scalar, n, Root::q> law;
    PassSums<Scalar> sums;
    return pass_dynamics(transition, B, kernel::zeros<Vector<Scalar, Root::q>>(), Scalar(0),
                         static_cast<Matrix<Scalar, Root::q, Root::q>*>(nullptr), v, law, sums);
  }
};

/// What a step of the forward pass used, on its way into a record.
template <typename Record>
struct SmootherObserver {
  Record& record;

  template <typename A>
  void transition(const A& a) const {
    record.transition = a;
  }
  template <typename X, typename H, typename R, typename Innovation>
  void correction(const X& x, const H& slot_d, const R& noise, const Innovation& innovation) const {
    record.add(x, slot_d, noise, innovation);
  }
};

/// The forward pass's filter and its records.
template <typename Scalar_, typename D>
class SmootherMemory {
 public:
  using Scalar = Scalar_;
  static constexpr int n = states_of<D>;
  using Record = SmootherRecord<Scalar, D>;
  struct Node {
    Record record;
    Estimate<Scalar, n> filtered, smoothed;
    double time = 0;
  };

  explicit SmootherMemory(D dynamics) : model(std::move(dynamics)) {}

  NoisyDynamics<Scalar, D> model;
  std::vector<Node> nodes;
  int last = 0;
  typename Record::Root root;  // where it is constant

  [[nodiscard]] const D& dynamics() const { return model.dynamics; }
  [[nodiscard]] const Vector<Scalar, n>& x() const { return filtered().x; }
  [[nodiscard]] const Matrix<Scalar, n, n>& P() const { return filtered().P; }
  [[nodiscard]] Node& node(int k) { return nodes[static_cast<std::size_t>(k)]; }
  [[nodiscard]] const Node& node(int k) const { return nodes[static_cast<std::size_t>(k)]; }
  [[nodiscard]] const Estimate<Scalar, n>& filtered() const { return node(last).filtered; }
  [[nodiscard]] bool full() const { return nodes.size() == static_cast<std::size_t>(last) + 1; }

  /// Node k is where the filter stands.
  void keep(int k, const Record& record, const Estimate<Scalar, n>& estimate, double time) {
    node(k) = {record, estimate, estimate, time};
    last = k;
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

  /// covariance_lost: at some nodes no digit of the filter's P is left, or P_s is not finite, and these keep
  /// the filter's estimate.
  [[nodiscard]] Status smooth() {
    Status answer = Status::ok;
    CostToGo<Scalar, n> v;
    node(last).smoothed = node(last).filtered;
    if (node(last).record.lost) answer = Status::covariance_lost;
    for (int k = last; k > 0; --k) {
      const Record& record = node(k).record;
      // v is about the filter's estimate here; the record is about its prediction.
      const Vector<Scalar, n> off = node(k).filtered.x - record.prediction;
      v.slope = v.slope - v.information * off;
      v.information += record.own.information;
      v.slope += record.own.slope;
      Node& before = node(k - 1);
      bool valid = record.pass(v) && !before.record.lost;
      valid = valid && condition(before.filtered.P, v.information, before.smoothed.P);
      before.smoothed.x = before.filtered.x - before.smoothed.P * v.slope;
      if (valid && all_finite(before.smoothed.x)) continue;
      before.smoothed = before.filtered;
      answer = Status::covariance_lost;
    }
    return answer;
  }
};

}  // namespace detail

/// The method of Smoother: a one-pass rule that remembers what its steps use.
template <OnePassRule Rule>
struct Remembering {
  static_assert(
      detail::is_smoothable<Rule>,
      "jml: a smoother belongs to the symmetric one-pass rules Kalman, Ekf and Sddre: P of another rule "
      "is no covariance, or no step of it is one linearisation");
  static constexpr bool rolls_back = true, optimal_on_linear = true, symmetric = true;
  template <typename Scalar, typename D>
  using Belief = detail::SmootherMemory<Scalar, D>;

  [[no_unique_address]] Rule rule;
  int capacity = 0;

  template <typename D>
  static consteval bool accepts() {
    return OnePass<Rule>::template accepts<D>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return OnePass<Rule>::template accepts_sensor<S>();
  }

  template <typename Belief, typename Scalar, int n>
  [[nodiscard]] Status start(Belief& memory, const Estimate<Scalar, n>& given, double time) const {
    memory.nodes.resize(static_cast<std::size_t>(capacity < 0 ? 0 : capacity) + 1);
    memory.keep(0, {}, given, time);
    Estimate<Scalar, n> same;
    const Status status = OnePass<Rule>(rule).start(memory.model, given, same);
    if constexpr (Belief::Record::Root::constant)
      static_cast<void>(memory.root.form(memory.model.dynamics, given.x, {}));
    return status;
  }

  template <typename Belief, typename At>
  [[nodiscard]] Status predict(Belief& memory, const At& at) const {
    if (memory.full()) return Status::memory_full;
    typename Belief::Record record;
    Estimate<typename Belief::Scalar, Belief::n> next;
    const Status status = detail::one_pass_predict(rule, memory.model, memory.filtered(), at, next,
                                                   detail::SmootherObserver<decltype(record)>{record});
    if (!usable(status)) return status;
    if (!memory.form(record, at)) return Status::invalid_disturbance_covariance;
    record.prediction = next.x;
    memory.keep(memory.last + 1, record, next, end_of(at).time);
    return status;
  }
  template <typename Belief, typename Sample, typename Report>
  void correct(Belief& memory, const Sample& sample, Report& report) const {
    auto record = memory.node(memory.last).record;
    if (memory.last == 0) record.prediction = memory.x();
    Estimate<typename Belief::Scalar, Belief::n> next;
    detail::one_pass_correct(rule, memory.filtered(), sample, next, report,
                             detail::SmootherObserver<decltype(record)>{record});
    if (!usable(report.status)) return;
    // P⁺ = N - K S Kᵀ is right to the rounding of N: what is below ten of these is none of its digits.
    using Scalar = typename Belief::Scalar;
    constexpr Scalar rounding = Scalar(10) * std::numeric_limits<Scalar>::epsilon();
    for (int i = 0; i < Belief::n; ++i)
      record.lost = record.lost || next.P(i, i) < rounding * memory.P()(i, i);
    memory.keep(memory.last, record, next, memory.node(memory.last).time);
  }
  template <typename Belief, typename Sample, typename Report>
  void step(Belief& memory, const Sample& sample, Report& report) const {
    const int before = memory.last;
    report.status = predict(memory, sample.at);
    if (!usable(report.status)) return;
    const auto at = end_of(sample.at);
    correct(memory, jml::Sample{sample.sensor, sample.y, at, sample.gate}, report);
    if (!usable(report.status)) memory.last = before;
  }
};

/// A filter that can look back.
///
///     jml::Smoother smoother{jml::Filter{jml::Ekf{}, VanDerPol{}, jml::Estimate{x0, P0}}, 500};
///     const auto report = smoother.step(SaturatingPosition{}, y);  // as with the filter
///     const jml::Status status = smoother.smooth();                // then smoother.x(k), smoother.P(k)
///
/// Its verbs do, report and refuse what those of Filter do; step() and predict() add a node. The memory is
/// reserved at construction; where it is used up, they answer memory_full.
template <typename Rule, typename D, typename Scalar = double>
class Smoother : public Filter<Remembering<Rule>, D, Scalar> {
  using Base = Filter<Remembering<Rule>, D, Scalar>;

 public:
  using typename Base::Covariance;
  using typename Base::State;

  /// Starts, as node 0, where `filter` stands, with its gate; a sensor that reads the control sees none
  /// before the first step. `capacity`: steps and predictions to remember; none where negative.
  Smoother(const Filter<Rule, D, Scalar>& filter, int capacity)
      : Base({filter.method(), capacity}, filter.dynamics(), filter.estimate(), filter.time()) {
    this->gate = filter.gate;
  }

  /// Smooths all nodes with all measurements so far; more may follow, and another smooth(). covariance_lost:
  /// at some nodes no digit of the filter's P is left, or P_s is not finite, and these keep the filter's
  /// estimate.
  [[nodiscard]] Status smooth() {
    return this->status() == Status::ok ? this->mutable_belief().smooth() : this->status();
  }

  /// Number of nodes: the start, and one for each step() and predict().
  [[nodiscard]] int samples() const { return this->belief().last + 1; }
  // Of a node, 0 ≤ k < samples():
  /// As of the last smooth(); at nodes that are newer, the filter's.
  [[nodiscard]] const State& x(int k) const { return this->belief().node(k).smoothed.x; }
  [[nodiscard]] const Covariance& P(int k) const { return this->belief().node(k).smoothed.P; }
  [[nodiscard]] double time(int k) const { return this->belief().node(k).time; }  ///< s
  /// The filter's estimate after the last correction there.
  [[nodiscard]] const Estimate<Scalar, Base::states>& filtered(int k) const {
    return this->belief().node(k).filtered;
  }
  // Of the last node, as the filter has them; and that filter.
  using Base::P;
  using Base::time;
  using Base::x;
  [[nodiscard]] const Base& filter() const { return *this; }
};

}  // namespace jml
