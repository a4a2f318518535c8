// SPDX-License-Identifier: BSD-3-Clause
// A small strapdown study (examples/campaign/strapdown_flights.hpp): nothing is refused, the covariance is
// believed within what so few flights can tell, estimators agree, and a heading that is far off is found.
#include <gtest/gtest.h>

#include <campaign/strapdown_flights.hpp>
#include <jml/analysis/consistency.hpp>

namespace {

using namespace study;

constexpr auto gnss_and_baro = jml::sensors<navigation::GnssFix, navigation::Barometer>;
constexpr std::uint64_t seed = 1;

TEST(StrapdownStudy, CovarianceIsBelieved) {
  Journey journey;
  journey.seconds = 20;
  Consistency ekf{"EKF"}, factored{"EKF in factors"}, lag{"fixed lag 20"};
  constexpr std::uint64_t flights = 20;
  for (std::uint64_t run = 0; run < flights; ++run) {
    const Flown flown = fly(journey, seed, run);
    jml::Filter one{jml::Ekf{}, journey.unit(), flown.start};
    ekf.add(journey, flown, run, one);
    jml::Filter two{jml::Factored{jml::Ekf{}}, journey.unit(), flown.start};
    factored.add(journey, flown, run, two);
    jml::Filter three{jml::FixedLag<20>{}, journey.unit(), gnss_and_baro, flown.start};
    lag.add(journey, flown, run, three);
  }
  const auto end = jml::chi_square_average_interval(15, flights, 0.999);
  for (const Consistency* e : {&ekf, &factored, &lag}) {
    EXPECT_EQ(e->refused.size(), 0U) << e->name;
    EXPECT_TRUE(end.contains(e->at_end())) << e->name << ' ' << e->at_end();
    EXPECT_TRUE(jml::mean_interval(e->mean(), e->standard_error(), flights, 0.999).contains(15))
        << e->name << ' ' << e->mean();
    EXPECT_NEAR(e->mean(), ekf.mean(), 0.1) << e->name;
  }
  EXPECT_NEAR(factored.mean(), ekf.mean(), 1e-6);
}

TEST(StrapdownStudy, HeadingIsFound) {
  const Journey journey = coarse_start();
  Convergence lag{"fixed lag 20"};
  for (std::uint64_t run = 0; run < 20; ++run) {
    const Flown flown = fly(journey, seed, run);
    jml::Filter filter{jml::FixedLag<20>{}, journey.unit(), gnss_and_baro, flown.start};
    lag.add(journey, flown, run, filter);
  }
  EXPECT_EQ(lag.refused.size(), 0U);
  EXPECT_GE(lag.share(), 0.9);
}

}  // namespace
