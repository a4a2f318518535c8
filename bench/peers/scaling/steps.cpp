// SPDX-License-Identifier: BSD-3-Clause
// A filter step of JML_SCALING_N states and JML_SCALING_P measurements, dense and mildly nonlinear: by the
// library, in plain loops (bench/limit.hpp) and as one writes it in fixed-size Eigen.
#include <Eigen/Cholesky>
#include <jml/jml.hpp>

#include "../../limit.hpp"
#include "models/dense.hpp"
#include "study.hpp"

namespace {

constexpr int n = JML_SCALING_N, p = JML_SCALING_P;
using Dynamics = models::DenseDynamics<n>;
using Sensor = models::DenseSensor<n, p>;
using State = jml::Vector<double, n>;
using Square = jml::Matrix<double, n, n>;
using Measurement = jml::Vector<double, p>;

const Dynamics& dynamics() {
  static const Dynamics d;
  return d;
}
const Sensor& sensor() {
  static const Sensor s;
  return s;
}
jml::Estimate<double, n> start() {
  State x;
  for (int i = 0; i < n; ++i) x(i) = 0.1 * std::sin(1.0 + i);
  return {x, 0.1 * Square::Identity()};
}
const Measurement& measurement() {
  static const Measurement y = sensor().measurement(start().x);
  return y;
}

template <typename Method>
auto make(const Method& rule) {
  return jml::Filter{rule, dynamics(), start()};
}
enum Rule { ekf, one_pass };
template <Rule rule>
void library(long steps) {
  static auto filter = [] {
    if constexpr (rule == ekf)
      return make(jml::Ekf{});
    else
      return make(jml::Jml{});
  }();
  for (long k = 0; k < steps; ++k) {
    if (!jml::usable(filter.step(sensor(), measurement()).status)) std::abort();
    scaling::keep(filter);
  }
}

template <bool symmetric>
void loops(long steps) {
  static limit::State<n> estimate = [] {
    limit::State<n> s;
    Eigen::Map<State>(s.x) = start().x;
    limit::copy(start().P, s.P);
    return s;
  }();
  static limit::Square<n> noise;
  static limit::Square<p> R;
  limit::copy(dynamics().Q, noise);
  limit::copy(jml::Matrix<double, p, p>(sensor().noise_covariance()), R);
  for (long k = 0; k < steps; ++k) {
    if constexpr (symmetric)
      limit::ekf_step<n, p>(dynamics(), sensor(), noise, R, measurement(), estimate);
    else
      limit::jml_step<n, p>(dynamics(), sensor(), noise, R, measurement(), estimate);
    scaling::keep(estimate);
  }
}

void eigen(long steps) {
  static auto estimate = start();
  const Square& noise = dynamics().Q;
  const jml::Matrix<double, p, p> R = sensor().noise_covariance();
  for (long k = 0; k < steps; ++k) {
    const Square A = dynamics().dynamics_jacobian(estimate.x);
    const State x = dynamics().dynamics(estimate.x);
    const Square N = A * estimate.P * A.transpose() + noise;
    const jml::Matrix<double, p, n> H = sensor().measurement_jacobian(x);
    const jml::Matrix<double, n, p> NH = N * H.transpose();
    const jml::Matrix<double, p, p> S = H * NH + R;
    const jml::Matrix<double, n, p> K = S.llt().solve(NH.transpose()).transpose();
    estimate.x = x + K * (measurement() - sensor().measurement(x));
    const Square P = N - K * NH.transpose();
    estimate.P = (P + P.transpose()) / 2;
    scaling::keep(estimate);
  }
}

#ifdef JML_SCALING_LARGE
constexpr double size = p;
const scaling::Register all[] = {{"ekf_n30_by_p", size, n, p, library<ekf>},
                                 {"jml_n30_by_p", size, n, p, library<one_pass>},
                                 {"ekf_loops_n30_by_p", size, n, p, loops<true>},
                                 {"jml_loops_n30_by_p", size, n, p, loops<false>},
                                 {"ekf_eigen_n30_by_p", size, n, p, eigen}};
#elif defined(JML_SCALING_BY_P)
constexpr double size = p;
const scaling::Register all[] = {{"ekf_by_p", size, n, p, library<ekf>},
                                 {"jml_by_p", size, n, p, library<one_pass>},
                                 {"ekf_loops_by_p", size, n, p, loops<true>},
                                 {"jml_loops_by_p", size, n, p, loops<false>},
                                 {"ekf_eigen_by_p", size, n, p, eigen}};
#else
constexpr double size = n;
const scaling::Register all[] = {{"ekf_by_n", size, n, p, library<ekf>},
                                 {"jml_by_n", size, n, p, library<one_pass>},
                                 {"ekf_loops_by_n", size, n, p, loops<true>},
                                 {"jml_loops_by_n", size, n, p, loops<false>},
                                 {"ekf_eigen_by_n", size, n, p, eigen}};
#endif

}  // namespace
