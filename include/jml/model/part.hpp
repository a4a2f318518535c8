// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A measurement of which only some components are there: a sensor with a mask.
///
/// A row that was not measured becomes one that says nothing: its m and its Jacobian are zero, its innovation
/// is zero, and R is 1 on its diagonal and 0 beside it. K, P, NIS and the log-likelihood are then those of
/// the marginal measurement, in every method, and no method knows of it.
#include <jml/warnings_begin.hpp>
#pragma once

#include <bit>
#include <cstdint>
#include <jml/model/sensors.hpp>

namespace jml {

/// Rows of a measurement, made by only(), first() or finite_rows().
struct Rows {
  std::uint64_t mask = 0;  ///< bit i: row i

  /// Row 0 … 63 is among them.
  [[nodiscard]] constexpr bool has(int row) const { return (mask >> row & 1U) != 0; }
  [[nodiscard]] constexpr int count() const { return std::popcount(mask); }  ///< how many
  /// No row is beyond the first p.
  [[nodiscard]] constexpr bool within(int p) const { return p >= 64 || mask >> p == 0; }
};

/// The rows named, 0 … 63: `filter.update(radar, y, jml::only(0, 2))`. A row out of this range is none of any
/// sensor, and the update is refused.
template <typename... Row>
[[nodiscard]] constexpr Rows only(Row... row) {
  constexpr auto bit = [](long long i) {
    return i >= 0 && i < 64 ? std::uint64_t(1) << i : ~std::uint64_t(0);
  };
  return {(std::uint64_t(0) | ... | bit(static_cast<long long>(row)))};
}
/// The first `count` rows: for a number of measurements that is known at run time only, up to the sensor's.
[[nodiscard]] constexpr Rows first(int count) {
  return {count <= 0 ? 0 : count >= 64 ? ~std::uint64_t(0) : (std::uint64_t(1) << count) - 1};
}
/// The rows of y that are finite: says that a NaN in it means "not measured". Nobody else may say so.
template <typename Scalar, int p>
[[nodiscard]] Rows finite_rows(const Vector<Scalar, p>& y) {
  static_assert(p <= 64, "jml: a mask has room for 64 rows");
  Rows rows;
  for (int i = 0; i < p; ++i) {
    if (std::isfinite(y(i))) rows.mask |= std::uint64_t(1) << i;
  }
  return rows;
}

/// A sensor of which `rows` were measured. Made by part().
template <typename S>
struct Part {
  static_assert(measurements_of<S> <= 64, "jml: a mask has room for 64 rows");
  [[no_unique_address]] S sensor;  ///< of all rows
  Rows rows;                       ///< that were measured
};

/// `filter.step(jml::part(radar, jml::only(0, 2)), y, dt)`; in a list of sensors:
/// jml::sensors<jml::Part<Radar>>.
template <typename S>
[[nodiscard]] Part<S> part(const S& sensor, Rows rows) {
  return {sensor, rows};
}

namespace detail {

template <typename S>
inline constexpr bool is_part = false;
template <typename S>
inline constexpr bool is_part<Part<S>> = true;

/// The sensor that a part is of, or a sensor itself.
template <typename S>
[[nodiscard]] constexpr auto& whole_of(S& sensor) {
  if constexpr (is_part<std::remove_cv_t<S>>)
    return sensor.sensor;
  else
    return sensor;
}

/// S has its place in the list as jml::Part<S>.
template <typename List, typename S>
inline constexpr bool listed_as_part =
    List::template index_of<S>() == List::count && List::template index_of<Part<S>>() < List::count;

template <typename List, typename S>
consteval bool require_listed() {
  static_assert(
      List::template index_of<S>() < List::count || listed_as_part<List, S>,
      "jml: this sensor type is not in the estimator's list: add it to jml::sensors<...> (a sensor of "
      "which a part is measured now and then as jml::Part<...>)");
  return true;
}

/// a with zeros in the rows that were not measured.
template <typename T, int rows, int cols>
constexpr Matrix<T, rows, cols> kept(Matrix<T, rows, cols> a, Rows measured) {
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < cols && !measured.has(i); ++j) a(i, j) = T(0);
  }
  return a;
}
/// R of the rows that were measured, apart from units in the others.
template <typename T, int p>
constexpr Matrix<T, p, p> decoupled(Matrix<T, p, p> R, Rows measured) {
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j < p; ++j) {
      if (!measured.has(i) || !measured.has(j)) R(i, j) = T(i == j ? 1 : 0);
    }
  }
  return R;
}

}  // namespace detail

template <typename S>
struct SensorTraits<Part<S>> : SensorDefaults {
  using Of = SensorTraits<S>;
  static constexpr int measurements = Of::measurements;
  static constexpr bool linear = Of::linear;

  template <typename... A>
  static constexpr auto measurement(const Part<S>& s, const A&... a)
      -> decltype(Of::measurement(s.sensor, a...)) {
    return detail::kept(Of::measurement(s.sensor, a...), s.rows);
  }
  template <typename... A>
  static constexpr auto jacobian(const Part<S>& s, const A&... a) -> decltype(Of::jacobian(s.sensor, a...)) {
    return detail::kept(Of::jacobian(s.sensor, a...), s.rows);
  }
  template <typename... A>
  static constexpr auto sdc(const Part<S>& s, const A&... a) -> decltype(Of::sdc(s.sensor, a...)) {
    return detail::kept(Of::sdc(s.sensor, a...), s.rows);
  }
  template <typename... A>
  static constexpr auto sdc_about(const Part<S>& s, const A&... a)
      -> decltype(Of::sdc_about(s.sensor, a...)) {
    return detail::kept(Of::sdc_about(s.sensor, a...), s.rows);
  }
  template <typename... A>
  static constexpr auto residual(const Part<S>& s, const A&... a) -> decltype(Of::residual(s.sensor, a...)) {
    return detail::kept(Of::residual(s.sensor, a...), s.rows);
  }
  template <typename... A>
  static constexpr auto noise_covariance(const Part<S>& s, const A&... a)
      -> decltype(Of::noise_covariance(s.sensor, a...)) {
    return detail::decoupled(Of::noise_covariance(s.sensor, a...), s.rows);
  }
  template <typename... A>
  static constexpr auto noise_spectral_density(const Part<S>& s, const A&... a)
      -> decltype(Of::noise_spectral_density(s.sensor, a...)) {
    return detail::decoupled(Of::noise_spectral_density(s.sensor, a...), s.rows);
  }
  template <typename... A>
  static constexpr auto noise_bound(const Part<S>& s, const A&... a)
      -> decltype(Of::noise_bound(s.sensor, a...)) {
    auto bound = Of::noise_bound(s.sensor, a...);
    for (int i = 0; i < measurements; ++i) {
      if (!s.rows.has(i)) bound(i) = 1;  // of a zero that is exactly zero: no bound at all
    }
    return bound;
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
