// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Does my method keep what jml::Filter promises? Flies copies of a filter, some of them treated badly.
///
///     const auto check = jml::check_method(jml::Filter{Mine{}, VanDerPol{}, start}, Position{}, {0.1, 0.3});
///     if (!check) std::printf("measurement %d: %s\n", check.at, check.what);
#include <jml/warnings_begin.hpp>
#pragma once

#include <initializer_list>
#include <jml/filter/compare.hpp>

namespace jml {

/// What check_method() found.
struct [[nodiscard]] MethodCheck {
  const char* what = nullptr;  ///< the first fault, in words; null where there is none
  int at = 0;                  ///< the measurement where it showed, from 0; else how many there were

  [[nodiscard]] bool ok() const { return what == nullptr; }      ///< nothing was found
  [[nodiscard]] explicit operator bool() const { return ok(); }  ///< as ok()
  /// The first expectation that is not met is kept.
  void expect(bool good, const char* otherwise) {
    if (ok() && !good) what = otherwise;
  }
};

namespace detail {

/// A filter whose belief can be put back, but not what else its verbs have left in it.
template <typename F>
struct UsedFilter : F {
  explicit UsedFilter(const F& filter) : F(filter) {}
  void put_back(const typename F::Belief& belief) { this->mutable_belief() = belief; }
};

/// y as numbers (of a signal zeros), moved by so many standard deviations of its innovation.
template <typename Y, typename R>
[[nodiscard]] Y moved(const auto& given, const R& report, double deviations) {
  using Scalar = typename Y::Scalar;
  Y y = kernel::zeros<Vector<Scalar, Y::RowsAtCompileTime>>();
  if constexpr (std::is_convertible_v<decltype(given), Y>) y = given;
  for (int i = 0; i < Y::RowsAtCompileTime; ++i) {
    const Scalar deviation = std::sqrt(std::abs(report.innovation_matrix(i, i)));
    y(i) += static_cast<Scalar>(deviations) * (deviation > 0 ? deviation : 1 + std::abs(y(i)));
  }
  return y;
}

/// What a usable status says of a filter that it has moved by dt.
template <typename Method, typename F>
void check_result(MethodCheck& check, const F& before, const F& after, double dt) {
  if constexpr (requires { after.box(); })
    check.expect(after.box().valid(), "the status is usable, but the box is not valid()");
  else
    check.expect(all_finite(typename F::State(after.x())), "the status is usable, but x is not finite");
  if constexpr (requires {
                  requires Method::symmetric;
                  after.P();
                }) {
    const typename F::Covariance P = after.P();
    check.expect(is_symmetric(P) && is_valid<true>(P),
                 "the method says `symmetric`, but P is not, or not finite, or has a negative variance");
  }
  const double end = before.time() + dt, rounding = 1e-15 * (std::abs(before.time()) + std::abs(end));
  double error = std::abs(after.time() - end);
  if constexpr (requires { after.depth(); }) error = std::max(error, std::abs(after.time(0) - end));
  check.expect(error <= rounding, "the time after a verb is not that before it plus dt");
}

/// A bad y, dt or row: no status is usable, and the filter stays as it was.
template <bool updates, bool masks, typename F, typename S, typename Y, typename Step>
void check_refusals(MethodCheck& check, F& filter, const S& sensor, const Y& y, const Step& dt,
                    const typename F::Control& control) {
  using Scalar = typename Y::Scalar;
  constexpr Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  constexpr int p = Y::RowsAtCompileTime;
  const F before = filter;
  const auto expect_refused = [&](Status status, const char* accepted) {
    check.expect(!usable(status), accepted);
    check.expect(same_bits(filter, before), "a refusal changes x, P, box or time");
  };
  for (int i = 0; i < p; ++i) {
    if constexpr (is_part<S>) {
      if (!sensor.rows.has(i)) continue;
    }
    for (const Scalar bad : {nan, std::numeric_limits<Scalar>::infinity()}) {
      Y wrong = y;
      wrong(i) = bad;
      const char* accepted = "a measurement that is not finite is accepted";
      expect_refused(filter.step(sensor, wrong, dt, control).status, accepted);
      if constexpr (updates) expect_refused(filter.update(sensor, wrong).status, accepted);
    }
  }
  for (const Scalar bad : {Scalar(-1), nan}) {
    const char* accepted = "a dt that is negative or a NaN is accepted";
    expect_refused(filter.step(sensor, y, bad, control).status, accepted);
    expect_refused(filter.predict(bad, control), accepted);
  }
  if constexpr (masks)
    expect_refused(filter.update(sensor, y, only(p)).status, "a row that the sensor has not is accepted");
}

}  // namespace detail

/// Checks a method on copies of `filter`, at every measurement of `flight`:
///   same input, same bits, and nothing is remembered beside the belief;
///   a refusal leaves time and belief, shown or not, as they were;
///   predict() and update() accept what step() does, and time goes on by dt;
///   a gate is obeyed, where the report has an innovation matrix, and leaves the prediction;
///   P of a method that says `symmetric` is so, without a negative variance;
///   a method that says `optimal_on_linear` is the Kalman filter where the models say `linear`, to 1e-9
///   (float: 1e-3) of the standard deviations of its prediction.
/// filter: at its start or in flight. flight: measurements that it can follow, in braces or a container. dt,
/// control: of each step.
template <typename M, typename D, typename Scalar, typename S,
          typename Flight = std::initializer_list<typename Filter<M, D, Scalar>::template Measurement<S>>,
          typename Step = NoTime>
MethodCheck check_method(const Filter<M, D, Scalar>& filter, const S& sensor, const Flight& flight,
                         const Step& dt = {},
                         const typename Filter<M, D, Scalar>::Control& control =
                             kernel::zeros<typename Filter<M, D, Scalar>::Control>()) {
  using F = Filter<M, D, Scalar>;
  using Method = typename MethodOf<M>::type;
  using Y = typename F::template Measurement<S>;
  // A sensor that measures all the time has no update(). A method with a list of sensors, which shows in its
  // With, need not have a place for a part of one.
  constexpr bool updates = !has_noise_spectral_density<S, typename F::State, typename F::At>() ||
                           has_noise_covariance<S, typename F::State, typename F::At>();
  constexpr bool listed = requires { typename Method::template With<Sensors<S>>; };
  constexpr bool masks = updates && !listed && SensorTraits<S>::measurements < 64;
  double length = 0;
  if constexpr (std::is_arithmetic_v<Step>) length = static_cast<double>(static_cast<Scalar>(dt));
  // One piece of code for all: the compiler may round each copy of it in its own way.
  const auto step = [&](F& other, const auto& y) JML_NOINLINE { return other.step(sensor, y, dt, control); };

  MethodCheck check;
  check.expect(filter.status() == Status::ok, "the filter refuses its start: its status() says why");
  F flown = filter, twin = filter;
  for (const auto& y : flight) {
    const F before = flown;
    const auto report = step(flown, y);
    const auto same = [&](F& other) { return same_bits(report, step(other, y)) && same_bits(other, flown); };
    check.expect(same(twin), "two copies differ on the same flight: same input, same bits");
    check.expect(usable(report.status), "step() refuses a measurement of the flight: its report says why");
    detail::check_result<Method>(check, before, flown, length);

    const Y good = detail::moved<Y>(y, report, 0);
    F predicted = before;
    check.expect(usable(predicted.predict(dt, control)), "predict() refuses what step() accepts");
    detail::check_result<Method>(check, before, predicted, length);
    if constexpr (updates) {
      F updated = predicted;
      check.expect(usable(updated.update(sensor, good).status), "update() refuses what step() accepts");
      detail::check_result<Method>(check, before, updated, length);
    }
    if constexpr (std::is_copy_assignable_v<typename F::Belief>) {
      const Y another = detail::moved<Y>(y, report, 1);
      detail::UsedFilter<F> used(before);  // by every verb, over no time
      static_cast<void>(used.predict(Step{}, control));
      static_cast<void>(used.step(sensor, another, Step{}, control));
      if constexpr (updates) static_cast<void>(used.update(sensor, another));
      used.put_back(before.belief());
      check.expect(same(used), "a step depends on what ran before: something is kept beside the belief");
    }
    F refusing = before;
    detail::check_refusals<updates, masks>(check, refusing, sensor, good, dt, control);
    check.expect(same(refusing), "a refusal changes the next step: a hidden part of the belief was touched");

    predicted.gate.probability = 0.5;
    const Y absurd = detail::moved<Y>(y, report, 1000);
    // Silent without an innovation matrix, and where the sensor's residual makes an absurd y ordinary.
    const auto expect_rejected = [&](F& other, const auto& answer) {
      const Scalar nis = answer.nis();
      if ((answer.gate == Verdict::off && !std::isfinite(nis)) || other.gate.passes(nis, answer.degrees))
        return;
      const bool rejected = usable(answer.status) && answer.gate == Verdict::rejected;
      check.expect(rejected, "a measurement far outside the gate is not rejected");
      check.expect(std::isfinite(nis), "a measurement is rejected without a finite nis()");
      check.expect(same_place(other, predicted), "a rejected measurement does not leave what predict() does");
      F next = predicted;
      static_cast<void>(step(other, y));
      static_cast<void>(step(next, y));
      check.expect(same_place(other, next), "a rejected measurement changes the next step");
    };
    F stepped = before, updated = predicted;
    stepped.gate = predicted.gate;
    expect_rejected(stepped, step(stepped, absurd));
    if constexpr (updates) expect_rejected(updated, updated.update(sensor, absurd));
    if (!check) return check;
    ++check.at;
  }
  check.expect(check.at > 0, "there are no measurements: nothing was checked");
  constexpr bool linear = DiscreteDynamics<D> && DynamicsTraits<D>::linear && SensorTraits<S>::linear;
  if constexpr (linear && detail::HasRiccati<typename F::Belief> && requires { Method::optimal_on_linear; }) {
    const int left = Method::optimal_on_linear ? leaves_kalman(filter, sensor, flight, dt, control) : -1;
    if (check && left >= 0) check = {"says `optimal_on_linear`, but is not the Kalman filter", left};
  }
  return check;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
