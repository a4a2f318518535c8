// SPDX-License-Identifier: BSD-3-Clause
// One criterion J at several depths: a fixed lag, the whole flight, a smoother; and how far a filter is above
// the least J.
#include <cmath>
#include <cstdio>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>

#include "models/van_der_pol.hpp"

using models::SaturatingPosition, models::VanDerPol;

int main() {
  const jml::Vector<double, 2> x0(1, 0);
  const jml::Matrix<double, 2, 2> P0 = 0.1 * jml::Matrix<double, 2, 2>::Identity();

  std::array<double, 100> flight{};
  jml::Noise noise(1);
  jml::Vector<double, 2> truth = x0;
  for (double& y : flight) {
    truth = VanDerPol{}.dynamics(truth) + VanDerPol{}.disturbance_input() * std::sqrt(20.0) * noise.normal();
    y = SaturatingPosition{}.measurement(truth)(0) + std::sqrt(0.02) * noise.normal();
  }

  bool sound = true;
  // [lag]
  jml::Filter lag{jml::FixedLag<20>{}, VanDerPol{}, jml::sensors<SaturatingPosition>, jml::Estimate{x0, P0}};
  for (const double y : flight) {
    const auto report = lag.step(SaturatingPosition{}, y);  // re-optimises the last 20 steps
    sound &= jml::usable(report.status);
  }
  const jml::Vector<double, 2> ten_steps_ago = lag.x(10);  // lag.x() is the present; lag.P(10) likewise
  // [/lag]

  // [batch]
  const jml::Estimate prior{x0, P0};
  jml::Batch batch{VanDerPol{}, jml::sensors<SaturatingPosition>, prior, {.steps = 100}};  // memory: here
  for (const double y : flight) sound &= jml::usable(batch.step(SaturatingPosition{}, y));
  const auto answer = batch.solve();                     // batch.x(k), batch.w(k), batch.P(k), answer.cost
  const auto excess = jml::excess_cost(batch, lag.x());  // min{J : x_N = x̂} - min J
  // [/batch]

  // [smoother]
  jml::Smoother smoother{jml::Filter{jml::Ekf{}, VanDerPol{}, jml::Estimate{x0, P0}}, 100};
  for (const double y : flight) sound &= jml::usable(smoother.step(SaturatingPosition{}, y).status);
  sound &= jml::usable(smoother.smooth());  // smoother.x(k), smoother.P(k)
  // [/smoother]

  // [robust]
  batch.options.loss = jml::Loss::huber(2);  // from two deviations on, residuals count linearly
  batch.start = jml::Start::several;         // several starts: the least J of all of them
  const auto robust = batch.solve();
  // [/robust]

  std::printf("least J %.6f in %d passes; the fixed lag ends %.1e above it, the EKF %.1e\n", answer.cost,
              answer.iterations, excess.value, jml::excess_cost(batch, smoother.filter().x()).value);
  std::printf("ten steps ago: fixed lag %.3f, batch %.3f, smoother %.3f\n", ten_steps_ago(0), batch.x(90)(0),
              smoother.x(90)(0));
  std::printf("with Huber's loss J %.6f, found from %d starts\n", robust.cost, robust.agreed);
  return sound && jml::usable(answer.status) && jml::usable(robust.status) && excess.value < 1e-3 ? 0 : 1;
}
