// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A method of ℝⁿ on states in a space: its verbs in local coordinates about the state it stands at.
///
/// A step goes from the chart at x̂ to the chart at x̄ = f(x̂) (model/local_context.hpp); where it ends at z,
/// the state becomes x̄ ⊞ z, and P ← J P Jᵀ with J the slope of the chart there (the reset of an error state,
/// whole). A method that iterates sees noise through f(x, w) and m(x, v) themselves: the step is done again
/// about the w and v that it found, w = Q f_wᵀ λ and v = R m_vᵀ ν, until these no longer move. Where f bends
/// much in w, iterated/whole_step.hpp says where.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/local_belief.hpp>
#include <jml/filter/method.hpp>
#include <jml/model/local_dynamics.hpp>
#include <jml/model/local_sensor.hpp>

namespace jml::detail {
/// The method iterates on its models, so that noise that does not just add is worth a second look.
template <typename M>
consteval bool iterates() {
  if constexpr (requires { M::iterates; })
    return M::iterates;
  else
    return false;
}

/// D is to be run in local coordinates by M: a state in a space; or in ℝⁿ, where M iterates, noise as an
/// argument, or a `Space` that is said.
template <typename M, typename D>
consteval bool runs_locally() {
  if constexpr (!requires {
                  requires DynamicsTraits<D>::states > 0;
                  DynamicsTraits<D>::disturbances;
                })
    return false;
  else if constexpr (!is_flat<D>)
    return true;
  else
    return (iterates<M>() || rolls_back<M>()) && (requires {
             typename D::Space;
           } || NoisyDynamicsIn<D, double, states_of<D>, StepContext<double, DynamicsTraits<D>::controls>>);
}

/// The SDC matrices of a rule, or of the rule inside an iterated one, are about a point that charts have.
template <typename Rule>
consteval bool refers_to_a_point() {
  if constexpr (requires { typename Rule::Inner; })
    return refers_to_a_point<typename Rule::Inner>();
  else if constexpr (requires { Rule::about_origin; })
    return Rule::uses_sdc && !Rule::about_origin && !Rule::about_estimate;
  else
    return false;
}
template <typename Method>
consteval bool require_reference_in_space() {
  if constexpr (requires { typename Method::Rule; }) {
    static_assert(!refers_to_a_point<typename Method::Rule>(),
                  "jml: over states in a space the SDC matrices are about the origin of the space, "
                  "jml::AboutOrigin, or about the estimate, jml::AboutEstimate");
  }
  return true;
}

template <typename Inner, typename D>
struct LocalMethod : Inner {
  static_assert(require_reference_in_space<Inner>());
  static constexpr bool refrozen = iterates<Inner>();
  static constexpr bool revises_step = refrozen && !requires { Inner::Rule::measurement_only; };
  using Local = LocalDynamics<D, revises_step>;
  template <typename Scalar, typename>
  using Model = typename ModelOf<Inner, Scalar, Local>::type;
  template <typename Scalar, typename>
  struct BeliefType : LocalBelief<Scalar, D, typename Inner::template Belief<Scalar, Local>> {
    using Dynamics = D;
  };
  template <typename Scalar, typename Of>
  using Belief = BeliefType<Scalar, Of>;
  template <typename Scalar, typename, typename S>
  using Report = typename ReportOf<Inner, Scalar, Local, S>::type;

  LocalMethod(const Inner& of) : Inner(of) {}  // NOLINT(google-explicit-constructor): the same thing

  /// As of the method in ℝⁿ, with P in the tangent at x, degrees × degrees; invalid_state where x is not in
  /// its space (a quaternion of another length than 1).
  template <typename Model, typename Given, typename Belief>
  [[nodiscard]] Status start(const Model& model, const Given& given, Belief& belief) const {
    using Scalar = typename Belief::Scalar;
    constexpr int n = Local::states;
    static_assert(int(decltype(given.x)::RowsAtCompileTime) == states_of<D>,
                  "jml: the estimate has not as many numbers as a state of the dynamics");
    belief.x = given.x;
    const Vector<Scalar, n> zero = kernel::zeros<Vector<Scalar, n>>();
    Status status = Status::invalid_covariance;
    if constexpr (requires { given.U; }) {
      static_assert(int(decltype(given.D)::RowsAtCompileTime) == n,
                    "jml: U and D have the size of the degrees of freedom, not of the numbers of a state");
      status = inner().start(model, FactoredEstimate<Scalar, n>(zero, given.U, given.D), belief.local);
    } else {
      static_assert(int(decltype(given.P)::RowsAtCompileTime) == n,
                    "jml: P has the size of the degrees of freedom, not of the numbers of a state");
      status = inner().start(model, Estimate<Scalar, n>(zero, given.P), belief.local);
    }
    belief.x = Space::plus(given.x, zero);  // a quaternion in the digits of float is one of double's here
    return all_finite(given.x) && Space::contains(belief.x) ? status : Status::invalid_state;
  }

  template <typename Model, typename Belief, typename At>
  [[nodiscard]] Status predict(const Model& model, const Belief& prior, const At& at, Belief& next) const {
    auto there = local_step<typename Belief::Scalar>(model.dynamics.model, prior.x, at);
    if (const Status status = check_step<Space>(there); status != Status::ok) return status;
    const Status status = inner().predict(model, prior.local, there, next.local);
    if (!usable(status)) return status;
    // What is left of z is rounding.
    kernel::set_zero(next.local.x);
    next.x = there.to;
    return status;
  }

  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
               Report& report) const {
    using Scalar = typename Belief::Scalar;
    LocalContext<Scalar, D> here(sample.at);
    here.from = here.to = prior.x;
    iterate<false>(
        local_sensor<D, Scalar>(sample.sensor), here, prior, sample, next, report,
        [&](const auto& sensor, const Gate& gate, Report& out) {
          inner().correct(model, prior.local, jml::Sample{sensor, sample.y, here, gate}, next.local, out);
        },
        model);
  }

  template <typename Model, typename Belief, typename Sample, typename Report>
  void step(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
            Report& report) const {
    using Scalar = typename Belief::Scalar;
    auto there = local_step<Scalar>(model.dynamics.model, prior.x, sample.at);
    report.status = check_step<Space>(there);
    if (report.status != Status::ok) return;
    iterate<true>(
        local_sensor<D, Scalar>(sample.sensor), there, prior, sample, next, report,
        [&](const auto& sensor, const Gate& gate, Report& out) {
          const jml::Sample local{sensor, sample.y, there, gate};
          if constexpr (requires { inner().again(model, prior.local, local, next.local, out); }) {
            const Report fresh = out;
            if (inner().attempt(model, prior.local, local, next.local, out)) return;
            out = fresh;
            inner().again(model, prior.local, local, next.local, out);
          } else if constexpr (requires { inner().step(model, prior.local, local, next.local, out); }) {
            inner().step(model, prior.local, local, next.local, out);
          } else {
            typename std::remove_cvref_t<decltype(prior.local)> predicted{};
            out.status = inner().predict(model, prior.local, there, predicted);
            const auto end = end_of(there);
            if (usable(out.status))
              inner().correct(model, predicted, jml::Sample{sensor, sample.y, end, gate}, next.local, out);
          }
        },
        model);
  }
  template <typename... A>
  bool attempt(const A&...) const = delete;  // those of the method in ℝⁿ are not these
  template <typename... A>
  void again(const A&...) const = delete;

 private:
  using Space = SpaceOf<D>;

  [[nodiscard]] const Inner& inner() const { return *this; }

  /// Does `run`, of an iterating method about the noise that it finds, and ends the belief where it led to.
  template <bool moves, typename Sensor, typename There, typename Belief, typename Sample, typename Report,
            typename Run, typename Model>
  void iterate(Sensor sensor, There& there, const Belief& prior, const Sample& sample, Belief& next,
               Report& report, const Run& run, const Model& model) const {
    if constexpr (!refrozen)
      run(sensor, sample.gate, report);
    else
      refine<moves>(sensor, there, prior, sample, next, report, run, model);
    if (!usable(report.status)) return;
    if (const Status status = settle_at(next, there.to); status != Status::ok) report.status = status;
  }

  /// Runs until the noise that it finds is that about which it was linearised. The first time it begins at
  /// the prediction, then where its root was, as its neighbours are known. Where it took long, or does not
  /// come to rest, the minima of the criterion with f(x, w) itself say about which w it is to be done.
  template <bool moves, typename Sensor, typename There, typename Belief, typename Sample, typename Report,
            typename Run, typename Model>
  void refine(Sensor& sensor, There& there, const Belief& prior, const Sample& sample, Belief& next,
              Report& report, const Run& run, const Model& model) const {
    using Scalar = typename Belief::Scalar;
    constexpr Scalar tolerance = std::is_same_v<Scalar, float> ? Scalar(1e-4) : Scalar(1e-10);
    constexpr int most = 50;
    const Report fresh = report;
    int iterations = 0;
    const auto again = [&] {
      report = fresh;
      run(sensor, Gate{}, report);
      iterations += report.iterations;
    };
    constexpr bool seeks = moves && revises_step && Local::disturbances > 0 && requires {
      inner().seek(model, prior.local, jml::Sample{sensor, sample.y, there, Gate{}}, there, true, true,
                   iterations);
    };
    const auto seek = [&](bool begun, bool widely) {
      if constexpr (seeks)
        return inner().seek(model, prior.local, jml::Sample{sensor, sample.y, there, Gate{}}, there, begun,
                            widely, iterations);
      else
        return false;
    };
    if constexpr (seeks) there.search = Search::prediction;
    run(sensor, sample.gate, report);
    iterations = report.iterations;
    const Report first = report;
    const bool rootless = report.status == Status::not_converged || report.status == Status::no_minimum;
    bool searched = rootless, restless = false;
    if (rootless && seek(false, true)) again();
    Scalar before = std::numeric_limits<Scalar>::infinity();
    for (int round = 0; usable(report.status) && report.gate != Verdict::rejected; ++round) {
      const Scalar change = refreeze<moves>(sensor, there, next, report, model, sample.y);
      const bool took_long = round == 0 && iterations > 7;
      restless = restless || change > before / Scalar(4);
      const bool widely = seeks && !searched && (took_long || restless);
      if (change <= tolerance && !(took_long && widely)) break;
      if (round == most || !std::isfinite(change)) {
        report.status = Status::not_converged;
        break;
      }
      there.search = Search::slope;
      const There found = there;
      const bool moved = (widely || restless) && seek(true, widely);
      searched = searched || widely;
      before = change;
      again();
      if (moved && !usable(report.status)) {
        there = found;
        again();
      }
      if (seeks && !searched && !usable(report.status)) {
        searched = true;
        if (seek(false, true)) again();
      }
    }
    report.iterations = iterations;
    report.gate = first.gate;
    report.innovation = first.innovation;
    report.innovation_matrix = first.innovation_matrix;
  }

  /// w and v of the root just found become those that the models are linearised about. How far they moved, in
  /// standard deviations.
  template <bool moves, typename Sensor, typename There, typename Belief, typename Report, typename Model,
            typename Y>
  [[nodiscard]] static auto refreeze(Sensor& sensor, There& there, const Belief& next, const Report& report,
                                     const Model& model, const Y& y) {
    using Scalar = typename Belief::Scalar;
    constexpr int n = Local::states, q = Local::disturbances;
    constexpr int p = measurements_of<Sensor>;
    const auto end = end_of(there);
    const Vector<Scalar, n>& z = next.local.x;
    Scalar most = 0;
    const Vector<Scalar, n> here = kernel::zeros<Vector<Scalar, n>>();  // x̂, where Q is taken, as R is at x̄
    Vector<Scalar, n> prediction = here;
    if constexpr (moves) prediction = predicted_state(model.dynamics, here, there);
    kernel::SymmetricFactor<Scalar, p> R;
    if (!R.factor(noise_covariance(sensor, prediction, end))) return std::numeric_limits<Scalar>::infinity();
    const Vector<Scalar, p> nu =
        R.solve(measurement_residual(sensor, Vector<Scalar, p>(y), measurement(sensor, z, end)));
    if constexpr (moves && q > 0 && revises_step) {
      const Vector<Scalar, n> lambda = kernel::transposed(measurement_jacobian(sensor, z, end)) * nu;
      const Matrix<Scalar, q, q> Q = disturbance_covariance(model.dynamics, here, there);
      const Vector<Scalar, q> mean = mean_disturbance(model.dynamics.model, there.from,
                                                      static_cast<const typename There::Plain&>(there));
      // By the slope that the step had, which makes x_1 = f(x_s, w), and by that at its own x_s.
      const auto by = [&](const Vector<Scalar, n>& x_s) -> Vector<Scalar, q> {
        const Matrix<Scalar, n, q> f_w = disturbance_input(model.dynamics, x_s, there);
        return mean + Q * Vector<Scalar, q>(kernel::transposed(f_w) * lambda);
      };
      const Vector<Scalar, q> taken = by(here);
      there.frozen = false;
      const Vector<Scalar, q> w = by(report.smoothed);
      for (int i = 0; i < q; ++i) {
        const Scalar off = std::max(std::abs(w(i) - there.w(i)), std::abs(taken(i) - there.w(i)));
        if (Q(i, i) > Scalar(0)) most = std::max(most, off / std::sqrt(Q(i, i)));
      }
      there.w = w;
      there.frozen = true;
    }
    if constexpr (moves && revises_step)
      there.slope_at = report.smoothed;
    else
      there.slope_at = z;
    most = std::max(most, whole_of(sensor).refreeze(z, nu, end));
    return most;
  }
};
}  // namespace jml::detail
#include <jml/warnings_end.hpp>
