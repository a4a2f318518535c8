// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A method of ℝⁿ on states in a space: its verbs in local coordinates about the state it stands at.
///
/// A step goes from the chart at x̂ to the chart at x̄ = f(x̂) (model/local_context.hpp); where it ends at z,
/// the state becomes x̄ ⊞ z, and P ← J P Jᵀ with J the slope of the chart there (the reset of an error state,
/// whole). A method that iterates sees noise through f(x, w) and m(x, v) themselves: the step is done again
/// about the w and v that it found, w = Q f_wᵀ λ and v = R m_vᵀ ν, until these no longer move.
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
    iterate(
        local_sensor<D, Scalar>(sample.sensor), here, next, report,
        [&](const auto& sensor, Report& out) {
          inner().correct(model, prior.local, jml::Sample{sensor, sample.y, here, sample.gate}, next.local,
                          out);
          return Verb::correct;
        },
        model, sample.y);
  }

  template <typename Model, typename Belief, typename Sample, typename Report>
  void step(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
            Report& report) const {
    using Scalar = typename Belief::Scalar;
    auto there = local_step<Scalar>(model.dynamics.model, prior.x, sample.at);
    report.status = check_step<Space>(there);
    if (report.status != Status::ok) return;
    iterate(
        local_sensor<D, Scalar>(sample.sensor), there, next, report,
        [&](const auto& sensor, Report& out) {
          const jml::Sample local{sensor, sample.y, there, sample.gate};
          if constexpr (requires { inner().again(model, prior.local, local, next.local, out); }) {
            const Report fresh = out;
            if (inner().attempt(model, prior.local, local, next.local, out)) return Verb::step;
            out = fresh;
            inner().again(model, prior.local, local, next.local, out);
          } else if constexpr (requires { inner().step(model, prior.local, local, next.local, out); }) {
            inner().step(model, prior.local, local, next.local, out);
          } else {
            typename std::remove_cvref_t<decltype(prior.local)> predicted{};
            out.status = inner().predict(model, prior.local, there, predicted);
            const auto end = end_of(there);
            if (usable(out.status))
              inner().correct(model, predicted, jml::Sample{sensor, sample.y, end, sample.gate}, next.local,
                              out);
          }
          return Verb::step;
        },
        model, sample.y);
  }
  template <typename... A>
  bool attempt(const A&...) const = delete;  // those of the method in ℝⁿ are not these
  template <typename... A>
  void again(const A&...) const = delete;

 private:
  using Space = SpaceOf<D>;
  enum class Verb : std::uint8_t { correct, step };

  [[nodiscard]] const Inner& inner() const { return *this; }

  /// Runs `verb`, of an iterating method about the noise that it finds, and ends the belief where it led to.
  template <typename Sensor, typename There, typename Belief, typename Report, typename Run, typename Model,
            typename Y>
  static void iterate(Sensor sensor, There& there, Belief& next, Report& report, const Run& run,
                      const Model& model, const Y& y) {
    using Scalar = typename Belief::Scalar;
    const Report fresh = report;
    Verb verb = run(sensor, report);
    if constexpr (refrozen) {
      const Report first = report;
      constexpr Scalar tolerance = std::is_same_v<Scalar, float> ? Scalar(1e-4) : Scalar(1e-10);
      constexpr int most = 50;
      int iterations = report.iterations;
      for (int round = 0; usable(report.status) && report.gate != Verdict::rejected; ++round) {
        const Scalar change = refreeze(sensor, there, next, report, model, y, verb == Verb::step);
        if (change <= tolerance) break;
        if (round == most || !std::isfinite(change)) {
          report.status = Status::not_converged;
          break;
        }
        report = fresh;
        verb = run(sensor, report);
        iterations += report.iterations;
      }
      report.iterations = iterations;
      report.gate = first.gate;
      report.innovation = first.innovation;
      report.innovation_matrix = first.innovation_matrix;
    }
    if (!usable(report.status)) return;
    if (const Status status = settle_at(next, there.to); status != Status::ok) report.status = status;
  }

  /// w and v of the root just found become those that the models are linearised about. How far they moved, in
  /// standard deviations.
  template <typename Sensor, typename There, typename Belief, typename Report, typename Model, typename Y>
  [[nodiscard]] static auto refreeze(Sensor& sensor, There& there, const Belief& next, const Report& report,
                                     const Model& model, const Y& y, bool moves) {
    using Scalar = typename Belief::Scalar;
    constexpr int n = Local::states, q = Local::disturbances;
    constexpr int p = measurements_of<Sensor>;
    const auto end = end_of(there);
    const Vector<Scalar, n>& z = next.local.x;
    Scalar most = 0;
    kernel::SymmetricFactor<Scalar, p> R;
    if (!R.factor(noise_covariance(sensor, z, end))) return std::numeric_limits<Scalar>::infinity();
    const Vector<Scalar, p> nu =
        R.solve(measurement_residual(sensor, Vector<Scalar, p>(y), measurement(sensor, z, end)));
    if constexpr (q > 0 && revises_step) {
      if (moves) {
        const Vector<Scalar, n> lambda = kernel::transposed(measurement_jacobian(sensor, z, end)) * nu;
        const Matrix<Scalar, q, q> Q = disturbance_covariance(model.dynamics, report.smoothed, there);
        const Matrix<Scalar, n, q> f_w = disturbance_input(model.dynamics, report.smoothed, there);
        const Vector<Scalar, q> w = mean_disturbance(model.dynamics.model, there.from,
                                                     static_cast<const typename There::Plain&>(there)) +
                                    Q * Vector<Scalar, q>(kernel::transposed(f_w) * lambda);
        for (int i = 0; i < q; ++i) {
          if (Q(i, i) > Scalar(0)) most = std::max(most, std::abs(w(i) - there.w(i)) / std::sqrt(Q(i, i)));
        }
        there.w = w;
        there.slope_at = report.smoothed;
        there.frozen = true;
      }
    }
    most = std::max(most, whole_of(sensor).refreeze(z, nu, end));
    return most;
  }
};

}  // namespace jml::detail
