// SPDX-License-Identifier: BSD-3-Clause
// A Monte Carlo campaign: what a scenario is, two estimators on the same flights, and what is asked of the
// result.
#include <cmath>
#include <cstdio>
#include <jml/analysis/consistency.hpp>
#include <jml/campaign/campaign.hpp>
#include <jml/jml.hpp>

// [model]
struct Walk {  // x⁺ = x + w
  static constexpr int states = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.5); }
};
struct Position {  // y = x + v
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(1.0); }
};
// [/model]

// [scenario]
struct Walks {
  static constexpr int states = 1, measurements = 1;  // and controls, where the model has them
  std::string name = "random walk";
  int steps = 50;
  double dt = 1;      // s
  Position sensor{};  // what the estimators are given
  double lost = 100;  // a run whose error is above it counts as lost

  /// Draws one run: the true states and what was measured. Called from several threads at once.
  void fly(jml::CounterNoise& noise, jml::Flight<1, 1>& flight) const {
    const jml::Vector<double, 1> start(noise.normal());  // as the prior of the filters says: 0 ± 1
    jml::simulate(Walk{}, sensor, start, jml::GaussianNoise{}, jml::GaussianNoise{}, noise, flight);
  }
  /// What rmse() is of; rmse(i) is of component i. Leave it out for the norm of x̂ - x.
  static double error(const jml::Vector<double, 1>& x, const jml::Vector<double, 1>& truth) {
    return std::abs(x(0) - truth(0));
  }
};
// [/scenario]

int main() {
  // [campaign]
  const jml::Estimate prior{jml::Vector<double, 1>(0.0), jml::Matrix<double, 1, 1>(1.0)};
  jml::Campaign campaign{
      Walks{}, jml::Estimator{"EKF", [=](const auto&) { return jml::Filter{jml::Ekf{}, Walk{}, prior}; }},
      jml::Estimator{"prediction alone", [=](const auto&) {
                       jml::Filter filter{jml::Ekf{}, Walk{}, prior};
                       filter.gate = {1e-9};  // rejects all that comes
                       return filter;
                     }}};
  // With .journal = "walks.journal" a campaign that was stopped goes on where it was.
  campaign.options = {.runs = 1000, .seed = 1, .threads = 2, .progress = false};
  const jml::CampaignResult result = campaign.run();
  if (!result.ok()) {
    std::puts(result.message());
    return 1;
  }
  // [/campaign]

  // [result]
  const auto ekf = result.estimator("EKF");
  const jml::Figure rmse = ekf.at(50).rmse(0), nees = ekf.at(50).nees();
  std::printf("EKF: RMSE %.3f ± %.3f, 95 %% within [%.3f, %.3f]; NEES %.3f\n", rmse.value,
              rmse.standard_error, rmse.low, rmse.high, nees.value);
  const bool consistent = jml::chi_square_average_interval(1, 1000).contains(nees.value);
  std::printf("consistent: %s; %zu runs failed, %zu lost\n", consistent ? "yes" : "no", ekf.failed().size(),
              ekf.lost().size());
  // [/result]

  // [difference]
  const jml::Figure more =
      result.difference("prediction alone", "EKF");  // of a run's RMSE, on the same flights
  std::printf("without measurements the RMSE of a flight is %.2f larger, 95 %% within [%.2f, %.2f]\n",
              more.value, more.low, more.high);
  // [/difference]

  std::remove("half.journal");
  // [parts]
  // On one machine of two: the first 64 of the campaign's 128 blocks of runs. On the other: .first = 64.
  campaign.options.count = 64;
  campaign.options.journal = "half.journal";
  const jml::CampaignResult part = campaign.run();
  // Later, where that journal is: what it has is taken over, what no part has is flown.
  campaign.options = {.runs = 1000, .seed = 1, .progress = false, .parts = {"half.journal"}};
  const jml::CampaignResult whole = campaign.run();
  // [/parts]
  std::remove("half.journal");

  // [replay]
  const auto replay = campaign.replay(471);  // one run again: replay.flight, and of each estimator its rows
  const auto& last = replay.tracks[0].rows[50];
  std::printf("run 471 ends at %.3f, the EKF at %.3f\n", replay.flight.truth[50](0), last.x(0));
  // [/replay]

  // The prediction's variance is ½ more than the steady P = ½ of the filter, and R = 1.
  const double alone = result.estimator("prediction alone").at(50).rmse(0).value;
  const bool right =
      rmse.low < std::sqrt(0.5) && std::sqrt(0.5) < rmse.high && std::abs(alone - std::sqrt(26)) < 0.5;
  const bool merged = part.estimator("EKF").kept() == 512 && whole.blocks_taken_over() == 64 &&
                      whole.estimator("EKF").at(50).rmse(0).value == rmse.value && more.low > 0;
  return right && consistent && merged && replay.ok() ? 0 : 1;
}
