// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One exact step in the plain form: root, N, P and K, and whether the digits of Scalar suffice for them.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/one_pass.hpp>
#include <jml/iterated/digits.hpp>
#include <jml/iterated/rules.hpp>

namespace jml {

namespace detail {

/// How a step in the digits of Scalar ended.
enum class Digits : std::uint8_t {
  held,     ///< or refused: the report says it
  too_few,  ///< the step can be done over again in twice as many
};

/// How much of a joint step is done.
enum class Extent : std::uint8_t {
  all,
  root,  ///< x and report.smoothed, and no P
};

/// The implicit step of `d` and `s` from `prior` into `report`, `x` and `P`, which are touched on refusal
/// too. too_few: where the report has a usable status, x and report.smoothed are the root all the same.
template <Extent extent = Extent::all, typename Rule, typename D, typename S, typename Prior, typename Scalar,
          int n, int p, typename At, typename SensorAt>
[[nodiscard]] Digits joint_step_into(const Rule& rule, const D& d,
                                     const ProcessNoise<Scalar, D>& process_noise, const S& s,
                                     const Prior& prior, const Vector<Scalar, p>& y, const At& at,
                                     const SensorAt& at_y, const Gate& gate,
                                     IteratedReport<Scalar, n, p>& report, Vector<Scalar, n>& x,
                                     Matrix<Scalar, n, n>& P, Scalar& spread) {
  using Inner = typename Rule::Inner;
  Digits digits = Digits::held;
  const auto answer = [&report, &digits](Status status) {
    report.status = status;
    return digits;
  };
  // Ends here, without a root: a symmetric rule looks for it in twice the digits.
  const auto too_few = [&](Status status) {
    report.status = status;
    if constexpr (Inner::symmetric) digits = Digits::too_few;
  };
  if (!valid(rule.options) || !gate.valid()) return answer(Status::invalid_option);
  if (!all_finite(y)) return answer(Status::invalid_measurement);
  if (!all_finite(prior.x)) return answer(Status::invalid_state);
  const Vector<Scalar, n> prediction = predicted_state(d, prior.x, at);
  if (!all_finite(prediction)) return answer(Status::dynamics_not_finite);
  const Matrix<Scalar, p, p> R = noise_covariance(s, prediction, at_y);
  if (!is_noise_covariance(R)) return answer(Status::invalid_noise_covariance);

  const bool noise_valid = process_noise.with(d, prior.x, at, [&](const Matrix<Scalar, n, n>& noise) {
    using Step = JointStep<D, S, Scalar, n, At, SensorAt>;
    Step step{d, s, prior, noise, y, at, at_y, R, {}, kernel::zeros<Vector<Scalar, n>>(), {}, {}};
    if (!step.R_factor.factor(R)) return void(answer(Status::invalid_noise_covariance));
    if constexpr (has_disturbance_mean<D, Vector<Scalar, n>, At>())
      step.mean_effect = prediction - dynamics(d, prior.x, at);
    step.set_scale(prediction);
    Root<Step> start;

    // The prediction's innovation, its matrix, and the gate on it.
    Step::join(prior.x, prediction, start.z);
    if (!step.visit(start.z, start.visit)) {
      if (!all_finite(prior.P)) return void(answer(Status::invalid_covariance));
      return void(
          answer(all_finite(start.visit.f_x) ? Status::sensor_not_finite : Status::dynamics_not_finite));
    }
    kernel::assign(report.innovation, start.visit.innovation);
    {
      Matrix<Scalar, n, p> Nm;
      kernel::add_product<1>(start.visit.Cm, start.visit.f_x, start.visit.Pfm, Nm);  // N m_xᵀ
      kernel::add_product<1>(R, start.visit.m_x, Nm, report.innovation_matrix);      // S = R + m_x N m_xᵀ
    }
    if constexpr (Inner::symmetric && extent == Extent::all) {
      if (!gate.off() && all_finite(report.innovation_matrix) &&
          !gate_has_digits(start.visit, prior.P, noise, report.innovation_matrix, growth_before<D>(prior)))
        return too_few(Status::innovation_indefinite);
    }
    if (!judge(gate, report)) return void(answer(Status::innovation_indefinite));
    if (report.gate == Verdict::rejected) {
      NoSizes sizes;
      report.status = predict_into(rule.inner, d, process_noise, prior, at, x, P, sizes);
      if (report.status != Status::ok) return;
      bool held = all_finite(x) && all_finite(P);
      if constexpr (Inner::symmetric) {
        const Scalar grown = growth_before<D>(prior) * growth_with_zeros(P, P, spread);
        report.rounding = std::numeric_limits<Scalar>::epsilon() * grown;
        if (held && !(grown <= worst_growth<Scalar>)) return too_few(Status::covariance_lost);
      }
      if (!held) report.status = Status::covariance_lost;
      return;
    }

    if constexpr (Inner::symmetric && extent == Extent::all) {
      bool far = false;  // a sensor so fine that the digits may not suffice: ask before the iteration
      for (int i = 0; i < p; ++i) far |= !(report.innovation_matrix(i, i) <= fine_sensor<Scalar> * R(i, i));
      if (far && short_of_digits(step, start.visit, growth_before<D>(prior)))
        return too_few(Status::not_converged);
    }
    const bool symmetric_prior = Inner::symmetric || is_symmetric(prior.P);
    const Root<Step> root = solve_joint_step(rule, step, prediction, symmetric_prior, start);
    report.solver = root.solver;
    report.iterations = root.iterations;
    report.residual = root.residual;
    report.cost = root.cost;
    report.status = root.status;
    if (!usable(root.status)) {
      if constexpr (Inner::symmetric && extent == Extent::all) {
        if (root.status != Status::no_minimum && short_of_digits(step, start.visit, growth_before<D>(prior)))
          too_few(root.status);
      }
      return;
    }
    kernel::assign(x, Step::next(root.z));
    kernel::assign(report.smoothed, Step::smoothed(root.z));
    if constexpr (extent == Extent::root) return;

    // N, P and K once, with the slots at the root.
    const Vector<Scalar, n> x_s = Step::smoothed(root.at), x_1 = Step::next(root.at);
    const auto slot = [&]<auto which>() -> Matrix<Scalar, n, n> {
      if constexpr (same_slot<which, Slot::jacobian>)
        return root.visit.f_x;
      else
        return dynamics_slot<which>(rule.inner, d, x_s, prior.x, at);
    };
    const auto sensor_slot_at_root = [&]<auto which>() -> Matrix<Scalar, p, n> {
      if constexpr (same_slot<which, Slot::jacobian>)
        return root.visit.m_x;
      else
        return sensor_slot<which>(rule.inner, s, x_1, prediction, at_y);
    };
    const Matrix<Scalar, n, n> A = slot.template operator()<Inner::A>();
    Matrix<Scalar, n, n> AP, N;
    kernel::product(A, prior.P, AP);  // A P
    if constexpr (Inner::symmetric) {
      kernel::add_symmetric_product<1>(noise, AP, A, N);  // N = A P Aᵀ + G Q Gᵀ
    } else {
      // N = A P Bᵀ + G Q Gᵀ
      kernel::add_product_transposed<1>(noise, AP, slot.template operator()<Inner::B>(), N);
    }
    Matrix<Scalar, p, p> S_root;
    Scalar condition = 0;
    const Matrix<Scalar, p, n> slot_d = sensor_slot_at_root.template operator()<Inner::D>(),
                               slot_e = sensor_slot_at_root.template operator()<Inner::E>();
    const bool regular =
        correct_riccati<Inner::symmetric>(N, slot_d, slot_e, R, S_root, report.gain, P, condition);
    if (!regular) {
      if (!all_finite(S_root)) return void(answer(Status::sensor_not_finite));
      if constexpr (Inner::symmetric) {
        digits = Digits::too_few;
        return;
      }
      return void(answer(Status::singular_innovation));
    }
    constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
    if constexpr (Inner::symmetric) {
      const Scalar growth = growth_before<D>(prior), worst = worst_growth<Scalar> / (growth + condition);
      Scalar grown = growth_of(P, N, spread);
      kernel::mirror(P);
      if (!(grown <= worst)) grown = growth_with_zeros(P, N, spread);
      report.rounding = epsilon * ((growth + condition) * grown);
      bool held = grown <= worst;
      // A residual of the second line moves x by (I - K m_x) of it: it is to be small against √N_ii.
      if (root.status == Status::accepted_at_rounding ||
          (root.status == Status::ok && rule.options.tolerance == 0)) {
        const Scalar share = root.residual * root.residual * growth * Scalar(1e6);
        kernel::repeat<n>([&](int i) JML_INLINE {
          held &= share * (step.scale(i) * step.scale(i)) <= N(i, i) || N(i, i) == Scalar(0);
        });
      }
      if (!held) {
        if (!all_finite(N)) return void(answer(Status::covariance_lost));
        digits = Digits::too_few;
      }
    } else {
      report.rounding = epsilon * condition * largest_loss(N, P);
      if (!(report.rounding <= plain_error<Scalar>)) {
        report.redone = true;
        if (!general_riccati_in_two(prior.P, A, slot.template operator()<Inner::B>(), noise, slot_d, slot_e,
                                    R, N, P, report.gain))
          return void(answer(Status::singular_innovation));
        report.rounding = extended_epsilon<Scalar> * largest_loss(N, P);
      }
      if (!(report.rounding <= worst_error<Scalar> && all_finite(P) && all_finite(x)))
        return void(answer(Status::covariance_lost));
    }
  });
  if (!noise_valid) return answer(Status::invalid_disturbance_covariance);
  return digits;
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
