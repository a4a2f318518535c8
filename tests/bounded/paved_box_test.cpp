// SPDX-License-Identifier: BSD-3-Clause
// A union of boxes: the truth is in one of its parts, always; two places that a range cannot tell apart are
// two parts, and the next range decides; one part is the guaranteed box; what fits none is named.
#include <gtest/gtest.h>

#include <jml/bounded/bounded_noise.hpp>
#include <jml/campaign/noise.hpp>

#include "models/plaza.hpp"

namespace {

using jml::Box, jml::Filter, jml::Guaranteed, jml::Paved, jml::Status;
using Pose = jml::Vector<double, 3>;
using Way = jml::Vector<double, 2>;
using Range = models::BoundedRangeToTag;
using Robot = models::BoundedPlazaRobot;

template <typename F>
bool in_a_part(const F& filter, const Pose& x) {
  for (const Box<double, 3>& part : filter.parts()) {
    if (part.contains(x)) return true;
  }
  return false;
}
bool same(const Box<double, 3>& a, const Box<double, 3>& b) {
  return (a.lower.array() == b.lower.array()).all() && (a.upper.array() == b.upper.array()).all();
}
/// box() is the smallest box around parts().
template <typename F>
void expect_hull(const F& filter) {
  Box<double, 3> hull = filter.parts()[0];
  for (const Box<double, 3>& part : filter.parts()) {
    ASSERT_TRUE(part.valid());
    hull.lower = hull.lower.cwiseMin(part.lower);
    hull.upper = hull.upper.cwiseMax(part.upper);
  }
  EXPECT_TRUE(same(filter.box(), hull));
}

// Seen from a road, |north| ≤ 0.5, through the tag: 5 m away is 5 m east or 5 m west.
struct Road : ::testing::Test {
  Box<double, 3> road{Pose(-10, -0.5, 0), Pose(10, 0.5, 0)};
  Range near{{0, 0}, 0, 0.1}, far{{10, 0}, 0, 0.1};
  Filter<Paved<8>, Robot> filter{Paved<8>{}, Robot{.bound = 0, .bound_slope = 0}, road};

  void SetUp() override { ASSERT_EQ(filter.update(near, 5.0).status, Status::ok); }
};

TEST_F(Road, TwoPlaces) {
  int east = 0, west = 0;
  for (const Box<double, 3>& part : filter.parts()) {
    east += part.lower(0) > 0;
    west += part.upper(0) < 0;
  }
  EXPECT_GE(east, 1);
  EXPECT_GE(west, 1);
  EXPECT_EQ(east + west, static_cast<int>(filter.parts().size()));
  EXPECT_LE(filter.parts().size(), 8U);
  expect_hull(filter);
  // The ring 4.9 … 5.1 m on the road: |east| in √(4.9² - 0.5²) = 4.874 … 5.1.
  for (const Box<double, 3>& part : filter.parts()) {
    EXPECT_GT(part.lower.cwiseAbs().cwiseMin(part.upper.cwiseAbs())(0), 4.874 - 0.05);
  }
  EXPECT_NEAR(filter.box().upper(0), 5.1, 0.06);
  EXPECT_NEAR(filter.box().lower(0), -5.1, 0.06);
  for (int i = 0; i <= 400; ++i) {
    for (const double radius : {4.9000001, 5.0, 5.0999999}) {
      const double north = -0.5 + i / 400.0, side = i % 2 == 0 ? 1 : -1;
      EXPECT_TRUE(in_a_part(filter, Pose(side * std::sqrt(radius * radius - north * north), north, 0)));
    }
  }
}

TEST_F(Road, TheNextRangeDecides) {
  ASSERT_EQ(filter.update(far, 5.0).status, Status::ok);  // 15 m from the place in the west
  expect_hull(filter);
  EXPECT_GT(filter.box().lower(0), 4.8);
  EXPECT_TRUE(in_a_part(filter, Pose(5, 0, 0)));
  EXPECT_LT(filter.box().width()(0), 0.3);
}

// 10 m from the far tag is halfway between the two places: the box around both takes it, the union does not.
TEST_F(Road, WhatFitsNoPartIsNamed) {
  const auto before = filter;
  const auto report = filter.update(far, 10.0);
  EXPECT_EQ(report.status, Status::accepted_without_measurement);
  EXPECT_EQ(report.violation.row, 0);
  EXPECT_EQ(report.violation.state, -1);
  // The nearest state is (4.874, 0.5), 5.150 m away: 4.750 m from 10 ± 0.1.
  EXPECT_GT(report.violation.excess, 4.65);
  EXPECT_LT(report.violation.excess, 4.7501);
  EXPECT_TRUE(same(filter.box(), before.box()));
  ASSERT_EQ(filter.parts().size(), before.parts().size());
  for (std::size_t i = 0; i < filter.parts().size(); ++i)
    EXPECT_TRUE(same(filter.parts()[i], before.parts()[i]));
  Filter one{Guaranteed{}, Robot{.bound = 0, .bound_slope = 0}, road};
  ASSERT_EQ(one.update(near, 5.0).status, Status::ok);
  EXPECT_EQ(one.update(far, 10.0).status, Status::ok);
}

// Both places move along, and stay two.
TEST_F(Road, PartsMove) {
  ASSERT_EQ(filter.predict(1.0, Way(2, 0)), Status::ok);
  expect_hull(filter);
  EXPECT_TRUE(in_a_part(filter, Pose(7, 0, 0)));
  EXPECT_TRUE(in_a_part(filter, Pose(-3, 0, 0)));
  EXPECT_FALSE(in_a_part(filter, Pose(2, 0, 0)));
}

/// The robot among four tags; every second error of odometry and range is at its bound.
struct Drive {
  Robot robot{.bound = 0.02, .bound_slope = 0.2, .turn_bound = 0.01};
  Pose truth{0, 0, 1};
  jml::Noise noise;
  explicit Drive(std::uint64_t seed) : noise(seed) {}

  [[nodiscard]] Box<double, 3> start(double half, double turn) {
    const Pose reach(half, half, turn);
    Pose off;
    for (int i = 0; i < 3; ++i) off(i) = 0.99 * noise.uniform(-1, 1) * reach(i);
    return {truth + off - reach, truth + off + reach};
  }
  double error(double bound) {
    const double u = noise.uniform(-1, 1);
    return 0.999999 * bound * (noise.uniform() < 0.5 ? std::copysign(1.0, u) : u);
  }
  Way go() {
    const Way way(noise.uniform(0, 0.6), noise.uniform(-0.3, 0.5));
    const jml::StepContext<double, 2> at{0, 1, way};
    Pose w = robot.disturbance_bound(truth, at);
    for (int i = 0; i < 3; ++i) w(i) = error(w(i));
    truth = robot.dynamics(truth, at) + robot.disturbance_input(truth, at) * w;
    return way;
  }
  Range tag() { return {{10 * std::copysign(1.0, noise.uniform(-1, 1)), noise.uniform(-9, 9)}, 0.5, 1}; }
  double range(const Range& tag) { return tag.measurement(truth)(0) + error(tag.bound); }
};

// A distance in every second row, from a start that knows little of the heading.
TEST(PavedBox, TheTruthIsInOneOfThePartsAlways) {
  int outside = 0, wider = 0, steps = 0, refused = 0;
  double paved_width = 0, guaranteed_width = 0;
  std::size_t most = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Drive drive(seed);
    const Box<double, 3> start = drive.start(4, seed % 3 == 0 ? 3.2 : 0.3);
    Filter paved{Paved<8>{}, drive.robot, start};
    Filter guaranteed{Guaranteed{}, drive.robot, start};
    for (int k = 0; k < 150; ++k) {
      const Way way = drive.go();
      if (k % 2 == 0) {
        const Range tag = drive.tag();
        const double y = drive.range(tag);
        refused += paved.step(tag, y, 1.0, way).status != Status::ok;
        refused += guaranteed.step(tag, y, 1.0, way).status != Status::ok;
      } else {
        refused += paved.predict(1.0, way) != Status::ok;
        refused += guaranteed.predict(1.0, way) != Status::ok;
      }
      outside += !in_a_part(paved, drive.truth);
      outside += !paved.box().contains(drive.truth);
      most = std::max(most, paved.parts().size());
      paved_width += paved.box().width().head<2>().maxCoeff();
      guaranteed_width += guaranteed.box().width().head<2>().maxCoeff();
      wider += paved.box().width()(0) > guaranteed.box().width()(0) * (1 + 1e-9);
      ++steps;
    }
    expect_hull(paved);
  }
  EXPECT_EQ(refused, 0);
  EXPECT_EQ(outside, 0);
  EXPECT_EQ(most, 8U);
  EXPECT_LT(paved_width, 0.6 * guaranteed_width) << paved_width << ' ' << guaranteed_width;
  EXPECT_LT(wider, steps / 50);
}

// No range sees the heading: parts are bisected along it where its width bends the dynamics, and ranges drop
// those that point elsewhere. One box keeps the whole turn.
TEST(PavedBox, FindsTheHeading) {
  Drive drive(41);
  drive.robot = {.bound = 0.01, .bound_slope = 0};
  const Box<double, 3> start = drive.start(0.1, 3.2);
  Filter paved{Paved<8>{}, drive.robot, start};
  Filter guaranteed{Guaranteed{}, drive.robot, start};
  for (int k = 0; k < 60; ++k) {
    const Way way = drive.go();
    const Range tag{{k % 2 == 0 ? 10.0 : -10.0, 9}, 0, 0.2};
    const double y = drive.range(tag);
    ASSERT_EQ(paved.step(tag, y, 1.0, way).status, Status::ok);
    ASSERT_EQ(guaranteed.step(tag, y, 1.0, way).status, Status::ok);
    ASSERT_TRUE(in_a_part(paved, drive.truth)) << k;
  }
  EXPECT_LT(paved.box().width()(2), 3.2);  // half of it is ruled out
  EXPECT_GT(guaranteed.box().width()(2), 6.4);
}

// Not the truth alone: whatever state of the box explains the range stays. Boxes of all sizes about the tag.
TEST(PavedBox, NothingIsLostByARange) {
  jml::Noise noise(5);
  int outside = 0, parted = 0;
  long checked = 0;
  for (int run = 0; run < 1000; ++run) {
    const double size = 10 * std::pow(10.0, noise.uniform(-2, 0));
    Box<double, 3> box;
    for (int i = 0; i < 3; ++i) {
      const double middle = size * noise.uniform(-1.5, 1.5);
      box.lower(i) = middle - size * noise.uniform();
      box.upper(i) = middle + size * noise.uniform();
    }
    const auto inside = [&box, &noise](bool at_a_side) {
      Pose x;
      for (int i = 0; i < 3; ++i) {
        const double at = noise.uniform();
        x(i) = box.lower(i) + at * (box.upper(i) - box.lower(i));
        if (at_a_side && i == 0) x(i) = at < 0.5 ? box.lower(i) : box.upper(i);
      }
      return x;
    };
    const Range tag{{0, 0}, 0, 0.1};
    const double y = tag.measurement(inside(run % 3 == 0))(0) + 0.0999999 * noise.uniform(-1, 1);
    Filter filter{Paved<8>{}, Robot{.bound = 0, .bound_slope = 0}, box};
    ASSERT_EQ(filter.update(tag, y).status, Status::ok) << run;
    parted += filter.parts().size() > 2;
    for (int k = 0; k < 400; ++k) {
      const Pose x = inside(k % 4 == 0);
      if (std::abs(y - tag.measurement(x)(0)) > 0.1 - 1e-12) continue;
      ++checked;
      outside += !in_a_part(filter, x);
    }
  }
  EXPECT_EQ(outside, 0);
  EXPECT_GT(checked, 5000);
  EXPECT_GT(parted, 500);
}

// Four boxes, room for two: the pair that touches first, then the one that loses the least; units do not
// count.
TEST(PavedBox, MergesWhatCostsLeast) {
  using Point = jml::Vector<double, 2>;
  struct None {};
  for (const double unit : {1.0, 1e6}) {
    const auto box = [unit](double west, double south, double east, double north) {
      return Box<double, 2>{Point(west * unit, south), Point(east * unit, north)};
    };
    jml::detail::Paving<double, 2, 4, None> paving;
    paving.start(box(0, 0, 4, 1));
    paving.bisect(0, 0);  // 0 … 2 and 2 … 4
    EXPECT_EQ(paving.box(0).upper(0), 2 * unit);
    EXPECT_EQ(paving.box(1).lower(0), 2 * unit);
    paving.bisect(1, 1);
    paving.box(2) = box(20, 0, 22, 1);
    paving.bisect(2, 0);
    paving.box(3) = box(20, 2, 22, 3);  // 1 above the third
    ASSERT_EQ(paving.count(), 4);
    paving.box(1) = box(2, 0, 4, 1);
    paving.merge(4);  // nothing is to be lost, but the halves are one box again
    ASSERT_EQ(paving.count(), 3);
    EXPECT_EQ(paving.box(0).upper(0), 4 * unit);
    EXPECT_EQ(paving.box(0).upper(1), 1);
    paving.merge(2);
    ASSERT_EQ(paving.count(), 2);
    EXPECT_EQ(paving.box(0).upper(0), 4 * unit);
    EXPECT_EQ(paving.box(1).lower(0), 20 * unit);
    EXPECT_EQ(paving.box(1).lower(1), 0);
    EXPECT_EQ(paving.box(1).upper(1), 3);
    EXPECT_EQ(paving.hull().upper(0), 22 * unit);
    EXPECT_EQ(paving.hull().lower(0), 0);
  }
}

TEST(PavedBox, OnePartIsTheGuaranteedBox) {
  Drive drive(31);
  const Box<double, 3> start = drive.start(4, 0.3);
  Filter one{Paved<1>{}, drive.robot, start};
  Filter guaranteed{Guaranteed{}, drive.robot, start};
  for (int k = 0; k < 200; ++k) {
    const Way way = drive.go();
    const Range tag = drive.tag();
    const double y = drive.range(tag) + (k % 50 == 49 ? 30 : 0);
    const auto report = one.step(tag, y, 1.0, way), wanted = guaranteed.step(tag, y, 1.0, way);
    ASSERT_EQ(report.status, wanted.status);
    EXPECT_EQ(report.violation.row, wanted.violation.row);
    EXPECT_EQ(report.violation.excess, wanted.violation.excess);
    ASSERT_TRUE(same(one.box(), guaranteed.box())) << k;
    ASSERT_EQ(one.parts().size(), 1U);
    EXPECT_TRUE(same(one.parts()[0], one.box()));
  }
}

// No box to begin with: nothing to bisect, until the measurements have made one.
TEST(PavedBox, BeginsWithoutABox) {
  Filter filter{Paved<8>{}, Robot{.bound = 0.1, .bound_slope = 0}};
  EXPECT_EQ(filter.predict(1.0, Way(0, 0)), Status::state_unbounded);
  EXPECT_EQ(filter.update(Range{{0, 0}, 0, 0.1}, 5.0).status, Status::ok);
  EXPECT_EQ(filter.parts().size(), 1U);  // the heading has no bound yet
  EXPECT_EQ(filter.predict(1.0, Way(0, 0)), Status::state_unbounded);
}

// A bound that is none, and a range that is none, change nothing.
TEST(PavedBox, Refusals) {
  Filter filter{Paved<8>{}, Robot{.bound = 0.1, .bound_slope = 0}, Box{Pose(-9, -9, 0), Pose(9, 9, 1)}};
  ASSERT_EQ(filter.step(Range{{0, 0}, 0, 0.1}, 5.0, 1.0, Way(1, 0)).status, Status::ok);
  const Box<double, 3> box = filter.box();
  const Pose last = filter.parts().back().lower;
  EXPECT_EQ(filter.update(Range{{0, 0}, 0, -0.1}, 5.0).status, Status::invalid_noise_bound);
  EXPECT_EQ(filter.update(Range{{0, 0}, 0, 0.1}, std::nan("")).status, Status::invalid_measurement);
  EXPECT_EQ(filter.update(Range{{std::nan(""), 0}, 0, 0.1}, 5.0).status, Status::sensor_not_finite);
  EXPECT_EQ(filter.predict(1.0, Way(1e200, 1e200)), Status::ok);  // far, but a number
  EXPECT_EQ(filter.reset(Box{Pose(-9, -9, 0), Pose(9, 9, 1)}, 0), Status::ok);
  EXPECT_EQ(filter.parts().size(), 1U);
  EXPECT_TRUE(box.valid() && last(0) > -10);
}

}  // namespace
