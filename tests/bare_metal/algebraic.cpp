// SPDX-License-Identifier: BSD-3-Clause
#include "trajectory.hpp"

namespace bare_metal {

namespace {

template <typename Scalar>
bool run_algebraic(const double (&y)[steps], Table& table) {
  jml::AlgebraicFilter filter{jml::Rnls{},
                              oscillator,
                              jml::Vector<Scalar, 2>(Scalar(0.5), Scalar(0)),
                              {.gain = jml::GainUpdate::every_sample}};
  for (int i = 0; i < steps; ++i) {
    const auto report = filter.step(signal, static_cast<Scalar>(y[i]), static_cast<Scalar>(dt));
    if (!jml::usable(report.status)) return false;
    if ((i + 1) % kept_every != 0) continue;
    double(&row)[numbers_kept] = table[i / kept_every];
    for (int k = 0; k < 2; ++k) row[k] = static_cast<double>(filter.x()(k));
    for (int k = 0; k < 4; ++k) row[2 + k] = static_cast<double>(filter.V()(k % 2, k / 2));
  }
  return true;
}

}  // namespace

bool algebraic_double(const double (&y)[steps], Table& table) { return run_algebraic<double>(y, table); }
bool algebraic_float(const double (&y)[steps], Table& table) { return run_algebraic<float>(y, table); }

}  // namespace bare_metal
