// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random single steps over four models, and an oracle for their roots that shares nothing with the library's solver:
/// the two ground-truth lines and the cost (11), in long double, from the models' hand-written Jacobians.
#pragma once

#include <Eigen/LU>
#include <cmath>
#include <jml/jml.hpp>
#include <jml/campaign/noise.hpp>

#include "models/pendulum.hpp"
#include "models/polynomial.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"

namespace random_steps {

using namespace jml::operators;

/// A prior, a measurement and the models of one step.
template <typename D, typename S>
struct Task {
  static constexpr int n = jml::states_of<D>, p = jml::measurements_of<S>;
  D dynamics;
  S sensor;
  jml::Estimate<double, n> prior;
  jml::Vector<double, p> y;
  bool symmetric = true;
};

/// P = spread² D L Lᵀ D with random unit-lower L, `units` on the diagonal of D; twisted by an antisymmetric part if asked.
template <int n>
jml::Matrix<double, n, n> random_covariance(jml::Noise& noise, const jml::Vector<double, n>& units, bool symmetric) {
  jml::Matrix<double, n, n> L = jml::Matrix<double, n, n>::Identity();
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < i; ++j) L(i, j) = 0.5 * noise.normal();
    L.row(i) *= units(i) * std::exp(0.5 * noise.normal());
  }
  jml::Matrix<double, n, n> P = L * L.transpose();
  P = (P + P.transpose()).eval() / 2;
  if (!symmetric) {
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < i; ++j) {
        const double twist = 0.2 * noise.normal() * std::sqrt(P(i, i) * P(j, j));
        P(i, j) += twist;
        P(j, i) -= twist;
      }
    }
  }
  return P;
}

/// Draws the truth from the prior and the measurement from the truth.
template <typename D, typename S, int n>
void complete(Task<D, S>& task, jml::Noise& noise, const jml::Vector<double, n>& units, bool symmetric) {
  task.symmetric = symmetric;
  task.prior.P = random_covariance<n>(noise, units, symmetric);
  const jml::Matrix<double, n, n> covariance = (task.prior.P + task.prior.P.transpose()) / 2;
  const jml::Vector<double, n> truth = task.prior.x + noise.normal_vector<n>(covariance);
  const jml::Matrix<double, n, n> C =
      task.dynamics.disturbance_input() * task.dynamics.disturbance_covariance() * task.dynamics.disturbance_input().transpose();
  const jml::Vector<double, n> next = task.dynamics.dynamics(truth) + noise.normal_vector<n>(C);
  const jml::Vector<double, Task<D, S>::p> error = noise.normal_vector<Task<D, S>::p>(task.sensor.noise_covariance());
  task.y = task.sensor.measurement(next) + error;
}

using VanDerPol = Task<models::VanDerPol, models::SaturatingPosition>;
using Pendulum = Task<models::Pendulum, models::SineSensor>;
using Radar = Task<models::BallisticTarget, models::Radar>;
using Polynomial = Task<models::Polynomial<4>, models::PolynomialSensor<4, 2>>;

/// Weak: short steps, small prior. Strong: long steps, a prior as wide as the nonlinearity.
inline void draw(VanDerPol& t, jml::Noise& noise, bool strong, bool symmetric) {
  t.dynamics.dt = strong ? noise.uniform(0.05, 0.3) : noise.uniform(0.01, 0.05);
  t.dynamics.c = strong ? 0.5 : 0.1;
  t.sensor.r = std::pow(10.0, noise.uniform(strong ? -3 : -2, 0));
  t.prior.x = {1.5 * noise.normal(), 1.5 * noise.normal()};
  complete(t, noise, jml::Vector<double, 2>(jml::Vector<double, 2>::Constant(strong ? 0.5 : 0.1)), symmetric);
}
inline void draw(Pendulum& t, jml::Noise& noise, bool strong, bool symmetric) {
  t.dynamics.dt = strong ? noise.uniform(0.05, 0.2) : noise.uniform(0.005, 0.05);
  t.sensor.r = std::pow(10.0, noise.uniform(-3, -1));
  t.prior.x = {noise.normal(), 2 * noise.normal()};
  complete(t, noise, jml::Vector<double, 2>(jml::Vector<double, 2>(0.1, 0.3) * (strong ? 3 : 1)), symmetric);
}
inline void draw(Radar& t, jml::Noise& noise, bool strong, bool symmetric) {
  t.dynamics.dt = strong ? 1.0 : 0.1;
  t.dynamics.drag = strong ? 0.2 : 0.02;
  t.sensor.range_sd = strong ? 0.3 : 0.05;
  t.sensor.angle_sd = strong ? 0.02 : 5e-3;
  t.prior.x << 20 + 5 * noise.uniform(), 10 + 5 * noise.uniform(), 5 + 5 * noise.uniform(), noise.normal(), noise.normal(),
      0.5 * noise.normal();
  jml::Vector<double, 6> units;
  units << 1, 1, 1, 0.2, 0.2, 0.2;
  complete(t, noise, jml::Vector<double, 6>(units * (strong ? 1.0 : 0.1)), symmetric);
}
inline void draw(Polynomial& t, jml::Noise& noise, bool strong, bool symmetric) {
  t.dynamics.constant = 0.1;
  t.dynamics.bend = strong ? 0.05 : 0.01;
  t.sensor.bend = strong ? 0.05 : 0.01;
  t.prior.x = 0.7 * noise.normal_vector<4>();
  complete(t, noise, jml::Vector<double, 4>(jml::Vector<double, 4>::Constant(strong ? 0.4 : 0.1)), symmetric);
}

/// What the oracle says of a pair (x_s, x_1).
struct Verdict {
  double residual = 0;  ///< of the two lines, over the state scale
  double cost = 0;      ///< (11), with P⁻¹ by an explicit inverse; meaningful for symmetric positive P
};

/// Of a size known at run time: one set of Eigen's expressions serves all models.
using Big = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
template <typename Scalar, int rows, int cols>
Big big(const jml::Matrix<Scalar, rows, cols>& a) {
  Big out(rows, cols);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols; ++j) out(i, j) = a(i, j);
  }
  return out;
}

/// The part of judge() that only needs numbers: the lines' residuals over the scale, and the cost (11).
inline Verdict judge(const Big& prior, const Big& P, const Big& x_s, const Big& x_1, const Big& start, const Big& f, const Big& f_x,
                     const Big& m_x, const Big& misfit, const Big& R, const Big& C) {
  const Big nu = R.inverse() * misfit, e = m_x.transpose() * nu;
  const Big first = prior + P * (f_x.transpose() * e) - x_s, second = f + C * e - x_1;
  Verdict out;
  for (int i = 0; i < prior.rows(); ++i) {
    const long double scale = std::abs(prior(i)) + std::abs(start(i)) + std::sqrt(std::abs(P(i, i)) + C(i, i));
    out.residual = std::max(out.residual, static_cast<double>(std::abs(first(i)) / scale));
    out.residual = std::max(out.residual, static_cast<double>(std::abs(second(i)) / scale));
  }
  const Big back = x_s - prior;
  // w = Q Gᵀ e at a root, so wᵀ Q⁻¹ w = eᵀ C e.
  const Big cost = back.transpose() * (P.inverse() * back) + e.transpose() * (C * e) + misfit.transpose() * nu;
  out.cost = static_cast<double>(cost(0, 0) / 2);
  return out;
}

template <typename D, typename S>
Verdict judge(const Task<D, S>& t, const jml::Vector<double, Task<D, S>::n>& smoothed, const jml::Vector<double, Task<D, S>::n>& next) {
  using X = jml::Vector<long double, Task<D, S>::n>;
  using Y = jml::Vector<long double, Task<D, S>::p>;
  X prior, x_s, x_1;
  for (int i = 0; i < Task<D, S>::n; ++i) {
    prior(i) = t.prior.x(i);
    x_s(i) = smoothed(i);
    x_1(i) = next(i);
  }
  Y y;
  for (int i = 0; i < Task<D, S>::p; ++i) y(i) = t.y(i);
  const Big G = big(t.dynamics.disturbance_input()), C = G * big(t.dynamics.disturbance_covariance()) * G.transpose();
  return judge(big(prior), big(t.prior.P), big(x_s), big(x_1), big(X(t.dynamics.dynamics(prior))), big(X(t.dynamics.dynamics(x_s))),
               big(t.dynamics.dynamics_jacobian(x_s)), big(t.sensor.measurement_jacobian(x_1)),
               big(jml::measurement_residual(t.sensor, y, Y(t.sensor.measurement(x_1)))), big(t.sensor.noise_covariance()), C);
}

}  // namespace random_steps
