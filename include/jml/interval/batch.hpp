// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The whole-interval joint maximum likelihood estimator: the trajectory of least J (Rusnak 2015, eq. (5))
/// given all measurements of a flight.
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <jml/filter/filter.hpp>
#include <jml/interval/fineness.hpp>
#include <jml/interval/local_record.hpp>
#include <jml/interval/minimise.hpp>
#include <jml/interval/recording.hpp>
#include <jml/interval/start.hpp>

namespace jml {

/// The method of Batch: each step adds a node, each measurement a record, and nothing is computed.
template <typename List>
struct Recorder {
  /// What filter/method.hpp asks of a method.
  /// @{
  static constexpr bool rolls_back = true;
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;
  template <typename Scalar, typename D>
  using Belief = detail::Recording<D, List, Scalar>;
  /// No innovation, no gate: status alone.
  template <typename Scalar, typename D, typename S>
  using Report = jml::Report<Scalar, measurements_of<S>>;

  using SensorList = List;
  template <typename Sensors>
  using With = Recorder<Sensors>;

  Capacity capacity;  ///< nodes, made room for at the start

  /// Room for that many steps.
  Recorder(const Capacity& room) : capacity(room) {}  // NOLINT(google-explicit-constructor): the same thing
  template <typename Other>
  explicit Recorder(const Recorder<Other>& other) : capacity(other.capacity) {}

  template <typename D>
  static consteval bool accepts() {
    static_assert(detail::is_list_of_sensors<List>,
                  "jml: a batch makes room for measurements: name the types of the sensors, Batch{dynamics, "
                  "jml::sensors<…>, estimate, {.steps = 1000}}");
    return detail::require_discrete<D>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return detail::require_sensor<S>() && detail::require_listed<List, S>();
  }

  template <typename Belief, typename Given>
  [[nodiscard]] Status start(Belief& recording, const Given& prior, double time) const {
    static_assert(Given::states == states_of<typename Belief::Dynamics>,
                  "jml: the estimate has not as many states as the dynamics");
    return recording.start(prior, time, capacity);
  }
  template <typename Belief, typename At>
  [[nodiscard]] Status predict(Belief& recording, const At& at) const {
    return recording.append(at);
  }
  template <typename Belief, typename Sample, typename Report>
  void correct(Belief& recording, const Sample& sample, Report& report) const {
    with_listed(sample.sensor,
                [&](const auto& sensor) { report.status = recording.append(sensor, sample.y, sample.at); });
  }
  template <typename Belief, typename Sample, typename Report>
  void step(Belief& recording, const Sample& sample, Report& report) const {
    with_listed(sample.sensor, [&](const auto& sensor) {
      const auto end = end_of(sample.at);
      report.status = recording.check(sensor, sample.y, end);
      if (report.status == Status::ok) report.status = recording.append(sample.at);
      if (report.status == Status::ok) report.status = recording.append(sensor, sample.y, end);
    });
  }
  /// @}

 private:
  template <typename S, typename Use>
  static void with_listed(const S& sensor, const Use& use) {
    if constexpr (detail::listed_as_part<List, S>)
      use(part(sensor, first(64)));
    else
      use(sensor);
  }
};

/// Records a flight with the verbs of Filter, then finds the whole trajectory at once.
///
///     jml::Batch batch{VanDerPol{}, jml::sensors<SaturatingPosition>, estimate, {.steps = 1000}};
///     for (double y : flight) (void)batch.step(SaturatingPosition{}, y);
///     const auto report = batch.solve();  // batch.x(k), batch.w(k), batch.P(k)
///
/// List: `jml::sensors<…>`, the types of all sensors. Node 0 is the time of the prior; each step() or
/// predict() adds one; update() is of the present node, before any step of x_0. P_0 and G Q Gᵀ may be
/// singular. The heap is used by the constructor only; a verb that finds no room answers memory_full.
/// State-dependent G, Q and R are frozen at the trajectory, until it agrees with them; J has no
/// log-determinant term.
template <typename D, typename List, typename Scalar_ = double>
class Batch : public Filter<Recorder<List>, D, Scalar_> {
  using Base = Filter<Recorder<List>, D, Scalar_>;
  using Belief = typename Base::Belief;
  static constexpr bool in_charts = requires(Belief& b) { b.inside(); };

 public:
  using Scalar = Scalar_;                                               ///< of the estimate
  static constexpr int states = DynamicsTraits<D>::states;              ///< numbers of x
  static constexpr int degrees = degrees_of<D>;                         ///< of freedom
  static constexpr int disturbances = DynamicsTraits<D>::disturbances;  ///< entries of w
  /// As of Filter.
  /// @{
  using typename Base::Covariance;
  using typename Base::State;
  /// @}

  /// `prior`: x̂_0 and P_0, symmetric positive semidefinite. `time`: s, of x_0. A bad one does not throw:
  /// status() names it, and every verb and solve() answer it.
  Batch(D dynamics, List, const Estimate<Scalar, states, degrees>& prior, Capacity capacity, double time = 0)
      : Base(Recorder<List>{capacity}, std::move(dynamics), prior, time) {}
  /// Of another size: refused in words.
  template <int n, int m>
    requires(n != states || m != degrees)
  Batch(D dynamics, List, const Estimate<Scalar, n, m>& prior, Capacity capacity, double time = 0)
      : Base(Recorder<List>{capacity}, std::move(dynamics), prior, time) {}

  /// Where to begin at the present node, for Start::given: a state.
  void guess(const Argument<Scalar, states>& x) { detail::set_point(store(), store().last(), x); }

  BatchOptions options;         ///< as of solve()
  Start start = Start::filter;  ///< where solve() begins

  /// Minimises J. May be called again after more measurements. not_converged: the states are the best
  /// trajectory found; another refusal: they are no answer.
  BatchReport<Scalar> solve() {
    return solve_by([this] { return minimise(); });
  }

  [[nodiscard]] int steps() const { return store().last(); }  ///< nodes 0 … steps()
  using Base::time;
  using Base::x;
  /// The state at a node, 0 … steps(): of the trajectory of least J after solve().
  [[nodiscard]] decltype(auto) x(int node) const {
    if constexpr (in_charts)
      return detail::point_of(store(), node);
    else
      return coordinates(node);
  }
  [[nodiscard]] double time(int node) const { return store().time_of(node); }  ///< s
  /// The disturbance between `node` and the next, in the units of the model, without its mean w̄.
  [[nodiscard]] Vector<Scalar, disturbances> w(int node) const {
    auto L = kernel::zeros<Matrix<Scalar, disturbances, disturbances>>();
    (void)detail::NoiseRoot<Scalar, typename Store::Dynamics>::root_of_covariance(
        store().dynamics(), coordinates(node), store().node(node + 1).at(), L);
    return L * store().node(node + 1).b[store().now()];
  }

  /// P of every node in order, use(node, P): the inverse curvature of J (Gauss-Newton) at the answer, which
  /// is the smoother's covariance to first order (Laplace). False where there is none.
  template <typename Use>
  bool covariances(const Use& use) {
    return covariances(steps(), use);
  }
  /// The same of one node; NaN where there is none. Its time grows with the number of steps.
  [[nodiscard]] Covariance P(int node) {
    Covariance out = kernel::filled<Covariance>(std::numeric_limits<Scalar>::quiet_NaN());
    (void)covariances(node, [&](int j, const Covariance& P) {
      if (j == node) out = P;
    });
    return out;
  }

  /// For other engines on the same problem (interval/ceres.hpp, interval/excess_cost.hpp).
  [[nodiscard]] auto& recording() { return store(); }

 protected:
  /// solve(), where minimise() lowers J from the nominal. `clip`: of detail::start_at().
  template <typename Minimise, typename Clip = detail::Nothing>
  BatchReport<Scalar> solve_by(const Minimise& minimise, const Clip& clip = {}) {
    BatchReport<Scalar> report;
    report.status = this->status();
    if (report.status == Status::ok && !options.valid()) report.status = Status::invalid_option;
    if (report.status != Status::ok) return report;
    const auto solve_at = [&](int which) {
      detail::start_at(store(), which, clip);
      return minimise();
    };
    if (start == Start::several)
      report = solve_from_several(solve_at);
    else
      report = start == Start::given ? minimise() : solve_at(start == Start::filter ? 0 : 1);
    // An ε of a start known to more digits than Scalar has is no small part of a deviation.
    if (report.status == Status::accepted_at_rounding && report.step > detail::plain_error<Scalar> / 10 &&
        detail::AllDigits<typename Store::Dynamics, Scalar>::known(store().start()))
      report.status = Status::accuracy_not_met;
    if (detail::any_linear<typename Store::List> || report.status == Status::sensor_not_finite) {
      for (int j = 0; j <= steps(); ++j) {
        const auto at = end_of(store().node(j).at());
        store().visit(j, [&](const auto& record) {
          if (report.status == Status::sensor_not_finite && report.node < 0 &&
              !all_finite(measurement(record.sensor, coordinates(j), at)))
            report.node = j;
          if (usable(report.status) && detail::too_fine(record.sensor, coordinates(j), record.y, at))
            report.status = Status::accuracy_not_met;
        });
      }
    }
    return report;
  }

 private:
  /// Start::filter and Start::prediction are the first two of Start::several.
  template <typename SolveAt>
  [[nodiscard]] BatchReport<Scalar> solve_from_several(const SolveAt& solve_at) {
    std::array<BatchReport<Scalar>, 2 + 2 * degrees> found;
    int best = 0, iterations = 0;
    for (int i = 0; i < 2 + 2 * degrees; ++i) {
      auto& report = found[static_cast<std::size_t>(i)];
      const auto& least = found[static_cast<std::size_t>(best)];
      report = solve_at(i);
      iterations += report.iterations;
      if (usable(report.status) && !(usable(least.status) && least.cost <= report.cost)) best = i;
    }
    BatchReport<Scalar> report = solve_at(best);
    report.iterations += iterations;
    report.agreed = 0;
    const Scalar slack = Scalar(1e-6) * (Scalar(1) + std::abs(report.cost));
    for (const auto& other : found)
      report.agreed += usable(other.status) && other.cost <= report.cost + slack;
    return report;
  }

  template <typename Use>
  bool covariances(int last, const Use& use) {
    if (this->status() != Status::ok) return false;
    if constexpr (in_charts)
      return detail::interval_covariances(store(), options.loss, last, [&](int j, const Covariance& P) {
        use(j, Covariance(detail::in_tangent(store(), j, P)));
      });
    else
      return detail::interval_covariances(store(), options.loss, last, use);
  }
  /// Minimises J from the nominal; in charts about it, as often as it moved far.
  [[nodiscard]] BatchReport<Scalar> minimise() {
    auto report = detail::minimise(store(), options, false, false);
    while (usable(report.status)) {
      const bool far = detail::place_charts(store()) > Scalar(1);
      if (!far || report.iterations >= options.max_iterations) break;
      BatchOptions left = options;
      left.max_iterations -= report.iterations;
      const int before = report.iterations;
      report = detail::minimise(store(), left, false, false);
      report.iterations += before;
    }
    return report;
  }

  [[nodiscard]] const auto& coordinates(int node) const { return store().node(node).x[store().now()]; }
  static auto& inside(auto& belief) {
    if constexpr (in_charts)
      return belief.inside();
    else
      return belief;
  }
  auto& store() { return inside(this->mutable_belief()); }
  const auto& store() const { return inside(this->belief()); }
  using Store = std::remove_cvref_t<decltype(inside(std::declval<Belief&>()))>;
};

/// Types from the arguments.
/// @{
template <typename D, typename Scalar, int n, int m>  // refused in words
Batch(D, const Estimate<Scalar, n, m>&, Capacity, double = 0) -> Batch<D, void, Scalar>;
template <typename D, typename... S, typename Scalar, int n, int m>
Batch(D, Sensors<S...>, const Estimate<Scalar, n, m>&, Capacity, double = 0)
    -> Batch<D, Sensors<S...>, Scalar>;
/// @}

}  // namespace jml
#include <jml/warnings_end.hpp>
