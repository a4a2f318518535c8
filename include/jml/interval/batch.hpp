// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The whole-interval joint maximum likelihood estimator: the trajectory of least J (Rusnak 2015, eq. (5))
/// given all measurements of a flight.
#pragma once

#include <jml/interval/minimise.hpp>
#include <jml/interval/recording.hpp>
#include <jml/interval/start.hpp>

namespace jml {

/// Records a flight with the verbs of Filter, then finds the whole trajectory at once.
///
///     jml::Batch batch{VanDerPol{}, jml::sensors<SaturatingPosition>, estimate, {.steps = 1000}};
///     for (double y : flight) (void)batch.step(SaturatingPosition{}, y);
///     const auto report = batch.solve();  // batch.x(k), batch.w(k), batch.covariance(k)
///
/// List: jml::sensors<…>, the types of all sensors. Node 0 is the time of the prior; each step() or predict()
/// adds one. P_0 and G Q Gᵀ may be singular. The heap is used by the constructor only; a verb that finds no
/// room answers memory_full. State-dependent G, Q and R are frozen at the trajectory, until it agrees with
/// them; J has no log-determinant term.
template <typename D, typename List, typename Scalar = double>
class Batch;

template <typename D, typename... S, typename Scalar_>
class Batch<D, Sensors<S...>, Scalar_> {
  using Traits = DynamicsTraits<D>;
  using List = Sensors<S...>;
  using Store = detail::Recording<D, List, Scalar_>;
  static_assert(detail::require_discrete<D>());

 public:
  using Scalar = Scalar_;
  static constexpr int states = Traits::states, disturbances = Traits::disturbances;
  using State = Vector<Scalar, states>;
  using Covariance = Matrix<Scalar, states, states>;
  using Control = Argument<Scalar, Traits::controls>;
  using At = StepContext<Scalar, Traits::controls>;
  using Report = BatchReport<Scalar>;

  /// `prior`: x̂_0 and P_0, symmetric positive semidefinite. `time`: s, of x_0. A bad one does not throw:
  /// status() names it, and every verb and solve() answer it.
  Batch(D dynamics, List, const Estimate<Scalar, states>& prior, Capacity capacity, double time = 0)
      : store_(std::move(dynamics), prior, time, capacity) {}

  /// Predict over dt, then measure y at its end; as Filter::step.
  template <typename Sensor>
  [[nodiscard]] Status step(const Sensor& sensor, const Argument<Scalar, measurements_of<Sensor>>& y,
                            Scalar dt, const Control& control = kernel::zeros<Control>()) {
    if (const Status status = store_.check(sensor, y); status != Status::ok) return status;
    if (const Status status = predict(dt, control); status != Status::ok) return status;
    return store_.append(sensor, y);
  }
  template <typename Sensor>
  [[nodiscard]] Status step(const Sensor& sensor, const Argument<Scalar, measurements_of<Sensor>>& y) {
    static_assert(!Store::reads_contexts,
                  "jml: this model reads time, dt or control: pass dt, step(sensor, y, dt)");
    return step(sensor, y, Scalar(0));
  }
  template <typename Sensor>
    requires(measurements_of<Sensor> == 1)
  [[nodiscard]] Status step(const Sensor& sensor, Scalar y, Scalar dt,
                            const Control& control = kernel::zeros<Control>()) {
    return step(sensor, Vector<Scalar, 1>(y), dt, control);
  }
  template <typename Sensor>
    requires(measurements_of<Sensor> == 1)
  [[nodiscard]] Status step(const Sensor& sensor, Scalar y) {
    return step(sensor, Vector<Scalar, 1>(y));
  }

  /// A step without a measurement.
  [[nodiscard]] Status predict(Scalar dt, const Control& control = kernel::zeros<Control>()) {
    return store_.append({store_.time_of(store_.last()), dt, control});
  }
  [[nodiscard]] Status predict() {
    static_assert(!reads_context<Scalar, D>(),
                  "jml: this model reads time, dt or control: pass dt, predict(dt)");
    return predict(Scalar(0));
  }

  /// A measurement of the present node; before any step, of x_0.
  template <typename Sensor>
  [[nodiscard]] Status update(const Sensor& sensor, const Argument<Scalar, measurements_of<Sensor>>& y) {
    if (const Status status = store_.check(sensor, y); status != Status::ok) return status;
    return store_.append(sensor, y);
  }
  template <typename Sensor>
    requires(measurements_of<Sensor> == 1)
  [[nodiscard]] Status update(const Sensor& sensor, Scalar y) {
    return update(sensor, Vector<Scalar, 1>(y));
  }

  /// Where to begin at the present node, for Start::given.
  void guess(const Argument<Scalar, states>& x) { store_.node(store_.last()).x[store_.now()] = x; }

  BatchOptions options;
  Start start = Start::filter;

  /// Minimises J. May be called again after more measurements. not_converged: the states are the best
  /// trajectory found; another refusal: they are no answer.
  Report solve() {
    Report report;
    report.status = status();
    if (report.status == Status::ok && !options.valid()) report.status = Status::invalid_option;
    if (report.status != Status::ok) return report;
    if (start == Start::filter) detail::start_at_filter(store_, store_.estimate());
    if (start == Start::prediction) detail::start_at_prediction(store_, store_.estimate());
    return detail::minimise(store_, options, false, false);
  }

  [[nodiscard]] Status status() const { return store_.status(); }  ///< of the prior and constants
  [[nodiscard]] int steps() const { return store_.last(); }        ///< nodes 0 … steps()
  [[nodiscard]] const State& x(int node) const { return store_.node(node).x[store_.now()]; }
  [[nodiscard]] double time(int node) const { return store_.time_of(node); }  ///< s
  /// The disturbance between `node` and the next, in the units of the model, without its mean w̄.
  [[nodiscard]] Vector<Scalar, disturbances> w(int node) const {
    auto L = kernel::zeros<Matrix<Scalar, disturbances, disturbances>>();
    (void)detail::NoiseRoot<Scalar, D>::root_of_covariance(store_.dynamics(), x(node),
                                                           store_.node(node + 1).at(), L);
    return L * store_.node(node + 1).b[store_.now()];
  }

  /// P of every node in order, use(node, P): the inverse curvature of J (Gauss-Newton) at the answer, which
  /// is the smoother's covariance to first order (Laplace). False where there is none.
  template <typename Use>
  bool covariances(const Use& use) {
    return covariances(steps(), use);
  }
  /// The same of one node; NaN where there is none. Its time grows with the number of steps.
  [[nodiscard]] Covariance covariance(int node) {
    Covariance out = kernel::filled<Covariance>(std::numeric_limits<Scalar>::quiet_NaN());
    (void)covariances(node, [&](int j, const Covariance& P) {
      if (j == node) out = P;
    });
    return out;
  }

  /// For other engines on the same problem (interval/ceres.hpp, interval/excess_cost.hpp).
  [[nodiscard]] Store& recording() { return store_; }

 private:
  template <typename Use>
  bool covariances(int last, const Use& use) {
    detail::Sweep<Store> sweep(store_, options.loss);
    detail::PassSums<Scalar> sums;
    if (!sweep.template backward<detail::Curvature::none, false, true>(Scalar(0), sums)) return false;
    sweep.covariances(last, use);
    return true;
  }

  Store store_;
};

template <typename D, typename... S, typename Scalar, int n>
Batch(D, Sensors<S...>, const Estimate<Scalar, n>&, Capacity, double = 0) -> Batch<D, Sensors<S...>, Scalar>;

}  // namespace jml
