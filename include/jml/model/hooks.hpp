// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions a model may have, each as a type: what model/call.hpp finds and calls, whichever arguments
/// it takes.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/traits.hpp>

namespace jml::detail::hooks {

/// f(x).
struct Dynamics {
  template <typename D, typename... A>
  static constexpr auto of(const D& d, const A&... a) -> decltype(DynamicsTraits<D>::dynamics(d, a...)) {
    return DynamicsTraits<D>::dynamics(d, a...);
  }
};
/// f_x(x).
struct DynamicsJacobian {
  template <typename D, typename... A>
  static constexpr auto of(const D& d, const A&... a) -> decltype(DynamicsTraits<D>::jacobian(d, a...)) {
    return DynamicsTraits<D>::jacobian(d, a...);
  }
};
/// F(x).
struct DynamicsSdc {
  template <typename D, typename... A>
  static constexpr auto of(const D& d, const A&... a) -> decltype(DynamicsTraits<D>::sdc(d, a...)) {
    return DynamicsTraits<D>::sdc(d, a...);
  }
};
/// F(x; r), which takes (x, r) or (x, r, at).
struct DynamicsSdcAbout {
  template <typename D, typename... A>
  static constexpr auto of(const D& d, const A&... a) -> decltype(DynamicsTraits<D>::sdc_about(d, a...)) {
    return DynamicsTraits<D>::sdc_about(d, a...);
  }
};
/// G.
struct DisturbanceInput {
  template <typename D, typename... A>
  static constexpr auto of(const D& d, const A&... a)
      -> decltype(DynamicsTraits<D>::disturbance_input(d, a...)) {
    return DynamicsTraits<D>::disturbance_input(d, a...);
  }
};
/// Q, per step.
struct DisturbanceCovariance {
  template <typename D, typename... A>
  static constexpr auto of(const D& d, const A&... a)
      -> decltype(DynamicsTraits<D>::disturbance_covariance(d, a...)) {
    return DynamicsTraits<D>::disturbance_covariance(d, a...);
  }
};
/// Q, a density.
struct DisturbanceSpectralDensity {
  template <typename D, typename... A>
  static constexpr auto of(const D& d, const A&... a)
      -> decltype(DynamicsTraits<D>::disturbance_spectral_density(d, a...)) {
    return DynamicsTraits<D>::disturbance_spectral_density(d, a...);
  }
};
/// w̄.
struct DisturbanceMean {
  template <typename D, typename... A>
  static constexpr auto of(const D& d, const A&... a)
      -> decltype(DynamicsTraits<D>::disturbance_mean(d, a...)) {
    return DynamicsTraits<D>::disturbance_mean(d, a...);
  }
};
/// ū.
struct DisturbanceBound {
  template <typename D, typename... A>
  static constexpr auto of(const D& d, const A&... a)
      -> decltype(DynamicsTraits<D>::disturbance_bound(d, a...)) {
    return DynamicsTraits<D>::disturbance_bound(d, a...);
  }
};
/// m(x).
struct Measurement {
  template <typename S, typename... A>
  static constexpr auto of(const S& s, const A&... a) -> decltype(SensorTraits<S>::measurement(s, a...)) {
    return SensorTraits<S>::measurement(s, a...);
  }
};
/// m_x(x).
struct MeasurementJacobian {
  template <typename S, typename... A>
  static constexpr auto of(const S& s, const A&... a) -> decltype(SensorTraits<S>::jacobian(s, a...)) {
    return SensorTraits<S>::jacobian(s, a...);
  }
};
/// M(x).
struct MeasurementSdc {
  template <typename S, typename... A>
  static constexpr auto of(const S& s, const A&... a) -> decltype(SensorTraits<S>::sdc(s, a...)) {
    return SensorTraits<S>::sdc(s, a...);
  }
};
/// M(x; r), which takes (x, r) or (x, r, at).
struct MeasurementSdcAbout {
  template <typename S, typename... A>
  static constexpr auto of(const S& s, const A&... a) -> decltype(SensorTraits<S>::sdc_about(s, a...)) {
    return SensorTraits<S>::sdc_about(s, a...);
  }
};
/// R of a sample.
struct NoiseCovariance {
  template <typename S, typename... A>
  static constexpr auto of(const S& s, const A&... a)
      -> decltype(SensorTraits<S>::noise_covariance(s, a...)) {
    return SensorTraits<S>::noise_covariance(s, a...);
  }
};
/// R, a density.
struct NoiseSpectralDensity {
  template <typename S, typename... A>
  static constexpr auto of(const S& s, const A&... a)
      -> decltype(SensorTraits<S>::noise_spectral_density(s, a...)) {
    return SensorTraits<S>::noise_spectral_density(s, a...);
  }
};
/// b.
struct NoiseBound {
  template <typename S, typename... A>
  static constexpr auto of(const S& s, const A&... a) -> decltype(SensorTraits<S>::noise_bound(s, a...)) {
    return SensorTraits<S>::noise_bound(s, a...);
  }
};

}  // namespace jml::detail::hooks
#include <jml/warnings_end.hpp>
