// SPDX-License-Identifier: BSD-3-Clause
// Measurements far better than the prior, of an attitude that is far off: P after a correction is J P Jᵀ in
// the tangent where it ended, in every form of a belief, with the digits that plain numbers have not. What P
// has to be: the sum of informations, in long double, carried from tangent to tangent by the right Jacobian.
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "models/attitude_in_space.hpp"

namespace {

using Real = long double;
using State = jml::Vector<double, 4>;
using Vector3 = jml::Vector<double, 3>;
using Matrix3 = jml::Matrix<double, 3, 3>;
using Exact3 = jml::Matrix<Real, 3, 3>;
using models::VectorSensor;
using Turning = models::TurningIn<jml::SO3>;

Exact3 cross(const jml::Vector<Real, 3>& v) {
  Exact3 K;
  K << 0, -v(2), v(1), v(2), 0, -v(0), -v(1), v(0), 0;
  return K;
}
Exact3 right_jacobian(const Vector3& z) {
  const jml::Vector<Real, 3> v = z.cast<Real>();
  const Real angle = v.norm(), square = angle * angle;
  if (angle < 1e-4L) return Exact3::Identity() - cross(v) / 2 + cross(v) * cross(v) / 6;
  return Exact3::Identity() - (1 - std::cos(angle)) / square * cross(v) +
         (angle - std::sin(angle)) / (square * angle) * cross(v) * cross(v);
}
/// P⁻¹ after a vector is seen from `before`, in the tangent at `after`. ∂ R(x ⊞ δ)ᵀ d = (Rᵀ d) × δ.
Exact3 information(const Exact3& prior, const State& before, const State& after, const VectorSensor& sensor) {
  const Exact3 H = cross(jml::Vector<Real, 3>(sensor.measurement(before).cast<Real>()));
  const Exact3 at_before = prior + H.transpose() * H / (Real(sensor.sigma) * sensor.sigma);
  const Exact3 back = right_jacobian(jml::SO3::minus(after, before)).inverse();
  return back.transpose() * at_before * back;
}

template <typename Method>
void expect_informations(const Method& method, double sigma) {
  SCOPED_TRACE(sigma);
  const State x0{0.5, 0.5, -0.5, 0.5}, truth = jml::SO3::plus(x0, Vector3(0.25, -0.3, 0.2));
  const Matrix3 P0 = (Matrix3() << 0.2, 0.05, 0, 0.05, 0.1, 0.02, 0, 0.02, 0.3).finished();
  jml::Filter filter{method, Turning{}, jml::Estimate{x0, P0}};
  Exact3 exact = P0.cast<Real>().inverse();
  const VectorSensor sensors[] = {{{0.6, 0, 0.8}, sigma}, {{0, 1, 0}, sigma}, {{0.8, 0.6, 0}, sigma}};
  for (const VectorSensor& sensor : sensors) {
    const State before = filter.x();
    const auto report = filter.update(sensor, sensor.measurement(truth));
    ASSERT_TRUE(jml::usable(report.status)) << report.status;
    exact = information(exact, before, filter.x(), sensor);
  }
  const Matrix3 P = exact.inverse().cast<double>();
  EXPECT_LT((filter.P() - P).norm(), 1e-3 * P.norm()) << filter.P() << "\n\n" << P;
  // In every direction.
  const Exact3 share = exact * filter.P().template cast<Real>();
  EXPECT_LT((share - Exact3::Identity()).norm(), 1e-2L) << share;
}

TEST(PreciseInSpace, PStandsInTheTangentWhereTheStateIs) {
  // Below 1e-6 no P in plain numbers holds it; factors do.
  for (const double sigma : {0.1, 1e-3, 1e-6}) expect_informations(jml::Ekf{}, sigma);
  for (const double sigma : {0.1, 1e-3, 1e-6, 3e-8, 1e-8})
    expect_informations(jml::Factored{jml::Ekf{}}, sigma);
  expect_informations(jml::Jml<jml::AboutEstimate>{}, 0.1);
  expect_informations(jml::Jml<jml::AboutEstimate>{}, 1e-3);
}

}  // namespace
