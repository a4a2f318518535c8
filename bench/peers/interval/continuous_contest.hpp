// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The contests of a continuous EKF, a held measurement every 10 ms: continuous_n2, continuous_n6.
#pragma once

#include <models/continuous.hpp>
#include <vector>

#include "../harness.hpp"

namespace peers {

constexpr double sample = 0.01;  // s
#if JML_PEER_N == 2
using Oscillating = models::Oscillator;
using Signal = models::SaturatingSignal;
#else
using Oscillating = models::OscillatorChain;
using Signal = models::SaturatingSignals;
#endif
constexpr int n = Oscillating::states, p = Signal::measurements;
using State = jml::Vector<double, n>;
using Square = jml::Matrix<double, n, n>;
using Measurement = jml::Vector<double, p>;

inline std::vector<Measurement> read_signal(const Data& data, long steps) {
  std::vector<Measurement> y;
  const auto& rows = data.rows("y");
  for (long k = 0; k < steps; ++k)
    y.push_back(Eigen::Map<const Measurement>(rows[static_cast<std::size_t>(k) % rows.size()].data()));
  return y;
}

inline Result result_of_sample(const State& x, const Square& P, bool usable) {
  Result out;
  for (int i = 0; i < n; ++i) {
    out.x.push_back(x(i));
    out.P_diagonal.push_back(P(i, i));
  }
  out.usable = usable;
  return out;
}

}  // namespace peers
