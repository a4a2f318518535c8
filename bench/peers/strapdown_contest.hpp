// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The contest strapdown: inertial samples at 100 Hz and fixes of GNSS (position and velocity) at 10 Hz, of a
/// flight of examples/navigation. What is compared beside x and P: how far the estimates are from the truth.
#pragma once

#include <cmath>
#include <navigation/sensors.hpp>

#include "harness.hpp"

namespace peers {

using Attitude = jml::Vector<double, 4>;

/// What is known at first, the samples, the fixes and the truth, all in the axes of examples/navigation.
struct Flight {
  double dt;
  long every;  ///< a fix after every so many samples
  navigation::State<double> x0;
  jml::Matrix<double, 15, 15> P0;
  jml::Vector<double, 3> arm;
  std::vector<jml::Vector<double, 6>> inertial, fix;
  std::vector<navigation::State<double>> truth;  ///< at the fixes

  explicit Flight(const Data& data)
      : dt(data.number("dt")),
        every(static_cast<long>(data.number("every"))),
        x0(data.row("x0").data()),
        P0(jml::Vector<double, 15>(data.row("P0_diagonal").data()).asDiagonal()),
        arm(data.row("arm").data()) {
    for (const auto& row : data.rows("imu")) inertial.emplace_back(row.data());
    for (const auto& row : data.rows("gnss")) fix.emplace_back(row.data());
    for (const auto& row : data.rows("truth")) truth.emplace_back(row.data());
  }
};

/// A contender has `predict(sample, dt)`, `correct(fix)`: true where usable; `state()`, 16 numbers;
/// `variance(i)`; `bytes()`.
template <typename Contender>
class StrapdownJob : public Job {
 public:
  StrapdownJob(const Data& data, long steps) : flight_(data), steps_(steps), contender_(flight_) {
    if (steps > static_cast<long>(flight_.inertial.size())) std::abort();
    estimates_.resize(flight_.fix.size());
  }
  void run() override {
    std::size_t fixes = 0;
    long until = flight_.every;
    for (long k = 0; k < steps_; ++k) {
      usable_ = contender_.predict(flight_.inertial[static_cast<std::size_t>(k)], flight_.dt) && usable_;
      if (--until > 0) continue;
      until = flight_.every;
      usable_ = contender_.correct(flight_.fix[fixes]) && usable_;
      estimates_[fixes++] = contender_.state();
    }
    fixes_ = fixes;
    keep(contender_);
  }
  [[nodiscard]] Result result() const override {
    Result out;
    const navigation::State<double> x = contender_.state();
    out.x.assign(x.data(), x.data() + x.size());
    for (int i = 0; i < 15; ++i) out.P_diagonal.push_back(contender_.variance(i));
    double position = 0, angle = 0;
    std::size_t counted = 0;
    for (std::size_t k = fixes_ / 6; k < fixes_; ++k) {  // the first sixth is settling
      const auto error = navigation::Space::minus(flight_.truth[k], estimates_[k]);
      position += error.template segment<3>(3).squaredNorm();
      angle += error.template head<3>().squaredNorm();
      ++counted;
    }
    if (counted > 0) {
      out.more["rms_position_m"] = std::sqrt(position / static_cast<double>(counted));
      out.more["rms_attitude_mrad"] = 1e3 * std::sqrt(angle / static_cast<double>(counted));
    }
    out.state_bytes = contender_.bytes();
    out.usable = usable_;
    return out;
  }

 private:
  Flight flight_;
  long steps_;
  Contender contender_;
  std::vector<navigation::State<double>> estimates_;
  std::size_t fixes_ = 0;
  bool usable_ = true;
};

template <typename Contender>
int run_strapdown(int argc, char** argv, const char* name) {
  return run(argc, argv, name,
             [](const Data& data, long steps) -> Job* { return new StrapdownJob<Contender>(data, steps); });
}

}  // namespace peers
