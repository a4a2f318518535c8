// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The terms of the criterion J (Rusnak 2015, eq. (5)) as cost functions of Ceres (component jml::ceres); who
/// needs them is interval/ceres.hpp.
///
/// Unknowns: the states of all nodes, each component counted in a unit that is a power of two near its
/// natural size. The scaling is exact, and no tolerance of Ceres then depends on the units of the model.
#include <jml/warnings_begin.hpp>
#pragma once

#include <ceres/sized_cost_function.h>

#include <Eigen/Cholesky>
#include <jml/model/functions.hpp>

namespace jml::detail {

/// Ceres wants Jacobians by rows; Eigen calls a column with that order an error.
template <int rows, int cols>
using CeresJacobian =
    Eigen::Matrix<double, rows, cols, cols == 1 && rows != 1 ? Eigen::ColMajor : Eigen::RowMajor>;

/// to = L⁻¹ from, the Jacobian of a whitened residual.
template <int rows, int cols>
void write_whitened(const Matrix<double, rows, rows>& L, const Matrix<double, rows, cols>& from, double* to) {
  Eigen::Map<CeresJacobian<rows, cols>> out(to);
  out = L.template triangularView<Eigen::Lower>().solve(from);
}

/// Holds a difference d to be a disturbance of covariance C, singular or not: the residual L⁻¹ (d + S λ) with
/// L Lᵀ = C + S. S is zero where C is regular, else a small diagonal matrix. After a minimisation
/// λ ← (C + S)⁻¹ (d + S λ); once λ stays, d = C λ, whatever S is (method of multipliers, with the disturbance
/// minimised out).
template <int n>
struct Hold {
  using X = Vector<double, n>;
  using Square = Matrix<double, n, n>;
  Square L = kernel::identity<Square>();
  X slack = kernel::zeros<X>();  // the diagonal of S

  /// size: the natural size of d, a standard deviation each; S = share · size². False where that does not
  /// make C positive definite.
  bool form(const Square& C, const X& size, double share) {
    const X least = share * size.cwiseAbs2();
    const Square floor = least.asDiagonal();
    const bool regular = Eigen::LLT<Square>(C - floor).info() == Eigen::Success;
    slack = regular ? X(kernel::zeros<X>()) : least;
    const Eigen::LLT<Square> root(regular ? C : Square(C + floor));
    L = root.matrixL();
    return root.info() == Eigen::Success && all_finite(L);
  }
  [[nodiscard]] X residual(const X& d, const X& multiplier) const {
    return L.template triangularView<Eigen::Lower>().solve(d + slack.cwiseProduct(multiplier));
  }
  /// The next λ.
  [[nodiscard]] X multiplier(const X& d, const X& before) const {
    return L.transpose().template triangularView<Eigen::Upper>().solve(residual(d, before));
  }
};

/// x⁺ = f(x) + G w̄ + G w, over one step.
template <typename D>
class StepTerm final : public ::ceres::SizedCostFunction<states_of<D>, states_of<D>, states_of<D>> {
  static constexpr int n = states_of<D>;

 public:
  using X = Vector<double, n>;
  using At = StepContext<double, DynamicsTraits<D>::controls>;

  StepTerm(const D& dynamics, const At& at, const X& unit, const Hold<n>& hold)
      : dynamics_(dynamics), at_(at), unit_(unit), hold_(hold) {}

  X mean_effect = kernel::zeros<X>();  // G w̄
  X multiplier = kernel::zeros<X>();   // λ

  [[nodiscard]] X difference(const X& x, const X& next) const {
    return next - dynamics(dynamics_, x, at_) - mean_effect;
  }
  [[nodiscard]] const Hold<n>& hold() const { return hold_; }

  bool Evaluate(const double* const* u, double* out, double** jacobians) const override {
    const X x = unit_.cwiseProduct(Eigen::Map<const X>(u[0]));
    const X next = unit_.cwiseProduct(Eigen::Map<const X>(u[1]));
    const X r = hold_.residual(difference(x, next), multiplier);
    Eigen::Map<X>(out, n) = r;
    bool finite = all_finite(r);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      const Matrix<double, n, n> slope = -dynamics_jacobian(dynamics_, x, at_) * unit_.asDiagonal();
      write_whitened(hold_.L, slope, jacobians[0]);
      finite = finite && all_finite(slope);
    }
    if (jacobians != nullptr && jacobians[1] != nullptr) {
      const Matrix<double, n, n> slope = unit_.asDiagonal();
      write_whitened(hold_.L, slope, jacobians[1]);
    }
    return finite;
  }

 private:
  const D& dynamics_;
  At at_;
  const X& unit_;
  const Hold<n>& hold_;
};

/// x_0 = x̂_0, with P_0.
template <int n>
class PriorTerm final : public ::ceres::SizedCostFunction<n, n> {
 public:
  using X = Vector<double, n>;

  PriorTerm(const X& mean, const X& unit) : mean_(mean), unit_(unit) {}

  Hold<n> hold;
  X multiplier = kernel::zeros<X>();  // λ

  [[nodiscard]] X difference(const X& x) const { return x - mean_; }

  bool Evaluate(const double* const* u, double* out, double** jacobians) const override {
    const X x = unit_.cwiseProduct(Eigen::Map<const X>(u[0]));
    Eigen::Map<X>(out, n) = hold.residual(difference(x), multiplier);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      const Matrix<double, n, n> slope = unit_.asDiagonal();
      write_whitened(hold.L, slope, jacobians[0]);
    }
    return true;
  }

 private:
  const X& mean_;
  const X& unit_;
};

/// y = m(x) + v.
template <typename S, int n, typename At>
class MeasurementTerm final : public ::ceres::SizedCostFunction<measurements_of<S>, n> {
  static constexpr int p = measurements_of<S>;

 public:
  using X = Vector<double, n>;

  MeasurementTerm(const S& sensor, const Vector<double, p>& y, const At& at, const X& unit)
      : sensor_(sensor), y_(y), at_(at), unit_(unit) {}

  /// Takes R at x. False where it is no covariance. `change` becomes the relative change where that is
  /// larger.
  bool freeze(const X& x, double& change) {
    const Matrix<double, p, p> before = L_;
    const Eigen::LLT<Matrix<double, p, p>> root(noise_covariance(sensor_, x, at_));
    L_ = root.matrixL();
    change = std::max(change, (L_ - before).norm() / L_.norm());
    return root.info() == Eigen::Success && all_finite(L_);
  }

  bool Evaluate(const double* const* u, double* out, double** jacobians) const override {
    const X x = unit_.cwiseProduct(Eigen::Map<const X>(u[0]));
    const Vector<double, p> r = measurement_residual(sensor_, y_, measurement(sensor_, x, at_));
    Eigen::Map<Vector<double, p>>(out, p) = L_.template triangularView<Eigen::Lower>().solve(r);
    bool finite = all_finite(r);
    if (jacobians != nullptr && jacobians[0] != nullptr) {
      const Matrix<double, p, n> slope = -measurement_jacobian(sensor_, x, at_) * unit_.asDiagonal();
      write_whitened(L_, slope, jacobians[0]);
      finite = finite && all_finite(slope);
    }
    return finite;
  }

 private:
  const S& sensor_;
  const Vector<double, p>& y_;
  At at_;
  const X& unit_;
  Matrix<double, p, p> L_ = kernel::identity<Matrix<double, p, p>>();
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
