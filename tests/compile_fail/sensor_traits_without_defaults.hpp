// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a specialisation of SensorTraits lacks what it should inherit: write `template <> struct
// jml::SensorTraits<Yours> : jml::SensorDefaults`
#include "parts.hpp"

namespace sensor_traits_without_defaults {
struct Theirs {};
}  // namespace sensor_traits_without_defaults

template <>
#ifdef MISTAKE
struct jml::SensorTraits<sensor_traits_without_defaults::Theirs> {
#else
struct jml::SensorTraits<sensor_traits_without_defaults::Theirs> : jml::SensorDefaults {
#endif
  static constexpr int measurements = 1;
  static auto measurement(const sensor_traits_without_defaults::Theirs&, const auto& x) {
    return parts::Position{}.measurement(x);
  }
  static parts::Matrix1 noise_covariance(const sensor_traits_without_defaults::Theirs&) {
    return parts::Matrix1(1);
  }
};

namespace sensor_traits_without_defaults {

inline bool run() {
  jml::Filter filter{jml::Ekf{}, parts::Model{}, parts::start};
  return jml::usable(filter.step(Theirs{}, 1.0).status);
}

}  // namespace sensor_traits_without_defaults
