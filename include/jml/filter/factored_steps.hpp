// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The steps of a factored belief in the digits of Scalar (ud_factors.hpp).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored_belief.hpp>
#include <jml/filter/step_in_two.hpp>

namespace jml {

/// What a factored filter reports. NIS and log-likelihood are sums over the rows as they were taken, right
/// where S itself is singular to rounding too.
template <typename Scalar, int n, int p>
struct FactoredReport : StepReport<Scalar, n, p> {
  /// Perfect rows (R = 0) of what was known exactly, which were skipped; rows that gave a variance to a
  /// direction of which nothing was known; and each row as it was taken.
  detail::RowsFound<Scalar, p> rows;

  /// As Report::nis(); `degrees` do not count rows that were redundant or resolved a direction.
  [[nodiscard]] Scalar nis() const { return rows.nis(); }
  /// As Report::log_likelihood(), of the rows that count in nis().
  [[nodiscard]] Scalar log_likelihood() const {
    Scalar sum = nis() + Scalar(this->degrees) * Scalar(1.8378770664093453);
    for (int i = 0; i < p; ++i) {
      if (!std::isinf(rows.variance(i))) sum += std::log(rows.variance(i));
    }
    return -sum / Scalar(2);
  }
};

namespace detail {

/// Dynamics, and the factors of G Q Gᵀ where that is a constant.
template <typename Scalar, typename D>
struct FactoredDynamics {
  explicit FactoredDynamics(const D& model) : dynamics(model) {
    if constexpr (NoiseFactors<Scalar, D>::constant)
      valid = noise.form(dynamics, kernel::zeros<Vector<Scalar, states_of<D>>>(), {});
  }

  [[no_unique_address]] D dynamics;
  NoiseFactors<Scalar, D> noise;
  bool valid = true;

  [[nodiscard]] Status status() const { return valid ? Status::ok : Status::invalid_disturbance_covariance; }
};

/// How much rounding of an ε may grow in the worst direction of P.
template <typename Scalar>
inline constexpr Scalar worst_magnification = [] {
  Scalar root = 1;  // √ε, as √ is no constant expression
  for (int i = 0; i < 60; ++i) root = (root + std::numeric_limits<Scalar>::epsilon() / root) / Scalar(2);
  return Scalar(8) / root;
}();

/// P_ii of `next`, and whether its digits suffice: the terms that it came from, of which `sizes` is the sum
/// of squares, against what is left of them.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline bool settle(FactoredBelief<Scalar, n>& next, const Vector<Scalar, n>& sizes) {
  constexpr Scalar limit = worst_magnification<Scalar> * worst_magnification<Scalar>;
  Scalar sums[n], variances[n] = {};
  bool held = true;
  if constexpr (n <= 8) {  // written out, in registers
    kernel::repeat<n, 8>([&](int back) JML_INLINE {
      const int i = n - 1 - back;
      Scalar sum = std::sqrt(Scalar(n) * sizes(i)), variance = next.D(i);
      kernel::repeat<n, 8>([&](int k) JML_INLINE {
        if (k <= i) return;
        const Scalar u = std::abs(next.U(i, k));
        sum += u * sums[k];
        variance += u * u * next.D(k);
      });
      sums[i] = sum;
      variances[i] = variance;
      held &= sum * sum <= limit * next.D(i) && (next.D(i) >= least_variance<Scalar> || sum == Scalar(0));
    });
  } else {
    for (int i = 0; i < n; ++i) sums[i] = std::sqrt(Scalar(n) * sizes(i));  // ≥ Σ of the terms
    for (int k = n - 1; k >= 0; --k) {
      const Scalar sum = sums[k], d = next.D(k);
      held &= sum * sum <= limit * d && (d >= least_variance<Scalar> || sum == Scalar(0));
      kernel::Strip<Scalar, n>::each(k + 1, [&](int i, auto u) JML_INLINE {  // sums_k is done
        auto weighted = u, rest = u;
        u.load(&next.U(i, k));
        u.make_positive();
        rest.load(&sums[i]);
        rest.add(u, sum);  // Σ + |U_ik| Σ_k
        rest.store(&sums[i]);
        weighted = u;
        weighted.scale(d);
        rest.load(&variances[i]);
        rest.add(weighted, u);  // P_ii + U_ik² D_k
        rest.store(&variances[i]);
      });
    }
  }
  for (int i = 0; i < n; ++i) next.variances(i) = variances[i];
  next.extended = false;
  next.magnification = Scalar(0);
  return held && all_finite(next.x);
}

/// x̄ = A x + f(0) of affine dynamics, with what rounding leaves: a later measurement may be finer than the
/// digits of x.
template <typename D, typename Belief, typename Scalar, int n, typename At>
void move_in_all_digits(const D& d, const Matrix<Scalar, n, n>& A, const Belief& prior, const At& at,
                        Belief& next) {
  using T = Extended<Scalar>;
  const Vector<Scalar, n> constant = predicted_state(d, kernel::zeros<Vector<Scalar, n>>(), at);
  for (int i = 0; i < n; ++i) {
    T sum(constant(i));
    Scalar low = 0;
    for (int j = 0; j < n; ++j) {
      sum = sum + T(A(i, j)) * T(prior.x(j));
      low += A(i, j) * prior.x_low(j);
    }
    const auto parts = in_two<Scalar>(sum + T(low));
    next.x(i) = parts.high;
    next.x_low(i) = parts.low;
  }
}

/// N by Thornton, and x̄. `sizes`: Σ A² P_ii + Σ B² d, what N came from.
template <typename Rule, typename Model, typename Belief, typename At, typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Status factored_prediction(const Rule& rule, const Model& model,
                                                           const Belief& prior, const At& at, Belief& next,
                                                           Vector<Scalar, n>& sizes) {
  using Noise = std::remove_cvref_t<decltype(model.noise)>;
  constexpr int q = Noise::columns, m = n + q;
  constexpr bool affine = DynamicsTraits<std::remove_cvref_t<decltype(model.dynamics)>>::linear;
  if constexpr (!affine) {
    kernel::assign(next.x, predicted_state(model.dynamics, prior.x, at));
    kernel::set_zero(next.x_low);
  }
  const Vector<Scalar, n>& point = Rule::evaluated_at == EvaluatedAt::estimate ? prior.x : next.x;
  const Matrix<Scalar, n, n> A = dynamics_slot<Rule::A>(rule, model.dynamics, point, prior.x, at);
  if constexpr (affine) move_in_all_digits(model.dynamics, A, prior, at, next);
  kernel::Padded<Scalar, n, m> W;
  Vector<Scalar, m> d;
  const auto place = [&](const Noise& noise) JML_INLINE {
    for (int k = 0; k < q; ++k) {
      for (int i = 0; i < kernel::Strip<Scalar, n>::padded; ++i) W(i, k) = i < n ? noise.B(i, k) : Scalar(0);
      d(k) = noise.d(k);
    }
    kernel::assign(sizes, noise.sizes);
  };
  if constexpr (Noise::constant) {
    place(model.noise);
  } else {
    Noise noise;
    if (!noise.form(model.dynamics, prior.x, at)) return Status::invalid_disturbance_covariance;
    place(noise);
  }
  for (int i = 0; i < n; ++i) d(q + i) = prior.D(i);
  kernel::add_weighted_squares(A, prior.variances, sizes);
  kernel::times_unit_upper<Scalar, n, m>(A, prior.U, W);               // [B, A U]
  kernel::orthogonalise<Noise::triangular, Scalar, n, m>(W, d, next);  // A P Aᵀ + G Q Gᵀ
  return Status::ok;
}

/// NIS beyond which the rounding of P tells in x: the gain is as wrong as P is.
template <typename Scalar, int p>
inline constexpr Scalar surprising = Scalar(1e6) * Scalar(p);

enum class FastCorrection : std::uint8_t { done, refused, short_of_digits };

/// One measurement into the factors of `next`, in place.
template <typename Rule, typename S, typename Belief, typename Y, typename At, typename Scalar, int n, int p>
[[nodiscard]] JML_INLINE inline FastCorrection factored_correction(const Rule& rule, const S& s, const Y& y,
                                                                   const At& at, Belief& next,
                                                                   FactoredReport<Scalar, n, p>& report) {
  const auto answer = [&report](Status status) {
    report.status = status;
    return FastCorrection::refused;
  };
  const Matrix<Scalar, p, p> R = noise_covariance(s, next.x, at);
  constexpr bool exact = exact_sensor<S, Vector<Scalar, p>>();
  Vector<Scalar, p> e = measurement_residual(s, y, measurement(s, next.x, at));
  Matrix<Scalar, n, p> H = kernel::transposed(sensor_slot<Rule::D>(rule, s, next.x, next.x, at));
  if constexpr (exact) {
    using T = Extended<Scalar>;
    const Vector<Scalar, p> given = from_origin<n>(s, y, at);
    for (int i = 0; i < p; ++i) {
      T sum(given(i));
      Scalar low = 0;
      for (int j = 0; j < n; ++j) {
        sum = sum - T(H(j, i)) * T(next.x(j));
        low += H(j, i) * next.x_low(j);
      }
      e(i) = in_two<Scalar>(sum - T(low)).high;
    }
  }
  kernel::assign(report.innovation, e);
  if (!all_finite(e) || !all_finite(H)) {
    if (!all_finite(y)) return answer(Status::invalid_measurement);
    return answer(all_finite(next.x) ? Status::sensor_not_finite : Status::invalid_state);
  }
  kernel::SymmetricFactor<Scalar, p> noise;
  Vector<Scalar, p> r = kernel::diagonal(R);
  const bool correlated = !is_diagonal(R);
  if (correlated ? !is_covariance(R) : !(diagonal_is<Definite::positive_or_zero>(R) && all_finite(r)))
    return answer(Status::invalid_noise_covariance);
  bool held = diagonal_is<Definite::positive>(R);
  if (correlated && held) {  // independent rows L⁻¹ H of R = L D Lᵀ
    held = noise.factor(R);
    for (int i = 0; i < p; ++i) {
      r(i) = Scalar(1) / noise.inverse_diagonal(i);
      held = held && r(i) > Scalar(1e-6) * R(i, i);
      for (int k = 0; k < i; ++k) {
        e(i) -= noise.lower(i, k) * e(k);
        kernel::subtract_column(H, k, noise.lower(i, k), H, i);
      }
    }
  }
  if (!held) return FastCorrection::short_of_digits;

  Matrix<Scalar, n, p> k;
  Matrix<Scalar, p, p> lower = kernel::identity<Matrix<Scalar, p, p>>();  // of S = L diag(alpha) Lᵀ
  Vector<Scalar, p> alphas;
  Vector<Scalar, n> gain;
  Scalar nis = 0;
  for (int i = 0; i < p; ++i) {
    Scalar alpha;
    kernel::correct_row(next, &H(0, i), r(i), gain, alpha);
    const Scalar inverse = Scalar(1) / alpha;
    nis += e(i) * e(i) * inverse;
    kernel::scale_column(gain, 0, inverse, k, i);
    for (int l = i + 1; l < p; ++l) {
      lower(l, i) = kernel::Strip<Scalar, n>::dot(n, &H(0, l), &k(0, i));
      e(l) -= lower(l, i) * e(i);
    }
    alphas(i) = alpha;
  }
  if (!(nis <= surprising<Scalar, p>)) return FastCorrection::short_of_digits;
  if constexpr (exact) {  // x̄ + Σ k e, with what rounding leaves
    for (int j = 0; j < n; ++j) {
      Scalar change = 0;
      for (int i = 0; i < p; ++i) change += k(j, i) * e(i);
      const auto parts = in_two<Scalar>(as_one(next.x(j), next.x_low(j)) + Extended<Scalar>(change));
      next.x(j) = parts.high;
      next.x_low(j) = parts.low;
    }
  } else {
    kernel::add_product<1>(next.x, k, e, next.x);
    kernel::set_zero(next.x_low);
  }
  kernel::assign(report.rows.innovation, e);
  kernel::assign(report.rows.variance, alphas);
  if (correlated) {  // of S itself: that of R before it
    for (int i = p - 1; i > 0; --i) {
      for (int l = 0; l < p; ++l) {
        for (int a = 0; a < i; ++a) lower(i, l) += noise.lower(i, a) * lower(a, l);
      }
    }
  }
  Matrix<Scalar, p, p> scaled;  // L diag(alpha)
  for (int l = 0; l < p; ++l) kernel::scale_column(lower, l, alphas(l), scaled, l);
  kernel::set_zero(report.innovation_matrix);
  kernel::add_symmetric_product<1>(report.innovation_matrix, scaled, lower, report.innovation_matrix);
  for (int i = p - 1; i >= 0; --i) {  // K = [k] L⁻¹
    for (int l = i + 1; l < p; ++l) kernel::subtract_column(k, l, lower(l, i), k, i);
  }
  kernel::assign(report.gain, k);
  return FastCorrection::done;
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
