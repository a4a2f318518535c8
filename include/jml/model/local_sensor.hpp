// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A sensor in local coordinates: μ(z) = m(to ⊞ z, v) and its derivatives, see model/local_context.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/local_context.hpp>

namespace jml::detail {

/// S about the point `to` of its context; the v that m is linearised about, and m_v v.
template <typename S, typename D, typename Scalar>
struct LocalSensor {
  using Space = SpaceOf<D>;
  static constexpr int measurements = measurements_of<S>, noises = noises_of_sensor<S>(),
                       numbers = Space::numbers;
  using Plain = typename LocalContext<Scalar, D>::Plain;
  static constexpr bool noisy = NoisySensorIn<S, Scalar, numbers, Plain>;
  struct NoPoint {};
  struct NoisePoint {
    Vector<Scalar, noises> v = kernel::zeros<Vector<Scalar, noises>>();
    Vector<Scalar, measurements> effect = kernel::zeros<Vector<Scalar, measurements>>();
    Matrix<Scalar, measurements, measurements> R =
        kernel::zeros<Matrix<Scalar, measurements, measurements>>();
    bool frozen = false;
  };

  [[no_unique_address]] S sensor;
  [[no_unique_address]] std::conditional_t<noisy, NoisePoint, NoPoint> point{};

  template <typename T>
    requires MeasuresIn<S, T, numbers, Plain>
  [[nodiscard]] Vector<T, measurements> measurement(const Vector<T, Space::tangent>& z,
                                                    const LocalContext<Scalar, D>& at) const {
    const Plain& plain = at;
    const Vector<T, numbers> x = Space::plus(cast_to<T>(at.to), z);
    if constexpr (noisy) {
      Vector<T, measurements> out = ask_noisy<hooks::Measurement>(sensor, x, cast_to<T>(point.v), plain);
      for (int i = 0; i < measurements; ++i) out(i) = out(i) - point.effect(i);
      return out;
    } else {
      return jml::measurement(sensor, x, plain);
    }
  }
  /// Of a sensor with its own m_x, which is that of m(x ⊞ δ).
  template <typename T>
    requires(std::is_same_v<T, Scalar> &&
             Callable<HookOf<hooks::MeasurementJacobian, S>, Vector<Scalar, numbers>, Plain>)
  [[nodiscard]] Matrix<T, measurements, Space::tangent> measurement_jacobian(
      const Vector<T, Space::tangent>& z, const LocalContext<Scalar, D>& at) const {
    const Plain& plain = at;
    const Vector<Scalar, numbers> x = Space::plus(at.to, z);
    const Matrix<Scalar, measurements, Space::tangent> m_x =
        call(hook<hooks::MeasurementJacobian>(sensor), x, plain);
    return m_x * Space::chart_slope(at.to, z);
  }
  template <typename T>
    requires(std::is_same_v<T, Scalar> && !noisy &&
             !Callable<HookOf<hooks::MeasurementJacobian, S>, Vector<Scalar, numbers>, Plain> &&
             MeasuresIn<S, Dual<T, derivatives_at_once(Space::tangent)>, numbers, Plain>)
  [[nodiscard]] Matrix<T, measurements, Space::tangent> measurement_jacobian(
      const Vector<T, Space::tangent>& z, const LocalContext<Scalar, D>& at) const {
    const Plain& plain = at;
    constexpr int m = derivatives_at_once(Space::tangent);
    using Z = Dual<T, m>;
    Matrix<T, measurements, Space::tangent> out;
    const bool still = all_zero(z);
    for (int first = 0; first < Space::tangent; first += m) {
      const Vector<Z, numbers> x = still ? Space::template seed_at<m>(at.to, -first)
                                         : Space::plus(cast_to<Z>(at.to), seed_from<m>(z, first));
      const Vector<Z, measurements> y = jml::measurement(sensor, x, plain);
      for (int j = 0; j < m && first + j < Space::tangent; ++j) {
        for (int i = 0; i < measurements; ++i) out(i, first + j) = y(i).partial[j];
      }
    }
    return out;
  }
  /// M about the origin of the space.
  template <typename T>
    requires(std::is_same_v<T, Scalar>)
  [[nodiscard]] Matrix<T, measurements, Space::tangent> measurement_sdc(
      const Vector<T, Space::tangent>& z, const LocalContext<Scalar, D>& at) const {
    const Vector<T, Space::tangent> r = Space::minus(Space::template origin<Scalar>(), at.to);
    const Vector<T, measurements> here = measurement(z, at), there = measurement(r, at);
    const auto left = [&](const Vector<T, measurements>& along) {
      return measurement_residual(sensor, here, Vector<T, measurements>(there + along));
    };
    return derive_sdc<measurements>(
        [&](const Vector<T, Space::tangent>& between) {
          return jml::measurement_jacobian(*this, between, at);
        },
        left, sizes(here, there), z, r);
  }
  template <typename T>
    requires(std::is_same_v<T, Scalar>)
  [[nodiscard]] Matrix<T, measurements, measurements> noise_covariance(
      const Vector<T, Space::tangent>& z, const LocalContext<Scalar, D>& at) const {
    const Plain& plain = at;
    // Of an exact step R is that at its prediction x̄, about whatever w the step is linearised.
    const Vector<Scalar, numbers> x = at.frozen ? at.to : Vector<Scalar, numbers>(Space::plus(at.to, z));
    if constexpr (noisy) {
      return point.frozen ? point.R : effective_covariance(x, plain);
    } else {
      return jml::noise_covariance(sensor, x, plain);
    }
  }
  /// v ← R m_vᵀ ν, the noise that a root with ν = (m_v R m_vᵀ)⁻¹ (y - μ(z)) says. How far it moved, in
  /// standard deviations.
  [[nodiscard]] Scalar refreeze(const Vector<Scalar, Space::tangent>& z,
                                const Vector<Scalar, measurements>& nu, const LocalContext<Scalar, D>& at) {
    Scalar most = 0;
    if constexpr (noisy) {
      const Plain& plain = at;
      const Vector<Scalar, numbers> x = Space::plus(at.to, z);
      const Matrix<Scalar, noises, noises> R =
          evaluate<hooks::NoiseCovariance, noises, noises>(sensor, x, plain);
      const Matrix<Scalar, measurements, noises> m_v =
          noise_slope<hooks::Measurement, measurements>(sensor, x, point.v, plain);
      const Vector<Scalar, noises> v = R * Vector<Scalar, noises>(kernel::transposed(m_v) * nu);
      for (int i = 0; i < noises; ++i) {
        if (R(i, i) > Scalar(0)) most = std::max(most, std::abs(v(i) - point.v(i)) / std::sqrt(R(i, i)));
      }
      point.v = v;
      point.effect = noise_slope<hooks::Measurement, measurements>(sensor, x, v, plain) * v;
      point.R = effective_covariance(x, plain);
      point.frozen = true;
    }
    return most;
  }
  template <typename T>
  [[nodiscard]] Vector<T, measurements> residual(const Vector<T, measurements>& y,
                                                 const Vector<T, measurements>& predicted) const {
    return measurement_residual(sensor, y, predicted);
  }

 private:
  /// m_v R m_vᵀ at x and the v of the point.
  [[nodiscard]] Matrix<Scalar, measurements, measurements> effective_covariance(
      const Vector<Scalar, numbers>& x, const Plain& plain) const {
    const Matrix<Scalar, noises, noises> R =
        evaluate<hooks::NoiseCovariance, noises, noises>(sensor, x, plain);
    const Matrix<Scalar, measurements, noises> m_v =
        noise_slope<hooks::Measurement, measurements>(sensor, x, point.v, plain);
    return kernel::symmetric_part(
        Matrix<Scalar, measurements, measurements>(m_v * R * kernel::transposed(m_v)));
  }
};

/// The sensor of an estimator in local coordinates; a part of one stays a part.
template <typename D, typename Scalar, typename S>
[[nodiscard]] LocalSensor<S, D, Scalar> local_sensor(const S& sensor) {
  return {sensor, {}};
}
template <typename D, typename Scalar, typename S>
[[nodiscard]] Part<LocalSensor<S, D, Scalar>> local_sensor(const Part<S>& part) {
  return {{part.sensor, {}}, part.rows};
}
template <typename D, typename Scalar, typename S>
using LocalSensorOf = decltype(local_sensor<D, Scalar>(std::declval<const S&>()));

/// The same of a list of them.
template <typename D, typename Scalar, typename List>
struct LocalList {
  using type = List;
};
template <typename D, typename Scalar, typename... S>
struct LocalList<D, Scalar, Sensors<S...>> {
  using type = Sensors<LocalSensorOf<D, Scalar, S>...>;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
