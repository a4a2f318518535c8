// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One interval of ẋ = f(x) + G w by Gauss-Legendre collocation with three stages, order 6.
///
/// Stages X_i = x + h Σ_j a_ij (f(X_j) + G w_j) and end x + h Σ_j b_j (f(X_j) + G w_j), where w_j = w(t_j) is
/// free. Gauss methods are symplectic, b_i a_ij + b_j a_ji = b_i b_j: the least of
/// Σ h b_i ½ [w_iᵀQ⁻¹w_i + (y_i - m(X_i))ᵀR⁻¹(y_i - m(X_i))] over the w_i is the same method applied to the
/// two-point problem (12) of Rusnak (2018) itself, its costate of order 6 too. Whitened: G w_j = B β_j / √(h
/// b_j) with B Bᵀ = G Q Gᵀ, so that the first term is ½|β|².
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <jml/linear_algebra.hpp>
#include <jml/model/concepts.hpp>
#include <jml/solve/elimination.hpp>

namespace jml::detail {

/// The coefficients of the method.
struct Gauss {
  static constexpr int stages = 3;
  static constexpr double root = 3.872983346207416885;  // √15
  static constexpr double a[3][3] = {{5. / 36, 2. / 9 - root / 15, 5. / 36 - root / 30},
                                     {5. / 36 + root / 24, 2. / 9, 5. / 36 - root / 24},
                                     {5. / 36 + root / 30, 2. / 9 + root / 15, 5. / 36}};
  static constexpr double b[3] = {5. / 18, 4. / 9, 5. / 18};
  static constexpr double c[3] = {0.5 - root / 10, 0.5, 0.5 + root / 10};
};

/// The context of stage i of the interval `at`.
template <typename At>
[[nodiscard]] At stage_of(At at, int i) {
  at.time += Gauss::c[i] * static_cast<double>(at.dt);
  at.dt = 0;
  return at;
}

/// What moves by δx of the start and δβ: the stages X_i by XA_i δx + XB_i δβ, the end by A δx + B δβ.
template <typename Scalar, int n, int m>
struct CollocatedInterval {
  Matrix<Scalar, n, n> A, F[3], XA[3];
  Matrix<Scalar, n, m> B, XB[3];
  Matrix<Scalar, 3 * n, 3 * n> M;  // of the stage equations, I - h (a_ij f_x(X_j))
};

template <typename Scalar, typename D>
class CollocatedStep {
 public:
  static constexpr int n = DynamicsTraits<D>::states, q = DynamicsTraits<D>::disturbances, m = 3 * q;
  using X = Vector<Scalar, n>;
  using Whitened = Vector<Scalar, m>;
  using At = Context<Scalar, D>;
  using Stages = std::array<X, 3>;

  /// Refers to its arguments. B: B Bᵀ = G Q Gᵀ.
  CollocatedStep(const D& dynamics, const Matrix<Scalar, n, q>& B) : dynamics_(dynamics), B_(B) {}

  /// h a_ij, h b_j, √(h b_j).
  [[nodiscard]] static Scalar ha(const At& at, int i, int j) {
    return at.dt * static_cast<Scalar>(Gauss::a[i][j]);
  }
  [[nodiscard]] static Scalar hb(const At& at, int j) { return at.dt * static_cast<Scalar>(Gauss::b[j]); }
  [[nodiscard]] static Scalar root(const At& at, int j) { return std::sqrt(hb(at, j)); }

  /// The stages and the end by Newton's method from the stages given. False where it does not converge.
  [[nodiscard]] bool solve(const X& x, const Whitened& beta, const At& at, Stages& stages, X& end) const {
    constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
    X pushes[3], slopes[3];
    for (int j = 0; j < 3; ++j) {
      Vector<Scalar, q> part;
      for (int c = 0; c < q; ++c) part(c) = beta(j * q + c) / root(at, j);
      pushes[j] = B_ * part;
    }
    Scalar moved = 0;
    for (int iteration = 0; iteration < 12; ++iteration) {
      Matrix<Scalar, n, n> F[3];
      for (int j = 0; j < 3; ++j) {
        slopes[j] = predicted_state(dynamics_, stages[std::size_t(j)], stage_of(at, j)) + pushes[j];
        F[j] = dynamics_jacobian(dynamics_, stages[std::size_t(j)], stage_of(at, j));
      }
      Matrix<Scalar, 3 * n, 3 * n> M;
      stage_matrix(F, at, M);
      Vector<Scalar, 3 * n> rest;
      for (int i = 0; i < 3; ++i) {
        X sum = x - stages[std::size_t(i)];
        for (int j = 0; j < 3; ++j) kernel::add_scaled(sum, sum, ha(at, i, j), slopes[j]);
        for (int k = 0; k < n; ++k) rest(i * n + k) = sum(k);
      }
      if (!(kernel::eliminate(M, rest) > Scalar(0)) || !all_finite(rest)) return false;
      moved = 0;
      for (int k = 0; k < n; ++k) {
        Scalar size = std::abs(x(k)), by = 0;
        for (int i = 0; i < 3; ++i) {
          auto& X_i = stages[std::size_t(i)];
          X_i(k) += rest(i * n + k);
          size = std::max(size, std::abs(X_i(k)));
          by = std::max(by, std::abs(rest(i * n + k)));
        }
        if (by > Scalar(0)) moved = std::max(moved, by / size);
      }
      if (moved <= Scalar(4) * epsilon) break;
    }
    kernel::assign(end, x);
    for (int j = 0; j < 3; ++j) {
      const X slope = predicted_state(dynamics_, stages[std::size_t(j)], stage_of(at, j)) + pushes[j];
      kernel::add_scaled(end, end, hb(at, j), slope);
    }
    return moved <= std::sqrt(epsilon) && all_finite(end);
  }

  /// False where the stage equations are singular.
  [[nodiscard]] bool linearise(const Stages& stages, const At& at,
                               CollocatedInterval<Scalar, n, m>& out) const {
    for (int j = 0; j < 3; ++j)
      out.F[j] = dynamics_jacobian(dynamics_, stages[std::size_t(j)], stage_of(at, j));
    stage_matrix(out.F, at, out.M);
    Matrix<Scalar, 3 * n, 3 * n> M = out.M;
    Matrix<Scalar, 3 * n, n + m> right = kernel::zeros<Matrix<Scalar, 3 * n, n + m>>();
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < n; ++k) {
        right(i * n + k, k) = Scalar(1);
        for (int j = 0; j < 3; ++j) {
          for (int c = 0; c < q; ++c) right(i * n + k, n + j * q + c) = ha(at, i, j) * B_(k, c) / root(at, j);
        }
      }
    }
    if (!(kernel::eliminate(M, right) > Scalar(0)) || !all_finite(right)) return false;
    out.A = kernel::identity<Matrix<Scalar, n, n>>();
    for (int i = 0; i < 3; ++i) {
      out.XA[i] = kernel::block<n, n>(right, i * n, 0);
      out.XB[i] = kernel::block<n, m>(right, i * n, n);
      for (int k = 0; k < n; ++k) {
        for (int c = 0; c < q; ++c) out.B(k, i * q + c) = B_(k, c) * root(at, i);
      }
    }
    for (int i = 0; i < 3; ++i) {
      const Matrix<Scalar, n, n> hF = hb(at, i) * out.F[i];
      out.A += hF * out.XA[i];
      out.B += hF * out.XB[i];
    }
    return true;
  }

  /// Of a function with gradient `slope` at the end and s_i at the stages: its gradient by each f(X_j), with
  /// the start fixed, into `weights`, and by the start. False where the stage equations are singular.
  [[nodiscard]] bool adjoint(const CollocatedInterval<Scalar, n, m>& interval, const At& at, const X& slope,
                             const X (&s)[3], X (&weights)[3], X& start) const {
    Matrix<Scalar, 3 * n, 3 * n> MT = kernel::transposed(interval.M);
    Vector<Scalar, 3 * n> nu;
    for (int i = 0; i < 3; ++i) {
      const X part = s[i] + hb(at, i) * (kernel::transposed(interval.F[i]) * slope);
      for (int k = 0; k < n; ++k) nu(i * n + k) = part(k);
    }
    if (!(kernel::eliminate(MT, nu) > Scalar(0))) return false;
    kernel::assign(start, slope);
    for (int j = 0; j < 3; ++j) {
      kernel::scale(weights[j], hb(at, j), slope);
      for (int k = 0; k < n; ++k) {
        start(k) += nu(j * n + k);
        for (int i = 0; i < 3; ++i) weights[j](k) += ha(at, i, j) * nu(i * n + k);
      }
    }
    return true;
  }

 private:
  static void stage_matrix(const Matrix<Scalar, n, n> (&F)[3], const At& at,
                           Matrix<Scalar, 3 * n, 3 * n>& M) {
    M = kernel::identity<Matrix<Scalar, 3 * n, 3 * n>>();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        for (int c = 0; c < n; ++c) {
          for (int k = 0; k < n; ++k) M(i * n + k, j * n + c) -= ha(at, i, j) * F[j](k, c);
        }
      }
    }
  }

  const D& dynamics_;
  const Matrix<Scalar, n, q>& B_;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
