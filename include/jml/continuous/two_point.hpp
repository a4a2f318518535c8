// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The continuous least-squares smoother: the trajectory of least J(t) (Rusnak 2018, eq. (8)) given y over an
/// interval, which is the solution of the two-point boundary value problem (12):
///   ẋ = f(x) + G Q Gᵀ λ,  x(t_0) = x̄ + P_0 λ(t_0);   λ̇ = -f_xᵀ λ - m_xᵀ R⁻¹ (y - m(x)),  λ(t) = 0.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/signal.hpp>
#include <jml/continuous/two_point_answers.hpp>
#include <jml/interval/excess_cost.hpp>

namespace jml {

/// Records y(t), then finds the whole trajectory at once.
///
///     jml::TwoPoint smoother{Oscillator{}, sensor, jml::Estimate{x0, P0}, {.steps = 1000}};
///     for (int k = 0; k < 1000; ++k) (void)smoother.step(jml::Line{y[k], y[k + 1]}, dt);
///     const auto report = smoother.solve();  // smoother.x(k), smoother.costate(k), report.cost
///
/// Each step is an interval: y held, in a straight line, or any function of time that is smooth inside. By
/// collocation of order 6 in dt (continuous/collocation.hpp), x, λ and J alike: halve dt, and compare, where
/// dt times the rates of the model and of the Kalman-Bucy gain is not small. The minimisation is that of
/// Batch: a minimum of J, not just a root of (12). G, Q and R are constants; P_0 and G Q Gᵀ may be singular.
/// The heap is used by the constructor only.
template <typename D, typename S, typename Scalar_ = double>
class TwoPoint {
  static_assert(detail::require_continuous<D>() && detail::require_flat<D>() && detail::require_sensor<S>());

 public:
  /// Sizes and types of the model; Record: insides.
  /// @{
  using Scalar = Scalar_;
  static constexpr int states = DynamicsTraits<D>::states, disturbances = DynamicsTraits<D>::disturbances,
                       controls = DynamicsTraits<D>::controls, measurements = SensorTraits<S>::measurements;
  using State = Vector<Scalar, states>;
  using Covariance = Matrix<Scalar, states, states>;
  using Control = Vector<Scalar, controls>;
  using Record = detail::TwoPointRecord<D, S, Scalar>;
  using At = typename Record::At;
  /// @}
  static_assert(detail::measures_always<S, State, At>(),
                "jml: the two-point smoother is of a sensor with a noise_spectral_density(); one that gives "
                "samples goes with jml::discretize into jml::Batch");
  static_assert(disturbances > 0, "jml: without disturbances J is a function of x_0 alone: take jml::Batch");
  static_assert(ProcessNoise<Scalar, D>::constant &&
                    detail::ConstantHook<detail::hooks::NoiseSpectralDensity, S, State, At>,
                "jml: the two-point smoother takes G, Q and R that are constants, functions of ()");
  static_assert(!detail::ReadsState<detail::hooks::DisturbanceMean, D, State>,
                "jml: the two-point smoother takes a disturbance_mean() that does not read the state");

  /// `prior`: x̄ and P_0, symmetric positive semidefinite. capacity.steps: intervals. A bad argument does not
  /// throw: status() names it, and every verb and solve() answer it.
  TwoPoint(D dynamics, S sensor, const Estimate<Scalar, states>& prior, Capacity capacity, double time = 0)
      : record_(std::move(dynamics), std::move(sensor), prior, capacity.steps, time) {}

  BatchOptions options;         ///< of Batch; a loss is refused
  Start start = Start::filter;  ///< filter, prediction or given

  /// y over the next dt, s: a Vector or a number (held), a Line, or a function of time.
  template <typename Y>
  Status step(const Y& y, Scalar dt, const Argument<Scalar, controls>& control = kernel::zeros<Control>()) {
    const At at{time(), dt, control};
    Status status = Status::invalid_measurement;
    detail::with_signal<measurements, Scalar>(
        record_.sensor(), y, at.time, static_cast<double>(dt),
        [&](const auto& signal) {
          std::array<Vector<Scalar, measurements>, 3> samples;
          for (int i = 0; i < 3; ++i) samples[std::size_t(i)] = signal(detail::stage_of(at, i).time);
          status = record_.append(at, &samples);
        },
        [] {});
    return status;
  }
  /// Nothing is measured over the next dt.
  Status predict(Scalar dt, const Argument<Scalar, controls>& control = kernel::zeros<Control>()) {
    return record_.append(At{time(), dt, control}, nullptr);
  }
  /// Where to begin at the present node, for Start::given.
  void guess(const Argument<Scalar, states>& x) { record_.set_state(steps(), x); }

  /// Minimises J. May be called again after more steps. not_converged: the states are the best trajectory
  /// found; another refusal: they are no answer.
  BatchReport<Scalar> solve() {
    BatchReport<Scalar> report;
    report.status = status();
    if (report.status == Status::ok &&
        (!options.valid() || options.loss.kind != Loss::Kind::none || start == Start::several))
      report.status = Status::invalid_option;
    if (report.status != Status::ok) return report;
    begin();
    report = detail::minimise(record_, options, false, false);
    if (usable(report.status)) report.gradient = detail::Sweep<Record>(record_, Loss{}).gradient();
    return report;
  }

  /// Ok, or what is wrong with the arguments of the constructor.
  [[nodiscard]] Status status() const { return record_.status(); }
  [[nodiscard]] int steps() const { return record_.last(); }                   ///< nodes 0 … steps()
  [[nodiscard]] double time() const { return record_.time_of(steps()); }       ///< s, of the last node
  [[nodiscard]] double time(int node) const { return record_.time_of(node); }  ///< s
  [[nodiscard]] const State& x() const { return x(steps()); }                  ///< of the last node
  /// 0 … steps().
  [[nodiscard]] const State& x(int node) const { return record_.node(node).x[std::size_t(record_.now())]; }
  /// λ of (12); zero at the last node.
  [[nodiscard]] const State& costate(int node) const { return record_.node(node).costate; }
  /// Q Gᵀ λ at the node, without its mean w̄.
  [[nodiscard]] Vector<Scalar, disturbances> w(int node) const {
    const auto at = record_.node(node).at;
    return disturbance_spectral_density(record_.dynamics(), x(node), at) *
           (kernel::transposed(disturbance_input(record_.dynamics(), x(node), at)) * costate(node));
  }
  /// P of every node in order, use(node, P): the inverse curvature of J (Gauss-Newton) at the answer, on a
  /// linear system the Kalman-Bucy smoother's. False where there is none.
  template <typename Use>
  bool covariances(const Use& use) {
    if (status() != Status::ok || !detail::interval_covariances(record_)) return false;
    for (int j = 0; j <= steps(); ++j) use(j, record_.node(j).P);
    return true;
  }
  /// The same of one node; NaN where there is none. Its time grows with the number of steps.
  [[nodiscard]] Covariance P(int node) {
    auto out = kernel::filled<Covariance>(std::numeric_limits<Scalar>::quiet_NaN());
    if (status() == Status::ok && detail::interval_covariances(record_)) out = record_.node(node).P;
    return out;
  }

  /// For other solvers of the same problem.
  /// @{
  [[nodiscard]] Record& recording() { return record_; }
  [[nodiscard]] const Record& recording() const { return record_; }
  /// @}
  /// Sets the states where solve() begins; for other solvers of the same problem.
  void begin() {
    if (start == Start::given) return;
    const auto now = std::size_t(record_.now());
    const auto one = record_.step();
    constexpr int n = states, m = Record::m, p = measurements;
    State x = record_.start().x;
    Covariance P = record_.start().P();
    record_.set_state(0, x);
    for (int j = 1; j <= steps(); ++j) {
      auto& node = record_.node(j);
      node.stages[now] = {x, x, x};
      State end;
      detail::CollocatedInterval<Scalar, n, m> interval;
      if (one.solve(x, kernel::zeros<Vector<Scalar, m>>(), node.at, node.stages[now], end) &&
          one.linearise(node.stages[now], node.at, interval)) {
        x = end;
        if (start == Start::filter && node.measured) {  // an EKF of samples at the last stages, R/h
          const auto at = detail::stage_of(node.at, 2);
          P = interval.A * P * kernel::transposed(interval.A) + interval.B * kernel::transposed(interval.B);
          const State& seen = node.stages[now][2];
          const Matrix<Scalar, p, n> H = measurement_jacobian(record_.sensor(), seen, at);
          const Matrix<Scalar, p, n> HP = H * P;
          const Matrix<Scalar, p, p> R =
              noise_spectral_density(record_.sensor(), x, at) / node.at.dt + HP * kernel::transposed(H);
          kernel::SymmetricFactor<Scalar, p> factor;
          const Vector<Scalar, p> r =
              measurement_residual(record_.sensor(), node.y[2], measurement(record_.sensor(), seen, at));
          if (factor.factor(kernel::symmetric_part(R)) && all_finite(r) && all_finite(P)) {
            x += kernel::transposed(HP) * factor.solve(r);
            for (int c = 0; c < n; ++c)
              kernel::set_column(interval.A, c,
                                 State(kernel::transposed(HP) * factor.solve(kernel::column_of(HP, c))));
            P = kernel::symmetric_part(Covariance(P - interval.A));
          }
        }
      }
      record_.set_state(j, x);
    }
  }

 private:
  Record record_;
};

/// The excess of `x`, an estimate of the last state of `smoother`, in the continuous criterion (8):
/// min{J : x(t) = x̂} - min J. As of a Batch.
template <typename D, typename S, typename Scalar, int n>
[[nodiscard]] ExcessCost<Scalar> excess_cost(TwoPoint<D, S, Scalar> smoother, const Vector<Scalar, n>& x) {
  return detail::excess_cost_of(std::move(smoother), x);
}

}  // namespace jml
#include <jml/warnings_end.hpp>
