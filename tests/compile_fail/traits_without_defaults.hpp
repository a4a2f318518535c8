// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: a specialisation of DynamicsTraits lacks what it should inherit: write `template <> struct
// jml::DynamicsTraits<Yours> : jml::DynamicsDefaults`
#include "parts.hpp"

namespace traits_without_defaults {
struct Theirs {};
}  // namespace traits_without_defaults

template <>
#ifdef MISTAKE
struct jml::DynamicsTraits<traits_without_defaults::Theirs> {
#else
struct jml::DynamicsTraits<traits_without_defaults::Theirs> : jml::DynamicsDefaults {
#endif
  static constexpr int states = 2, disturbances = 2;
  static auto dynamics(const traits_without_defaults::Theirs&, const auto& x) { return x; }
  static parts::Matrix2 disturbance_covariance(const traits_without_defaults::Theirs&) {
    return parts::Matrix2::Identity();
  }
};

namespace traits_without_defaults {

inline bool run() {
  jml::Filter filter{jml::Ekf{}, Theirs{}, parts::start};
  return jml::usable(filter.predict());
}

}  // namespace traits_without_defaults
