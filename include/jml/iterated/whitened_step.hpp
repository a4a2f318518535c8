// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The one-step criterion (11) as a small least-squares problem: what the fallback solver below the iteration
/// minimises.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/iterated/bend.hpp>
#include <jml/iterated/root.hpp>

namespace jml::detail {

/// (11) whitened, for a least-squares solver: x_s = x̂ + L a, G w = B b, with L Lᵀ = sym(P), B Bᵀ = C,
/// negative parts cut to zero; minimise ½|a|² + ½|b|² + ½|R^{-½}(y - m(f(x_s) + G w̄ + B b))|². Minimising the
/// norm of the two lines instead is a trap: it stalls at points that are no roots.
template <typename Step, typename Scalar, int n>
struct WhitenedStep {
  static constexpr bool whitened = true, curved = Bend<Step>::of_m || Bend<Step>::of_f;
  static constexpr int p = Step::p, parameters = 2 * n, residuals = 2 * n + p;
  const Step& step;
  Matrix<Scalar, n, n> L, B;
  Scalar still;  ///< a gradient of (11) in u, in deviations, from which on Newton on the lines is as good

  WhitenedStep(const Step& s, const IterationOptions& options)
      : step(s),
        L(kernel::SemidefiniteFactor<Scalar, n>(kernel::symmetric_part(s.prior.P)).L),
        B(kernel::SemidefiniteFactor<Scalar, n>(s.noise).L),
        still(options.max_newton > 0 ? Scalar(1e-2) : Scalar(0)) {}

  JML_RARE typename Step::Z point(const Vector<Scalar, 2 * n>& u) const {
    typename Step::Z z;
    Vector<Scalar, n> x_s, x_1;
    kernel::add_product<1>(step.prior.x, L, kernel::block<n, 1>(u, 0, 0), x_s);  // x_s = x̂ + L a
    const Vector<Scalar, n> f = dynamics(step.dynamics_model, x_s, step.at) + step.mean_effect;
    kernel::add_product<1>(f, B, kernel::block<n, 1>(u, n, 0), x_1);  // x_1 = f(x_s) + G w̄ + B b
    Step::join(x_s, x_1, z);
    return z;
  }

  /// u of a root: a = Lᵀ f_xᵀ e, b = Bᵀ e.
  JML_RARE Vector<Scalar, 2 * n> coordinates(const typename Step::Visit& at) const {
    Vector<Scalar, 2 * n> u;
    Vector<Scalar, n> e, fe, part;
    kernel::product(kernel::transposed(at.m_x), at.weighted_innovation, e);  // e = m_xᵀ ν
    kernel::product(kernel::transposed(at.f_x), e, fe);
    kernel::product(kernel::transposed(L), fe, part);
    kernel::set_block(u, 0, 0, part);
    kernel::product(kernel::transposed(B), e, part);
    kernel::set_block(u, n, 0, part);
    return u;
  }

  JML_RARE bool evaluate(const Vector<Scalar, 2 * n>& u, Vector<Scalar, residuals>& r,
                         Matrix<Scalar, residuals, 2 * n>* J) const {
    const typename Step::Z z = point(u);
    const Vector<Scalar, n> x_1 = Step::next(z);
    Vector<Scalar, p> innovation =
        measurement_residual(step.sensor, step.y, measurement(step.sensor, x_1, step.at_y));
    whiten(innovation);
    kernel::set_block(r, 0, 0, u);
    kernel::set_block(r, 2 * n, 0, innovation);
    if (J != nullptr) {
      const Matrix<Scalar, n, n> f_x = dynamics_jacobian(step.dynamics_model, Step::smoothed(z), step.at);
      const Matrix<Scalar, p, n> m_x = measurement_jacobian(step.sensor, x_1, step.at_y);
      Matrix<Scalar, n, n> fL;
      Matrix<Scalar, p, n> by_a, by_b;
      kernel::multiply(f_x, L, fL);     // f_x L
      kernel::multiply(m_x, fL, by_a);  // m_x f_x L
      kernel::multiply(m_x, B, by_b);   // m_x B
      kernel::set_zero(*J);
      for (int j = 0; j < 2 * n; ++j) (*J)(j, j) = Scalar(1);
      for (int j = 0; j < 2 * n; ++j) {
        Vector<Scalar, p> column = j < n ? -kernel::column_of(by_a, j) : -kernel::column_of(by_b, j - n);
        whiten(column);
        kernel::set_block(*J, 2 * n, j, column);
      }
      if (!all_finite(*J)) return false;
    }
    return all_finite(r);
  }

  /// H ← H - [f_x L  B]ᵀ (Σ ν_k ∇²m_k) [f_x L  B] - [L  0]ᵀ Λ [L  0]: what JᵀJ leaves out of the Hessian.
  JML_RARE void add_curvature(const Vector<Scalar, 2 * n>& u, Matrix<Scalar, 2 * n, 2 * n>& H) const {
    typename Step::Visit at;
    const typename Step::Z z = point(u);
    if (!step.visit_apart(z, at)) return;
    const Bend<Step> bend(step, z, at);
    if (!bend.finite) return;
    const auto take = [&](const Matrix<Scalar, n, n>& second, const Matrix<Scalar, n, 2 * n>& by) {
      Matrix<Scalar, n, 2 * n> product;
      kernel::multiply(second, by, product);
      kernel::add_symmetric_transposed_product<-1>(H, by, product, H);
    };
    Matrix<Scalar, n, 2 * n> by = kernel::zeros<Matrix<Scalar, n, 2 * n>>();
    kernel::set_block(by, 0, 0, L);
    if constexpr (Bend<Step>::of_f) take(bend.f, by);
    if constexpr (Bend<Step>::of_m) {
      Matrix<Scalar, n, n> fL;
      kernel::multiply(at.f_x, L, fL);
      kernel::set_block(by, 0, 0, fL);
      kernel::set_block(by, 0, n, B);
      take(bend.m, by);
    }
  }

  /// v ← D^{-½} L⁻¹ v of R = L D Lᵀ.
  void whiten(Vector<Scalar, p>& v) const {
    for (int i = 0; i < p; ++i) {
      for (int k = 0; k < i; ++k) v(i) -= step.R_factor.lower(i, k) * v(k);
    }
    for (int i = 0; i < p; ++i) v(i) *= std::sqrt(step.R_factor.inverse_diagonal(i));
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
