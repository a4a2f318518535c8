// SPDX-License-Identifier: BSD-3-Clause
// scaling_batch STEPS: one line, ns of a step and iteration of jml::Batch on the Van der Pol oscillator, ns
// of a step of the solution, iterations, bytes of its memory for a step, kB of the process at its largest.
#include <malloc.h>
#include <time.h>

#include <cstdio>
#include <cstdlib>
#include <jml/campaign/noise.hpp>
#include <jml/jml.hpp>
#include <models/van_der_pol.hpp>

#include "process.hpp"

int main(int argc, char** argv) {
  const int steps = argc > 1 ? std::atoi(argv[1]) : 0;
  if (steps < 1) return 2;
  const models::VanDerPolWhite dynamics;
  const models::SaturatingPosition sensor;
  const jml::Estimate<double, 2> prior{{1.5, 0.5}, 0.1 * jml::Matrix<double, 2, 2>::Identity()};
  const auto in_use = [] {
    const auto info = mallinfo2();
    return static_cast<double>(info.uordblks + info.hblkhd);
  };
  const double before = in_use();
  jml::Batch batch{dynamics, jml::sensors<models::SaturatingPosition>, prior, {steps}};
  const double bytes = in_use() - before;
  jml::Noise noise(1);
  jml::Vector<double, 2> x(1, 0);
  jml::Filter ekf{jml::Ekf{}, dynamics, prior};
  batch.start = jml::Start::given;
  batch.guess(prior.x);
  for (int k = 0; k < steps; ++k) {
    x = dynamics.dynamics(x) + noise.normal_vector(dynamics.disturbance_covariance());
    const jml::Vector<double, 1> y = sensor.measurement(x) + noise.normal_vector(sensor.noise_covariance());
    if (!jml::usable(ekf.step(sensor, y).status) || batch.step(sensor, y) != jml::Status::ok) return 3;
    batch.guess(ekf.x());
  }
  const auto now = [] {  // s of processor time
    timespec at{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &at);
    return static_cast<double>(at.tv_sec) + 1e-9 * static_cast<double>(at.tv_nsec);
  };
  const double begin = now();
  const auto report = batch.solve();
  const double end = now();
  if (!jml::usable(report.status)) {
    std::fprintf(stderr, "%s\n", jml::describe(report.status));
    return 4;
  }
  const double ns = 1e9 * (end - begin) / steps;
  std::printf("%.6g,%.6g,%d,%.6g,%ld\n", ns / report.iterations, ns, report.iterations, bytes / steps,
              scaling::kilobytes("VmHWM"));
}
