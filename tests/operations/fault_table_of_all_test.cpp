// SPDX-License-Identifier: BSD-3-Clause
// Every row of the fault table, by night: radar, Van der Pol, a pendulum with bounds, strapdown navigation.
#include <strapdown_flights.hpp>

#include "models/bounded.hpp"
#include "operations/fault_worlds.hpp"

namespace {

template <typename World, typename Sensor>
void fly_all(const World& world, const std::string& called, int flights, faults::Table& table,
             const Sensor& list) {
  const auto start = [](const auto& tape) {
    if constexpr (requires { tape.start; })
      return tape.start;
    else
      return World::start();
  };
  const auto ekf = [&](const auto& t) { return jml::Filter{jml::Ekf{}, world.target, start(t)}; };
  const auto factored = [&](const auto& t) {
    return jml::Filter{jml::Factored{jml::Ekf{}}, world.target, start(t)};
  };
  const auto iekf = [&](const auto& t) { return jml::Filter{jml::Iekf{}, world.target, start(t)}; };
  const auto lag = [&](jml::Loss loss) {
    return [&, loss](const auto& t) {
      return jml::Filter{jml::FixedLag<20>{jml::LagOptions{.loss = loss}}, world.target, list, start(t)};
    };
  };
  faults::add_rows(world, called + ",EKF", ekf, flights, table);
  faults::add_rows(world, called + ",EKF in factors", factored, flights, table);
  faults::add_rows(world, called + ",iterated EKF", iekf, flights, table);
  faults::add_rows(world, called + ",fixed lag 20", lag({}), flights, table);
  faults::add_rows(world, called + ",fixed lag 20 with Huber's loss", lag(jml::Loss::huber(2)), flights,
                   table);
}

// P of the exact JML step is no covariance, and a gate on it is refused: its rows are the bare ones.
TEST(FaultTable, OfARadarByNight) {
  faults::Table table;
  const faults::RadarWorld world{};
  fly_all(world, "radar", 5, table, jml::sensors<models::Radar>);
  const auto jml = [&](const auto&) { return jml::Filter{jml::IteratedJml{}, world.target, world.start()}; };
  faults::add_rows(world, "radar,iterated JML", jml, 5, table, 1);
  faults::expect_stored(table);
}

TEST(FaultTable, OfVanDerPol) {
  faults::Table table;
  const faults::VanDerPolWorld world{};
  fly_all(world, "Van der Pol", 5, table, jml::sensors<models::SaturatingPosition>);
  const auto jml = [&](const auto&) { return jml::Filter{jml::IteratedJml{}, world.target, world.start()}; };
  faults::add_rows(world, "Van der Pol,iterated JML", jml, 5, table, 1);
  faults::expect_stored(table);
}

struct PendulumBase {
  static constexpr double dt = 0.05;
  models::BoundedPendulum target;
  models::BoundedAngleSensor sensor;
  static jml::Estimate<double, 2> start() {
    return {jml::Vector<double, 2>(1, 0),
            jml::Matrix<double, 2, 2>(0.03 * jml::Matrix<double, 2, 2>::Identity())};
  }
  static jml::Vector<double, 1> noise_deviation() { return jml::Vector<double, 1>(std::sqrt(1e-3)); }
  static jml::Vector<double, 2> jump() { return {1, 0}; }  // 100 deviations of the prediction
  [[nodiscard]] static double draw(jml::Noise& noise) { return std::sqrt(3.0) * noise.uniform(-1, 1); }
  [[nodiscard]] jml::Vector<double, 2> next(const jml::Vector<double, 2>& x, jml::Noise& noise) const {
    return target.dynamics(x) + target.disturbance_input() * std::sqrt(0.05) * draw(noise);
  }
  static double error(const jml::Vector<double, 2>& estimate, const jml::Vector<double, 2>& truth) {
    return std::abs(estimate(0) - truth(0));
  }
  static jml::Lockout<2> policy() {
    jml::Lockout<2> lockout{.after = 20, .recovery = jml::Recovery::inflate};
    lockout.variances << 1, 1;
    return lockout;
  }
};

// A measurement that contradicts the bounds is not used, whatever the gate.
TEST(FaultTable, OfAPendulumWithBounds) {
  faults::Table table;
  const faults::SampledWorld<PendulumBase, 2, 1> world{};
  const jml::Box<double, 2> box{jml::Vector<double, 2>(0.5, -0.5), jml::Vector<double, 2>(1.5, 0.5)};
  const auto ekf = [&](const auto&) { return jml::Filter{jml::Ekf{}, world.target, world.start()}; };
  const auto linearised = [&](const auto&) { return jml::Filter{jml::Linearised{}, world.target, box}; };
  const auto guaranteed = [&](const auto&) { return jml::Filter{jml::Guaranteed{}, world.target, box}; };
  faults::add_rows(world, "pendulum,EKF", ekf, 5, table);
  faults::add_rows(world, "pendulum,linearised box", linearised, 5, table, 1);
  faults::add_rows(world, "pendulum,guaranteed box", guaranteed, 5, table, 1);
  faults::expect_stored(table);
}

/// Ten inertial samples a second and a fix each second; a sample of the script is a fix.
struct StrapdownWorld {
  using Y = jml::Vector<double, 6>;
  struct Flight : faults::Tape<16, 6> {
    std::vector<jml::Vector<double, 6>> inertial;
    jml::Estimate<double, 16, 15> start;
  };
  study::Journey journey = [] {
    study::Journey out;
    out.dt = 0.1;
    out.seconds = 60;
    out.gnss_every = 10;
    return out;
  }();
  navigation::Strapdown target = journey.unit();
  navigation::GnssFix sensor = journey.receiver();
  faults::Script script{.begin = 30, .end = 36, .samples = 60, .delay = 3, .settled = 5};

  [[nodiscard]] Flight fly(std::uint64_t seed, bool jumps) const {
    const study::Flown flown = study::fly(journey, seed, 0);
    Flight tape;
    tape.start = flown.start;
    tape.inertial = flown.flight.inertial;
    tape.y = flown.gnss;
    tape.sd = sensor.noise_covariance().diagonal().cwiseSqrt();
    for (int k = 0; k < script.samples; ++k) {
      tape.truth.push_back(flown.flight.truth[static_cast<std::size_t>(10 * (k + 1))]);
      const jml::Vector<double, 3> by(50, 50, 100);  // some 100 deviations of the prediction
      if (!jumps || k < script.begin) continue;
      tape.truth.back().segment<3>(navigation::position) += by;
      tape.y[static_cast<std::size_t>(k)].head<3>() += by;
    }
    return tape;
  }
  template <typename F>
  jml::Status pass(F& filter, const Flight& tape, int k) const {
    jml::Status status = jml::Status::ok;
    for (int i = 10 * k; i < 10 * k + 10 && jml::usable(status); ++i)
      status = filter.predict(0.1, tape.inertial[static_cast<std::size_t>(i)]);
    return status;
  }
  template <typename F, typename C>
  jml::Status sample(F& filter, C& channel, const Flight& tape, int k, const Y& y) const {
    const jml::Status status = pass(filter, tape, k);
    return jml::usable(status) ? channel.update(filter, y).status : status;
  }
  static double error(const jml::Vector<double, 16>& estimate, const jml::Vector<double, 16>& truth) {
    return (estimate - truth).segment<3>(navigation::position).norm();
  }
  static jml::Lockout<15> policy() {
    jml::Lockout<15> lockout{.after = 5, .recovery = jml::Recovery::inflate};
    lockout.variances << 0.01, 0.01, 0.01, 1e4, 1e4, 1e4, 25, 25, 25, 0, 0, 0, 0, 0, 0;
    return lockout;
  }
};

TEST(FaultTable, OfStrapdownNavigation) {
  faults::Table table;
  fly_all(StrapdownWorld{}, "strapdown", 1, table, jml::sensors<navigation::GnssFix>);
  faults::expect_stored(table);
}

}  // namespace
