// SPDX-License-Identifier: BSD-3-Clause
// Every method that is shipped passes the check that is shipped: equal bits twice, refusals that leave no trace, a
// gate that is obeyed, and the Kalman filter on a linear system from each that says so.
#include <gtest/gtest.h>

#include "models/combinations.hpp"
#include "models/linear.hpp"

namespace {

using jml::Matrix, jml::Vector;

using Step = models::CombinedStep<double, false>;
using Flow = models::CombinedOscillator<double, false>;
using Sampled = models::CombinedSensor<double, false, false>;
using Always = models::CombinedSensor<double, false, true>;

const auto start = models::combined_start<double>();
const jml::Box<double, 2> box{Vector<double, 2>(0.5, 0), Vector<double, 2>(1.2, 0.6)};

template <typename Filter, typename S>
void check(const char* name, const Filter& filter, const S& sensor) {
  const auto y = models::combined_y<double>;
  const auto check = jml::check_method(filter, sensor, {y(1), y(2), y(3), y(4), y(5), y(6)}, 0.05);
  EXPECT_TRUE(check.ok()) << name << ", measurement " << check.at << ": " << check.what;
}

TEST(CheckEveryMethod, InDiscreteTime) {
  check("EKF", jml::Filter{jml::Ekf{}, Step{}, start}, Sampled{});
  check("SDDRE", jml::Filter{jml::Sddre{}, Step{}, start}, Sampled{});
  check("JML", jml::Filter{jml::Jml{}, Step{}, start}, Sampled{});
  check("IEKF", jml::Filter{jml::Iekf{}, Step{}, start}, Sampled{});
  check("iterated JML", jml::Filter{jml::IteratedJml{}, Step{}, start}, Sampled{});
  check("linearised", jml::Filter{jml::Linearised{}, Step{}, box}, Sampled{});
  check("guaranteed", jml::Filter{jml::Guaranteed{}, Step{}, box}, Sampled{});
  check("fixed lag", jml::Filter{jml::FixedLag<3, 4>{}, Step{}, jml::sensors<Sampled>, start}, Sampled{});
  jml::Bounds<2> bounds;
  bounds.upper(0) = start.x(0);
  check("fixed lag within bounds", jml::Filter{jml::Bounded{jml::FixedLag<3, 4>{}, bounds}, Step{}, jml::sensors<Sampled>, start}, Sampled{});
}

TEST(CheckEveryMethod, InContinuousTime) {
  const auto both = [](const char* name, const auto& method) {
    const auto from = [] {
      if constexpr (requires { method.options; })
        return Vector<double, 2>(start.x);
      else
        return start;
    }();
    check(name, jml::Filter{method, Flow{}, from}, Always{});
    jml::Filter sampled{method, Flow{}, from};
    if constexpr (requires { method.options; }) {  // update() has a gain after the first step
      ASSERT_TRUE(jml::usable(sampled.step(Sampled{}, 0.7, 0.05)));
    }
    check(name, sampled, Sampled{});
  };
  both("EKF, Runge-Kutta", jml::Continuous{jml::Ekf{}});
  both("RNLS, Runge-Kutta", jml::Continuous{jml::Rnls{}});
  both("SDDRE, Davison-Maki", jml::Continuous{jml::Sddre{}, jml::DavisonMaki{}});
  both("RNLS, Davison-Maki", jml::Continuous{jml::Rnls{}, jml::DavisonMaki{}});
  both("algebraic SDDRE", jml::Algebraic{jml::Sddre{}});
  both("algebraic RNLS", jml::Algebraic{jml::Rnls{}});
}

TEST(CheckEveryMethod, LinearIsKalman) {
  const models::ConstantVelocity d;
  models::LinearSensor<4, 2> s;
  s.M << 1, 0, 0.2, 0, 0, 0.1, 1, 0;
  s.R << 2, 0.5, 0.5, 1;
  const jml::Estimate<double, 4> from{Vector<double, 4>(1, 2, -3, 1), Matrix<double, 4, 4>(2 * Matrix<double, 4, 4>::Identity())};
  const std::array<Vector<double, 2>, 6> y{Vector<double, 2>(1, -3), Vector<double, 2>(3, -1), Vector<double, 2>(0, 2),
                                           Vector<double, 2>(-1, 1), Vector<double, 2>(2, 2), Vector<double, 2>(4, -2)};
  const auto linear = [&](const char* name, const auto& filter) {
    const auto check = jml::check_method(filter, s, y, 0.1);
    EXPECT_TRUE(check.ok()) << name << ", measurement " << check.at << ": " << check.what;
  };
  linear("Kalman", jml::Filter{jml::Kalman{}, d, from});
  linear("iterated JML", jml::Filter{jml::IteratedJml{}, d, from});
  linear("fixed lag", jml::Filter{jml::FixedLag<4, 4>{{.sweeps = 20}}, d, jml::sensors<models::LinearSensor<4, 2>>, from});
}

}  // namespace
