// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Is my model what I think it is? Compares what a model supplies with what can be derived from the rest of
/// it.
///
///     const auto report = jml::check_model(VanDerPol{}, x);
///     if (!report.ok()) report.print([](const char* line) { std::puts(line); });
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <jml/model/concepts.hpp>
#include <jml/model/model_report.hpp>
#include <limits>

namespace jml {

namespace detail {

/// Adds the worst entry of `given` that differs from `expected` by more than `tolerance` of the row's scale.
template <int rows, int cols>
void compare(ModelReport& report, Finding::Function function, Finding::Fault fault,
             const Matrix<double, rows, cols>& given, const Matrix<double, rows, cols>& expected,
             double tolerance, const Vector<double, rows>& floor) {
  Finding worst{function, fault, 0, 0, 0, 0};
  double largest = tolerance;
  for (int i = 0; i < rows; ++i) {
    const double scale =
        std::max(expected.row(i).cwiseAbs().maxCoeff(), given.row(i).cwiseAbs().maxCoeff()) + floor(i);
    for (int j = 0; j < cols; ++j) {
      const double error = std::abs(given(i, j) - expected(i, j)) / (scale > 0 ? scale : 1);
      if (!(error <= largest)) {
        largest = error;
        worst.row = i;
        worst.column = j;
        worst.given = given(i, j);
        worst.expected = expected(i, j);
      }
    }
  }
  if (!(largest <= tolerance)) report.add(worst);
}

template <int rows, int cols>
bool require_finite(ModelReport& report, Finding::Function function,
                    const Matrix<double, rows, cols>& value) {
  if (all_finite(value)) return true;
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols; ++j) {
      if (std::isfinite(value(i, j))) continue;
      report.add({function, Finding::Fault::not_finite, i, j, value(i, j), 0});
      return false;
    }
  }
  return false;
}

/// A derivative by central differences, and how far it may be off.
struct Quotient {
  double value = std::numeric_limits<double>::quiet_NaN();
  double error = std::numeric_limits<double>::infinity();
};

/// Compares each entry of `given` with a central difference quotient. x says little of the step: a function
/// may turn within 1e-9, or hardly at all. So the step goes from a tenth of x down to the rounding of x, and
/// the quotient that is taken is the one that changes least with it, beside its size and its rounding.
template <int rows, int n, typename F, typename Difference>
void compare_with_differences(ModelReport& report, const Vector<double, n>& x, const F& f,
                              const Vector<double, rows>& value, const Matrix<double, rows, n>& given,
                              const Difference& difference) {
  constexpr double epsilon = std::numeric_limits<double>::epsilon();
  constexpr int steps = 30;
  Finding worst{Finding::Function::jacobian, Finding::Fault::disagrees_with_differences, 0, 0, 0, 0};
  double largest = 1;
  const Vector<double, rows> through_x = given.cwiseAbs() * x.cwiseAbs();
  for (int j = 0; j < n; ++j) {
    // The most certain quotient beside its own size, and that beside nothing for what has no size: a zero.
    std::array<Quotient, rows> sharp, zero;
    Matrix<double, rows, 3> last = kernel::filled<Matrix<double, rows, 3>>(0);  // three steps, a ring
    Vector<double, rows> noise = value, finer;
    double h = 0.1 * std::max(std::abs(x(j)), 1e-2);
    for (int k = 0; k < steps && h >= 4 * epsilon * std::abs(x(j)); ++k, h /= 8) {
      Vector<double, n> above = x, below = x;
      above(j) += h;
      below(j) -= h;
      const Vector<double, rows> f_above = f(above), f_below = f(below);
      const double width = above(j) - below(j);
      last.col(k % 3) = difference(f_above, f_below) / width;
      finer = 4 * epsilon * (through_x + value.cwiseAbs() + f_above.cwiseAbs() + f_below.cwiseAbs()) / width;
      for (int i = 0; k > 1 && i < rows; ++i) {
        const auto r = static_cast<std::size_t>(i);
        const double now = last(i, (k - 1) % 3);
        const double moved = std::max(std::abs(now - last(i, k % 3)), std::abs(now - last(i, (k - 2) % 3)));
        const Quotient candidate{now, noise(i) + moved};
        if (candidate.error < zero[r].error) zero[r] = candidate;
        if (candidate.error * std::abs(sharp[r].value) < sharp[r].error * std::abs(now) ||
            (std::isnan(sharp[r].value) && std::isfinite(candidate.error)))
          sharp[r] = candidate;
      }
      noise = finer;
    }
    for (int i = 0; i < rows; ++i) {
      const auto r = static_cast<std::size_t>(i);
      const Quotient& found = sharp[r].error < 0.1 * std::abs(sharp[r].value) ? sharp[r] : zero[r];
      const double size = std::max(std::abs(found.value), std::abs(given(i, j)));
      const double allowed = 1e-5 * size + 10 * found.error;
      const double beyond = allowed > 0 ? std::abs(given(i, j) - found.value) / allowed : 0.0;
      if (beyond <= largest) continue;
      largest = beyond;
      worst.row = i;
      worst.column = j;
      worst.given = given(i, j);
      worst.expected = found.value;
    }
  }
  if (!(largest <= 1)) report.add(worst);
}

/// Jacobian, SDC and linearity of f: Rⁿ → R^rows at x. `difference(a, b)` is a - b, angles wrapped.
template <int rows, bool generic, bool linear, int n, typename F, typename J, typename Sdc,
          typename Difference>
void check_function(ModelReport& report, Finding::Function itself, const Vector<double, n>& x, const F& f,
                    const J& jacobian, const Sdc& sdc, const Difference& difference) {
  using Fault = Finding::Fault;
  const Vector<double, rows> value = f(x);
  if (!require_finite(report, itself, value)) return;
  const Matrix<double, rows, n> given = jacobian(x);
  if (!require_finite(report, Finding::Function::jacobian, given)) return;
  const Vector<double, rows> none = kernel::zeros<Vector<double, rows>>();
  if constexpr (generic) {
    compare(report, Finding::Function::jacobian, Fault::disagrees_with_duals, given,
            derive_jacobian<rows>(f, x), 1e-11, none);
  }
  compare_with_differences<rows>(report, x, f, value, given, difference);
  const auto [F_x, reference, change] = sdc(x);
  if (require_finite(report, Finding::Function::sdc, F_x)) {
    const Vector<double, rows> product = F_x * (x - reference);
    // The last part is what rounding of x does to f.
    const Vector<double, rows> floor =
        F_x.cwiseAbs() * (x - reference).cwiseAbs() + value.cwiseAbs() + given.cwiseAbs() * x.cwiseAbs();
    compare(report, Finding::Function::sdc, Fault::breaks_definition, product, change, 1e-12, floor);
  }
  if constexpr (linear) {
    const Vector<double, n> elsewhere = x * 1.5 + kernel::filled<Vector<double, n>>(1);
    compare(report, Finding::Function::linear, Fault::not_linear,
            Matrix<double, rows, n>(jacobian(elsewhere)), given, 1e-12, none);
  }
}

}  // namespace detail

/// Checks dynamics at x, n, in whatever units: that its Jacobian is the derivative, its SDC matrix satisfies
/// F(x) x = f(x) - f(0), Q is a covariance, G and w̄ are finite, a claim of linearity holds. Use several x,
/// none of them special. f is called up to 60 n times, at up to a tenth of x (or 1e-3) beside x.
template <Dynamics D, int n, typename At = StepContext<double, DynamicsTraits<D>::controls>>
  requires is_flat<D>
[[nodiscard]] ModelReport check_model(const D& d, const Vector<double, n>& x,
                                      const At& at = no_context<double, D>()) {
  static_assert(states_of<D> == n, "jml: x has not as many states as the dynamics");
  ModelReport report;
  constexpr bool generic =
      detail::Generic<detail::HookOf<detail::hooks::Dynamics, D>, Vector<Dual<double, n>, n>, At>;
  const auto f = [&](const auto& z) { return dynamics(d, z, at); };
  struct Sdc {
    Matrix<double, n, n> F;
    Vector<double, n> reference, change;
  };
  detail::check_function<n, generic, DynamicsTraits<D>::linear>(
      report, Finding::Function::dynamics, x, f,
      [&](const Vector<double, n>& z) { return dynamics_jacobian(d, z, at); },
      [&](const Vector<double, n>& z) {
        const Vector<double, n> origin = kernel::zeros<Vector<double, n>>();
        return Sdc{dynamics_sdc<true>(d, z, origin, at), origin,
                   dynamics(d, z, at) - dynamics(d, origin, at)};
      },
      [](const Vector<double, n>& a, const Vector<double, n>& b) { return Vector<double, n>(a - b); });
  if constexpr (DynamicsTraits<D>::disturbances > 0) {
    const auto Q = [&] {
      if constexpr (ContinuousDynamics<D>)
        return disturbance_spectral_density(d, x, at);
      else
        return disturbance_covariance(d, x, at);
    }();
    if (!is_covariance(Q))
      report.add({Finding::Function::covariance, Finding::Fault::not_a_covariance, 0, 0, Q(0, 0), 0});
    detail::require_finite(report, Finding::Function::input, disturbance_input(d, x, at));
    if constexpr (has_disturbance_mean<D, Vector<double, n>, At>()) {
      detail::require_finite(report, Finding::Function::mean,
                             Vector<double, n>(predicted_state(d, x, at) - dynamics(d, x, at)));
    }
  }
  return report;
}

/// Checks a sensor at x, n, likewise; R must be positive definite.
template <Sensor S, int n, typename At = StepContext<double>>
[[nodiscard]] ModelReport check_model(const S& s, const Vector<double, n>& x, const At& at = {}) {
  constexpr int p = measurements_of<S>;
  ModelReport report;
  constexpr bool generic =
      detail::Generic<detail::HookOf<detail::hooks::Measurement, S>, Vector<Dual<double, n>, n>, At>;
  const auto m = [&](const auto& z) { return measurement(s, z, at); };
  const auto difference = [&](const Vector<double, p>& a, const Vector<double, p>& b) {
    return measurement_residual(s, a, b);
  };
  struct Sdc {
    Matrix<double, p, n> M;
    Vector<double, n> reference;
    Vector<double, p> change;
  };
  detail::check_function<p, generic, SensorTraits<S>::linear>(
      report, Finding::Function::measurement, x, m,
      [&](const Vector<double, n>& z) { return measurement_jacobian(s, z, at); },
      [&](const Vector<double, n>& z) {
        const Vector<double, n> origin = kernel::zeros<Vector<double, n>>();
        const Vector<double, p> here = measurement(s, z, at), there = measurement(s, origin, at);
        return Sdc{measurement_sdc<true>(s, z, origin, at), origin, difference(here, there)};
      },
      difference);
  const auto R = [&] {
    if constexpr (has_noise_spectral_density<S, Vector<double, n>, At>())
      return noise_spectral_density(s, x, at);
    else
      return noise_covariance(s, x, at);
  }();
  if (!is_noise_covariance(R))
    report.add({Finding::Function::covariance, Finding::Fault::not_a_covariance, 0, 0, R(0, 0), 0});
  return report;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
