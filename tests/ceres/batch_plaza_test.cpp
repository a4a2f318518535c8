// SPDX-License-Identifier: BSD-3-Clause
// Two engines, one real recording: Plaza 1 (examples/data/plaza1/README.md), 9657 steps of seven states, G Q Gᵀ of
// rank six and turning with the heading, ranges with outliers.
#include <gtest/gtest.h>

#include "ceres/batch_flights.hpp"
#include "support/plaza.hpp"

namespace {

TEST(Agreement, Plaza1) {
  const demo::Plaza data(PLAZA1_DATA);
  const auto rows = static_cast<int>(data.odometry.size()), ranges = static_cast<int>(data.ranges.size());
  jml::Batch by_sweep{models::PlazaRobot<4>{}, jml::sensors<models::RangeToTag<4>>, demo::start<4>(data),
                      jml::Capacity{rows, ranges}, data.truth[0][0]};
  by_sweep.options.loss = jml::Loss::huber(2);
  std::size_t next = 0;
  for (const auto& [time, distance, turn] : data.odometry) {
    const double dt = time - by_sweep.time(by_sweep.steps());
    ASSERT_EQ(by_sweep.predict(dt, jml::Vector<double, 2>(distance, turn)), jml::Status::ok);
    for (; next < data.ranges.size() && data.ranges[next][0] <= time; ++next) {
      const auto& range = data.ranges[next];
      ASSERT_EQ(by_sweep.update(data.radio<4>(range), range[2]), jml::Status::ok);
    }
  }
  ASSERT_EQ(by_sweep.steps(), 9657);
  auto by_ceres = by_sweep;
  batch_flights::expect_agreement(by_sweep, by_ceres);
}

}  // namespace
