// SPDX-License-Identifier: BSD-3-Clause
// Flights to try a navigation filter on: smooth random manoeuvres, what a perfect inertial unit reads on them
// and what one of a grade does, and samples of the other sensors.
//
// Attitude and velocity are given functions of time. The perfect samples are those that, held over dt, lead
// Strapdown::dynamics from each true state to the next: the rate is the logarithm of two successive attitudes
// over dt, the specific force the difference of two velocities over dt, less gravity, seen in the axes of the
// middle of the step. The position is that of the mechanisation. So the filter's model is the truth.
//
// `Random`: jml::Noise, or jml::CounterNoise of a campaign.
#pragma once

#include <array>
#include <vector>

#include "sensors.hpp"

namespace navigation {

/// A smooth random function of time: a few sines.
class Wave {
 public:
  Wave() = default;
  /// Its derivative has the root mean square `slope`, per s. Periods: s.
  template <typename Random>
  static Wave of_slope(double slope, double quickest, double slowest, Random& random) {
    return {slope, quickest, slowest, true, random};
  }
  /// It has itself the root mean square `size`.
  template <typename Random>
  static Wave of_size(double size, double quickest, double slowest, Random& random) {
    return {size, quickest, slowest, false, random};
  }
  [[nodiscard]] double operator()(double t) const {
    double sum = 0;
    for (const Sine& sine : sines_) sum += sine.size * std::sin(sine.frequency * t + sine.phase);
    return sum;
  }

 private:
  struct Sine {
    double size = 0, frequency = 0, phase = 0;
  };
  template <typename Random>
  Wave(double rms, double quickest, double slowest, bool of_slope, Random& random) {
    constexpr double turn = 6.283185307179586;
    const double each = rms * std::sqrt(2.0 / static_cast<double>(sines_.size()));
    for (Sine& sine : sines_) {
      const double period = std::exp(random.uniform(std::log(quickest), std::log(slowest)));
      sine.frequency = turn / period;
      sine.phase = random.uniform(0, turn);
      sine.size = of_slope ? each / sine.frequency : each;
    }
  }
  std::array<Sine, 4> sines_{};
};

/// How a vehicle moves: root mean squares.
struct Liveliness {
  double speed = 10;                       // m/s, of the constant part of the velocity, on each axis
  double acceleration = 1.5, climb = 0.5;  // m/s², on each horizontal axis and upwards
  double turn = 0.2;                       // rad/s, of the heading
  double tilt = 0.15;                      // rad, of pitch and of roll
  double quickest = 4, slowest = 30;       // s, periods of manoeuvres
};

/// Attitude and velocity over time.
class Path {
 public:
  template <typename Random>
  Path(const Liveliness& how, Random& random) {
    const auto slope = [&](double size) { return Wave::of_slope(size, how.quickest, how.slowest, random); };
    heading_at_start_ = random.uniform(-3.141592653589793, 3.141592653589793);
    heading_ = slope(how.turn);
    pitch_ = Wave::of_size(how.tilt, how.quickest, how.slowest, random);
    roll_ = Wave::of_size(how.tilt, how.quickest, how.slowest, random);
    for (std::size_t i = 0; i < 3; ++i) {
      drift_[i] = i < 2 ? how.speed * random.normal() : 0;
      velocity_[i] = slope(i < 2 ? how.acceleration : how.climb);
    }
  }
  /// The quaternion from the body's axes to the local ones, at t s.
  [[nodiscard]] jml::Vector<double, 4> attitude(double t) const {
    const auto about = [](int axis, double angle) {
      jml::Vector<double, 3> turn{0, 0, 0};
      turn(axis) = angle;
      return jml::exp_quaternion(turn);
    };
    const auto level =
        jml::quaternion_product(about(2, heading_at_start_ + heading_(t)), about(1, pitch_(t)));
    return jml::quaternion_product(level, about(0, roll_(t)));
  }
  /// m/s, in the local axes.
  [[nodiscard]] jml::Vector<double, 3> velocity(double t) const {
    jml::Vector<double, 3> out;
    for (std::size_t i = 0; i < 3; ++i) out(static_cast<int>(i)) = drift_[i] + velocity_[i](t);
    return out;
  }

 private:
  double heading_at_start_ = 0;
  Wave heading_, pitch_, roll_;
  std::array<double, 3> drift_{};
  std::array<Wave, 3> velocity_{};
};

/// A flight: states at the times 0 … steps, samples of the steps 0 … steps - 1.
struct Flight {
  double dt = 0;                                 // s
  std::vector<State<double>> truth;              // with the biases of the unit
  std::vector<jml::Vector<double, 6>> motion;    // what a perfect unit reads
  std::vector<jml::Vector<double, 6>> inertial;  // what this one does: motion + bias + noise
  std::vector<jml::Vector<double, 12>> w;        // dynamics(truth[k], w[k]) = truth[k + 1] with inertial[k]

  [[nodiscard]] int steps() const { return static_cast<int>(motion.size()); }
};

/// Flies along `path` for `steps` of dt s with an inertial unit whose biases are `biases` at first (gyros
/// rad/s, accelerometers m/s²) and whose noise is that of its grade.
template <typename Random>
Flight fly(const Strapdown& unit, const Path& path, const jml::Vector<double, 6>& biases, double dt,
           int steps, Random& random) {
  Flight flight;
  flight.dt = dt;
  State<double> x = State<double>::Zero();
  x.head<4>() = path.attitude(0);
  x.segment<3>(velocity) = path.velocity(0);
  x.segment<6>(gyro_bias) = biases;
  flight.truth.push_back(x);
  for (int k = 0; k < steps; ++k) {
    const jml::Vector<double, 4> q = path.attitude(k * dt), next_q = path.attitude((k + 1) * dt);
    const jml::Vector<double, 3> v = path.velocity(k * dt), next_v = path.velocity((k + 1) * dt);
    const jml::Vector<double, 3> turn =
        jml::log_quaternion(jml::quaternion_product(jml::conjugate(q), next_q));
    const auto middle = jml::quaternion_product(q, jml::exp_quaternion(jml::Vector<double, 3>(turn / 2)));
    jml::Vector<double, 3> acceleration = (next_v - v) / dt;
    acceleration(2) += unit.gravity;
    jml::Vector<double, 6> motion;
    motion << turn / dt, jml::rotate_back(middle, acceleration);

    jml::StepContext<double, 6> at{k * dt, dt, motion};
    const jml::Vector<double, 12> w = random.template normal_vector<12>(unit.disturbance_covariance(x, at));
    flight.motion.push_back(motion);
    flight.inertial.push_back(motion + x.segment<6>(gyro_bias) + w.head<6>());
    flight.w.push_back(w);

    x.head<4>() = next_q;
    x.segment<3>(position) += (v + next_v) * (dt / 2);
    x.segment<3>(velocity) = next_v;
    x.segment<6>(gyro_bias) += w.tail<6>();
    flight.truth.push_back(x);
  }
  return flight;
}

/// What `sensor` measures at time k > 0, noise included.
template <typename S, typename Random>
auto measure(const S& sensor, const Flight& flight, int k, Random& random) {
  const auto now = static_cast<std::size_t>(k);
  const State<double>& x = flight.truth[now];
  jml::StepContext<double, 6> at{k * flight.dt, flight.dt, flight.motion[now - 1]};
  at.control += x.segment<6>(gyro_bias);  // a sensor that takes the bias off it again sees the true rate
  const auto noise = random.template normal_vector<S::measurements>(jml::noise_covariance(sensor, x, at));
  return jml::Vector<double, S::measurements>(jml::measurement(sensor, x, at) + noise);
}

}  // namespace navigation
