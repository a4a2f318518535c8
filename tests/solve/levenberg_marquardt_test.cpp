// SPDX-License-Identifier: BSD-3-Clause
// The fallback solver in a valley that is bent and narrow: ½ |u - (1, 1)|² + ½ ((|u|² - 2) / width)². Its
// least point (1, 1) lies on the circle, and the way there is along it; straight steps go as far as the root
// of the width.
#include <gtest/gtest.h>

#include <jml/solve/levenberg_marquardt.hpp>

namespace {

struct Valley {
  static constexpr int parameters = 2, residuals = 3;
  static constexpr bool whitened = true;
  double width;
  bool evaluate(const jml::Vector<double, 2>& u, jml::Vector<double, 3>& r,
                jml::Matrix<double, 3, 2>* J) const {
    r << u(0) - 1, u(1) - 1, (u(0) * u(0) + u(1) * u(1) - 2) / width;
    if (J != nullptr) *J << 1, 0, 0, 1, 2 * u(0) / width, 2 * u(1) / width;
    return true;
  }
};

TEST(LevenbergMarquardt, GoesAlongABentValleyInStepsThatDoNotShrinkWithItsWidth) {
  for (const double width : {1e-2, 1e-3, 1e-4, 1e-5}) {
    jml::Vector<double, 2> u(-1.2, 0.75);
    const auto report = jml::LevenbergMarquardt{}.minimize(Valley{width}, u);
    EXPECT_TRUE(report.converged) << width;
    EXPECT_LE(report.iterations, 40) << width;
    EXPECT_NEAR(u(0), 1, 1e-6) << width;
    EXPECT_NEAR(u(1), 1, 1e-6) << width;
  }
}

}  // namespace
