// SPDX-License-Identifier: BSD-3-Clause
// Strapdown navigation, 16 numbers and 15 degrees of freedom: each step a prediction and a position of three
// rows.
#include "navigation/strapdown.hpp"

#include "trajectory.hpp"

namespace bare_metal {

namespace {

template <typename Scalar>
bool run_strapdown(const double (&y)[steps], Table& table) {
  using Position = jml::Vector<Scalar, 3>;
  navigation::State<Scalar> x = jml::kernel::zeros<navigation::State<Scalar>>();
  x(0) = Scalar(1);
  jml::Matrix<Scalar, 15, 15> P = jml::kernel::zeros<jml::Matrix<Scalar, 15, 15>>();
  for (int i = 0; i < 15; ++i) P(i, i) = Scalar(i < 3 ? 1e-2 : i < 9 ? 1 : i < 12 ? 1e-6 : 1e-4);
  jml::Filter filter{jml::Ekf{}, navigation::Strapdown{}, jml::Estimate<Scalar, 16, 15>{x, P}};
  jml::Vector<Scalar, 6> control = jml::kernel::zeros<jml::Vector<Scalar, 6>>();
  control(2) = Scalar(0.3);
  control(3) = Scalar(0.2);
  control(5) = Scalar(9.81);
  for (int i = 0; i < steps; ++i) {
    const auto sample = static_cast<Scalar>(y[i]);
    if (!jml::usable(
            filter.step(navigation::GnssPosition{}, Position(sample, sample, sample), Scalar(0.01), control)))
      return false;
    if ((i + 1) % kept_every != 0) continue;
    double(&row)[numbers_kept] = table[i / kept_every];
    for (int k = 0; k < 6; ++k)
      row[k] = static_cast<double>(k < 3 ? filter.x()(4 + k) : filter.P()(k - 3, k - 3));
  }
  return true;
}

}  // namespace

bool strapdown_double(const double (&y)[steps], Table& table) { return run_strapdown<double>(y, table); }
bool strapdown_float(const double (&y)[steps], Table& table) { return run_strapdown<float>(y, table); }

}  // namespace bare_metal
