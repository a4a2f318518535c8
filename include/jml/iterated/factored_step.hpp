// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One exact step of a factored belief: the root by the plain solver, and sweeps from it through the factors.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/iterated/joint_form.hpp>
#include <jml/iterated/linearised.hpp>
#include <jml/iterated/step_again.hpp>

namespace jml {

/// What a factored exact step reports; the rows are those of the step linearised at the prediction.
template <typename Scalar, int n, int p>
struct FactoredIteratedReport : FactoredReport<Scalar, n, p>, RootReport<Scalar, n> {};

namespace detail {

/// The most that a root may lie from one more sweep, in standard deviations; and the rounding of the models,
/// likewise. Where it is more, the step is done in twice the digits.
template <typename Scalar>
inline constexpr Scalar factored_slack = std::is_same_v<Scalar, float> ? Scalar(1e-2) : Scalar(1e-5);

/// Linearised dynamics with the noise of a step, as factored_prediction() takes them.
template <typename Model>
struct FrozenModel {
  using D = std::remove_cvref_t<decltype(Model::dynamics)>;
  using Given = std::remove_cvref_t<decltype(Model::noise)>;
  struct Noise : Given {
    static constexpr bool constant = true;
  };
  LinearisedDynamics<D, typename decltype(Given::d)::Scalar, Given::n> dynamics;
  Noise noise;
};

/// A step of a factored iterated rule in the digits of Scalar.
template <Motion motion, typename Rule, typename Model, typename Belief, typename At, typename Sample,
          typename AtY, typename Report>
struct FactoredExactStep {
  using Scalar = typename Belief::Scalar;
  static constexpr int n = Belief::states, p = Sample::measurements;
  static constexpr bool joint = motion == Motion::joint;
  using X = Vector<Scalar, n>;
  using S = std::remove_cvref_t<decltype(std::declval<Sample>().sensor)>;
  static constexpr bool exact = exact_sensor<S, Vector<Scalar, p>>();
  static constexpr bool linear = exact && linear_motion<motion, Model>();
  using Inner = typename Rule::Inner;
  static constexpr bool by_jacobians =
      same_slot<Inner::A, Slot::jacobian> && same_slot<Inner::D, Slot::jacobian>;

  const Rule& rule;
  const Model& model;
  const Belief& prior;
  const At& at;
  const Sample& sample;
  const AtY& at_y;
  Belief& next;
  Report& report;

  /// False where the digits do not suffice; a usable status then says that the root was found.
  [[nodiscard]] bool run() {
    report.status = Status::not_converged;
    Belief predicted;
    X sizes;
    if (const Status status = predict(linearised_rule(), prior.x, predicted, sizes); status != Status::ok)
      return refuse(status);
    const X prediction = predicted.x;

    // The step linearised at the prediction, and the gate on it.
    commit(next, predicted);
    report.status = Status::ok;
    const FastCorrection found = factored_correction(Ekf<>{}, sample.sensor, sample.y, at_y, next, report);
    if (found == FastCorrection::refused) return true;
    if (found == FastCorrection::short_of_digits || !report.rows.judge(sample.gate, report)) return no_root();
    if (report.gate == Verdict::rejected) {
      const Status status = predict(rule.inner, prior.x, next, sizes);
      if (status != Status::ok) return refuse(status);
      return settle(next, sizes) || no_root();
    }
    if constexpr (linear && !joint) {
      report.cost = report.rows.nis() / Scalar(2);
      report.iterations = 1;
      if constexpr (by_jacobians) return finish(sizes, next.x);
    }

    // The root, with P as a dense matrix.
    IteratedReport<Scalar, n, p> root;
    X x_1 = predicted.x;
    if (!solve(predicted, root, x_1))
      return root.status == Status::no_minimum ? refuse(root.status) : no_root();
    static_cast<RootReport<Scalar, n>&>(report) = root;
    if constexpr (linear && by_jacobians) return finish(sizes, root.smoothed);

    // More sweeps, from there, through the factors.
    const X x_s = root.smoothed;
    const Status status = predict(linearised_rule(), x_s, predicted, sizes);
    if (status != Status::ok) return refuse(status);
    Scalar floor = 0;
    if constexpr (!linear_motion<motion, Model>()) {
      X terms;
      for (int i = 0; i < n; ++i) terms(i) = epsilon * std::abs(predicted.x(i));
      floor = deviations_in<Scalar, true>(Factors{predicted}, n, terms.data());
    }
    const Scalar motion_floor = floor;
    FactoredReport<Scalar, n, p> again;
    bool held = true;
    for (int k = 0; k < 3; ++k) {
      floor = motion_floor;
      held = sweep<Slot::jacobian>(predicted, prediction, x_1, again, floor);
      X change = next.x - x_1;
      const Scalar moved = deviations_in<Scalar>(Factors{next}, n, change.data());
      held = held && moved <= factored_slack<Scalar> && floor <= factored_slack<Scalar>;
      if (!held || moved <= Scalar(1e-3) * factored_slack<Scalar>) break;
      held = !joint;  // x_s would move too
      if (joint) break;
      kernel::assign(x_1, next.x);
      ++report.iterations;
    }
    const X x = next.x, x_low = linear ? next.x_low : kernel::zeros<X>();
    if constexpr (!by_jacobians) {  // P by the slots of the rule at the root
      if (held) {
        if (predict(rule.inner, x_s, predicted, sizes) != Status::ok)
          return refuse(Status::dynamics_not_finite);
        held = sweep<Inner::D>(predicted, prediction, x_1, again, floor);
        kernel::assign(next.x, x);
        kernel::assign(next.x_low, x_low);
      }
    }
    if (held) {
      kernel::assign(report.gain, again.gain);
      report.status = root.status == Status::accepted_at_limit ? root.status : Status::ok;
      if (finish(sizes, joint ? x_s : x)) return true;
    }
    report.status = root.status;
    kernel::assign(next.x, x_1);
    kernel::set_zero(next.x_low);
    return false;
  }

 private:
  static constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  /// U and D as deviations_in() asks for them.
  struct Factors {
    const UdFactors<Scalar, n>& of;
    [[nodiscard]] Scalar U(int i, int j) const { return of.U(i, j); }
    [[nodiscard]] Scalar D(int i) const { return of.D(i); }
  };

  [[nodiscard]] auto linearised_rule() const {
    if constexpr (joint)
      return Ekf<>{};
    else
      return rule.inner;
  }
  [[nodiscard]] bool refuse(Status status) {
    report.status = status;
    return true;
  }
  [[nodiscard]] bool no_root() {
    report.status = Status::not_converged;
    return false;
  }
  [[nodiscard]] bool finish(const X& sizes, const X& smoothed) {
    kernel::assign(report.smoothed, smoothed);
    if (rule.options.accept_at_limit) report.status = Status::accepted_at_limit;
    return settle(next, sizes) || no_root();
  }

  /// The prediction by the slots of `by`; of a joint step linearised at x_s.
  template <typename By>
  [[nodiscard]] Status predict(const By& by, const X& x_s, Belief& out, X& sizes) const {
    out.extended = false;
    if constexpr (motion == Motion::none) {
      commit(out, prior);
      kernel::assign(sizes, prior.variances);
      return Status::ok;
    } else if constexpr (!joint) {
      return factored_prediction(by, model, prior, at, out, sizes);
    } else {
      const auto& d = model.dynamics;
      using D = std::remove_cvref_t<decltype(d)>;
      if constexpr (DynamicsTraits<D>::linear) return factored_prediction(by, model, prior, at, out, sizes);
      const X mean_effect = predicted_state(d, prior.x, at) - dynamics(d, prior.x, at);  // G w̄, frozen at x̂
      FrozenModel<Model> there{
          {x_s, dynamics(d, x_s, at) + mean_effect, dynamics_slot<By::A>(by, d, x_s, prior.x, at)},
          {model.noise}};
      if constexpr (!std::remove_cvref_t<decltype(model.noise)>::constant) {
        if (!there.noise.form(d, prior.x, at)) return Status::invalid_disturbance_covariance;
      }
      return factored_prediction(Ekf<>{}, there, prior, at, out, sizes);
    }
  }

  /// The root by the plain solver; its x_s in the report.
  [[nodiscard]] bool solve(const Belief& predicted, IteratedReport<Scalar, n, p>& root, X& x_1) const {
    constexpr Extent extent = Extent::root;
    const Gate off;
    Matrix<Scalar, n, n> none;
    Scalar spread = 0;
    if constexpr (joint) {
      using D = std::remove_cvref_t<decltype(model.dynamics)>;
      const Estimate<Scalar, n> dense{prior.x, prior.P()};
      const ProcessNoise<Scalar, D> noise(model.dynamics);
      (void)joint_step_into<extent>(rule, model.dynamics, noise, sample.sensor, dense, sample.y, at, at_y,
                                    off, root, x_1, none, spread);
    } else {
      const Estimate<Scalar, n> dense{predicted.x, predicted.P()};
      const NoisyDynamics<Scalar, Stay<n>> stay{Stay<n>{}};
      (void)joint_step_into<extent>(rule, stay.dynamics, stay.noise, sample.sensor, dense, sample.y,
                                    StepContext<Scalar>{}, at_y, off, root, x_1, none, spread);
    }
    return usable(root.status);
  }

  /// next ← predicted, corrected with the sensor linearised at x_1, its matrix in `slot`; adds what rounding
  /// makes of the innovation to `floor`. False where the digits do not suffice.
  template <auto slot>
  [[nodiscard]] bool sweep(const Belief& predicted, const X& prediction, const X& x_1,
                           FactoredReport<Scalar, n, p>& again, Scalar& floor) {
    const S& s = sample.sensor;
    commit(next, predicted);
    if constexpr (exact) {
      return factored_correction(Ekf<>{}, s, sample.y, at_y, next, again) == FastCorrection::done;
    } else {
      const LinearisedSensor<S, Scalar, n, p> there{s, x_1, measurement(s, x_1, at_y),
                                                    sensor_slot<slot>(rule.inner, s, x_1, prediction, at_y),
                                                    noise_covariance(s, prediction, at_y)};
      Vector<Scalar, p> terms =
          innovation_terms(sample.y, measurement_residual(s, sample.y, there.m), there.H, x_1);
      for (int i = 0; i < p; ++i) {
        for (int j = 0; j < n; ++j) terms(i) += std::abs(there.H(i, j)) * std::abs(predicted.x(j) - x_1(j));
      }
      kernel::SymmetricFactor<Scalar, p> R;
      if (!R.factor(there.R)) return false;
      floor += epsilon * deviations_in(R, terms);
      return factored_correction(Ekf<>{}, there, sample.y, at_y, next, again) == FastCorrection::done;
    }
  }
};

template <Motion motion, typename Rule, typename Model, typename Belief, typename At, typename Sample,
          typename AtY, typename Report>
void factored_exact_step(const Rule& rule, const Model& model, const Belief& prior, const At& at,
                         const Sample& sample, const AtY& at_y, Belief& next, Report& report) {
  if (!valid(rule.options) || !sample.gate.valid()) {
    report.status = Status::invalid_option;
    return;
  }
  const auto degrees = report.degrees;
  if (!prior.extended) {
    FactoredExactStep<motion, Rule, Model, Belief, At, Sample, AtY, Report> step{
        rule, model, prior, at, sample, at_y, next, report};
    if (step.run()) return;
  } else {
    report.status = Status::not_converged;
  }
  report.degrees = degrees;
  report.status = step_in_two<motion>(rule, model, prior, at, sample, at_y, next, report);
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
