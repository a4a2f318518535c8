// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// From continuous dynamics ẋ = f(x) + G w to one discrete step of length dt, with its Jacobian, SDC and
/// noise.
///
/// The stages of the integrator carry a matrix along: with A = f_x at each stage it becomes the Jacobian of
/// the step by the chain rule; with A = F, F(x) x = f(x), it becomes a SDC matrix of the step, exactly, for
/// the same reason.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>
#include <jml/model/discretize_in_space.hpp>
#include <jml/solve/exponential.hpp>
#include <jml/solve/runge_kutta.hpp>

namespace jml {
/// Noise of the step by Van Loan (1978, IEEE TAC 23): ∫₀^dt e^{As} G Q Gᵀ e^{Aᵀs} ds with A = f_x(x), from
/// one exponential of a 2n×2n matrix. n disturbances, G = I.
struct VanLoan {};
/// Noise held over the step: G dt and Q/dt, rank q as the continuous model's. Order 1, and cheap.
struct HeldNoise {};

/// One step of `Continuous` as discrete dynamics; dt comes with the StepContext of each step. Made by
/// discretize().
template <typename Continuous, typename Integrator, typename NoiseModel>
class Discretized {
  static_assert(detail::require_dynamics<Continuous>());
  static_assert(ContinuousDynamics<Continuous>,
                "jml: discretize makes a step of ẋ = f(x), which says `using time_domain = "
                "jml::ContinuousTime;`; x⁺ = f(x) goes into a filter as it is");
  using Traits = DynamicsTraits<Continuous>;
  static constexpr int n = Traits::states, q = Traits::disturbances;
  static constexpr bool van_loan = std::is_same_v<NoiseModel, VanLoan>;
  static_assert(ExplicitMethod<Integrator>,
                "jml: discretize<Integrator> makes a step of jml::Euler or jml::RungeKutta4, and of no other "
                "integrator; for DavisonMaki or Cvode keep the model continuous and take jml::Continuous");
  static_assert(van_loan || std::is_same_v<NoiseModel, HeldNoise>,
                "jml: discretize<Integrator, NoiseModel> takes jml::VanLoan (the default) or jml::HeldNoise");

  // Which derivatives the continuous model can give, for a state of scalar T.
  template <typename T, typename S>
  struct Gives {
    using X = Vector<T, n>;
    using Then = StepContext<S, Traits::controls>;
    static constexpr bool jacobian =
        detail::Generic<detail::HookOf<detail::hooks::DynamicsJacobian, Continuous>, X, Then> ||
        detail::Generic<detail::HookOf<detail::hooks::Dynamics, Continuous>, Vector<Dual<T, n>, n>, Then>;
    static constexpr bool sdc = requires(const Continuous& c, const X& x) {
      Traits::sdc(c, x);
    } || requires(const Continuous& c, const X& x, const Then& at) { Traits::sdc(c, x, at); };
  };

 public:
  /// Sizes and promises as a dynamics struct gives them.
  /// @{
  static constexpr int states = n;
  static constexpr int disturbances = van_loan && q > 0 ? n : q;
  static constexpr int controls = Traits::controls;
  static constexpr bool linear = Traits::linear;
  /// @}

  explicit Discretized(Continuous model) : continuous(std::move(model)) {}  ///< ẋ = f(x)
  Continuous continuous;                                                    ///< ẋ = f(x)

  /// x after one step of the integrator of length at.dt, n.
  template <typename T, typename S>
  Vector<T, n> dynamics(const Vector<T, n>& x, const StepContext<S, controls>& at) const {
    Vector<T, n> next;
    (void)explicit_step(Integrator{}, x, at.dt, next,
                        [&](int, S after, const Vector<T, n>& z, Vector<T, n>& slope) {
                          slope = jml::predicted_state(continuous, z, stage(at, after));
                          return Status::ok;
                        });
    return next;
  }

  /// Its derivative, n×n, from that of the continuous model.
  template <typename T, typename S>
  Matrix<T, n, n> dynamics_jacobian(const Vector<T, n>& x, const StepContext<S, controls>& at) const
    requires(Gives<T, S>::jacobian)
  {
    return carry(x, at, [&](const Vector<T, n>& z, const StepContext<S, controls>& then) {
      return jml::dynamics_jacobian(continuous, z, then);
    });
  }

  /// Where the continuous model has its own SDC matrix: about the origin, which must be an equilibrium.
  template <typename T, typename S>
  Matrix<T, n, n> dynamics_sdc(const Vector<T, n>& x, const StepContext<S, controls>& at) const
    requires(Gives<T, S>::sdc)
  {
    return carry(x, at, [&](const Vector<T, n>& z, const StepContext<S, controls>& then) {
      return jml::dynamics_sdc<true>(continuous, z, Vector<T, n>(kernel::zeros<Vector<T, n>>()), then);
    });
  }

  /// G dt of HeldNoise, n×q.
  template <typename S>
  Matrix<S, n, q> disturbance_input(const Vector<S, n>& x, const StepContext<S, controls>& at) const
    requires(!van_loan && q > 0)
  {
    return jml::disturbance_input(continuous, x, at) * at.dt;
  }

  /// Of the step: Van Loan's, n×n, or Q/dt, q×q; zero where dt is zero.
  template <typename S>
  Matrix<S, disturbances, disturbances> disturbance_covariance(const Vector<S, n>& x,
                                                               const StepContext<S, controls>& at) const
    requires(q > 0)
  {
    const Matrix<S, q, q> Q = jml::disturbance_spectral_density(continuous, x, at);
    if constexpr (!van_loan) {
      return at.dt > S(0) ? Matrix<S, q, q>(Q / at.dt) : Matrix<S, q, q>(kernel::zeros<Matrix<S, q, q>>());
    } else {
      const Matrix<S, n, q> G = jml::disturbance_input(continuous, x, at);
      const Matrix<S, n, n> A = jml::dynamics_jacobian(continuous, x, at);
      const Matrix<S, n, n> AT = kernel::transposed(A), C = G * Q * kernel::transposed(G);
      // Van Loan on a piece of dt that keeps ‖A‖ short, then doubled: e^{-A dt} must not overflow.
      S length = at.dt;
      int doublings = 0;
      const S rate = std::max(kernel::largest_column_sum(A), kernel::largest_column_sum(AT));
      while (rate * length > S(0.5) && doublings < 60) {
        length /= S(2);
        ++doublings;
      }
      // e^[-A C; 0 Aᵀ] is linear in C, which may have any size: so it is taken of one that is short too.
      const S size = S(2.5) * kernel::largest_column_sum(C) * length, unit = size > S(0) ? size : S(1);
      Matrix<S, 2 * n, 2 * n> H = kernel::zeros<Matrix<S, 2 * n, 2 * n>>();
      kernel::set_block(H, 0, 0, -A * length);
      kernel::set_block(H, 0, n, C * (length / unit));
      kernel::set_block(H, n, n, AT * length);
      const kernel::Exponential<S, 2 * n> exponential(H, kernel::largest_column_sum(H));
      const Matrix<S, 2 * n, 2 * n>& E = exponential.value();
      Matrix<S, n, n> transition = kernel::transposed(kernel::block<n, n>(E, n, n));
      Matrix<S, n, n> noise = unit * (transition * kernel::block<n, n>(E, 0, n));
      for (int i = 0; i < doublings; ++i) {
        noise = noise + transition * noise * kernel::transposed(transition);
        transition = transition * transition;
      }
      // What rounding left indefinite is cut: the result is a covariance, whatever the scales of the states.
      const Matrix<S, n, n> L = kernel::SemidefiniteFactor<S, n>(kernel::symmetric_part(noise)).L;
      Matrix<S, n, n> out = L * kernel::transposed(L);
      for (int k = 0; k < n; ++k) {
        for (int m = 0; m < k; ++m) out(m, k) = out(k, m);
      }
      return out;
    }
  }

 private:
  template <typename S>
  static StepContext<S, controls> stage(StepContext<S, controls> at, S after) {
    at.time += static_cast<double>(after);
    return at;
  }

  /// Φ of the step: from the identity by Φ̇ = A(x) Φ, moved together with x.
  template <typename T, typename S, typename A>
  Matrix<T, n, n> carry(const Vector<T, n>& x, const StepContext<S, controls>& at, const A& a) const {
    using Point = StateAndMatrix<Vector<T, n>, Matrix<T, n, n>>;
    const Point start{x, kernel::identity<Matrix<T, n, n>>()};
    Point end;
    (void)explicit_step(Integrator{}, start, at.dt, end, [&](int, S after, const Point& z, Point& slope) {
      const auto then = stage(at, after);
      slope.x = jml::predicted_state(continuous, z.x, then);
      slope.P = a(z.x, then) * z.P;
      return Status::ok;
    });
    return end.P;
  }
};

/// Discrete dynamics from continuous ones: `jml::discretize<jml::RungeKutta4>(model)`. dt is given at each
/// step. Integrator: Euler or RungeKutta4 (one step of it), NoiseModel: VanLoan or HeldNoise; any other type
/// is a compile-time error. Of dynamics in a space, or with w as an argument: DiscretizedInSpace, noise held.
template <typename Integrator, typename NoiseModel = VanLoan, typename Continuous>
  requires(detail::steps_in_space<Continuous>())
[[nodiscard]] DiscretizedInSpace<Continuous, Integrator> discretize(const Continuous& model) {
  return DiscretizedInSpace<Continuous, Integrator>(model);
}
/// The same, of flat dynamics.
template <typename Integrator, typename NoiseModel = VanLoan, typename Continuous>
  requires(!detail::steps_in_space<Continuous>())
[[nodiscard]] Discretized<Continuous, Integrator, NoiseModel> discretize(const Continuous& model) {
  return Discretized<Continuous, Integrator, NoiseModel>(model);
}

/// A sensor of continuous time as one of samples: R becomes R/dt, with the dt of the step. Made by sampled().
///
/// A sample then weighs as much as the measurement would over the step that it ends.
template <typename Continuous>
struct Sampled {
  /// As a sensor struct gives them.
  /// @{
  static constexpr int measurements = SensorTraits<Continuous>::measurements;
  static constexpr bool linear = SensorTraits<Continuous>::linear;
  /// @}
  Continuous continuous;  ///< with a noise_spectral_density()
};

template <typename Continuous>
struct SensorTraits<Sampled<Continuous>> : SensorTraits<Continuous> {
  using Of = SensorTraits<Continuous>;
  template <typename... A>
  static constexpr auto measurement(const Sampled<Continuous>& s, const A&... a)
      -> decltype(Of::measurement(s.continuous, a...)) {
    return Of::measurement(s.continuous, a...);
  }
  template <typename... A>
  static constexpr auto jacobian(const Sampled<Continuous>& s, const A&... a)
      -> decltype(Of::jacobian(s.continuous, a...)) {
    return Of::jacobian(s.continuous, a...);
  }
  template <typename... A>
  static constexpr auto sdc(const Sampled<Continuous>& s, const A&... a)
      -> decltype(Of::sdc(s.continuous, a...)) {
    return Of::sdc(s.continuous, a...);
  }
  template <typename... A>
  static constexpr auto sdc_about(const Sampled<Continuous>& s, const A&... a)
      -> decltype(Of::sdc_about(s.continuous, a...)) {
    return Of::sdc_about(s.continuous, a...);
  }
  template <typename... A>
  static constexpr auto residual(const Sampled<Continuous>& s, const A&... a)
      -> decltype(Of::residual(s.continuous, a...)) {
    return Of::residual(s.continuous, a...);
  }
  template <typename X, typename At>
  static auto noise_covariance(const Sampled<Continuous>& s, const X& x, const At& at) {
    return Matrix<typename X::Scalar, Of::measurements, Of::measurements>(
        noise_spectral_density(s.continuous, x, at) / at.dt);
  }
};

/// A discrete sensor from one of continuous time: `jml::sampled(sensor)`. A correction alone, whose dt is
/// zero, is refused.
template <typename Continuous>
[[nodiscard]] Sampled<Continuous> sampled(const Continuous& sensor) {
  return {sensor};
}

}  // namespace jml
#include <jml/warnings_end.hpp>
