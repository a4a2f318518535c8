// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The Jacobian of the n + n² coupled equations (17), (19) in z = (x, P column by column), for stiff solvers.
///
/// Along P it is written down: δẋ = δP W (y - m), δṖ = (A - K E) δP + δP (Bᵀ - W E P), W = Dᵀ R⁻¹. Along x
/// the slots are differentiated with dual numbers, one level above the model's own, where the model can be;
/// else by differences of the right-hand side. G, Q and R count as constants there.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/dual_functions.hpp>
#include <jml/riccati/differential.hpp>

namespace jml {

namespace detail {

template <typename D>
constexpr auto sdc_of(const D& d) {
  return [&d](const auto&... a) -> decltype(DynamicsTraits<D>::sdc(d, a...)) {
    return DynamicsTraits<D>::sdc(d, a...);
  };
}
template <typename S>
constexpr auto sensor_sdc_of(const S& s) {
  return [&s](const auto&... a) -> decltype(SensorTraits<S>::sdc(s, a...)) {
    return SensorTraits<S>::sdc(s, a...);
  };
}

/// True where a function, its Jacobian and its SDC matrix (if it is the model's own) accept dual numbers.
template <typename Function, typename Jacobian, typename Sdc, typename Scalar, int n, typename At>
constexpr bool accepts_duals() {
  using T = Dual<Scalar, n>;
  return Generic<Function, Vector<T, n>, At> &&
         (Generic<Jacobian, Vector<T, n>, At> || Generic<Function, Vector<Dual<T, n>, n>, At>) &&
         (!Callable<Sdc, Vector<Scalar, n>, At> || Generic<Sdc, Vector<T, n>, At>);
}

/// True where the model has no function of two vectors of this name, or one that accepts dual numbers too: a
/// SDC matrix about a reference of its own, or a sensor's residual, which a derived SDC matrix goes through.
template <typename Function, typename X, typename DualX, typename At>
constexpr bool pair_accepts_duals() {
  const auto answers_in = []<typename V, typename... A>(std::type_identity<V>, std::type_identity<A>...) {
    return std::is_same_v<typename std::remove_cvref_t<std::invoke_result_t<Function, V, V, A...>>::Scalar,
                          typename V::Scalar>;
  };
  constexpr std::type_identity<DualX> duals;
  constexpr std::type_identity<At> at;
  if constexpr (std::is_invocable_v<Function, X, X, At>)
    return answers_in(duals, at);
  else if constexpr (std::is_invocable_v<Function, X, X>)
    return answers_in(duals);
  else
    return true;
}
template <typename D>
constexpr auto sdc_about_of(const D& d) {
  return [&d](const auto&... a) -> decltype(DynamicsTraits<D>::sdc_about(d, a...)) {
    return DynamicsTraits<D>::sdc_about(d, a...);
  };
}
template <typename S>
constexpr auto sensor_sdc_about_of(const S& s) {
  return [&s](const auto&... a) -> decltype(SensorTraits<S>::sdc_about(s, a...)) {
    return SensorTraits<S>::sdc_about(s, a...);
  };
}
template <typename S>
constexpr auto residual_of(const S& s) {
  return [&s](const auto&... a) -> decltype(SensorTraits<S>::residual(s, a...)) {
    return SensorTraits<S>::residual(s, a...);
  };
}

}  // namespace detail

/// True where every slot of the flow can be differentiated by dual numbers.
template <typename Flow>
constexpr bool differentiable() {
  using D = std::remove_cvref_t<decltype(std::declval<Flow>().dynamics())>;
  using S = std::remove_cvref_t<decltype(std::declval<Flow>().sensor())>;
  using Scalar = typename Flow::Scalar;
  using At = typename Flow::At;
  using X = typename Flow::X;
  using DualX = Vector<Dual<Scalar, Flow::n>, Flow::n>;
  bool all =
      detail::accepts_duals<detail::HookOf<detail::hooks::Dynamics, D>,
                            detail::HookOf<detail::hooks::DynamicsJacobian, D>,
                            decltype(detail::sdc_of(std::declval<const D&>())), Scalar, Flow::n, At>() &&
      detail::pair_accepts_duals<decltype(detail::sdc_about_of(std::declval<const D&>())), X, DualX, At>();
  if constexpr (Flow::measured) {
    using Y = Vector<Scalar, Flow::p>;
    using DualY = Vector<Dual<Scalar, Flow::n>, Flow::p>;
    all = all &&
          detail::accepts_duals<detail::HookOf<detail::hooks::Measurement, S>,
                                detail::HookOf<detail::hooks::MeasurementJacobian, S>,
                                decltype(detail::sensor_sdc_of(std::declval<const S&>())), Scalar, Flow::n,
                                At>() &&
          detail::pair_accepts_duals<decltype(detail::sensor_sdc_about_of(std::declval<const S&>())), X,
                                     DualX, At>() &&
          detail::pair_accepts_duals<decltype(detail::residual_of(std::declval<const S&>())), Y, DualY, At>();
  }
  return all;
}

/// ∂(ẋ, Ṗ)/∂(x, P), (n + n²)². False where the right-hand side is not to be had there.
template <typename Flow, typename Out>
[[nodiscard]] bool flow_jacobian(Flow& flow, double time, const typename Flow::X& x,
                                 const typename Flow::Square& P, Out& J) {
  using Scalar = typename Flow::Scalar;
  using Rule = std::remove_cvref_t<decltype(flow.rule())>;
  constexpr int n = Flow::n, p = Flow::p;
  typename Flow::Coefficients at;
  typename Flow::X drift;
  Vector<Scalar, p> innovation;
  if (flow.coefficients(time, x, at, drift, innovation) != Status::ok) return false;
  J.setZero();

  typename Flow::Square left = at.A, right = kernel::transposed(at.B);
  if constexpr (p > 0) {
    left -= P * at.W * at.E;
    right -= at.W * at.E * P;
    const Vector<Scalar, n> pull = at.W * innovation;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) J(i, n + n * j + i) = pull(j);
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {  // along P(i, j)
      const int column = n + n * j + i;
      for (int k = 0; k < n; ++k) {
        J(n + n * j + k, column) += left(k, i);
        J(n + n * k + i, column) += right(j, k);
      }
    }
  }

  if constexpr (differentiable<Flow>()) {
    using T = Dual<Scalar, n>;
    const auto now = flow.at(time);
    const Vector<T, n> z = seed(x);
    const Matrix<T, n, n> P_dual = kernel::cast<T>(P);
    Vector<T, n> dx = predicted_state(flow.dynamics(), z, now);
    const Matrix<T, n, n> A = dynamics_slot<Rule::A>(flow.rule(), flow.dynamics(), z, z, now);
    const Matrix<T, n, n> B = dynamics_slot<Rule::B>(flow.rule(), flow.dynamics(), z, z, now);
    Matrix<T, n, n> dP = A * P_dual + P_dual * kernel::transposed(B);
    if constexpr (p > 0) {
      const Matrix<T, p, n> slot_d = sensor_slot<Rule::D>(flow.rule(), flow.sensor(), z, z, now);
      const Matrix<T, p, n> slot_e = sensor_slot<Rule::E>(flow.rule(), flow.sensor(), z, z, now);
      const Vector<T, p> m = measurement(flow.sensor(), z, now);
      Vector<T, p> misfit;  // the sensor's own difference need not know dual numbers
      for (int i = 0; i < p; ++i) {
        misfit(i) = T(innovation(i));
        for (int k = 0; k < n; ++k) misfit(i).partial[k] = -m(i).partial[k];
      }
      const Matrix<T, n, p> K = P_dual * kernel::transposed(slot_d) * kernel::cast<T>(flow.information());
      dx += K * misfit;
      dP -= K * (slot_e * P_dual);
    }
    for (int k = 0; k < n; ++k) {
      for (int i = 0; i < n; ++i) J(i, k) = dx(i).partial[k];
      for (int i = 0; i < n * n; ++i) J(n + i, k) = dP.data()[i].partial[k];
    }
  } else {
    typename Flow::X here_x, there_x;
    typename Flow::Square here_P, there_P;
    if (flow.derivative(time, x, P, here_x, here_P) != Status::ok) return false;
    for (int k = 0; k < n; ++k) {
      typename Flow::X moved = x;
      const Scalar size = std::abs(x(k)) + std::sqrt(std::abs(P(k, k)));
      moved(k) += std::sqrt(std::numeric_limits<Scalar>::epsilon()) * (size > Scalar(0) ? size : Scalar(1));
      if (flow.derivative(time, moved, P, there_x, there_P) != Status::ok) return false;
      const Scalar inverse = Scalar(1) / (moved(k) - x(k));
      for (int i = 0; i < n; ++i) J(i, k) = (there_x(i) - here_x(i)) * inverse;
      for (int i = 0; i < n * n; ++i) J(n + i, k) = (there_P.data()[i] - here_P.data()[i]) * inverse;
    }
  }
  return true;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
