// SPDX-License-Identifier: BSD-3-Clause
// A channel beside a method of one's own that reads no gate, or that cannot predict; and a window that begins
// anew: whole or not at all, with the control of its last step.
#include <gtest/gtest.h>

#include <jml/jml.hpp>

namespace {

using jml::Status, jml::Verdict;
using Vector2 = jml::Vector<double, 2>;
using Matrix2 = jml::Matrix<double, 2, 2>;

struct Still {
  static constexpr int states = 2, disturbances = 0, controls = 1;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x, const auto&) const {
    return x;
  }
};
/// Both states, the first off by the control.
struct Shifted {
  static constexpr int measurements = 2;
  template <typename T>
  jml::Vector<T, 2> measurement(const jml::Vector<T, 2>& x, const auto& at) const {
    return {x(0) + double(at.control(0)), x(1)};
  }
  Matrix2 noise_covariance() const { return Matrix2::Identity(); }
};

/// The mean of the estimate and y, whatever the gate says.
struct Halfway {
  Status answer = Status::ok;  // of a prediction
  template <typename Scalar, jml::Dynamics D>
  using Belief = jml::Estimate<Scalar, jml::states_of<D>>;

  template <typename Model, typename Start, typename Belief>
  Status start(const Model&, const Start& given, Belief& belief) const {
    belief = given;
    return Status::ok;
  }
  template <typename Model, typename Belief, typename At>
  Status predict(const Model&, const Belief& prior, const At&, Belief& next) const {
    next = prior;
    return answer;
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct(const Model&, const Belief& prior, const Sample& sample, Belief& next, Report& report) const {
    report.innovation = sample.y - prior.x;
    report.innovation_matrix = 2 * Matrix2::Identity();
    next.x = prior.x + report.innovation / 2;
    next.P = prior.P / 2;
  }
};
const jml::Estimate<double, 2> start{Vector2(0, 0), Matrix2(Matrix2::Identity())};

TEST(ChannelEdges, AMethodThatReadsNoGateIsGivenAMeasurementOnce) {
  jml::Filter filter{Halfway{}, Still{}, start};
  jml::Channel channel{Shifted{}, jml::Lockout{}, jml::blocks(jml::only(0), jml::only(1))};
  channel.gate = {0.999};
  const auto report = channel.step(filter, Vector2(4, 8), 1.0);
  EXPECT_EQ(report.gate, Verdict::off);
  EXPECT_EQ(filter.x(), Vector2(2, 4));
  EXPECT_EQ(channel.tally().accepted, 1U);
}

TEST(ChannelEdges, NothingIsRecoveredAtATimeThatIsNotThatOfY) {
  jml::Filter filter{Halfway{Status::covariance_lost}, Still{}, start};
  jml::Channel channel{Shifted{}, jml::Lockout<>{.after = 1, .recovery = jml::Recovery::accept}};
  for (int k = 0; k < 3; ++k)
    EXPECT_EQ(channel.step(filter, Vector2(4, 8), 1.0).status, Status::covariance_lost);
  EXPECT_EQ(filter.x(), Vector2(0, 0));
  EXPECT_EQ(filter.time(), 0);
  EXPECT_EQ(channel.tally().refused, 3U);
  EXPECT_EQ(channel.tally().recovered, 0U);
  EXPECT_TRUE(channel.shut());
}

TEST(ChannelEdges, AWindowThatBeginsAnewKeepsTheControl) {
  jml::Filter lag{jml::FixedLag<4>{{.sweeps = 5}}, Still{}, jml::sensors<Shifted>, start};
  const jml::Vector<double, 1> control(3.0);
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(jml::usable(lag.step(Shifted{}, Vector2(3, 0), 1.0, control)));
  EXPECT_LT(lag.x().norm(), 1e-12);
  EXPECT_EQ(lag.rescale(Vector2(1e200, 1), Vector2(0, 0)), Status::invalid_option);
  EXPECT_EQ(lag.depth(), 3);
  ASSERT_EQ(lag.inflate(Vector2(1, 1)), Status::ok);
  EXPECT_EQ(lag.depth(), 0);
  ASSERT_TRUE(jml::usable(lag.update(Shifted{}, Vector2(3, 0))));
  EXPECT_LT(lag.x().norm(), 1e-12);
  ASSERT_EQ(lag.retune(Still{}), Status::ok);
  ASSERT_TRUE(jml::usable(lag.update(Shifted{}, Vector2(3, 0))));
  EXPECT_LT(lag.x().norm(), 1e-12);
}

}  // namespace
