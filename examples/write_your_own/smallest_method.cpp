// SPDX-License-Identifier: BSD-3-Clause
// The smallest method of one's own: an observer with a constant gain, whole; its check; and a gain rule.
#include <cmath>
#include <cstdio>
#include <jml/filter/check_method.hpp>
#include <jml/jml.hpp>

#include "midpoint_slot.hpp"
#include "models/van_der_pol.hpp"

// [method]
template <int n>
struct ConstantGain {  // x⁺ = f(x), then x + K (y - m(x))
  jml::Vector<double, n> K;

  template <typename Scalar, jml::Dynamics D>
  struct Belief {  // what is carried from sample to sample: no P here
    jml::Vector<Scalar, n> x;
  };
  template <typename Scalar, typename D>
  using Start = jml::Argument<Scalar, n>;  // what the filter is given at first

  // Makes a belief of it, or says why not.
  template <typename Model, typename Belief>
  [[nodiscard]] jml::Status start(const Model& model, const auto& x0, Belief& belief) const {
    belief.x = x0;
    return jml::all_finite(belief.x) ? model.status() : jml::Status::invalid_state;
  }
  // Over at.dt, from at.time, with at.control.
  template <typename Model, typename Belief, typename At>
  [[nodiscard]] jml::Status predict(const Model& model, const Belief& prior, const At& at,
                                    Belief& next) const {
    next.x = jml::predicted_state(model.dynamics, prior.x, at);
    return jml::all_finite(next.x) ? jml::Status::ok : jml::Status::dynamics_not_finite;
  }
  // With one measurement; report.status is ok at first.
  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct(const Model&, const Belief& prior, const Sample& sample, Belief& next, Report& report) const {
    static_assert(Sample::measurements == 1, "this gain is of one measurement");
    if (!jml::all_finite(sample.y)) {
      report.status = jml::Status::invalid_measurement;
      return;
    }
    const auto predicted = jml::measurement(sample.sensor, prior.x, sample.at);
    report.innovation = jml::measurement_residual(sample.sensor, sample.y, predicted);
    if (!jml::all_finite(report.innovation)) {
      report.status = jml::Status::sensor_not_finite;
      return;
    }
    report.gain = K;
    next.x = prior.x + K * report.innovation(0);
  }
};
// [/method]

int main() {
  using models::SaturatingPosition, models::VanDerPol;
  const jml::Vector<double, 2> x0(1, 0), K(0.3, 0.5);
  // [filter]
  jml::Filter filter{ConstantGain<2>{K}, VanDerPol{}, x0};
  const auto report = filter.step(SaturatingPosition{}, 0.7);
  // [/filter]

  // [check]
  const auto check = jml::check_method(jml::Filter{ConstantGain<2>{K}, VanDerPol{}, x0}, SaturatingPosition{},
                                       {0.7, 0.69, 0.66});
  if (!check) std::printf("measurement %d: %s\n", check.at, check.what);
  // [/check]

  // [rule]
  // A, B, D, E:
  using Row = jml::GainRule<own::Midpoint{}, jml::Slot::jacobian, jml::Slot::jacobian, own::Midpoint{}>;
  const jml::Estimate start{x0, jml::Matrix<double, 2, 2>(jml::Matrix<double, 2, 2>::Identity())};
  jml::Filter one_pass{Row{}, VanDerPol{}, start};
  jml::Filter exact{jml::Iterated<Row>{}, VanDerPol{}, start};  // the exact step, with P by these slots
  // [/rule]
  const bool sound = jml::usable(one_pass.step(SaturatingPosition{}, 0.7).status) &&
                     jml::usable(exact.step(SaturatingPosition{}, 0.7).status);

  const jml::Vector<double, 2> predicted = VanDerPol{}.dynamics(x0);
  const double innovation = 0.7 - predicted(0) / std::sqrt(1 + predicted(0) * predicted(0));
  const bool right = std::abs(filter.x()(1) - (predicted(1) + 0.5 * innovation)) < 1e-14;
  std::printf("x = (%.4f, %.4f); one pass %.4f, exact %.4f\n", filter.x()(0), filter.x()(1), one_pass.x()(0),
              exact.x()(0));
  return right && check.ok() && sound && jml::usable(report.status) ? 0 : 1;
}
