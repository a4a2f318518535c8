// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The health of a filter and its sensors in one word, with its reasons.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/operations/channel.hpp>
#include <jml/operations/limits.hpp>

namespace jml {

/// A reason to mistrust an estimate.
enum class Concern : std::uint8_t {
  not_started,         ///< the filter refuses every step: Filter::status()
  state_outside,       ///< x is beyond its Limits, or a NaN
  covariance_lost,     ///< P has a NaN
  covariance_changed,  ///< P was beyond its Limits, and was changed or could not be
  limits_refused,      ///< Limits that are none, or P could not be brought within them
  channel_shut,        ///< a gate has been shut for as long as its Lockout allows
  channel_inhibited,   ///< a channel is not used
  nothing_accepted,    ///< no channel accepted anything for `Health::patience` seconds
  nis_high,            ///< innovations larger than S says
  nis_low,             ///< innovations smaller than S says
  biased,              ///< innovations whose mean is not zero
  stuck,               ///< a sensor that repeats itself
};

/// One line for a log.
[[nodiscard]] constexpr const char* describe(Concern concern) {
  switch (concern) {
    case Concern::not_started:
      return "the filter has no valid start";
    case Concern::state_outside:
      return "the state is beyond its limits";
    case Concern::covariance_lost:
      return "P is not finite";
    case Concern::covariance_changed:
      return "P was beyond its limits";
    case Concern::limits_refused:
      return "the limits are none, or P cannot be brought within them";
    case Concern::channel_shut:
      return "the gate of a channel has shut";
    case Concern::channel_inhibited:
      return "a channel is inhibited";
    case Concern::nothing_accepted:
      return "no measurement was accepted for too long";
    case Concern::nis_high:
      return "innovations are larger than their covariance says";
    case Concern::nis_low:
      return "innovations are smaller than their covariance says";
    case Concern::biased:
      return "innovations have a mean";
    case Concern::stuck:
      return "a sensor repeats itself";
  }
  return "unknown concern";
}

/// Which concerns there are.
struct Health {
  static constexpr int kinds = static_cast<int>(Concern::stuck) + 1;  ///< concerns that there are
  std::bitset<kinds> concerns;                                        ///< bit i: Concern(i)

  [[nodiscard]] bool good() const { return concerns.none(); }  ///< no concern
  /// This one is among them.
  [[nodiscard]] bool has(Concern concern) const { return concerns[static_cast<std::size_t>(concern)]; }
  /// Adds it, where `is`.
  void note(Concern concern, bool is = true) {
    if (is) concerns.set(static_cast<std::size_t>(concern));
  }
};

/// The health of a filter, of what keep_within() found, and of its channels.
///
///     const auto kept = jml::keep_within(filter, limits);
///     const jml::Health health = jml::check_health(filter, kept, 10.0, radar, gnss);
///     if (health.has(jml::Concern::stuck)) …
///
/// patience: s, without an accepted measurement of any channel that was ever offered one; infinite: never
/// mind.
template <typename F, int states, int n, typename... C>
[[nodiscard]] Health check_health(const F& filter, const Kept<states, n>& kept, double patience,
                                  const C&... channels) {
  Health health;
  health.note(Concern::not_started, filter.status() != Status::ok);
  health.note(Concern::state_outside, kept.outside.any());
  health.note(Concern::covariance_lost, kept.status == Status::covariance_lost);
  health.note(Concern::limits_refused, kept.status != Status::ok && kept.status != Status::covariance_lost);
  health.note(Concern::covariance_changed,
              kept.raised.any() || kept.lowered.any() || kept.decorrelated.any());
  const auto look = [&health](const auto& channel) {
    const Alarms& alarms = channel.alarms();
    health.note(Concern::channel_shut, channel.shut());
    health.note(Concern::channel_inhibited, channel.use == Use::inhibit);
    health.note(Concern::nis_high, alarms.nis_high);
    health.note(Concern::nis_low, alarms.nis_low);
    health.note(Concern::biased, alarms.biased != 0);
    health.note(Concern::stuck, alarms.stuck);
  };
  (look(channels), ...);
  if constexpr (sizeof...(C) > 0)
    health.note(Concern::nothing_accepted,
                (channels.offered() || ...) &&
                    ((!channels.offered() || channels.since_accepted(filter.time()) > patience) && ...));
  return health;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
