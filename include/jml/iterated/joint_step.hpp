// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The equations of one exact JML step (Rusnak 2015, eqs. (9), (11)-(13)), without a solver.
///
/// With e = m_x(x_1)ᵀ R⁻¹ (y - m(x_1)) and C = G Q Gᵀ, the stationarity of (11) is the two ground-truth lines
///   x_s = x̂ + P f_x(x_s)ᵀ e,      x_1 = f(x_s) + G w̄ + C e,
/// x_s being x_{i/i+1} and x_1 being x̂_{i+1}. The SDC matrices do not occur in them: they shape P alone.
/// Unknown: z = (x_s, x_1), 2n.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <jml/model/hessian.hpp>
#include <jml/riccati/difference.hpp>

namespace jml {

/// No motion and no disturbance: turns the equations of a step into those of a correction alone.
template <int n>
struct Stay {
  /// As dynamics with f(x) = x and no disturbance.
  /// @{
  static constexpr int states = n, disturbances = 0;
  static constexpr bool linear = true;
  template <typename T>
  Vector<T, n> dynamics(const Vector<T, n>& x) const {
    return x;
  }
  template <typename T>
  Matrix<T, n, n> dynamics_jacobian(const Vector<T, n>&) const {
    return kernel::identity<Matrix<T, n, n>>();
  }
  template <typename T>
  Matrix<T, n, n> dynamics_sdc(const Vector<T, n>&) const {
    return kernel::identity<Matrix<T, n, n>>();
  }
  template <typename T>
  Matrix<T, n, n> dynamics_sdc_about(const Vector<T, n>&, const Vector<T, n>&) const {
    return kernel::identity<Matrix<T, n, n>>();
  }
  /// @}
};

namespace detail {

/// One step's data; refers to its arguments, which outlive it.
template <typename D, typename S, typename Scalar, int n, typename At, typename SensorAt>
struct JointStep {
  static constexpr int p = measurements_of<S>;
  static_assert(require_additive_noise<S, Vector<Scalar, n>, SensorAt>());
  using X = Vector<Scalar, n>;
  using Z = Vector<Scalar, 2 * n>;

  const D& dynamics_model;
  const S& sensor;
  const Estimate<Scalar, n>& prior;
  const Matrix<Scalar, n, n>& noise;  // C = G Q Gᵀ
  const Vector<Scalar, p>& y;
  const At& at;
  const SensorAt& at_y;
  Matrix<Scalar, p, p> R;
  kernel::SymmetricFactor<Scalar, p> R_factor;
  X mean_effect;           // G w̄, frozen at x̂
  X scale, inverse_scale;  // the state scale |x̂| + |x̄| + √(P_ii + C_ii), by component; 1 where all vanish

  JML_INLINE void set_scale(const X& prediction) {
    kernel::repeat<n>([&](int i) JML_INLINE {
      const Scalar size = std::abs(prior.x(i)) + std::abs(prediction(i)) +
                          std::sqrt(std::abs(prior.P(i, i)) + std::abs(noise(i, i)));
      scale(i) = size > Scalar(0) ? size : Scalar(1);
      inverse_scale(i) = Scalar(1) / scale(i);
    });
  }

  /// The largest entry of r over the state scale.
  JML_INLINE Scalar scaled(const Z& r) const {
    Scalar largest = 0;
    kernel::repeat<2 * n, 6>([&](int i) JML_INLINE {
      const Scalar ratio = std::abs(r(i)) * inverse_scale(i % n);
      largest = ratio > largest ? ratio : largest;  // visit() has refused a NaN
    });
    return largest;
  }

  /// The largest entry of a - b over the state scale.
  JML_INLINE Scalar moved(const Z& a, const Z& b) const {
    Z change;
    kernel::repeat<2 * n, 6>([&](int i) JML_INLINE { change(i) = a(i) - b(i); });
    return scaled(change);
  }

  /// z = (x_s, x_1), number by number: halves stored apart are slow to load as one.
  JML_INLINE static void join(const X& x_s, const X& x_1, Z& z) {
    kernel::repeat<n>([&](int i) JML_INLINE {
      z(i) = x_s(i);
      z(n + i) = x_1(i);
    });
  }
  JML_INLINE static X smoothed(const Z& z) {
    X out;
    kernel::repeat<n>([&](int i) JML_INLINE { out(i) = z(i); });
    return out;
  }
  JML_INLINE static X next(const Z& z) {
    X out;
    kernel::repeat<n>([&](int i) JML_INLINE { out(i) = z(n + i); });
    return out;
  }

  /// Everything one visit of the models at z gives.
  struct Visit {
    X f;                                    // f(x_s) + G w̄
    Matrix<Scalar, n, n> f_x;               // at x_s
    Matrix<Scalar, p, n> m_x;               // at x_1
    Vector<Scalar, p> innovation;           // y - m(x_1)
    Vector<Scalar, p> weighted_innovation;  // R⁻¹ innovation
    Matrix<Scalar, n, p> Pfm;               // P f_xᵀ m_xᵀ
    Matrix<Scalar, n, p> Cm;                // C m_xᵀ
    Z residual;                             // of the two lines
  };

  JML_INLINE bool visit(const Z& z, Visit& v) const {
    const X x_s = smoothed(z), x_1 = next(z);
    X f;
    kernel::assign(f, dynamics(dynamics_model, x_s, at));
    if constexpr (has_disturbance_mean<D, X, At>()) f += mean_effect;
    // What a model returns is stored number by number, and slow to load as columns: it is used where it was
    // made, by its numbers, and copied last. Nor is there a transpose, which is stored like that too.
    const Matrix<Scalar, n, n> f_x = dynamics_jacobian(dynamics_model, x_s, at);
    kernel::assign(v.innovation, measurement_residual(sensor, y, measurement(sensor, x_1, at_y)));
    const Matrix<Scalar, p, n> m_x = measurement_jacobian(sensor, x_1, at_y);
    kernel::assign(v.weighted_innovation, R_factor.solve(v.innovation));
    Matrix<Scalar, p, n> mf;
    kernel::product(m_x, f_x, mf);
    kernel::product_transposed(prior.P, mf, v.Pfm);  // P f_xᵀ m_xᵀ
    kernel::product_transposed(noise, m_x, v.Cm);    // C m_xᵀ
    X first, second;
    kernel::add_product<1>(prior.x, v.Pfm, v.weighted_innovation, first);  // x̂ + P f_xᵀ e
    kernel::add_product<1>(f, v.Cm, v.weighted_innovation, second);        // f(x_s) + G w̄ + C e
    kernel::repeat<n>([&](int i) JML_INLINE {
      v.residual(i) = first(i) - x_s(i);
      v.residual(n + i) = second(i) - x_1(i);
    });
    kernel::assign(v.f, f);
    kernel::assign(v.f_x, f_x);
    kernel::assign(v.m_x, m_x);
    return all_finite(v.residual);
  }

  /// The same out of the way of the usual iteration.
  [[nodiscard]] JML_RARE bool visit_apart(const Z& z, Visit& v) const { return visit(z, v); }

  /// What rounding alone leaves in the residual at z: ε times the terms it is the difference of. The
  /// innovation's own rounding, that of x_1 seen through m_x included, enters through R⁻¹: large where the
  /// measurement is far better than the prior.
  JML_INLINE Scalar rounding(const Z& z, const Visit& v) const {
    Vector<Scalar, p> terms;
    kernel::repeat<p>([&](int k) JML_INLINE {
      Scalar sum = std::abs(y(k)) + std::abs(y(k) - v.innovation(k));
      kernel::repeat<n>([&](int j) JML_INLINE { sum += std::abs(v.m_x(k, j) * z(n + j)); });
      terms(k) = sum;
    });
    terms = R_factor.solve(terms);
    Scalar largest = 0;
    kernel::repeat<n>([&](int i) JML_INLINE {
      Scalar first = std::abs(prior.x(i)), second = std::abs(v.f(i));
      kernel::repeat<p>([&](int k) JML_INLINE {
        first += std::abs(v.Pfm(i, k) * terms(k));
        second += std::abs(v.Cm(i, k) * terms(k));
      });
      largest = std::max({largest, first * inverse_scale(i), second * inverse_scale(i)});
    });
    return std::numeric_limits<Scalar>::epsilon() * largest;
  }

  /// ok: the residual is below the tolerance even with the rounding of its own evaluation added.
  /// accepted_at_rounding: it is not, but no more than a few roundings, so no better z can be told from this
  /// one.
  JML_INLINE Status verdict(const Z& z, const Visit& v, Scalar residual, Scalar tolerance) const {
    const Scalar floor = rounding(z, v);
    if (residual + floor <= tolerance) return Status::ok;
    return residual <= Scalar(8) * floor ? Status::accepted_at_rounding : Status::not_converged;
  }

  /// One sweep with matrices A (n×n) at x_s and E (p×n) at x_1 in the places of F and M; false where S is
  /// singular.
  ///   x̄ = f(x_s) + A (x̂ - x_s);   N m_xᵀ = A P f_xᵀ m_xᵀ + C m_xᵀ;   S = R + E N m_xᵀ;
  ///   δ = S⁻¹ (y - m(x_1) - E (x̄ - x_1));   x_1 ← x̄ + N m_xᵀ δ.
  /// With F and M and x_s ← x̂ + P f_xᵀ m_xᵀ R⁻¹ (y - m(x_1)) this is (9) as printed (F x̂ = f(x_s) + F (x̂ -
  /// x_s) whatever the reference). With the Jacobians and x_s ← x̂ + P f_xᵀ m_xᵀ δ it is a Gauss-Newton step
  /// of (11).
  template <bool as_printed>
  JML_INLINE bool sweep(const Z& z, const Visit& v, const Matrix<Scalar, n, n>& A,
                        const Matrix<Scalar, p, n>& E, Z& swept) const {
    const X x_s = smoothed(z), x_1 = next(z);
    X back, bar, ahead;
    kernel::repeat<n>([&](int i) JML_INLINE { back(i) = prior.x(i) - x_s(i); });
    kernel::add_product<1>(v.f, A, back, bar);  // x̄ = f(x_s) + A (x̂ - x_s)
    Matrix<Scalar, n, p> Nm;
    kernel::add_product<1>(v.Cm, A, v.Pfm, Nm);  // N m_xᵀ = C m_xᵀ + A P f_xᵀ m_xᵀ
    Matrix<Scalar, p, p> S_matrix;
    kernel::add_product<1>(R, E, Nm, S_matrix);  // S = R + E N m_xᵀ
    kernel::GeneralFactor<Scalar, p> factor;
    if (!factor.factor(S_matrix, noise_units(R))) return false;
    kernel::repeat<n>([&](int i) JML_INLINE { ahead(i) = bar(i) - x_1(i); });
    Vector<Scalar, p> innovation;
    kernel::add_product<-1>(v.innovation, E, ahead, innovation);  // y - m(x_1) - E (x̄ - x_1)
    const Vector<Scalar, p> delta = factor.solve(innovation);
    X swept_s, swept_1;
    // x_s ← x̂ + P f_xᵀ m_xᵀ R⁻¹ (y - m(x_1)), or x̂ + P f_xᵀ m_xᵀ δ
    kernel::add_product<1>(prior.x, v.Pfm, as_printed ? v.weighted_innovation : delta, swept_s);
    kernel::add_product<1>(bar, Nm, delta, swept_1);  // x_1 ← x̄ + N m_xᵀ δ
    join(swept_s, swept_1, swept);
    return true;
  }

  // The two lines as a square system for damped_newton.

  Z unit() const {
    Z out;
    join(scale, scale, out);
    return out;
  }

  JML_RARE bool residual(const Z& z, Z& r) const {
    Visit v;
    if (!visit_apart(z, v)) return false;
    r = v.residual;
    return true;
  }

  JML_RARE bool jacobian(const Z& z, Matrix<Scalar, 2 * n, 2 * n>& J) const {
    Visit v;
    if (!visit_apart(z, v)) return false;
    const X x_s = smoothed(z), x_1 = next(z);
    const Matrix<Scalar, n, p> m_xT = kernel::transposed(v.m_x);
    X e;
    kernel::multiply(m_xT, v.weighted_innovation, e);  // e = m_xᵀ R⁻¹ (y - m)
    Matrix<Scalar, p, n> Rm;                           // R⁻¹ m_x
    for (int j = 0; j < n; ++j) kernel::set_column(Rm, j, R_factor.solve(kernel::column_of(v.m_x, j)));
    Matrix<Scalar, n, n> slope, block, block2;
    // ∂e/∂x_1 = Σ ν_k ∇²m_k - m_xᵀ R⁻¹ m_x
    kernel::add_product<-1>(measurement_hessian(sensor, x_1, v.weighted_innovation, at_y), m_xT, Rm, slope);
    kernel::product(prior.P, dynamics_hessian(dynamics_model, x_s, e, at), block);  // P Σ e_k ∇²f_k
    kernel::set_block(J, 0, 0, block);
    kernel::product_transposed(prior.P, v.f_x, block);  // P f_xᵀ
    kernel::multiply(block, slope, block2);             // P f_xᵀ ∂e/∂x_1
    kernel::set_block(J, 0, n, block2);
    kernel::set_block(J, n, 0, v.f_x);
    kernel::multiply(noise, slope, block);  // C ∂e/∂x_1
    kernel::set_block(J, n, n, block);
    kernel::add_to_diagonal(J, Scalar(-1));
    return all_finite(J);
  }

  /// The one-step criterion (11) at a root: with x_s - x̂ = P f_xᵀ e and w = Q Gᵀ e no inverse is needed,
  /// ½ eᵀ f_x P f_xᵀ e + ½ eᵀ C e + ½ νᵀ R ν.
  JML_NOINLINE Scalar cost_at_root(const Visit& v) const {
    X e, fe, Pfe, Ce;
    kernel::product(kernel::transposed(v.m_x), v.weighted_innovation, e);  // e = m_xᵀ ν
    kernel::product(kernel::transposed(v.f_x), e, fe);                     // f_xᵀ e
    kernel::product(prior.P, fe, Pfe);                                     // P f_xᵀ e
    kernel::product(noise, e, Ce);                                         // C e
    return (kernel::dot(fe, Pfe) + kernel::dot(e, Ce) + kernel::dot(v.weighted_innovation, v.innovation)) /
           Scalar(2);
  }
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
