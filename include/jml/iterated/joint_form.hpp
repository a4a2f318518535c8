// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One exact step in the plain form: root, N, P and K, and whether the digits of Scalar suffice for them.
#pragma once

#include <jml/filter/one_pass.hpp>
#include <jml/iterated/rules.hpp>

namespace jml {

namespace detail {

/// How a step in the digits of Scalar ended.
enum class Digits : std::uint8_t {
  held,     ///< or refused: the report says it
  too_few,  ///< the step can be done over again in twice as many
};

/// What the rounding of N may have grown by in P⁺ = L D Lᵀ (lower triangle read), in its worst direction, and
/// in `spread` that of P⁺ itself. Infinite where a pivot is not positive.
///
/// An entry of P⁺ is right to some ε √(N_ii N_jj). What that makes of a pivot D_i is not ε N_ii alone: it is
/// vᵀ P⁺ v with row i of L⁻¹ as v, and takes ε Σ v_j² N_jj from all states before, s_i = N_ii + Σ_k L_ik²
/// s_k. A pivot that is lost is made of that, and would look large enough beside its own N_ii.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Scalar growth_of(const Matrix<Scalar, n, n>& P, const Matrix<Scalar, n, n>& N,
                                                 Scalar& spread) {
  Matrix<Scalar, n, n> L;
  Scalar sums[n], own[n], grown = 0, lowest = std::numeric_limits<Scalar>::max();
  spread = 0;
  const auto column = [&](int j, Scalar pivot) JML_INLINE {  // of pivot j, once row j of L is there
    const Scalar inverse = Scalar(1) / pivot;
    lowest = pivot < lowest ? pivot : lowest;
    sums[j] = N(j, j);
    own[j] = P(j, j);
    kernel::repeat<n, 8>([&](int k) JML_INLINE {
      if (k >= j) return;
      const Scalar square = L(j, k) * L(j, k);
      sums[j] += square * sums[k];
      own[j] += square * own[k];
    });
    grown += sums[j] * inverse;  // the sum, which no NaN escapes, for the largest
    spread += own[j] * inverse;
    return inverse;
  };
  if constexpr (n <= 8) {  // written out, in packets of the whole column
    kernel::Column<Scalar, n> entries[n], one;
    Scalar pivots[n];
    kernel::repeat<n, 8>([&](int j) JML_INLINE {
      one.load(&P(0, j));
      kernel::repeat<n, 8>([&](int k) JML_INLINE {
        if (k < j) one.subtract(entries[k], L(j, k));
      });
      one.store(pivots);
      entries[j] = one;
      one.scale(column(j, pivots[j]));
      one.store(&L(0, j));
    });
  } else {
    Matrix<Scalar, n, n> entries;
    for (int j = 0; j < n; ++j) {
      for (int i = j; i < n; ++i) entries(i, j) = P(i, j);
      for (int k = 0; k < j; ++k) {
        for (int i = j; i < n; ++i) entries(i, j) -= entries(i, k) * L(j, k);
      }
      const Scalar inverse = column(j, entries(j, j));
      for (int i = j; i < n; ++i) L(i, j) = entries(i, j) * inverse;
    }
  }
  return lowest >= least_variance<Scalar> ? grown : std::numeric_limits<Scalar>::infinity();
}

/// The same where a state is known exactly, its variance zero in N too: then it counts for nothing.
template <typename Scalar, int n>
[[nodiscard]] JML_NOINLINE Scalar growth_with_zeros(const Matrix<Scalar, n, n>& P,
                                                    const Matrix<Scalar, n, n>& N, Scalar& spread) {
  Matrix<Scalar, n, n> kept = P, from = N;
  for (int i = 0; i < n; ++i) {
    bool zero = N(i, i) == Scalar(0);
    for (int j = 0; j < n; ++j) zero = zero && (i > j ? P(i, j) : P(j, i)) == Scalar(0);
    if (zero) kept(i, i) = from(i, i) = Scalar(1);
  }
  return growth_of(kept, from, spread);
}

/// The most of it that a dense P can bear.
template <typename Scalar>
inline constexpr Scalar worst_growth = iterated_error<Scalar> / std::numeric_limits<Scalar>::epsilon();

/// What the rounding of the prior may be in N = A P Aᵀ + G Q Gᵀ. A correction alone has no such product.
template <typename D, typename Prior>
[[nodiscard]] JML_INLINE inline auto growth_before(const Prior& prior) {
  if constexpr (std::is_same_v<D, Stay<Prior::states>>)
    return typename Prior::Scalar(1);
  else
    return spread_of(prior);
}

/// The digits of S suffice for the gate's question: neither its sums nor its inverse cancel all but a few.
template <typename Visit, typename Scalar, int n, int p>
[[nodiscard]] JML_NOINLINE bool gate_has_digits(const Visit& at, const Matrix<Scalar, n, n>& P,
                                                const Matrix<Scalar, n, n>& noise,
                                                const Matrix<Scalar, p, p>& S, Scalar growth) {
  kernel::SymmetricFactor<Scalar, p> factor;
  if (!factor.factor(S)) return false;
  Matrix<Scalar, n, n> fP, N;
  kernel::product(at.f_x, P, fP);
  kernel::add_symmetric_product<1>(noise, fP, at.f_x, N);  // N = f_x P f_xᵀ + C
  for (int i = 0; i < p; ++i) {
    Scalar terms = 0;  // S_ii, had nothing cancelled
    for (int j = 0; j < n; ++j) terms += std::abs(at.m_x(i, j)) * std::sqrt(std::abs(N(j, j)));
    terms = S(i, i) > terms * terms ? S(i, i) : terms * terms;
    if (!(growth * terms * factor.inverse_diagonal(i) <= worst_growth<Scalar>)) return false;
  }
  return true;
}

/// Where no root was found: the prediction's P or S have lost their digits.
template <typename Step, typename Scalar>
[[nodiscard]] JML_NOINLINE bool short_of_digits(const Step& step, const typename Step::Visit& at,
                                                Scalar growth) {
  constexpr int n = static_cast<int>(Step::X::RowsAtCompileTime), p = Step::p;
  Matrix<Scalar, n, n> fP, N, P;
  Matrix<Scalar, p, p> S;
  Matrix<Scalar, n, p> gain;
  Scalar condition = 0;
  kernel::product(at.f_x, step.prior.P, fP);
  kernel::add_symmetric_product<1>(step.noise, fP, at.f_x, N);  // N = f_x P f_xᵀ + C
  if (!all_finite(N) || !all_finite(at.m_x)) return false;
  if (!correct_riccati<true>(N, at.m_x, at.m_x, step.R, S, gain, P, condition)) return true;
  Scalar spread = 0;
  kernel::mirror(P);
  return !((growth + condition) * growth_with_zeros(P, N, spread) <= worst_growth<Scalar>);
}

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
    const bool regular = correct_riccati<Inner::symmetric>(
        N, sensor_slot_at_root.template operator()<Inner::D>(),
        sensor_slot_at_root.template operator()<Inner::E>(), R, S_root, report.gain, P, condition);
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
      if (!(report.rounding <= worst_error<Scalar> && all_finite(P) && all_finite(x)))
        return void(answer(Status::covariance_lost));
    }
  });
  if (!noise_valid) return answer(Status::invalid_disturbance_covariance);
  return digits;
}

}  // namespace detail

}  // namespace jml
