// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The Hamiltonian system of McCaffrey 1998, eq. (10), whose unstable manifold carries the Lyapunov function
/// S of the state-dependent Riccati filter, and what is asked of a point of it. Used by stability_region.hpp.
///
///   H(x, λ) = λᵀf + ½ λᵀGQGᵀλ - ½ hᵀR⁻¹h,   ẋ = f + GQGᵀλ,   λ̇ = -f_xᵀλ + h_xᵀR⁻¹h,   λ = ∂S/∂x.
/// Along a characteristic Ṡ = λᵀẋ = ½ λᵀGQGᵀλ + ½ hᵀR⁻¹h where H = 0: never negative, so ln S can be the
/// independent variable. Where Gᵀλ and h vanish together Ṡ does too; there time goes on at a bounded
/// pace while S waits, so that S may fall short of the value asked for but never runs past it.
///
/// Coordinates: x = T z and λ = T⁻ᵀ ζ with V(0) = T Tᵀ, a canonical change, then both divided by
/// √(2S). On the linear system z = ζ is a unit vector; no unit of the model is left.
///
/// G, Q and R must be constants: with G(x), λ̇ would have the term -½ ∂(λᵀGQGᵀλ)/∂x, with R(x) another, and
/// neither is derived here. Refused at compile time.
#include <jml/warnings_begin.hpp>
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <jml/factors.hpp>
#include <jml/riccati/algebraic.hpp>
#include <jml/riccati/process_noise.hpp>
#include <jml/status.hpp>

namespace jml {

/// A point of a characteristic and what the filter without input does there.
template <int n>
struct StabilityPoint {
  Vector<double, n> x = kernel::zeros<Vector<double, n>>();       ///< units of x
  Vector<double, n> lambda = kernel::zeros<Vector<double, n>>();  ///< ∂S/∂x
  double level = 0;                                               ///< S
  /// dS/dt of ẋ = f - V(x)HᵀR⁻¹h, per second: the full condition is rate < 0.
  double rate = 0;
  /// ½hᵀR⁻¹h - λᵀV(x)HᵀR⁻¹h: the printed condition (13) is printed < 0. It lacks -½ λᵀGQGᵀλ.
  double printed = 0;
  double hamiltonian = 0;      ///< |H| over the sum of the sizes of its terms: 0 on the manifold
  double covariance = 0;       ///< size of V(x) relative to V(0), 1 at the origin
  Status status = Status::ok;  ///< of V(x)
};

namespace detail {

template <typename D, typename S>
consteval bool require_constant_noise() {
  using T = DynamicsTraits<D>;
  using X = Vector<double, T::states>;
  using At = StepContext<double, T::controls>;
  static_assert(require_continuous<D>() && require_sensor<S>());
  static_assert(
      !requires(const D& d, const X& x) { T::disturbance_input(d, x); } &&
          !requires(const D& d, const X& x) { T::disturbance_spectral_density(d, x); },
      "jml: the region of stability needs a constant G and Q: disturbance_input() and "
      "disturbance_spectral_density() without arguments");
  static_assert(
      !requires(const S& s, const X& x) { SensorTraits<S>::noise_spectral_density(s, x); } &&
          !requires(const S& s, const X& x, const At& at) {
            SensorTraits<S>::noise_spectral_density(s, x, at);
          },
      "jml: the region of stability needs a constant R: noise_spectral_density() without arguments");
  return true;
}

/// The filter's model about the origin, its steady V(0) and the coordinates z.
template <typename D, typename S>
class RiccatiFilterModel {
  static_assert(require_constant_noise<D, S>());

 public:
  static constexpr int n = states_of<D>, p = measurements_of<S>;
  using X = Vector<double, n>;
  using Covariance = Matrix<double, n, n>;
  using At = StepContext<double, DynamicsTraits<D>::controls>;

  RiccatiFilterModel(const D& d, const S& s) : d_(d), s_(s), at_(no_context<double, D>()) {
    status_ = prepare();
  }

  /// invalid_state: f(0) or m(0) is not zero. covariance_lost: V(0) is singular, S has no start.
  [[nodiscard]] Status status() const { return status_; }
  [[nodiscard]] const Covariance& origin_covariance() const { return V0_; }
  [[nodiscard]] const Covariance& noise() const { return noise_; }
  /// Mean decay rate of the linear filter at the origin, 1/s: the pace of everything.
  [[nodiscard]] double pace() const { return pace_; }
  [[nodiscard]] bool printed_can_hold() const { return printed_can_hold_; }
  [[nodiscard]] double definiteness() const { return definiteness_; }

  [[nodiscard]] X into(const X& x) const { return T_.template triangularView<Eigen::Lower>().solve(x); }
  [[nodiscard]] X out_of(const X& z) const { return T_.template triangularView<Eigen::Lower>() * z; }
  [[nodiscard]] X costate_into(const X& lambda) const { return T_.transpose() * lambda; }
  [[nodiscard]] X costate_out_of(const X& zeta) const {
    return T_.transpose().template triangularView<Eigen::Upper>().solve(zeta);
  }

  [[nodiscard]] X f(const X& x) const { return dynamics(d_, x, at_); }
  [[nodiscard]] Vector<double, p> h(const X& x) const { return measurement(s_, x, at_); }
  [[nodiscard]] Vector<double, p> weighted(const Vector<double, p>& y) const { return R_.solve(y); }
  [[nodiscard]] Covariance f_x(const X& x) const { return dynamics_jacobian(d_, x, at_); }
  [[nodiscard]] Matrix<double, p, n> h_x(const X& x) const { return measurement_jacobian(s_, x, at_); }

  /// V(x) from a neighbour's V, and V HᵀR⁻¹h, eq. (9) and (8).
  [[nodiscard]] Status gain(const X& x, Covariance& V, X& correction) const {
    const X origin = kernel::zeros<X>();
    const Covariance F = dynamics_sdc<true>(d_, x, origin, at_);
    const Matrix<double, p, n> H = measurement_sdc<true>(s_, x, origin, at_);
    const auto solution = solve_algebraic_riccati(equation(F, H), V);
    if (!usable(solution.status)) return solution.status;
    V = solution.X;
    correction = V * (H.transpose() * weighted(h(x)));
    return all_finite(correction) ? Status::ok : Status::covariance_lost;
  }

  /// Everything StabilityPoint says; V is the neighbour's and becomes this point's.
  [[nodiscard]] StabilityPoint<n> examine(const X& x, const X& lambda, double level, Covariance& V) const {
    StabilityPoint<n> out{x, lambda, level};
    const X drift = f(x);
    const Vector<double, p> y = h(x);
    const double disturbed = 0.5 * lambda.dot(noise_ * lambda), seen = 0.5 * y.dot(weighted(y));
    const double moved = lambda.dot(drift);
    const double size = std::abs(moved) + disturbed + seen;
    out.hamiltonian = size > 0 ? std::abs(moved + disturbed - seen) / size : 0.0;
    X correction = kernel::zeros<X>();
    out.status = gain(x, V, correction);
    out.printed = seen - lambda.dot(correction);
    out.rate = out.printed - disturbed;
    const Covariance half = T_.template triangularView<Eigen::Lower>().solve(V);
    out.covariance = T_.template triangularView<Eigen::Lower>().solve(half.transpose()).norm() / std::sqrt(n);
    if (!usable(out.status)) out.covariance = std::numeric_limits<double>::infinity();
    return out;
  }

 private:
  AlgebraicRiccati<double, n> equation(const Covariance& F, const Matrix<double, p, n>& H) const {
    Covariance information;
    for (int j = 0; j < n; ++j) information.col(j) = H.transpose() * weighted(H.col(j));
    return {F, F.transpose(), noise_, 0.5 * (information + information.transpose())};
  }

  Status prepare() {
    const X origin = kernel::zeros<X>();
    const Covariance F = dynamics_sdc<true>(d_, origin, origin, at_);
    const Matrix<double, p, n> H = measurement_sdc<true>(s_, origin, origin, at_);
    if (!all_finite(F)) return Status::dynamics_not_finite;
    if (!all_finite(H)) return Status::sensor_not_finite;
    if (f(origin).norm() != 0 || h(origin).norm() != 0) return Status::invalid_state;
    const ProcessNoise<double, D> process(d_);
    if (!process.with(d_, origin, at_, [this](const auto& GQG) { noise_ = GQG; }))
      return Status::invalid_disturbance_covariance;
    const Matrix<double, p, p> R = noise_spectral_density(s_, origin, at_);
    if (!is_noise_covariance(R) || !R_.factor(R)) return Status::invalid_noise_covariance;
    const auto solution = solve_algebraic_riccati(equation(F, H));
    if (!usable(solution.status)) return solution.status;
    V0_ = solution.X;
    if (!is_definite<Definite::positive>(V0_)) return Status::covariance_lost;
    const Eigen::LLT<Covariance> cholesky(V0_);
    T_ = cholesky.matrixL();
    const Covariance information = equation(F, H).S;
    pace_ = -(F - V0_ * information).trace() / n;
    if (!(pace_ > 0)) return Status::no_stabilizing_solution;
    const Covariance seen = T_.transpose() * information * T_;
    const Covariance half = T_.template triangularView<Eigen::Lower>().solve(noise_);
    const Covariance disturbed = T_.template triangularView<Eigen::Lower>().solve(half.transpose());
    printed_can_hold_ = is_definite<Definite::positive>(seen);
    const Eigen::SelfAdjointEigenSolver<Covariance> modes(0.5 * (seen + disturbed), Eigen::EigenvaluesOnly);
    definiteness_ = std::max(0.0, modes.eigenvalues()(0)) / pace_;
    return Status::ok;
  }

  D d_;
  S s_;
  At at_;
  Status status_ = Status::ok;
  Covariance noise_ = kernel::zeros<Covariance>(), V0_ = kernel::zeros<Covariance>(),
             T_ = kernel::identity<Covariance>();
  kernel::SymmetricFactor<double, p> R_;
  double pace_ = 0, definiteness_ = 0;
  bool printed_can_hold_ = false;
};

/// The characteristics in the scaled coordinates: (z/√(2S), ζ/√(2S), ln S) against a variable that is ln S
/// wherever Ṡ is not small.
template <typename Model>
struct Characteristic {
  static constexpr int n = Model::n;
  using X = Vector<double, n>;
  using State = Vector<double, 2 * n + 1>;
  static constexpr double slowest = 1e-3;  // of Ṡ, relative to the pace of S: below, time leads

  const Model& model;

  static State state(const Model& model, const X& x, const X& lambda, double level) {
    State y;
    const double radius = std::sqrt(2 * level);
    y << model.into(x) / radius, model.costate_into(lambda) / radius, std::log(level);
    return y;
  }
  static double level(const State& y) { return std::exp(y(2 * n)); }
  X position(const State& y) const { return model.out_of(y.template head<n>() * std::sqrt(2 * level(y))); }
  X costate(const State& y) const {
    return model.costate_out_of(y.template segment<n>(n) * std::sqrt(2 * level(y)));
  }

  Status derivative(double, const double* from, double* to) const {
    const Eigen::Map<const State> y(from);
    Eigen::Map<State> out(to);
    const double S = std::exp(y(2 * n)), radius = std::sqrt(2 * S);
    const X x = model.out_of(y.template head<n>() * radius);
    const X lambda = model.costate_out_of(y.template segment<n>(n) * radius);
    const X disturbed = model.noise() * lambda;
    const auto h = model.h(x);
    const auto g = model.weighted(h);
    const double S_dot = 0.5 * lambda.dot(disturbed) + 0.5 * h.dot(g);
    const double seconds = S / std::max(S_dot, slowest * model.pace() * S);  // per unit of the variable
    const double gained = S_dot * seconds / S;
    const X x_dot = model.f(x) + disturbed;
    const X lambda_dot = model.h_x(x).transpose() * g - model.f_x(x).transpose() * lambda;
    out.template head<n>() = model.into(x_dot) * (seconds / radius) - 0.5 * gained * y.template head<n>();
    out.template segment<n>(n) =
        model.costate_into(lambda_dot) * (seconds / radius) - 0.5 * gained * y.template segment<n>(n);
    out(2 * n) = gained;
    return out.allFinite() ? Status::ok : Status::dynamics_not_finite;
  }
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
