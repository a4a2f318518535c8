// SPDX-License-Identifier: BSD-3-Clause
// scaling_memory STEPS: steps of jml::FixedLag<20> on the Van der Pol oscillator; prints kB of the process at
// its largest, kB of it that are no file's (the others, of libraries, come and go with the system's cache),
// and how many times the heap was asked after the first step.
#include <cstdio>
#include <cstdlib>
#include <jml/jml.hpp>
#include <models/van_der_pol.hpp>

#include "process.hpp"

namespace {
long allocations = 0;
}
extern "C" void* __libc_malloc(std::size_t);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}

int main(int argc, char** argv) {
  const long steps = argc > 1 ? std::atol(argv[1]) : 0;
  if (steps < 1) return 2;
  const models::VanDerPol dynamics;
  const models::SaturatingPosition sensor;
  jml::Filter filter{jml::FixedLag<20>{}, dynamics, jml::sensors<models::SaturatingPosition>,
                     jml::Estimate<double, 2>{{1.2, 0}, 0.1 * jml::Matrix<double, 2, 2>::Identity()}};
  jml::Vector<double, 2> truth{1, 0};
  long before = 0;
  for (long k = 0; k < steps; ++k) {
    truth = dynamics.dynamics(truth);
    const auto y = sensor.measurement(truth);
    if (!jml::usable(filter.step(sensor, y).status)) return 3;
    if (k == 0) before = allocations;
  }
  const long asked = allocations - before;
  std::printf("%ld,%ld,%ld\n", scaling::kilobytes("VmHWM"), scaling::kilobytes("RssAnon"), asked);
}
