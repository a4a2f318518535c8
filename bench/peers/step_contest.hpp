// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The contests of one filter step after another: n2, n6, n15, chosen at compile time by JML_PEER_N. The
/// models are those of tests/models, the start, the noise and the measurements come from the data file.
#pragma once

#include <Eigen/Core>

#include "harness.hpp"

#if JML_PEER_N == 2
#include "../../tests/models/van_der_pol.hpp"
#elif JML_PEER_N == 6
#include "../../tests/models/radar.hpp"
#else
#include "../../tests/models/dense.hpp"
#endif

namespace peers {

#if JML_PEER_N == 2
using Dynamics = models::VanDerPol;
using Sensor = models::SaturatingPosition;
#elif JML_PEER_N == 6
using Dynamics = models::BallisticTarget;
using Sensor = models::Radar;
#else
using Dynamics = models::DenseDynamics<15>;
using Sensor = models::DenseSensor<15, 6>;
#endif

constexpr int n = Dynamics::states, p = Sensor::measurements;
using State = jml::Vector<double, n>;
using Square = jml::Matrix<double, n, n>;
using Measurement = jml::Vector<double, p>;
using MeasurementSquare = jml::Matrix<double, p, p>;

/// What a contender is made from.
struct Contest {
  Dynamics dynamics;
  Sensor sensor;
  State x0;
  Square P0, Q;  ///< Q: G Q Gᵀ of a step
  MeasurementSquare R;
  std::vector<Measurement> y;

  explicit Contest(const Data& data) {
#if JML_PEER_N == 6
    dynamics.gravity = data.number("gravity");  // not the model's own
#endif
    x0 = Eigen::Map<const State>(data.row("x0").data());
    P0 = Eigen::Map<const Square>(data.row("P0").data());  // symmetric: rows or columns
    Q = Eigen::Map<const Square>(data.row("Q").data());
    R = Eigen::Map<const MeasurementSquare>(data.row("R").data());
    for (const auto& row : data.rows("y")) y.push_back(Eigen::Map<const Measurement>(row.data()));
  }
  /// y - m(x), an angle of the radar kept within half a turn.
  [[nodiscard]] Measurement residual(const Measurement& y_, const Measurement& predicted) const {
    const auto by = [&](const auto& of) -> Measurement {
      if constexpr (requires { of.residual(y_, predicted); })
        return of.residual(y_, predicted);
      else
        return y_ - predicted;
    };
    return by(sensor);
  }
};

/// A contender is constructed from a Contest and has `bool step(y)`, `x(i)`, `variance(i)`, `state_bytes()`.
template <typename Contender>
class StepJob : public Job {
 public:
  StepJob(const Data& data, long steps) : contest_(data), steps_(steps), contender_(contest_) {}
  void run() override {
    const std::size_t period = contest_.y.size();
    std::size_t at = 0;
    for (long i = 0; i < steps_; ++i) {
      usable_ = contender_.step(contest_.y[at]) && usable_;
      keep(contender_);
      at = at + 1 == period ? 0 : at + 1;
    }
  }
  [[nodiscard]] Result result() const override {
    Result out;
    for (int i = 0; i < n; ++i) {
      out.x.push_back(contender_.x(i));
      out.P_diagonal.push_back(contender_.variance(i));
    }
    out.state_bytes = contender_.state_bytes();
    out.usable = usable_;
    return out;
  }

 private:
  Contest contest_;
  long steps_;
  Contender contender_;
  bool usable_ = true;
};

template <typename Contender>
int run_steps(int argc, char** argv, const char* name) {
  return run(argc, argv, name,
             [](const Data& data, long steps) -> Job* { return new StepJob<Contender>(data, steps); });
}

}  // namespace peers
