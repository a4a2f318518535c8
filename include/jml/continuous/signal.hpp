// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a measurement does between two samples: it is held, it moves in a straight line, or it is a function
/// of time.
#include <jml/warnings_begin.hpp>
#pragma once

#include <concepts>
#include <jml/argument.hpp>
#include <jml/model/concepts.hpp>

namespace jml {

/// A measurement that moves in a straight line over an interval, from the last sample to the next one. The
/// right-hand side then has a kink at the samples and no jump: CVODE goes on without a restart.
template <typename Scalar, int p>
struct Line {
  /// Measurements, p each, at the start and the end of the interval.
  Line(const Argument<Scalar, p>& start, const Argument<Scalar, p>& end) : from(start), to(end) {}
  /// Of one measurement.
  Line(Scalar start, Scalar end)
    requires(p == 1)
      : from(kernel::filled<Vector<Scalar, p>>(start)), to(kernel::filled<Vector<Scalar, p>>(end)) {}
  Vector<Scalar, p> from;  ///< at the start, p
  Vector<Scalar, p> to;    ///< at the end, p
};
/// Types from the arguments.
/// @{
template <typename Scalar, int p>
Line(const Vector<Scalar, p>&, const Vector<Scalar, p>&) -> Line<Scalar, p>;
template <std::floating_point Scalar>
Line(Scalar, Scalar) -> Line<Scalar, 1>;
/// @}

namespace detail {

/// Where nothing measures.
struct NoSignal {
  Vector<double, 0> operator()(double) const { return {}; }
};

/// y(t) of a sample that is held.
template <typename Scalar, int p>
struct HeldSignal {
  const Vector<Scalar, p>& y;
  const Vector<Scalar, p>& operator()(double) const { return y; }
};

/// y(t) between two samples; `change` is the sensor's own difference, so that an angle takes the short way.
/// Exactly the samples at both ends, so that the next line is seen to go on from here.
template <typename Scalar, int p>
struct LineSignal {
  Vector<Scalar, p> from, to, change;
  double start, length;
  Vector<Scalar, p> operator()(double time) const {
    if (time >= start + length) return to;
    return from + static_cast<Scalar>((time - start) / length) * change;
  }
};

/// y as a Vector, from a number too where p = 1.
template <int p, typename Scalar, typename Y>
Vector<Scalar, p> as_measurement(const Y& y) {
  if constexpr (std::is_convertible_v<Y, Scalar>) {
    static_assert(p == 1, "jml: a single number for a sensor of several measurements");
    return kernel::filled<Vector<Scalar, p>>(static_cast<Scalar>(y));
  } else {
    static_assert(
        std::is_convertible_v<const Y&, Argument<Scalar, p>>,
        "jml: a measurement is a jml::Vector of p, a number where p = 1, and for a sensor that measures all "
        "the time also a jml::Line or a function from the time to a jml::Vector of p");
    const Argument<Scalar, p> given = y;
    return given;
  }
}

/// True for a sensor of continuous time, false for one of samples; a compile-time error for any other.
template <typename S, typename X, typename At>
consteval bool measures_always() {
  constexpr bool always = has_noise_spectral_density<S, X, At>(), samples = has_noise_covariance<S, X, At>();
  static_assert(always || samples,
                "jml: a sensor needs noise_spectral_density() (it measures all the time) or "
                "noise_covariance() (it gives samples), p×p, const");
  static_assert(!(always && samples),
                "jml: this sensor has a noise_spectral_density() and a noise_covariance(): which of them a "
                "continuous filter is to use cannot be told, give it two sensors");
  return always;
}

/// use(signal) with y(t) made of what the user gave for [start, start + length]; refuse() where a sample is
/// not finite.
template <int p, typename Scalar, typename S, typename Y, typename Use, typename Refuse>
JML_INLINE inline void with_signal(const S& sensor, const Y& y, double start, double length, const Use& use,
                                   const Refuse& refuse) {
  if constexpr (std::is_invocable_v<const Y&, double> && !requires { Y::RowsAtCompileTime; }) {
    if constexpr (std::is_same_v<std::remove_cvref_t<std::invoke_result_t<const Y&, double>>,
                                 Vector<Scalar, p>>)
      use(y);
    else
      use([&y](double time) { return as_measurement<p, Scalar>(y(time)); });
  } else if constexpr (requires { y.from; }) {
    const Argument<Scalar, p> from = y.from, to = y.to;
    if (!all_finite(from) || !all_finite(to)) return refuse();
    const Vector<Scalar, p> change = measurement_residual<Scalar, p>(sensor, to, from);
    use(LineSignal<Scalar, p>{from, to, change, start, length});
  } else {
    const Vector<Scalar, p> held = as_measurement<p, Scalar>(y);
    if (!all_finite(held)) return refuse();
    use(HeldSignal<Scalar, p>{held});
  }
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
