// SPDX-License-Identifier: BSD-3-Clause
// Strapdown navigation in numbers: NEES of 15 degrees of freedom over many flights, at the noise of the grade
// and at a tenth of it, where an excess that comes of linearising must vanish; and from how far off a heading
// converges.
//
//   strapdown_study [flights 1000] [seconds 60] [of a fixed lag 100] [coarse flights 200] [seed 1]
#include <figure.hpp>
#include <models/strapdown_by_hand.hpp>

#include "strapdown_flights.hpp"

namespace {

using namespace study;

/// The filter written by hand as an estimator, to leave out the reset of its covariance.
struct WithoutReset {
  models::StrapdownByHand filter;

  [[nodiscard]] const auto& x() const { return filter.x; }
  [[nodiscard]] const auto& P() const { return filter.P; }
  jml::Status predict(double dt, const jml::Vector<double, 6>& sample) {
    filter.predict(sample, dt);
    return jml::Status::ok;
  }
  jml::Status update(const navigation::Barometer& sensor, const jml::Vector<double, 1>& y) {
    filter.correct<1>(y, sensor.measurement(filter.x), models::by_hand::height_slope(),
                      sensor.noise_covariance());
    return jml::Status::ok;
  }
  jml::Status update(const navigation::GnssFix& sensor, const jml::Vector<double, 6>& y) {
    jml::StepContext<double, 6> at;
    at.control.head<3>() = filter.rate;
    const models::by_hand::Vector3 rate = filter.rate - filter.x.segment<3>(navigation::gyro_bias);
    jml::Matrix<double, 6, 15> m_x;
    m_x << models::by_hand::position_slope(filter.R(), sensor.place.arm),
        models::by_hand::velocity_slope(filter.R(), sensor.speed.arm, rate);
    filter.correct<6>(y, sensor.measurement(filter.x, at), m_x, sensor.noise_covariance());
    return jml::Status::ok;
  }
};

constexpr auto gnss_and_baro = jml::sensors<navigation::GnssFix, navigation::Barometer>;

void print(const Consistency& e) {
  const double band = 1.96 * std::sqrt(30 / e.flights());
  int outside = 0;
  const std::size_t half = e.total.size() / 2;
  for (std::size_t i = half; i < e.total.size(); ++i)
    outside += std::abs(e.total[i] / e.flights() - 15) > band;
  std::printf("%-18s %6.0f  %7.3f +- %.3f  %7.3f (15 +- %.2f)  %3d of %-3zu ", e.name.c_str(), e.flights(),
              e.mean(), e.standard_error(), e.at_end(), band, outside, e.total.size() - half);
  for (const double part : e.parts) std::printf(" %6.3f", part / e.flights());
  std::printf("  %zu\n", e.refused.size());
  for (const auto& [run, status] : e.refused)
    std::printf("    flight %llu: %s\n", static_cast<unsigned long long>(run), jml::describe(status));
}

/// Mean NEES of the EKF over the second half of each flight. The fixed lag, which takes ten times as long,
/// flies the first `lags` alone.
std::vector<double> consistency(const Journey& journey, std::uint64_t flights, std::uint64_t lags,
                                std::uint64_t seed) {
  Consistency ekf{"EKF"}, factored{"EKF in factors"}, bare{"EKF, no reset"}, lag{"fixed lag 20"},
      same{"EKF, those of it"};
  for (std::uint64_t run = 0; run < flights; ++run) {
    const Flown flown = fly(journey, seed, run);
    const auto unit = journey.unit();
    jml::Filter one{jml::Ekf{}, unit, flown.start};
    ekf.add(journey, flown, run, one);
    jml::Filter two{jml::Factored{jml::Ekf{}}, unit, flown.start};
    factored.add(journey, flown, run, two);
    WithoutReset four{{unit, flown.start.x, flown.start.P, false}};
    bare.add(journey, flown, run, four);
    if (run < lags) {
      jml::Filter three{jml::FixedLag<20>{}, unit, gnss_and_baro, flown.start};
      three.method().options.newton = false;
      lag.add(journey, flown, run, three);
    }
    if (run + 1 == lags) same = ekf;
  }
  same.name = "EKF, those of it";
  std::printf(
      "\nNEES, 15 degrees of freedom, %g s; at first %g deg of tilt, %g deg of heading; all times %g\n",
      journey.seconds, journey.tilt / degree, journey.heading / degree, journey.scale);
  std::printf("%-18s %6s  %16s  %20s  %10s  %s\n", "", "flights", "second half", "at the end", "outside 95%",
              " parts (3): att, pos, vel, gyro, acc; refused");
  const std::string key = std::string(journey.heading > 10 * degree ? "off_by_30/" : "off_by_5/") +
                          (journey.scale < 1 ? "tenth_" : "");
  const std::pair<const char*, const Consistency*> all[] = {
      {"ekf", &ekf}, {"factored", &factored}, {"no_reset", &bare}, {"lag20", &lag}, {"ekf_of_those", &same}};
  for (const auto& [name, e] : all) {
    if (e->total.empty()) continue;
    print(*e);
    figure::print(key + name + "_nees", e->mean());
    figure::print(key + name + "_nees_error", e->standard_error());
    figure::print(key + name + "_flights", e->flights());
  }
  std::fflush(stdout);
  return ekf.refused.empty() ? ekf.second_half : std::vector<double>{};
}
/// The same flights at full noise and at a tenth of it.
void excess(Journey journey, std::uint64_t flights, std::uint64_t lags, std::uint64_t seed) {
  const std::vector<double> full = consistency(journey, flights, lags, seed);
  journey.scale = 0.1;
  const std::vector<double> tenth = consistency(journey, flights, lags, seed);
  if (full.size() != tenth.size()) return;
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < full.size(); ++i) {
    sum += full[i] - tenth[i];
    squares += (full[i] - tenth[i]) * (full[i] - tenth[i]);
  }
  const double n = static_cast<double>(full.size()), mean = sum / n;
  std::printf("EKF, flight by flight: full noise minus a tenth of it: %.4f +- %.4f\n", mean,
              std::sqrt((squares / n - mean * mean) / (n - 1)));
  std::fflush(stdout);
}

void print(const Convergence& e) {
  std::printf("%-22s %5zu   %5.1f %%   %5.1f / %5.1f s   %3zu astray, %3zu refused\n", e.name.c_str(),
              e.flights(), 100 * e.share(), e.before(0.5), e.before(0.9), e.astray.size(), e.refused.size());
  if (!e.astray.empty()) {
    std::printf("    astray:");
    for (std::size_t i = 0; i < std::min<std::size_t>(e.astray.size(), 12); ++i)
      std::printf(" %llu", static_cast<unsigned long long>(e.astray[i]));
    std::printf(e.astray.size() > 12 ? " ...\n" : "\n");
  }
  for (std::size_t i = 0; i < std::min<std::size_t>(e.refused.size(), 6); ++i)
    std::printf("    refused: flight %llu, %s\n", static_cast<unsigned long long>(e.refused[i].first),
                jml::describe(e.refused[i].second));
}

void coarse(std::uint64_t flights, std::uint64_t seed) {
  const Journey journey = coarse_start();
  Convergence ekf{"EKF"}, iekf{"IEKF"}, lag{"fixed lag 20"}, batch{"batch, from filter"},
      several{"the same, from several"};
  for (std::uint64_t run = 0; run < flights; ++run) {
    const Flown flown = fly(journey, seed, run);
    const auto unit = journey.unit();
    jml::Filter one{jml::Ekf{}, unit, flown.start};
    ekf.add(journey, flown, run, one);
    jml::Filter two{jml::Iekf{}, unit, flown.start};
    iekf.add(journey, flown, run, two);
    jml::Filter three{jml::FixedLag<20>{}, unit, gnss_and_baro, flown.start};
    lag.add(journey, flown, run, three);
    jml::Batch whole{unit, gnss_and_baro, flown.start, {.steps = journey.steps()}};
    const std::size_t found = batch.times.size();
    batch.add_whole(journey, flown, run, whole);
    // Some of those that it lost: thirty times the work.
    if (batch.times.size() > found || several.flights() == 10) continue;
    jml::Batch again{unit, gnss_and_baro, flown.start, {.steps = journey.steps()}};
    again.start = jml::Start::several;
    several.add_whole(journey, flown, run, again);
  }
  std::printf("\nCoarse starts: heading off by up to 150 deg, %g s, inertial samples of %g Hz, GNSS 1 Hz\n",
              journey.seconds, 1 / journey.dt);
  std::printf("%-22s %5s   %s   half / nine tenths below 5 deg before\n", "", "flights", "converged");
  const std::pair<const char*, const Convergence*> all[] = {
      {"ekf", &ekf}, {"iekf", &iekf}, {"lag20", &lag}, {"batch", &batch}, {"batch_several", &several}};
  for (const auto& [name, e] : all) {
    print(*e);
    const std::string key = std::string("coarse/") + name;
    figure::print(key + "_converged", 100 * e->share(), "%");
    figure::print(key + "_flights", static_cast<double>(e->flights()));
    figure::print(key + "_half_before", e->before(0.5), "s");
  }
}

}  // namespace

int main(int count, char** arguments) {
  const auto number = [&](int i, unsigned long long otherwise) {
    return count > i ? std::strtoull(arguments[i], nullptr, 10) : otherwise;
  };
  const std::uint64_t flights = number(1, 1000), lags = number(3, 100), starts = number(4, 200);
  const std::uint64_t seed = number(5, 1);
  Journey journey;
  journey.seconds = static_cast<double>(number(2, 60));
  if (flights > 1) {
    excess(journey, flights, lags, seed);
    journey.tilt = 5 * degree;
    journey.heading = 30 * degree;
    excess(journey, flights, lags, seed);
  }
  if (starts > 0) coarse(starts, seed);
  return 0;
}
