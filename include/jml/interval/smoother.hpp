// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The fixed-interval smoother behind Kalman, Ekf and Sddre: what all measurements say of every past context.
///
/// Bierman's form of the Bryson-Frazier smoother, which goes back with a costate λ and its matrix Λ and
/// inverts nothing but S. The Rauch-Tung-Striebel form divides by the predicted covariance N, which is
/// singular where P_0 = 0 or G Q Gᵀ has not full rank. With the x̂, P, A, H = D, S, K and innovation ν of the
/// forward pass, the smoothed pair is x̂ - P λ, P - P Λ P wherever λ and Λ stand, from zero at the end:
///   correction back:  λ ← (I - K H)ᵀ λ - Hᵀ S⁻¹ ν,   Λ ← (I - K H)ᵀ Λ (I - K H) + Hᵀ S⁻¹ H,
///   prediction back:  λ ← Aᵀ λ,                      Λ ← Aᵀ Λ A.
/// A prediction and the corrections after it are one map λ ← Φᵀ λ - b, Λ ← Φᵀ Λ Φ + W. It begins as Φ = A,
/// b = 0, W = 0, and a correction, with E = H Φ, adds Eᵀ S⁻¹ ν to b and Eᵀ S⁻¹ E to W and takes K E from Φ:
/// one record per instant, of a size that does not depend on the sensors, and the model is not asked again.
#pragma once

#include <cstddef>
#include <jml/filter/filter.hpp>
#include <vector>

namespace jml {

namespace detail {

/// The map of a costate from the end of one step to the end of the step before.
template <typename Scalar, int n>
struct CostateMap {
  Matrix<Scalar, n, n> transition = kernel::zeros<Matrix<Scalar, n, n>>();   // Φᵀ
  Vector<Scalar, n> score = kernel::zeros<Vector<Scalar, n>>();              // b
  Matrix<Scalar, n, n> information = kernel::zeros<Matrix<Scalar, n, n>>();  // W

  void begin(const Matrix<Scalar, n, n>& A) {
    transition = kernel::transposed(A);
    kernel::set_zero(score);
    kernel::set_zero(information);
  }

  template <int p>
  void correct(const Matrix<Scalar, p, n>& H, const Matrix<Scalar, p, p>& S,
               const Vector<Scalar, p>& innovation, const Matrix<Scalar, n, p>& gain) {
    Matrix<Scalar, n, p> E, v, scaled, weight;  // E stands for its transpose, weight for Eᵀ S⁻¹
    kernel::product_transposed(transition, H, E);
    kernel::SymmetricFactor<Scalar, p> factor;
    static_cast<void>(factor.factor(S));  // it was regular in the step
    factor.right_solve(E, v, scaled, weight);
    kernel::add_product<1>(score, weight, innovation, score);
    kernel::add_symmetric_product<1>(information, scaled, v, information);
    kernel::add_product_transposed<-1>(transition, E, gain, transition);
  }

  void apply(Vector<Scalar, n>& costate, Matrix<Scalar, n, n>& costate_matrix) const {
    costate = transition * costate - score;
    Matrix<Scalar, n, n> half;
    kernel::product(transition, costate_matrix, half);
    kernel::add_symmetric_product<1>(information, half, transition, costate_matrix);
  }
};

template <typename Rule>
inline constexpr bool is_smoothable = false;
template <OnePassRule Rule>
inline constexpr bool is_smoothable<Rule> = Rule::symmetric;

/// A rule that keeps what its steps use.
template <typename Rule, typename Scalar, int n>
struct KeepingRule : Rule {
  explicit KeepingRule(const Rule& rule) : Rule(rule) {}
  mutable CostateMap<Scalar, n> map;  // of the step at hand; a filter takes its rule as const

  void keep_transition(const Matrix<Scalar, n, n>& slot_a) const { map.begin(slot_a); }
  template <int p>
  void keep_correction(const Matrix<Scalar, p, n>& slot_d, const Matrix<Scalar, p, p>& S,
                       const Vector<Scalar, p>& innovation, const Matrix<Scalar, n, p>& gain) const {
    map.correct(slot_d, S, innovation, gain);
  }
};

}  // namespace detail

/// A filter that can look back.
///
///     jml::Smoother smoother{jml::Filter{jml::Ekf{}, VanDerPol{}, jml::Estimate{x0, P0}}, 500};
///     const auto report = smoother.step(SaturatingPosition{}, y);  // as with the filter
///     const jml::Status status = smoother.smooth();                // then smoother.x(k), smoother.P(k)
///
/// step(), predict() and update() do, report and refuse what those of Filter do, and a refusal leaves records
/// and filter as they were. The memory, 4n² + 3n numbers and the time for each instant, is reserved at
/// construction; where it is used up, step() and predict() answer memory_full.
///
/// P_s = P - P Λ P is a difference: it loses the digits by which the measurements after an instant shrink the
/// filter's variances there, nine of sixteen where P_0 is 1e9 times too large.
template <typename Rule, typename D, typename Scalar = double>
class Smoother : Filter<detail::KeepingRule<Rule, Scalar, states_of<D>>, D, Scalar> {
  static_assert(
      detail::is_smoothable<Rule>,
      "jml: a smoother belongs to the symmetric one-pass rules Kalman, Ekf and Sddre: P of another rule "
      "is no covariance, or no step of it is one linearisation");
  using Forward = jml::Filter<detail::KeepingRule<Rule, Scalar, states_of<D>>, D, Scalar>;

 public:
  using Forward::states;
  using typename Forward::Control;
  using typename Forward::Covariance;
  using typename Forward::State;
  template <typename S>
  using Report = typename Forward::template Report<S>;
  template <typename S>
  using Measurement = typename Forward::template Measurement<S>;

  /// Starts, as node 0, where `filter` stands, with its gate; a sensor that reads the control sees none
  /// before the first step. `capacity`: steps and predictions to remember; none where negative.
  Smoother(const jml::Filter<Rule, D, Scalar>& filter, int capacity)
      : Forward(detail::KeepingRule<Rule, Scalar, states_of<D>>(filter.rule()), filter.dynamics(),
                filter.estimate(), filter.time()),
        nodes_(static_cast<std::size_t>(capacity < 0 ? 0 : capacity) + 1) {
    gate = filter.gate;
    keep_as(0);
  }

  using Forward::gate;    ///< innovation gate for every step and update; off by default
  using Forward::status;  ///< of the estimate at node 0 and the constants of the model

  /// Forgets all, and starts again from another estimate.
  Status reset(const Estimate<Scalar, states>& estimate, double time) {
    Forward::reset(estimate, time);
    keep_as(0);
    return status();
  }

  /// Filter::step(); adds a node.
  template <typename S>
  [[nodiscard]] Report<S> step(const S& sensor, const Measurement<S>& y, Scalar dt,
                               const Control& control = kernel::zeros<Control>()) {
    return next<Report<S>>([&] { return Forward::step(sensor, y, dt, control); });
  }
  template <typename S>
  [[nodiscard]] Report<S> step(const S& sensor, const Measurement<S>& y) {
    return next<Report<S>>([&] { return Forward::step(sensor, y); });
  }
  template <typename S>
    requires(measurements_of<S> <= 1)
  [[nodiscard]] Report<S> step(const S& sensor, Scalar y, Scalar dt,
                               const Control& control = kernel::zeros<Control>()) {
    return next<Report<S>>([&] { return Forward::step(sensor, y, dt, control); });
  }
  template <typename S>
    requires(measurements_of<S> <= 1)
  [[nodiscard]] Report<S> step(const S& sensor, Scalar y) {
    return next<Report<S>>([&] { return Forward::step(sensor, y); });
  }

  /// Filter::predict(); adds a node.
  [[nodiscard]] Status predict(Scalar dt, const Control& control = kernel::zeros<Control>()) {
    return next<Prediction>([&] { return Prediction{Forward::predict(dt, control)}; }).status;
  }
  [[nodiscard]] Status predict() {
    return next<Prediction>([&] { return Prediction{Forward::predict()}; }).status;
  }

  /// Filter::update(), of the last node.
  template <typename S>
  [[nodiscard]] Report<S> update(const S& sensor, const Measurement<S>& y) {
    Forward::rule().map = node(last_).map;
    const Report<S> report = Forward::update(sensor, y);
    if (usable(report.status)) keep_as(last_);
    return report;
  }
  template <typename S>
    requires(measurements_of<S> <= 1)
  [[nodiscard]] Report<S> update(const S& sensor, Scalar y) {
    return update(sensor, kernel::filled<Measurement<S>>(y));
  }

  /// Smooths all nodes with all measurements so far; more may follow, and another smooth(). covariance_lost:
  /// at some nodes no digit of P_s is left, and these keep the filter's estimate.
  [[nodiscard]] Status smooth() {
    if (status() != Status::ok) return status();
    Status answer = Status::ok;
    State costate = kernel::zeros<State>();
    Covariance costate_matrix = kernel::zeros<Covariance>();
    for (int k = last_; k > 0; --k) {
      node(k).map.apply(costate, costate_matrix);
      if (!node(k - 1).smooth(costate, costate_matrix)) answer = Status::covariance_lost;
    }
    return answer;
  }

  /// Number of nodes: the start, and one for each step() and predict().
  [[nodiscard]] int samples() const { return last_ + 1; }
  // Of a node, 0 ≤ k < samples():
  /// As of the last smooth(); at nodes that are newer, the filter's.
  [[nodiscard]] const State& x(int k) const { return node(k).smoothed.x; }
  [[nodiscard]] const Covariance& P(int k) const { return node(k).smoothed.P; }
  [[nodiscard]] double time(int k) const { return node(k).time; }  ///< s
  /// The filter's estimate after the last correction there.
  [[nodiscard]] const Estimate<Scalar, states>& filtered(int k) const { return node(k).filtered; }
  /// The filter at the last node.
  [[nodiscard]] const Forward& filter() const { return *this; }

 private:
  struct Node {
    detail::CostateMap<Scalar, states> map;  // to the node before
    Estimate<Scalar, states> filtered, smoothed;
    double time = 0;

    /// False where a variance is below the rounding of the filter's.
    bool smooth(const State& costate, const Covariance& costate_matrix) {
      constexpr Scalar slack = Scalar(4 * states) * std::numeric_limits<Scalar>::epsilon();
      smoothed.x = filtered.x - filtered.P * costate;
      Covariance PL;
      kernel::product(filtered.P, costate_matrix, PL);
      kernel::add_symmetric_product<-1>(filtered.P, PL, filtered.P, smoothed.P);
      bool valid = all_finite(smoothed.x) && all_finite(smoothed.P);
      for (int i = 0; i < states; ++i) valid &= smoothed.P(i, i) >= slack * filtered.P(i, i);
      if (valid) return true;
      smoothed = filtered;
      return false;
    }
  };
  struct Prediction {
    Status status = Status::ok;
  };

  template <typename Answer, typename Advance>
  Answer next(const Advance& advance) {
    Answer answer;
    if (status() == Status::ok && nodes_.size() == static_cast<std::size_t>(samples())) {
      answer.status = Status::memory_full;
      return answer;
    }
    answer = advance();
    if (usable(answer.status)) keep_as(last_ + 1);
    return answer;
  }

  [[nodiscard]] Node& node(int k) { return nodes_[static_cast<std::size_t>(k)]; }
  [[nodiscard]] const Node& node(int k) const { return nodes_[static_cast<std::size_t>(k)]; }
  /// Node k is where the filter stands.
  void keep_as(int k) {
    node(k).map = Forward::rule().map;
    node(k).filtered = node(k).smoothed = Forward::estimate();
    node(k).time = Forward::time();
    last_ = k;
  }

  std::vector<Node> nodes_;
  int last_ = 0;
};

}  // namespace jml
