// SPDX-License-Identifier: BSD-3-Clause
// The reentry vehicle of the EKF/UKF toolbox manual (Hartikainen, Solin and Särkkä 2011, table 4): EKF
// position RMSE 0.0084 km; 0.00842 ± 0.00007 recomputed with an independent implementation; smoother behind
// it 0.0044 km.
//
// RMSE: √ of the mean over the 2000 samples of a run of the squared distance (both coordinates summed, not
// averaged), each sample after its update; then the mean over runs.
#include "models/reentry.hpp"

#include <jml/interval/smoother.hpp>

#include "by_night.hpp"
#include "published/campaign.hpp"

namespace {

using State = jml::Vector<double, 5>;
using Covariance = jml::Matrix<double, 5, 5>;

constexpr int steps = 2000;

struct Track {
  std::vector<State> truth;
  std::vector<jml::Vector<double, 2>> y;

  explicit Track(std::uint64_t seed) {
    jml::Noise noise(seed);
    const models::ReentryVehicle vehicle{.parameter_variance = 0};
    const models::GroundRadar radar;
    State x = mean();
    x(4) = 0.6932;
    for (int i = 0; i < 4; ++i) x(i) += 1e-3 * noise.normal();
    for (int k = 0; k < steps; ++k) {
      x = vehicle.dynamics(x) +
          vehicle.disturbance_input() * noise.normal_vector(vehicle.disturbance_covariance());
      truth.push_back(x);
      y.push_back(radar.measurement(x) + noise.normal_vector(radar.noise_covariance()));
    }
  }
  /// What the filter believes at the start; its drag parameter is off by 0.6932 with a standard deviation
  /// of 1.
  static State mean() { return {6500.4, 349.14, -1.8093, -6.7967, 0}; }
  static Covariance covariance() {
    Covariance P = 1e-6 * Covariance::Identity();
    P(4, 4) = 1;
    return P;
  }
};

template <typename Rule>
void score(const Rule& rule, const Track& track, campaign::Score& out) {
  jml::Filter filter{rule, models::ReentryVehicle{}, jml::Estimate{Track::mean(), Track::covariance()}};
  double squares = 0;
  for (std::size_t k = 0; k < steps; ++k) {
    if (!jml::usable(filter.step(models::GroundRadar{}, track.y[k]).status)) out.refuse(filter.predict());
    const State error = filter.x() - track.truth[k];
    squares += error(0) * error(0) + error(1) * error(1);
  }
  out.finish(std::sqrt(squares / steps), 1);
}

/// The same with the smoother: every sample given all measurements of the run.
void score_smoother(const Track& track, campaign::Score& out) {
  jml::Smoother smoother{
      jml::Filter{jml::Ekf{}, models::ReentryVehicle{}, jml::Estimate{Track::mean(), Track::covariance()}},
      steps};
  for (const auto& y : track.y) {
    if (!jml::usable(smoother.step(models::GroundRadar{}, y).status)) out.refuse(smoother.predict());
  }
  EXPECT_EQ(smoother.smooth(), jml::Status::ok);
  double squares = 0;
  for (int k = 0; k < steps; ++k)
    squares += (smoother.x(k + 1) - track.truth[static_cast<std::size_t>(k)]).head<2>().squaredNorm();
  out.finish(std::sqrt(squares / steps), 1);
}

TEST(Reentry, EkfHasThePublishedError) {
  campaign::Score ekf{"EKF"};
  for (unsigned run = 0; run < 400; ++run) score(jml::Ekf{}, Track(run), ekf);
  ekf.print("km", "ekf");
  EXPECT_EQ(ekf.refused, 0);
  EXPECT_EQ(ekf.lost, 0);
  EXPECT_LT(ekf.error.figure().standard_error, 0.0001) << "too few runs to say anything";
  campaign::expect_agreement(ekf, {0.00842, 0.00007});
}

// The published figure is rounded to 0.00005 and is taken for a mean of 100 runs that scatter as these do. As many are
// enough by day: 400, which the stored figure is of, narrow the bound, mostly the published figure's own, by an eighth.
TEST(Reentry, SmootherHasThePublishedError) {
  campaign::Score smoother{"EKF smoother"};
  const unsigned runs = by_night() ? 400 : 100;
  for (unsigned run = 0; run < runs; ++run) score_smoother(Track(run), smoother);
  smoother.print("km", "smoother");
  EXPECT_EQ(smoother.refused, 0);
  EXPECT_EQ(smoother.lost, 0);
  const double ours = smoother.error.figure().standard_error;
  EXPECT_LT(ours, 0.0001) << "too few runs to say anything";
  const double of_100_runs = ours * std::sqrt(smoother.error.runs() / 100.0);
  campaign::expect_agreement(smoother, {0.0044, std::hypot(of_100_runs, 0.00005)});
}

// The other rules on the same tracks. The SDC matrices are derived about the start of the track, a point that
// means something here; the origin is the centre of the Earth.
TEST(Reentry, OtherRulesBesideIt) {
  campaign::Score ekf{"EKF"}, iekf{"IEKF"}, sddre{"SDDRE about the start"}, jml_rule{"JML about the start"},
      iterated{"iterated JML, estimate"};
  const jml::AboutPoint start{Track::mean()};
  for (unsigned run = 0; run < 20; ++run) {
    const Track track(run);
    score(jml::Ekf{}, track, ekf);
    score(jml::Iekf{}, track, iekf);
    score(jml::Sddre{start}, track, sddre);
    score(jml::Jml{start}, track, jml_rule);
    score(jml::IteratedJml{jml::AboutEstimate{}}, track, iterated);
  }
  for (const auto* s : {&ekf, &iekf, &sddre, &jml_rule, &iterated}) {
    s->print("km");
    EXPECT_EQ(s->refused, 0) << s->name << ": every step of this problem is mild";
    EXPECT_EQ(s->lost, 0) << s->name;
  }
  // A step is nearly linear here: iterating it changes the estimate by far less than its error.
  for (const auto* s : {&iekf, &iterated}) {
    EXPECT_NEAR(s->error.figure().value, ekf.error.figure().value, ekf.error.figure().standard_error)
        << s->name;
  }
}

}  // namespace
