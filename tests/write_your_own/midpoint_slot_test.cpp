// SPDX-License-Identifier: BSD-3-Clause
// The midpoint slot of examples/write_your_own: the SDC matrix of quadratic models, and how far from it
// beyond them.
#include "write_your_own/midpoint_slot.hpp"

#include <gtest/gtest.h>

#include <jml/campaign/noise.hpp>

#include "models/bare.hpp"
#include "models/polynomial.hpp"

namespace {

using jml::Status;
using State = jml::Vector<double, 3>;
using Covariance = jml::Matrix<double, 3, 3>;
using Dynamics = models::Polynomial<3>;
using Sensor = models::PolynomialSensor<3, 2>;

constexpr Dynamics quadratic{.constant = 0.1, .bend = 0.02, .cubic = 0};
constexpr Dynamics cubic{.constant = 0.1, .bend = 0.02, .cubic = 0.02};
constexpr Sensor sensor{.constant = 0.1, .bend = 0.05};
const jml::AboutPoint about{State(0.4, -0.3, 0.2)};
const jml::Estimate start{State(0.5, 0.1, -0.4), Covariance(0.1 * Covariance::Identity())};

/// The largest difference of x and P over a flight of two rules; the numbers of the flight are near 1.
template <typename One, typename Other, typename D, typename S = Sensor>
double distance(const One& one_rule, const Other& other_rule, const D& dynamics, const S& seen = sensor) {
  jml::Filter one{one_rule, dynamics, start};
  jml::Filter other{other_rule, dynamics, start};
  jml::Noise noise(1);
  double most = 0;
  State truth = start.x;
  for (int k = 0; k < 200; ++k) {
    const jml::Vector<double, 2> w = noise.normal_vector<2>(quadratic.disturbance_covariance());
    truth = dynamics.dynamics(truth) + quadratic.disturbance_input() * w;
    const jml::Vector<double, 2> y =
        sensor.measurement(truth) + noise.normal_vector<2>(sensor.noise_covariance());
    if (k % 5 == 4) {
      EXPECT_EQ(one.predict(), Status::ok) << k;
      EXPECT_EQ(other.predict(), Status::ok) << k;
    } else {
      EXPECT_TRUE(jml::usable(one.step(seen, y).status)) << k;
      EXPECT_TRUE(jml::usable(other.step(seen, y).status)) << k;
    }
    most = std::max(
        {most, (one.x() - other.x()).cwiseAbs().maxCoeff(), (one.P() - other.P()).cwiseAbs().maxCoeff()});
  }
  EXPECT_LT((one.x() - truth).norm(), 3) << "a flight that got lost compares nothing";
  return most;
}

TEST(Midpoint, IsTheSdcMatrixOfAQuadraticModel) {
  EXPECT_LT(distance(own::MidpointSddre{about}, jml::Sddre{about}, quadratic), 1e-12);
  EXPECT_LT(distance(own::MidpointJml{about}, jml::Jml{about}, quadratic), 1e-12);
}

// About the origin, where the models must not give SDC matrices of their own.
TEST(Midpoint, AboutTheOrigin) {
  const models::Bare<Dynamics> dynamics{quadratic};
  const models::BareSensor<Sensor> bare{sensor};
  EXPECT_LT(distance(own::MidpointSddre{}, jml::Sddre{}, dynamics, bare), 1e-12);
  EXPECT_LT(distance(own::MidpointJml{}, jml::Jml{}, dynamics, bare), 1e-12);
}

TEST(Midpoint, AboutTheEstimateIsTheEkf) {
  EXPECT_EQ(distance(own::MidpointSddre{jml::AboutEstimate{}}, jml::Ekf{}, cubic), 0);
}

TEST(Midpoint, DiffersWhereTheModelIsCubic) {
  EXPECT_GT(distance(own::MidpointSddre{about}, jml::Sddre{about}, cubic), 1e-6);
  EXPECT_GT(distance(own::MidpointJml{about}, jml::Jml{about}, cubic), 1e-6);
}

// The rows do not agree with one another: the tests above can fail.
TEST(Midpoint, TheRowsAreDifferentFilters) {
  EXPECT_GT(distance(own::MidpointSddre{about}, own::MidpointJml{about}, quadratic), 1e-3);
  EXPECT_GT(distance(own::MidpointSddre{about}, jml::Ekf{}, quadratic), 1e-3);
  EXPECT_GT(distance(own::MidpointJml{about}, jml::Sddre{jml::AboutPoint{State(0, 0, 0)}}, quadratic), 1e-3);
  static_assert(own::MidpointSddre<>::symmetric && !own::MidpointJml<>::symmetric);
}

// The exact step forms P with the slots of any rule.
TEST(Midpoint, InAnIteratedRule) {
  const jml::Iterated<own::MidpointJml<jml::AboutPoint<double, 3>>> midpoint{own::MidpointJml{about}};
  EXPECT_LT(distance(midpoint, jml::IteratedJml{about}, quadratic), 1e-11);
  EXPECT_GT(distance(midpoint, jml::IteratedJml{about}, cubic), 1e-6);
}

struct Cube {  // f = x³
  static constexpr int states = 1, disturbances = 0;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return jml::Vector<T, 1>(x(0) * x(0) * x(0));
  }
};
// f(x) - f(r) = (x² + x r + r²)(x - r), and 3 ((x + r)/2)² falls short of the bracket by (x - r)²/4.
TEST(Midpoint, OfACubeByHand) {
  using X = jml::Vector<double, 1>;
  const double x = 1.7, r = -0.4, F = 3 * (x + r) * (x + r) / 4, P = 0.3, f_x = 3 * x * x;
  EXPECT_NEAR(x * x + x * r + r * r - F, (x - r) * (x - r) / 4, 1e-15);
  jml::Filter sddre{own::MidpointSddre{jml::AboutPoint{X(r)}}, Cube{}, jml::Estimate{X(x), X(P)}};
  jml::Filter joint{own::MidpointJml{jml::AboutPoint{X(r)}}, Cube{}, jml::Estimate{X(x), X(P)}};
  ASSERT_EQ(sddre.predict(), Status::ok);
  ASSERT_EQ(joint.predict(), Status::ok);
  EXPECT_NEAR(sddre.P()(0), F * P * F, 1e-14);
  EXPECT_NEAR(joint.P()(0), F * P * f_x, 1e-14);
  EXPECT_NEAR(sddre.x()(0), x * x * x, 1e-14);
}

}  // namespace
