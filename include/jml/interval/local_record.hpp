// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An interval of the criterion J over states in a space: each node in its own chart
/// (model/local_context.hpp).
///
/// The chart of node 0 is that of the prior, and stays there: the prior's cost is ½ |x_0 ⊟ x̂_0|² in units of
/// P_0. Those of the others stand wherever it suits the iteration; J does not depend on them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/local_method.hpp>
#include <jml/interval/nodes.hpp>

namespace jml::detail {

/// The nodes of `store` are in charts.
template <typename Store>
concept InCharts = requires(Store& store) { store.node(0).context.from; };

/// The state of node j.
template <typename Store>
[[nodiscard]] auto point_of(const Store& store, int j) {
  using D = typename Store::Dynamics;
  return D::On::plus(store.node(j).context.to, store.node(j).x[static_cast<std::size_t>(store.now())]);
}
/// Node j goes to a state.
template <typename Store, typename State>
void set_point(Store& store, int j, const State& x) {
  auto& z = store.node(j).x[static_cast<std::size_t>(store.now())];
  if constexpr (InCharts<Store>) {
    if (j > 0) {
      store.node(j).context.to = x;
      kernel::set_zero(z);
    } else {
      z = Store::Dynamics::On::minus(x, store.node(j).context.to);
    }
  } else {
    z = x;
  }
}
/// P of node j in the tangent at its state, of a P in its chart.
template <typename Store, typename Scalar, int n>
[[nodiscard]] Matrix<Scalar, n, n> in_tangent(const Store& store, int j, const Matrix<Scalar, n, n>& P) {
  using Space = typename Store::Dynamics::On;
  const auto& node = store.node(j);
  const Vector<Scalar, n> z = node.x[static_cast<std::size_t>(store.now())];
  const Matrix<Scalar, n, n> J = Space::chart_slope(node.context.to, z);
  return kernel::symmetric_part(Matrix<Scalar, n, n>(J * P * kernel::transposed(J)));
}

/// A chart at the prediction from the state of the node before node j, and node j there. Nothing in ℝⁿ.
template <typename Store>
void place_chart(Store& store, int j) {
  if constexpr (InCharts<Store>) {
    if (j == 0) return;
    auto& node = store.node(j);
    auto& context = node.context;
    const auto& model = store.dynamics().model;
    const typename std::remove_cvref_t<decltype(context)>::Plain& plain = context;
    context.from = store.node(j - 1).context.to;
    const auto before = point_of(store, j - 1);
    if constexpr (Store::Dynamics::disturbances > 0) context.w = mean_disturbance(model, before, plain);
    context.to = moved(model, before, context.w, plain);
    kernel::set_zero(node.x[static_cast<std::size_t>(store.now())]);
    kernel::set_zero(
        node.b[static_cast<std::size_t>(store.now())]);  // or w would begin where an answer before ended
  }
}
/// Every chart but that of node 0 at the state of its node, with the noise's slope in it. How far the
/// farthest was off, in its tangent.
template <typename Store>
auto place_charts(Store& store) {
  typename Store::Number most = 0;
  if constexpr (InCharts<Store>) {
    for (int j = 1; j <= store.last(); ++j) {
      auto& node = store.node(j);
      auto& z = node.x[static_cast<std::size_t>(store.now())];
      node.context.from = store.node(j - 1).context.to;
      for (int i = 0; i < int(z.size()); ++i) most = std::max(most, std::abs(z(i)));
      node.context.to = point_of(store, j);
      kernel::set_zero(z);
      if constexpr (Store::Dynamics::disturbances > 0) {
        const auto& before = store.node(j - 1).x[static_cast<std::size_t>(store.now())];
        static_cast<void>(node.noise.form(store.dynamics(), before, node.context));
      }
    }
  }
  return most;
}

/// The w that the step to node j is linearised about becomes that of the nominal. How far it moved, in
/// standard deviations.
template <typename Store>
auto move_noise_point(Store& store, int j) {
  using D = typename Store::Dynamics;
  using Scalar = typename Store::Number;
  constexpr int q = D::disturbances;
  Scalar most = 0;
  if constexpr (q > 0) {
    auto& node = store.node(j);
    auto& context = node.context;
    const auto now = static_cast<std::size_t>(store.now());
    const typename std::remove_cvref_t<decltype(context)>::Plain& plain = context;
    Matrix<Scalar, q, q> L = kernel::zeros<Matrix<Scalar, q, q>>();
    static_cast<void>(
        NoiseRoot<Scalar, D>::root_of_covariance(store.dynamics(), store.node(j - 1).x[now], context, L));
    const Vector<Scalar, q> w =
        mean_disturbance(store.dynamics().model, point_of(store, j - 1), plain) + L * node.b[now];
    for (int i = 0; i < q; ++i) {
      Scalar variance = 0;
      for (int k = 0; k < q; ++k) variance += L(i, k) * L(i, k);
      if (variance > Scalar(0)) most = std::max(most, std::abs(w(i) - context.w(i)) / std::sqrt(variance));
    }
    context.w = w;
  }
  return most;
}

/// A step of D may become two, as its dynamics and its noise read dt.
template <typename Scalar, typename D>
inline constexpr bool splits =
    reads_context<Scalar, D>() && (NoiseRoot<Scalar, D>::q == 0 || !NoiseRoot<Scalar, D>::constant);
template <typename Scalar, typename D, bool refrozen>
inline constexpr bool splits<Scalar, LocalDynamics<D, refrozen>> = [] {
  using X = Vector<Scalar, states_of<D>>;
  using At = Context<Scalar, D>;
  constexpr bool constant =
      ConstantHook<hooks::DisturbanceCovariance, D, X, At> &&
      (ConstantHook<hooks::DisturbanceInput, D, X, At> || !has_disturbance_input<D, X, At>()) &&
      !HasHook<hooks::DisturbanceMean, D, X, At>;
  return reads_context<Scalar, D>() && (DynamicsTraits<D>::disturbances == 0 || !constant);
}();

/// The two steps that a step in charts becomes where a node is put into it, from coordinates z of its start.
template <typename D, typename X, typename At>
void split_step(const D&, const X&, At&, At&) {}
template <typename D, bool refrozen, typename X, typename Scalar>
void split_step(const LocalDynamics<D, refrozen>& d, const X& z, LocalContext<Scalar, D>& first,
                LocalContext<Scalar, D>& second) {
  const typename LocalContext<Scalar, D>::Plain& plain = first;
  const auto x = SpaceOf<D>::plus(first.from, z);
  if constexpr (DynamicsTraits<D>::disturbances > 0) first.w = mean_disturbance(d.model, x, plain);
  first.to = second.from = moved(d.model, x, first.w, plain);
}

/// A method with a memory of nodes on states in a space.
template <typename Inner, typename D>
struct LocalRecord : Inner {
  template <typename Scalar>
  using List = typename LocalList<D, Scalar, typename Inner::SensorList>::type;
  template <typename Scalar>
  using Method = typename Inner::template With<List<Scalar>>;
  using Local = LocalDynamics<D, true>;
  template <typename Scalar>
  using Store = typename Method<Scalar>::template Belief<Scalar, Local>;

  template <typename Scalar, typename>
  struct BeliefType : Store<Scalar> {
    using Inside = Store<Scalar>;
    using State = Vector<Scalar, states_of<D>>;
    using Covariance = Matrix<Scalar, Local::states, Local::states>;

    explicit BeliefType(const D& of) : Inside(Local{of}) {}

    [[nodiscard]] Inside& inside() { return *this; }
    [[nodiscard]] const Inside& inside() const { return *this; }
    [[nodiscard]] const D& dynamics() const { return inside().dynamics().model; }
    [[nodiscard]] State x(int age = 0) const { return point_of(inside(), inside().last() - age); }
    [[nodiscard]] Covariance P(int age = 0) const
      requires requires(const Inside& store) { store.P(0); }
    {
      return in_tangent(inside(), inside().last() - age, inside().P(age));
    }
    Status replace(const D& of) { return inside().replace(Local{of}); }
    void stand_at(const State& point) {
      auto& context = inside().node(0).context;
      context.from = context.to = point;
      kernel::set_zero(inside().node(0).x[static_cast<std::size_t>(inside().now())]);
    }
    /// Anew at `point`, with an estimate of the error in the tangent there, whose x is zero.
    template <typename Given>
    Status reset(const State& point, const Given& given, double time)
      requires requires(Inside& store) { store.reset(given, time); }
    {
      const Status status = inside().reset(given, time);
      if (status == Status::ok) stand_at(point);
      return status;
    }
  };
  template <typename Scalar, typename Of>
  using Belief = BeliefType<Scalar, Of>;
  template <typename Scalar, typename, typename S>
  using Report = typename ReportOf<Method<Scalar>, Scalar, Local, LocalSensorOf<D, Scalar, S>>::type;

  LocalRecord(const Inner& of) : Inner(of) {}  // NOLINT(google-explicit-constructor): the same thing

  template <typename Belief, typename Given>
  [[nodiscard]] Status start(Belief& belief, const Given& given, double time) const {
    using Scalar = typename Belief::Inside::Number;
    constexpr int n = Local::states;
    static_assert(int(decltype(given.x)::RowsAtCompileTime) == states_of<D>,
                  "jml: the estimate has not as many numbers as a state of the dynamics");
    const Vector<Scalar, n> zero = kernel::zeros<Vector<Scalar, n>>();
    Status status = Status::invalid_covariance;
    if constexpr (requires { given.U; }) {
      status =
          method<Scalar>().start(belief.inside(), FactoredEstimate<Scalar, n>(zero, given.U, given.D), time);
    } else {
      static_assert(int(decltype(given.P)::RowsAtCompileTime) == n,
                    "jml: P has the size of the degrees of freedom, not of the numbers of a state");
      status = method<Scalar>().start(belief.inside(), Estimate<Scalar, n>(zero, given.P), time);
    }
    const Vector<Scalar, states_of<D>> x = SpaceOf<D>::plus(given.x, zero);
    belief.stand_at(x);
    return all_finite(given.x) && SpaceOf<D>::contains(x) ? status : Status::invalid_state;
  }
  template <typename Belief, typename At>
  [[nodiscard]] Status predict(Belief& belief, const At& at) const {
    using Scalar = typename Belief::Inside::Number;
    auto there = step_from<Scalar>(belief, at);
    if (const Status status = check_step<SpaceOf<D>>(there); status != Status::ok) return status;
    const Status status = method<Scalar>().predict(belief.inside(), there);
    if (usable(status)) arrive(belief);
    return status;
  }
  template <typename Belief, typename Sample, typename Report>
  void correct(Belief& belief, const Sample& sample, Report& report) const {
    using Scalar = typename Belief::Inside::Number;
    LocalContext<Scalar, D> here(sample.at);
    here.from = here.to = belief.inside().node(belief.inside().last()).context.to;
    method<Scalar>().correct(belief.inside(),
                             jml::Sample{local_sensor<D, Scalar>(sample.sensor), sample.y, here, sample.gate},
                             report);
  }
  template <typename Belief, typename Sample, typename Report>
  void step(Belief& belief, const Sample& sample, Report& report) const {
    using Scalar = typename Belief::Inside::Number;
    auto there = step_from<Scalar>(belief, sample.at);
    report.status = check_step<SpaceOf<D>>(there);
    if (report.status != Status::ok) return;
    method<Scalar>().step(belief.inside(),
                          jml::Sample{local_sensor<D, Scalar>(sample.sensor), sample.y, there, sample.gate},
                          report);
    if constexpr (!requires { belief.inside().P(0); }) {
      if (usable(report.status)) arrive(belief);
    }
  }
  template <typename Belief, typename S, typename Y, typename Lateness, typename Report>
    requires requires(const Method<double>& m, Belief& belief, const S& s, const Y& y, const Lateness& late,
                      Report& report) {
      m.correct_late(belief.inside(), local_sensor<D, typename Belief::Inside::Number>(s), y, late, report);
    }
  void correct_late(Belief& belief, const S& sensor, const Y& y, const Lateness& late, Report& report) const {
    using Scalar = typename Belief::Inside::Number;
    method<Scalar>().correct_late(belief.inside(), local_sensor<D, Scalar>(sensor), y, late, report);
  }

 private:
  template <typename Scalar>
  [[nodiscard]] Method<Scalar> method() const {
    return Method<Scalar>(static_cast<const Inner&>(*this));
  }
  template <typename Scalar, typename Belief, typename At>
  [[nodiscard]] static auto step_from(const Belief& belief, const At& at) {
    const auto& store = belief.inside();
    auto there = local_step<Scalar>(belief.dynamics(), point_of(store, store.last()), at);
    there.from = store.node(store.last()).context.to;
    return there;
  }
  /// The last node, which has just been added, stands at the prediction.
  template <typename Belief>
  static void arrive(Belief& belief) {
    auto& store = belief.inside();
    kernel::set_zero(store.node(store.last()).x[static_cast<std::size_t>(store.now())]);
  }
};

}  // namespace jml::detail

namespace jml {
template <typename Inner, typename D>
struct PartsOf<detail::LocalRecord<Inner, D>> : PartsOfBase<detail::LocalRecord<Inner, D>, Inner> {};
}  // namespace jml
#include <jml/warnings_end.hpp>
