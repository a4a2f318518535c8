// SPDX-License-Identifier: BSD-3-Clause
// Strapdown navigation flown many times: does the covariance of 15 degrees of freedom tell the truth, and
// from how far off does a heading converge. For the study and its test; any flight can be flown again alone.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <jml/analysis/nees.hpp>
#include <jml/campaign/counter_noise.hpp>
#include <navigation/trajectory.hpp>
#include <string>
#include <vector>

namespace study {

using navigation::State;
constexpr double degree = 3.14159265358979323846 / 180;

/// What is flown. Everything random but the manoeuvres is scaled by `scale`.
struct Journey {
  double dt = 0.01, seconds = 60;
  double scale = 1;
  int gnss_every = 100, baro_every = 10;           // steps
  double tilt = 1 * degree, heading = 5 * degree;  // rad, standard deviations at first, about the local axes
  double coarse =
      0;  // rad: where positive, the error of the heading at first is uniform to this on both sides
  navigation::Grade grade{};
  navigation::GnssFix gnss{};
  navigation::Barometer baro{};
  navigation::Liveliness manoeuvres{};

  [[nodiscard]] int steps() const { return static_cast<int>(std::lround(seconds / dt)); }
  [[nodiscard]] navigation::Strapdown unit() const {
    return {{grade.gyro_noise * scale, grade.force_noise * scale, grade.gyro_walk * scale,
             grade.force_walk * scale}};
  }
  [[nodiscard]] navigation::GnssFix receiver() const {
    navigation::GnssFix out = gnss;
    for (double* sigma :
         {&out.place.horizontal, &out.place.vertical, &out.speed.horizontal, &out.speed.vertical})
      *sigma *= scale;
    return out;
  }
  [[nodiscard]] navigation::Barometer barometer() const { return {baro.sigma * scale}; }
  /// Standard deviations at first: attitude about the local axes, position, velocity, biases.
  [[nodiscard]] jml::Vector<double, 15> sigma() const {
    jml::Vector<double, 15> out;
    out << tilt, tilt, heading, 3, 3, 3, 0.5, 0.5, 0.5, 0.005, 0.005, 0.005, 0.05, 0.05, 0.05;
    return scale * out;
  }
};

/// One flight: the truth, all samples and where the estimators start.
struct Flown {
  navigation::Flight flight;
  std::vector<jml::Vector<double, 6>> gnss;
  std::vector<jml::Vector<double, 1>> baro;
  jml::Estimate<double, 16, 15> start;
};

/// The flight of this number. The truth lies about the start as P_0 says: R = Exp(ε) R̂ = R̂ Exp(R̂ᵀ ε) with ε
/// about the local axes, so P_0 of the attitude is R̂ᵀ D R̂.
inline Flown fly(const Journey& journey, std::uint64_t seed, std::uint64_t run) {
  jml::CounterNoise random(seed, run);
  Flown out;
  const jml::Vector<double, 15> sigma = journey.sigma();
  jml::Vector<double, 15> error = sigma.cwiseProduct(random.normal_vector<15>());
  if (journey.coarse > 0) error(2) = random.uniform(-journey.coarse, journey.coarse);
  const navigation::Path path(journey.manoeuvres, random);
  out.flight = navigation::fly(journey.unit(), path, error.tail<6>(), journey.dt, journey.steps(), random);

  out.start.x = out.flight.truth[0];
  out.start.x.head<4>() = jml::quaternion_product(
      jml::exp_quaternion(jml::Vector<double, 3>(-error.head<3>())), navigation::attitude_of(out.start.x));
  out.start.x.tail<12>() -= error.tail<12>();
  out.start.P = sigma.cwiseAbs2().asDiagonal();
  jml::Matrix<double, 3, 3> D = out.start.P.topLeftCorner<3, 3>(), turned, both;
  const jml::Vector<double, 4> q = navigation::attitude_of(out.start.x);
  for (int j = 0; j < 3; ++j) turned.col(j) = jml::rotate_back(q, jml::Vector<double, 3>(D.col(j)));
  D = turned.transpose();
  for (int j = 0; j < 3; ++j) both.col(j) = jml::rotate_back(q, jml::Vector<double, 3>(D.col(j)));
  out.start.P.topLeftCorner<3, 3>() = (both + both.transpose()) / 2;

  const auto gnss = journey.receiver();
  const auto baro = journey.barometer();
  for (int k = 1; k <= journey.steps(); ++k) {
    if (k % journey.baro_every == 0) out.baro.push_back(navigation::measure(baro, out.flight, k, random));
    if (k % journey.gnss_every == 0) out.gnss.push_back(navigation::measure(gnss, out.flight, k, random));
  }
  return out;
}

/// Gives all samples to an estimator, see(k) after those of each GNSS fix. The first refusal.
template <typename Estimator, typename See>
jml::Status navigate(const Journey& journey, const Flown& flown, Estimator& estimator, const See& see) {
  const auto gnss = journey.receiver();
  const auto baro = journey.barometer();
  for (int k = 1; k <= journey.steps(); ++k) {
    const auto before = static_cast<std::size_t>(k - 1);
    jml::Status status = estimator.predict(journey.dt, flown.flight.inertial[before]);
    if (jml::usable(status) && k % journey.baro_every == 0)
      status = estimator.update(baro, flown.baro[static_cast<std::size_t>(k / journey.baro_every - 1)]);
    const bool fix = k % journey.gnss_every == 0;
    if (jml::usable(status) && fix)
      status = estimator.update(gnss, flown.gnss[static_cast<std::size_t>(k / journey.gnss_every - 1)]);
    if (!jml::usable(status)) return status;
    if (fix) see(k);
  }
  return jml::Status::ok;
}

/// Of the heading, rad: the error of the attitude about the local vertical.
inline double heading_error(const State<double>& truth, const State<double>& x) {
  const jml::Vector<double, 3> error = navigation::Space::minus(truth, x).head<3>();
  return jml::rotate(navigation::attitude_of(truth), error)(2);
}

/// NEES of an estimator over flights, by fixes: of all 15 degrees of freedom, and of attitude, position,
/// velocity and the two biases alone.
struct Consistency {
  std::string name;
  std::vector<double> total{};                                   // [fix] summed over flights
  std::array<double, 5> parts{};                                 // second half, summed over flights and fixes
  std::vector<double> second_half{};                             // [flight] mean over the second half
  std::vector<std::pair<std::uint64_t, jml::Status>> refused{};  // the flight, and why

  template <typename Estimator>
  void add(const Journey& journey, const Flown& flown, std::uint64_t run, Estimator& estimator) {
    const int fixes = journey.steps() / journey.gnss_every, half = fixes / 2;
    std::vector<double> found;
    std::array<double, 5> blocks{};
    const jml::Status status = navigate(journey, flown, estimator, [&](int k) {
      const jml::Vector<double, 15> e =
          navigation::Space::minus(flown.flight.truth[static_cast<std::size_t>(k)], estimator.x());
      const jml::Matrix<double, 15, 15> P = estimator.P();
      found.push_back(jml::nees(e, P));
      if (static_cast<int>(found.size()) <= half) return;
      for (int i = 0; i < 5; ++i)
        blocks[static_cast<std::size_t>(i)] += jml::nees(e.segment<3>(3 * i), P.block<3, 3>(3 * i, 3 * i));
    });
    if (status != jml::Status::ok) {
      refused.emplace_back(run, status);
      return;
    }
    total.resize(found.size());
    double sum = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      total[i] += found[i];
      if (static_cast<int>(i) >= half) sum += found[i];
    }
    second_half.push_back(sum / (fixes - half));
    for (std::size_t i = 0; i < 5; ++i) parts[i] += blocks[i] / (fixes - half);
  }
  [[nodiscard]] double flights() const { return static_cast<double>(second_half.size()); }
  [[nodiscard]] double mean() const {
    double sum = 0;
    for (const double x : second_half) sum += x;
    return sum / flights();
  }
  [[nodiscard]] double standard_error() const {
    double squares = 0;
    const double middle = mean();
    for (const double x : second_half) squares += (x - middle) * (x - middle);
    return std::sqrt(squares / (flights() - 1) / flights());
  }
  [[nodiscard]] double at_end() const { return total.back() / flights(); }
};

/// From how far off a heading converges: its error below 5° to the end.
struct Convergence {
  std::string name;
  std::vector<double> times{};  // s, of those that converged, sorted by nobody
  std::vector<std::uint64_t> astray{};
  std::vector<std::pair<std::uint64_t, jml::Status>> refused{};

  template <typename Estimator>
  void add(const Journey& journey, const Flown& flown, std::uint64_t run, Estimator& estimator) {
    double since = -1;
    const jml::Status status = navigate(journey, flown, estimator, [&](int k) {
      const auto& truth = flown.flight.truth[static_cast<std::size_t>(k)];
      const bool near = std::abs(heading_error(truth, estimator.x())) < 5 * degree;
      if (!near)
        since = -1;
      else if (since < 0)
        since = k * journey.dt;
    });
    note(run, status, since);
  }
  /// A whole-interval estimator: at the end of the flight.
  template <typename Batch>
  void add_whole(const Journey& journey, const Flown& flown, std::uint64_t run, Batch& batch) {
    jml::Status status = navigate(journey, flown, batch, [](int) {});
    if (status == jml::Status::ok) status = batch.solve().status;
    const bool near = std::abs(heading_error(flown.flight.truth.back(), batch.x(batch.steps()))) < 5 * degree;
    note(run, jml::usable(status) ? jml::Status::ok : status, near ? journey.seconds : -1);
  }
  [[nodiscard]] std::size_t flights() const { return times.size() + astray.size() + refused.size(); }
  [[nodiscard]] double share() const {
    return static_cast<double>(times.size()) / static_cast<double>(flights());
  }
  /// `share` of those that converged did so before, s.
  [[nodiscard]] double before(double share) const {
    if (times.empty()) return std::nan("");
    std::vector<double> sorted = times;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }

 private:
  void note(std::uint64_t run, jml::Status status, double since) {
    if (status != jml::Status::ok)
      refused.emplace_back(run, status);
    else if (since < 0)
      astray.push_back(run);
    else
      times.push_back(since);
  }
};

/// A flight with 10 Hz inertial samples, GNSS and barometer, and a heading of which almost nothing is known.
inline Journey coarse_start() {
  Journey out;
  out.dt = 0.1;
  out.seconds = 30;
  out.gnss_every = 10;
  out.baro_every = 5;
  out.tilt = 2 * degree;
  out.heading = 80 * degree;
  out.coarse = 150 * degree;
  out.gnss = navigation::GnssFix({0.5, 0, -1});  // without an arm GNSS is linear, and an IEKF an EKF
  return out;
}

}  // namespace study
