// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// R and R⁻¹ of a measurement in continuous time, formed and checked once where R is a constant.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>
#include <jml/model/concepts.hpp>

namespace jml {

namespace detail {

/// Stands for the sensor where there is no measurement.
struct NoSensor {
  static constexpr int measurements = 0;
};

/// R and R⁻¹ of a measurement in continuous time, formed and checked once where R is a constant.
template <typename Scalar, int n, typename S>
class MeasurementNoise {
  static constexpr int p = SensorTraits<S>::measurements;
  using X = Vector<Scalar, n>;
  using Square = Matrix<Scalar, p, p>;
  template <typename At>
  static constexpr bool constant = ConstantHook<hooks::NoiseSpectralDensity, S, X, At>;

 public:
  /// False where R is not finite, not symmetric or not positive definite. `x` and `at` are of the start.
  template <typename At>
  [[nodiscard]] bool prepare(const S& s, const X& x, const At& at) {
    return form(s, x, at);
  }
  /// The same at another point, where R may have changed.
  template <typename At>
  [[nodiscard]] JML_INLINE bool at_point(const S& s, const X& x, const At& at) {
    if constexpr (constant<At>)
      return true;
    else
      return form(s, x, at);
  }

  Square R, inverse;

 private:
  template <typename At>
  bool form(const S& s, const X& x, const At& at) {
    R = noise_spectral_density(s, x, at);
    if (!is_noise_covariance(R)) return false;
    kernel::SymmetricFactor<Scalar, p> factor;
    if (!factor.factor(R)) return false;
    if constexpr (p == 1) {
      inverse = factor.inverse_diagonal;
    } else {
      for (int j = 0; j < p; ++j)
        kernel::set_column(inverse, j, factor.solve(kernel::column_of(kernel::identity<Square>(), j)));
      inverse = kernel::symmetric_part(inverse);
    }
    return true;
  }
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
