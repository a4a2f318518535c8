// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The root of an exact step in twice the digits: Gauss-Newton sweeps through U D Uᵀ, for the steps whose own
/// digits do not suffice.
///
/// A sweep linearises the models at z = (x_s, x_1) and solves the linear step exactly. What it moves is the
/// difference from z, so that neither x̄ - x_1 nor the innovation at x̄ loses a digit where x̄ is far from the
/// root; the models themselves are evaluated in the digits of Scalar. The pair is moved as one state of 2n
/// numbers, P_0 = diag(P, 0), F = [I 0; f_x 0]: then x_s needs no S⁻¹ and no P⁻¹.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored_belief.hpp>
#include <jml/filter/one_pass.hpp>
#include <jml/iterated/rules.hpp>

namespace jml::detail {

/// What moves before the measurement of an exact step.
enum class Motion : std::uint8_t {
  none,    ///< a correction alone
  before,  ///< predicted once, as by the inner rule (jml::Iekf)
  joint,   ///< the estimate before is revised with the one after
};

template <typename Scalar, int n>
[[nodiscard]] bool load_prior(ExtendedStep<Scalar>& two, const Estimate<Scalar, n>& prior) {
  if (!all_finite(prior.P) || !two.load(prior.P.data())) return false;
  two.load_state(prior.x.data(), nullptr);
  return true;
}
template <typename Scalar, int n>
[[nodiscard]] bool load_prior(ExtendedStep<Scalar>& two, const FactoredBelief<Scalar, n>& prior) {
  const bool low = prior.extended;
  two.load(prior.U.data(), prior.D.data(), low ? prior.U_low.data() : nullptr,
           low ? prior.D_low.data() : nullptr);
  two.load_state(prior.x.data(), prior.x_low.data());
  return true;
}
/// The prior with n zeros below it.
template <typename Scalar, int n>
[[nodiscard]] bool load_twice(ExtendedStep<Scalar>& two, const Estimate<Scalar, n>& prior) {
  Matrix<Scalar, 2 * n, 2 * n> P = kernel::zeros<Matrix<Scalar, 2 * n, 2 * n>>();
  kernel::set_block(P, 0, 0, prior.P);
  return all_finite(prior.P) && two.load(P.data());
}
template <typename Scalar, int n>
[[nodiscard]] bool load_twice(ExtendedStep<Scalar>& two, const FactoredBelief<Scalar, n>& prior) {
  using Square = Matrix<Scalar, 2 * n, 2 * n>;
  using Column = Vector<Scalar, 2 * n>;
  Square U = kernel::identity<Square>(), U_low = kernel::zeros<Square>();
  Column D = kernel::zeros<Column>(), D_low = kernel::zeros<Column>();
  kernel::set_block(U, 0, 0, prior.U);
  kernel::set_block(D, 0, 0, prior.D);
  if (prior.extended) {
    kernel::set_block(U_low, 0, 0, prior.U_low);
    kernel::set_block(D_low, 0, 0, prior.D_low);
    for (int i = 0; i < n; ++i) U_low(i, i) = Scalar(0);
  }
  two.load(U.data(), D.data(), U_low.data(), D_low.data());
  return true;
}
template <typename Scalar, int n>
[[nodiscard]] Extended<Scalar> prior_state(const Estimate<Scalar, n>& prior, int i) {
  return Extended<Scalar>(prior.x(i));
}
template <typename Scalar, int n>
[[nodiscard]] Extended<Scalar> prior_state(const FactoredBelief<Scalar, n>& prior, int i) {
  return as_one(prior.x(i), prior.x_low(i));
}

/// √(vᵀ P⁻¹ v) of P = U D Uᵀ (n×n, by its entries U(i, j) and D(i)), v overwritten: a distance in standard
/// deviations. A direction that is known exactly, or not at all, counts for nothing. `bound`: the most it can
/// be of a v of which only the sizes are given.
template <typename Scalar, bool bound = false, typename Factors, typename T>
[[nodiscard]] Scalar deviations_in(const Factors& P, int n, T* v) {
  const auto size = [](const T& a) { return std::abs(static_cast<Scalar>(a)); };
  Scalar sum = 0;
  for (int j = n - 1; j >= 0; --j) {
    for (int i = 0; i < j; ++i) {
      if constexpr (bound)
        v[i] = v[i] + T(std::abs(static_cast<Scalar>(P.U(i, j)))) * v[j];
      else
        v[i] = v[i] - T(P.U(i, j)) * v[j];
    }
    const Scalar variance = static_cast<Scalar>(P.D(j));
    if (variance > Scalar(0) && !std::isinf(variance)) sum += size(v[j]) * (size(v[j]) / variance);
  }
  return std::sqrt(sum);
}

/// √(vᵀ R⁻¹ v), the most it can be of a v of these sizes.
template <typename Scalar, int p>
[[nodiscard]] Scalar deviations_in(const kernel::SymmetricFactor<Scalar, p>& R, Vector<Scalar, p> v) {
  Scalar sum = 0;
  for (int i = 0; i < p; ++i) {
    for (int k = 0; k < i; ++k) v(i) += std::abs(R.lower(i, k)) * v(k);
    sum += v(i) * v(i) * R.inverse_diagonal(i);
  }
  return std::sqrt(sum);
}

/// |y| + |m(x)| + Σ |H x|: what the rounding of an innovation is a share of.
template <typename Scalar, int n, int p>
[[nodiscard]] Vector<Scalar, p> innovation_terms(const Vector<Scalar, p>& y,
                                                 const Vector<Scalar, p>& residual,
                                                 const Matrix<Scalar, p, n>& H, const Vector<Scalar, n>& x) {
  Vector<Scalar, p> terms;
  for (int i = 0; i < p; ++i) {
    terms(i) = std::abs(y(i)) + std::abs(y(i) - residual(i));
    for (int j = 0; j < n; ++j) terms(i) += std::abs(H(i, j) * x(j));
  }
  return terms;
}

/// The sweeps of one step. z: x_s (of a joint step) and then x_1.
template <Motion motion, typename Rule, typename Model, typename Prior, typename At, typename Sample,
          typename AtY>
struct SweepsInTwo {
  using Scalar = typename Prior::Scalar;
  using T = Extended<Scalar>;
  static constexpr int n = Prior::states, p = Sample::measurements;
  static constexpr int q = disturbances_in<motion != Motion::none, Model>();
  static constexpr int first = motion == Motion::joint ? n : 0, size = first + n;  // of x_1 in z
  using S = std::remove_cvref_t<decltype(std::declval<Sample>().sensor)>;
  using X = Vector<Scalar, n>;
  static constexpr bool exact = exact_sensor<S, Vector<Scalar, p>>();

  const Rule& rule;
  const Model& model;
  const Prior& prior;
  const At& at;
  const Sample& sample;
  const AtY& at_y;
  Matrix<Scalar, p, p> R;
  kernel::SymmetricFactor<Scalar, p> R_factor;
  bool regular = false;  // R is positive definite
  ExtendedMemory<Scalar, size, q, p> memory;

  /// What a sweep from a point came to.
  struct Sweep {
    T z[size];                // where it leads
    Scalar moved = 0;         // to there, in standard deviations
    Scalar floor = 0;         // what the rounding of the models may make of that
    Scalar motion_floor = 0;  // of it that of f
    Scalar cost = 0;          // (11), of the point that it started from
    bool still = false;       // no component moves by more than its own rounding
    Vector<Scalar, p> terms = kernel::zeros<Vector<Scalar, p>>();
  };

  [[nodiscard]] static Scalar high(const T& a) { return in_two<Scalar>(a).high; }
  [[nodiscard]] static X half(const T* z) {
    X out;
    for (int i = 0; i < n; ++i) out(i) = high(z[i]);
    return out;
  }

  /// P of the prediction by the slots of `by`, linearised at z, of what `two` (n states) is loaded with; not
  /// x where the step is joint.
  template <typename By>
  [[nodiscard]] Status predict(const By& by, const T* z, ExtendedStep<Scalar>& two) const {
    if (!load_prior(two, prior)) return Status::invalid_covariance;
    if constexpr (motion == Motion::before) return predict_in_two(by, model, prior.x, at, two);
    if constexpr (motion == Motion::joint) {
      const Matrix<Scalar, n, n> A = dynamics_slot<By::A>(by, model.dynamics, half(z), prior.x, at);
      if (!all_finite(A)) return Status::dynamics_not_finite;
      return move<n>(A, two);
    }
    return Status::ok;
  }

  [[nodiscard]] Status sweep(const T* z, Sweep& out) {
    ExtendedStep<Scalar> two(memory);
    T bar[size], v[size];  // z̄, of the models linearised at z
    constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
    if constexpr (motion == Motion::joint) {
      const auto& d = model.dynamics;
      const X x_s = DynamicsTraits<std::remove_cvref_t<decltype(d)>>::linear ? prior.x : half(z);
      const X effect = predicted_state(d, prior.x, at) - dynamics(d, prior.x, at);  // G w̄, frozen at x̂
      const X f = dynamics(d, x_s, at) + effect;
      const Matrix<Scalar, n, n> A = dynamics_jacobian(d, x_s, at);
      if (!all_finite(f) || !all_finite(A)) return Status::dynamics_not_finite;
      Matrix<Scalar, size, size> F = kernel::zeros<Matrix<Scalar, size, size>>();
      for (int i = 0; i < n; ++i) F(i, i) = Scalar(1);
      kernel::set_block(F, n, 0, A);
      if (!load_twice(two, prior)) return Status::invalid_covariance;
      if (const Status moved = move<size>(F, two); moved != Status::ok) return moved;
      for (int i = 0; i < n; ++i) {  // x̂, and x̄ = f(x_s) + A (x̂ - x_s)
        Scalar terms = std::abs(f(i));
        bar[i] = prior_state(prior, i);
        bar[n + i] = T(f(i));
        for (int j = 0; j < n; ++j) {
          const T back = prior_state(prior, j) - T(x_s(j));
          bar[n + i] = bar[n + i] + T(A(i, j)) * back;
          terms += std::abs(A(i, j) * static_cast<Scalar>(back));
        }
        v[i] = T(0);
        v[n + i] = T(epsilon * terms);
      }
      if constexpr (!DynamicsTraits<std::remove_cvref_t<decltype(d)>>::linear)
        out.motion_floor = deviations_in<Scalar, true>(two, size, v);
    } else {
      if (const Status moved = predict(rule.inner, z, two); moved != Status::ok) return moved;
      for (int i = 0; i < n; ++i) bar[i] = two.x(i);
    }

    const X x_1 = half(z + first);
    const Vector<Scalar, p> residual =
        measurement_residual(sample.sensor, sample.y, measurement(sample.sensor, x_1, at_y));
    const Matrix<Scalar, p, n> m_x = measurement_jacobian(sample.sensor, x_1, at_y);
    if (!all_finite(residual) || !all_finite(m_x)) return Status::sensor_not_finite;
    out.terms = innovation_terms(sample.y, residual, m_x, x_1);

    // (11) at z: distance from z̄, and the innovation there.
    for (int i = 0; i < size; ++i) v[i] = z[i] - bar[i];
    const Scalar far = deviations_in<Scalar>(two, size, v);
    Vector<Scalar, p> e;
    for (int i = 0; i < p; ++i) {
      e(i) = residual(i);
      for (int j = 0; j < n; ++j) e(i) -= m_x(i, j) * in_two<Scalar>(z[first + j]).low;
    }
    if (regular) {
      out.cost = (far * far + R_factor.squared_norm(e)) / Scalar(2);
      out.floor = out.motion_floor + (exact ? Scalar(0) : epsilon * deviations_in(R_factor, out.terms));
    }

    // x_1 ← x̄ + K (y - m(x_1) - m_x (x̄ - x_1)), as differences from x_1; of a linear m from 0.
    Vector<Scalar, size> upper, lower;
    const auto origin = [&](int i) { return exact && i >= first ? T(0) : T(high(z[i])); };
    for (int i = 0; i < size; ++i) {
      const auto part = in_two<Scalar>(bar[i] - origin(i));
      upper(i) = part.high;
      lower(i) = part.low;
    }
    two.load_state(upper.data(), lower.data());
    Matrix<Scalar, p, size> H = kernel::zeros<Matrix<Scalar, p, size>>();
    kernel::set_block(H, 0, first, m_x);
    Vector<Scalar, p> given = residual;
    if constexpr (exact) given = from_origin<n>(sample.sensor, sample.y, at_y);
    const RowsReport rows = two.correct(H.data(), R.data(), given.data(), true, out.terms.data(), nullptr);
    if (rows.status != Status::ok) return rows.status;
    out.still = true;
    for (int i = 0; i < size; ++i) {
      out.z[i] = origin(i) + two.x(i);
      v[i] = out.z[i] - z[i];
      const Scalar scale = std::abs(high(z[i])) + std::abs(high(bar[i]));
      out.still = out.still && std::abs(high(v[i])) <= Scalar(64) * epsilon * scale;
    }
    out.moved = deviations_in<Scalar>(two, size, v);
    return Status::ok;
  }

 private:
  /// P ← F P Fᵀ + G Q Gᵀ of `rows` states, the last n of which are disturbed; G and Q frozen at x̂.
  template <int rows>
  [[nodiscard]] Status move(const Matrix<Scalar, rows, rows>& F, ExtendedStep<Scalar>& two) const {
    Matrix<Scalar, q, q> Q = kernel::zeros<Matrix<Scalar, q, q>>();
    Matrix<Scalar, rows, q> G = kernel::zeros<Matrix<Scalar, rows, q>>();
    if constexpr (q > 0) {
      Q = disturbance_covariance(model.dynamics, prior.x, at);
      kernel::set_block(G, rows - n, 0, disturbance_input(model.dynamics, prior.x, at));
    }
    const bool valid = is_covariance(Q) && all_finite(G);
    return valid && two.move(F.data(), G.data(), Q.data(), nullptr) ? Status::ok
                                                                    : Status::invalid_disturbance_covariance;
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
