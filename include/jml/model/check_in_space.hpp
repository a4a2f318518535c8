// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// check_model() of a model whose states live in a space: in local coordinates about x.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/check.hpp>
#include <jml/model/local_dynamics.hpp>
#include <jml/model/local_sensor.hpp>

namespace jml {

/// Checks dynamics at x, a state: that x is one and the prediction too (`dynamics` not finite where it is
/// none), that its Jacobian is the derivative of f(x ⊞ δ) ⊟ f(x), that its SDC matrix satisfies F (x ⊟ r) =
/// f(x) ⊟ f(r), Q is a covariance. Use several x.
template <Dynamics D, int numbers, typename At = StepContext<double, DynamicsTraits<D>::controls>>
  requires(!is_flat<D>)
[[nodiscard]] ModelReport check_model(const D& d, const Vector<double, numbers>& x,
                                      const At& at = no_context<double, D>()) {
  static_assert(states_of<D> == numbers, "jml: x has not as many numbers as a state of the dynamics");
  using Space = SpaceOf<D>;
  constexpr int n = Space::tangent;
  ModelReport report;
  const detail::LocalDynamics<D> local{d};
  auto there = detail::local_step<double>(d, x, at);
  const bool inside = Space::contains(x) && detail::check_step<Space>(there) == Status::ok;
  if (!inside) there.to = kernel::filled<Vector<double, numbers>>(std::numeric_limits<double>::quiet_NaN());
  const Vector<double, n> still = kernel::zeros<Vector<double, n>>();
  // Of the size of the numbers that it is a difference of, so that their rounding is counted.
  const auto size = kernel::filled<Vector<double, n>>(1 + kernel::largest(there.to));
  const auto f = [&](const Vector<double, n>& z) {
    return Vector<double, n>(local.dynamics(z, there) + size);
  };
  struct Sdc {
    Matrix<double, n, n> F;
    Vector<double, n> reference, change;
  };
  detail::check_function<n, false, false>(
      report, Finding::Function::dynamics, still, f,
      [&](const Vector<double, n>& z) { return dynamics_jacobian(local, z, there); },
      [&](const Vector<double, n>& z) {
        const Vector<double, n> r = Space::minus(Space::template origin<double>(), there.from);
        return Sdc{local.dynamics_sdc(z, there), r, f(z) - f(r)};
      },
      [](const Vector<double, n>& a, const Vector<double, n>& b) { return Vector<double, n>(a - b); });
  if constexpr (DynamicsTraits<D>::disturbances > 0) {
    const auto Q = local.disturbance_covariance(still, there);
    if (!is_covariance(Q))
      report.add({Finding::Function::covariance, Finding::Fault::not_a_covariance, 0, 0, Q(0, 0), 0});
    detail::require_finite(report, Finding::Function::input, local.disturbance_input(still, there));
  }
  return report;
}

/// Checks a sensor of the states of `d` at x, likewise: `jml::check_model(Strapdown{}, GnssPosition{}, x)`.
template <Dynamics D, Sensor S, int numbers, typename At = StepContext<double, DynamicsTraits<D>::controls>>
[[nodiscard]] ModelReport check_model(const D&, const S& s, const Vector<double, numbers>& x,
                                      const At& at = {}) {
  static_assert(states_of<D> == numbers, "jml: x has not as many numbers as a state of the dynamics");
  using Space = SpaceOf<D>;
  constexpr int n = Space::tangent, p = measurements_of<S>;
  ModelReport report;
  const detail::LocalSensor<S, D, double> local{s, {}};
  detail::LocalContext<double, D> here(at);
  here.from = here.to = x;
  const Vector<double, n> still = kernel::zeros<Vector<double, n>>();
  const auto m = [&](const auto& z) { return local.measurement(z, here); };
  const auto difference = [&](const Vector<double, p>& a, const Vector<double, p>& b) {
    return measurement_residual(s, a, b);
  };
  struct Sdc {
    Matrix<double, p, n> M;
    Vector<double, n> reference;
    Vector<double, p> change;
  };
  detail::check_function<p, false, false>(
      report, Finding::Function::measurement, still, m,
      [&](const Vector<double, n>& z) { return measurement_jacobian(local, z, here); },
      [&](const Vector<double, n>& z) {
        const Vector<double, n> r = Space::minus(Space::template origin<double>(), x);
        return Sdc{local.measurement_sdc(z, here), r, difference(m(z), m(r))};
      },
      difference);
  const auto R = local.noise_covariance(still, here);
  if (!is_noise_covariance(R))
    report.add({Finding::Function::covariance, Finding::Fault::not_a_covariance, 0, 0, R(0, 0), 0});
  return report;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
