// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Continuous models whose four slots are constants that need not belong together, f = A x + a and m = E x +
/// e, and the filter's equations (17), (19) on them in long double.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <jml/estimate.hpp>
#include <jml/model/traits.hpp>

#include "models/linear.hpp"

namespace continuous_frozen {

/// The Jacobian is B, whatever f says.
template <int n>
struct Dynamics {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = n, disturbances = n;
  jml::Matrix<double, n, n> A, B, Q;
  jml::Vector<double, n> a;

  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    jml::Vector<T, n> f;
    for (int i = 0; i < n; ++i) {
      f(i) = T(a(i));
      for (int j = 0; j < n; ++j) f(i) += A(i, j) * x(j);
    }
    return f;
  }
  template <typename T>
  jml::Matrix<T, n, n> dynamics_sdc(const jml::Vector<T, n>&) const {
    return A.template cast<T>();
  }
  template <typename T>
  jml::Matrix<T, n, n> dynamics_jacobian(const jml::Vector<T, n>&) const {
    return B.template cast<T>();
  }
  jml::Matrix<double, n, n> disturbance_spectral_density() const { return Q; }
};

template <int n, int p>
struct Sensor {
  static constexpr int measurements = p;
  jml::Matrix<double, p, n> D, E;
  jml::Matrix<double, p, p> R;
  jml::Vector<double, p> e;

  template <typename T>
  jml::Vector<T, p> measurement(const jml::Vector<T, n>& x) const {
    jml::Vector<T, p> m;
    for (int i = 0; i < p; ++i) {
      m(i) = T(e(i));
      for (int j = 0; j < n; ++j) m(i) += E(i, j) * x(j);
    }
    return m;
  }
  template <typename T>
  jml::Matrix<T, p, n> measurement_sdc(const jml::Vector<T, n>&) const {
    return E.template cast<T>();
  }
  template <typename T>
  jml::Matrix<T, p, n> measurement_jacobian(const jml::Vector<T, n>&) const {
    return D.template cast<T>();
  }
  jml::Matrix<double, p, p> noise_spectral_density() const { return R; }
};

template <int n, int p>
struct Problem {
  Dynamics<n> dynamics;
  Sensor<n, p> sensor;
  jml::Estimate<double, n> start;
  jml::Vector<double, p> y;
  jml::Vector<double, p> climb = jml::Vector<double, p>::Zero();  ///< of y, per second
};

/// Slots near each other, as a model's are: B = A and D = E but for `twist`.
template <int n, int p>
Problem<n, p> random_problem(jml::Noise& noise, double twist) {
  Problem<n, p> out;
  out.dynamics.A = models::random_matrix<n, n>(noise);
  out.dynamics.B = out.dynamics.A + twist * models::random_matrix<n, n>(noise);
  out.dynamics.Q = models::random_covariance<n>(noise, 0.05);
  out.dynamics.a = models::random_matrix<n, 1>(noise);
  out.sensor.E = models::random_matrix<p, n>(noise);
  out.sensor.D = out.sensor.E + twist * models::random_matrix<p, n>(noise);
  out.sensor.R = models::random_covariance<p>(noise, 0.3);
  out.sensor.e = models::random_matrix<p, 1>(noise);
  out.start.x = models::random_matrix<n, 1>(noise);
  out.start.P = models::random_covariance<n>(noise, 0.1);
  out.y = models::random_matrix<p, 1>(noise);
  return out;
}

template <int n>
struct Solution {
  jml::Vector<long double, n> x;
  jml::Matrix<long double, n, n> P;
  bool escaped = false;     ///< P beyond 1e9: the pole is as good as reached
  long double largest = 0;  ///< of ‖P‖ on the way
};

/// (17), (19) over dt by their Taylor series, in long double: sums of products of the coefficients, steps of
/// a fifth of the rates' reach, so that they shrink towards a pole. Knows nothing of Radon's lemma.
template <int n, int p>
Solution<n> solve(const Problem<n, p>& problem, double dt) {
  using Square = jml::Matrix<long double, n, n>;
  using X = jml::Vector<long double, n>;
  constexpr int degree = 20;
  const Square A = problem.dynamics.A.template cast<long double>(),
               B = problem.dynamics.B.template cast<long double>();
  const jml::Matrix<long double, p, p> information = problem.sensor.R.template cast<long double>().inverse();
  const jml::Matrix<long double, p, n> E = problem.sensor.E.template cast<long double>();
  const jml::Matrix<long double, n, p> W =
      problem.sensor.D.template cast<long double>().transpose() * information;
  const Square WE = W * E;
  const X start_drive = W * (problem.y - problem.sensor.e).template cast<long double>();
  const X climb = W * problem.climb.template cast<long double>();
  Solution<n> s{problem.start.x.template cast<long double>(), problem.start.P.template cast<long double>()};
  X x[degree + 1];
  Square P[degree + 1];
  for (long double t = 0; t < dt;) {
    s.largest = std::max(s.largest, s.P.norm());
    if (!(s.P.norm() < 1e9L)) {
      s.escaped = true;
      return s;
    }
    const long double h =
        std::min<long double>(dt - t, 0.2L / (A.norm() + B.norm() + WE.norm() * s.P.norm()));
    const X drive = start_drive + t * climb;
    x[0] = s.x;
    P[0] = s.P;
    for (int k = 0; k < degree; ++k) {
      x[k + 1] = A * x[k] + P[k] * drive;
      if (k > 0) x[k + 1] += P[k - 1] * climb;
      P[k + 1] = A * P[k] + P[k] * B.transpose();
      if (k == 0) {
        x[1] += problem.dynamics.a.template cast<long double>();
        P[1] += problem.dynamics.Q.template cast<long double>();
      }
      for (int i = 0; i <= k; ++i) {
        const Square gain = P[i] * WE;
        x[k + 1] -= gain * x[k - i];
        P[k + 1] -= gain * P[k - i];
      }
      x[k + 1] /= k + 1;
      P[k + 1] /= k + 1;
    }
    s.x = x[degree];
    s.P = P[degree];
    for (int k = degree - 1; k >= 0; --k) {
      s.x = (x[k] + h * s.x).eval();
      s.P = (P[k] + h * s.P).eval();
    }
    t += h;
  }
  return s;
}

/// Largest error of x and P, relative to their largest entries.
template <int n>
double distance(const jml::Estimate<double, n>& got, const Solution<n>& wanted) {
  const long double off_x = (got.x.template cast<long double>() - wanted.x).cwiseAbs().maxCoeff();
  const long double off_P = (got.P.template cast<long double>() - wanted.P).cwiseAbs().maxCoeff();
  return static_cast<double>(std::max(off_x / std::max(1.0L, wanted.x.cwiseAbs().maxCoeff()),
                                      off_P / wanted.P.cwiseAbs().maxCoeff()));
}

}  // namespace continuous_frozen
