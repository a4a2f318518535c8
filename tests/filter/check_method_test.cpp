// SPDX-License-Identifier: BSD-3-Clause
// check_method is silent on the sound methods, and names the fault of each one that was broken on purpose.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <jml/bounded/box.hpp>
#include <jml/filter/check_method.hpp>
#include <jml/iterated/iterated.hpp>

#include "heap_trap.hpp"
#include "models/linear.hpp"
#include "models/radar.hpp"
#include "models/van_der_pol.hpp"

namespace {

using testing::HasSubstr;

template <typename Scalar = double>
jml::Estimate<Scalar, 2> oscillator_start() {
  return {jml::Vector<Scalar, 2>(1, 0.5),
          jml::Matrix<Scalar, 2, 2>(jml::Vector<Scalar, 2>(0.2, 0.4).asDiagonal())};
}
template <typename Scalar = double>
jml::Estimate<Scalar, 4> track_start() {
  return {jml::Vector<Scalar, 4>(1, -2, 3, 0.5),
          jml::Matrix<Scalar, 4, 4>(jml::Vector<Scalar, 4>(2, 1, 3, 1).asDiagonal())};
}
jml::Estimate<double, 6> target_start() {
  jml::Vector<double, 6> x, variances;
  x << 40, 25, 12, -0.4, 0.1, 0.02;
  variances << 1, 1, 1, 1e-2, 1e-2, 1e-2;
  return {x, jml::Matrix<double, 6, 6>(variances.asDiagonal())};
}
/// Both positions of a ConstantVelocity, with correlated noise.
models::LinearSensor<4, 2> positions() {
  models::LinearSensor<4, 2> s;
  s.M << 1, 0, 0, 0, 0, 0, 1, 0;
  s.R << 0.3, 0.1, 0.1, 0.2;
  return s;
}
const std::array<jml::Vector<double, 2>, 4> track{{{0.8, 3.1}, {-0.4, 3.6}, {-1.1, 3.4}, {-2.5, 3.9}}};
constexpr double dt = 0.5;

void expect_sound(const jml::MethodCheck& check) {
  EXPECT_TRUE(check.ok()) << check.at << ": " << check.what;
}
void expect_fault(const jml::MethodCheck& check, const char* what, int at = 0) {
  ASSERT_FALSE(check) << what;
  EXPECT_THAT(check.what, HasSubstr(what));
  EXPECT_EQ(check.at, at) << what;
}

template <typename M>
class SoundMethods : public testing::Test {};
using Methods = testing::Types<jml::Ekf<>, jml::Sddre<>, jml::Jml<>, jml::Iekf, jml::IteratedJml<>>;
TYPED_TEST_SUITE(SoundMethods, Methods);

TYPED_TEST(SoundMethods, PassOnVanDerPol) {
  expect_sound(jml::check_method(jml::Filter{TypeParam{}, models::VanDerPol{}, oscillator_start()},
                                 models::SaturatingPosition{}, {0.6, 0.7, 0.65, 0.9}));
}
TYPED_TEST(SoundMethods, PassOnRadar) {
  const auto start = target_start();
  std::array<jml::Vector<double, 3>, 3> flight;
  for (std::size_t i = 0; i < 3; ++i)
    flight[i] = models::Radar{}.measurement(
        jml::Vector<double, 6>(start.x + 0.1 * double(i) * jml::Vector<double, 6>::Ones()));
  jml::Filter filter{TypeParam{}, models::BallisticTarget{}, start};
  expect_sound(jml::check_method(filter, models::Radar{}, flight, 0.1));
  expect_sound(jml::check_method(filter, jml::part(models::Radar{}, jml::only(0, 2)), flight, 0.1));
}
TYPED_TEST(SoundMethods, PassOnLinear) {
  jml::Filter filter{TypeParam{}, models::ConstantVelocity{}, track_start(), 1e9};
  expect_sound(jml::check_method(filter, positions(), track, dt));
  filter.gate.probability = 0.9;  // the user's own gate: the Kalman filter beside it has it too
  auto outlier = track;
  outlier[2](0) += 100;
  expect_sound(jml::check_method(filter, positions(), outlier, dt));
  jml::Noise noise(3);
  const auto d = models::random_linear_dynamics<3, 2>(noise);
  const auto s = models::random_linear_sensor<3, 2>(noise);
  const jml::Estimate start{models::random_matrix<3, 1>(noise), models::random_covariance<3>(noise, 0.5)};
  expect_sound(jml::check_method(jml::Filter{TypeParam{}, d, start}, s, track));
}
// What a precise measurement leaves of a large P has the rounding of the large one, in the Kalman filter too.
TYPED_TEST(SoundMethods, PassWhereAlmostNothingWasKnown) {
  jml::Estimate start = track_start();
  start.P *= 1e9;
  jml::Matrix<double, 4, 4> mixed = start.P;
  mixed.array() += 1e8;
  expect_sound(
      jml::check_method(jml::Filter{TypeParam{}, models::ConstantVelocity{}, jml::Estimate{start.x, mixed}},
                        positions(), std::array{track[0]}, dt));
}
TYPED_TEST(SoundMethods, PassInFloat) {
  std::array<jml::Vector<float, 2>, 4> flight;
  for (std::size_t i = 0; i < 4; ++i) flight[i] = track[i].cast<float>();
  expect_sound(jml::check_method(jml::Filter{TypeParam{}, models::ConstantVelocity{}, track_start<float>()},
                                 positions(), flight, 0.1));
}

TEST(CheckMethod, PassesTheKalmanFilter) {
  expect_sound(jml::check_method(jml::Filter{jml::Kalman{}, models::ConstantVelocity{}, track_start()},
                                 positions(), track, dt));
}

TEST(CheckMethod, TakesNoHeap) {
  const jml::Filter filter{jml::IteratedJml{}, models::VanDerPol{}, oscillator_start()};
  jml::MethodCheck check;
  {
    heap_trap::Armed trap;
    check = jml::check_method(filter, models::SaturatingPosition{}, {0.6, 0.7});
  }
  EXPECT_EQ(heap_trap::allocations, 0);
  expect_sound(check);
}

/// x⁺ = x + dt u, one control.
struct Pushed {
  static constexpr int states = 1, controls = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const auto& at) const {
    return jml::Vector<T, 1>(x(0) + at.dt * at.control(0));
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(0.1); }
};
struct Direct {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x, const auto& at) const {
    return jml::Vector<T, 1>(x(0) + 0.1 * at.control(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.1); }
};
TEST(CheckMethod, HandsTheControlOn) {
  const jml::Estimate start{jml::Vector<double, 1>(0), jml::Matrix<double, 1, 1>(1)};
  expect_sound(jml::check_method(jml::Filter{jml::Ekf{}, Pushed{}, start}, Direct{}, {0.6, 1.2}, dt, 1.0));
  expect_fault(jml::check_method(jml::Filter{jml::Ekf{}, Pushed{}, start}, Direct{}, {0.6}, dt, std::nan("")),
               "refuses a measurement of the flight");
}

TEST(CheckMethod, NamesAFlightThatShowsNothing) {
  jml::Estimate bad = oscillator_start();
  bad.P(0, 0) = -1;
  expect_fault(jml::check_method(jml::Filter{jml::Ekf{}, models::VanDerPol{}, bad},
                                 models::SaturatingPosition{}, {0.6}),
               "refuses its start");
  const jml::Filter good{jml::Ekf{}, models::VanDerPol{}, oscillator_start()};
  expect_fault(jml::check_method(good, models::SaturatingPosition{}, std::array<double, 0>{}),
               "no measurements");
  expect_fault(jml::check_method(good, models::SaturatingPosition{}, {0.6, std::nan("")}),
               "refuses a measurement of the flight", 1);
  expect_fault(jml::check_method(
                   jml::Filter{jml::Ekf{}, models::ConstantVelocity{},
                               jml::Estimate{track_start().x, jml::Matrix<double, 4, 4>(-track_start().P)}},
                   positions(), std::array<jml::Vector<double, 2>, 0>{}, dt),
               "refuses its start");
}

/// A bearing whose thousand standard deviations are a full turn.
struct Bearing {
  static constexpr int measurements = 1;
  static constexpr double turn = 6.283185307179586;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Vector<double, 1> residual(const jml::Vector<double, 1>& y,
                                  const jml::Vector<double, 1>& predicted) const {
    return jml::Vector<double, 1>(std::remainder(y(0) - predicted(0), turn));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(turn * turn / 1e6); }
};
struct Still {
  static constexpr int states = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
};
TEST(CheckMethod, AsksForNoRejectionOfAFullTurn) {
  const jml::Estimate start{jml::Vector<double, 1>(0.5), jml::Matrix<double, 1, 1>(0)};
  expect_sound(jml::check_method(jml::Filter{jml::Ekf{}, Still{}, start}, Bearing{}, {0.5}));
}

enum class Flaw {
  none,
  // Of every correction.
  random_x,
  random_P,
  random_status,
  random_gate,
  random_innovation,
  random_innovation_matrix,
  x_not_finite,
  P_not_symmetric,
  P_negative,
  P_not_finite,
  accepts_nan,
  accepts_infinity,
  accepts_last_row,
  ignores_gate,
  uses_what_it_rejects,
  refuses_what_the_gate_stops,
  rejects_without_matrix,
  wrong_P,
  wrong_x,
  late_drift,
  forgets_dt,
  not_a_covariance,
  refuses_zero,
  // Of one verb; step() is sound.
  counts_predictions,
  counts_corrections,
  counts_steps,
  predict_refuses,
  update_refuses,
  predict_spoils,
  update_spoils,
  update_accepts,
  update_ignores_gate,
  update_uses_what_it_rejects,
  step_spoils,
  step_ignores_gate,
};
int calls_of_all = 0;

/// The EKF with one flaw.
template <bool symmetric_ = true, bool optimal = true>
struct Flawed {
  static constexpr bool symmetric = symmetric_, optimal_on_linear = optimal;
  template <typename Scalar, typename D>
  using Belief = jml::Estimate<Scalar, jml::states_of<D>>;

  Flaw flaw{};
  jml::OnePass<jml::Ekf<>> sound{};
  mutable int predictions = 0, corrections = 0, steps = 0;

  template <typename Model, typename Belief>
  jml::Status start(const Model& model, const Belief& given, Belief& belief) const {
    const jml::Status status = sound.start(model, given, belief);
    if (flaw == Flaw::not_a_covariance) belief.P(0, 1) += 1e-3;
    return status;
  }

  template <typename Model, typename Belief, typename At>
  jml::Status predict(const Model& model, const Belief& prior, At at, Belief& next) const {
    ++predictions;
    if (flaw == Flaw::predict_refuses) return jml::Status::not_converged;
    if (flaw == Flaw::forgets_dt) at.dt = 0;
    const jml::Status status = sound.predict(model, prior, at, next);
    if (flaw == Flaw::predict_spoils) next.P(0, 1) += 1;
    return status;
  }

  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
               Report& report) const {
    ++corrections;
    const bool blind = flaw == Flaw::ignores_gate || flaw == Flaw::uses_what_it_rejects;
    const jml::Gate open;
    sound.correct(model, prior, jml::Sample{sample.sensor, sample.y, sample.at, blind ? open : sample.gate},
                  next, report);
    const bool good = jml::usable(report.status), far = good && report.nis() > 1000;
    const bool last = std::isfinite(sample.y(Sample::measurements - 1)), nan = sample.y.hasNaN();
    if (!good && (flaw == Flaw::update_accepts || (flaw == Flaw::accepts_nan && nan) ||
                  (flaw == Flaw::accepts_infinity && !nan) || (flaw == Flaw::accepts_last_row && !last))) {
      next = prior;
      report.status = jml::Status::ok;
    }
    if (!good) return;
    const double little = 1e-12 * ++calls_of_all;
    const bool odd = calls_of_all % 2 == 1;
    if (flaw == Flaw::random_x) next.x(1) += little;
    if (flaw == Flaw::random_P) next.P(1, 1) *= 1 + little;
    if (flaw == Flaw::random_status && odd) report.status = jml::Status::accepted_at_rounding;
    if (flaw == Flaw::random_gate && odd) report.gate = jml::Verdict::accepted;
    if (flaw == Flaw::random_innovation) report.innovation(1) *= 1 + little;
    if (flaw == Flaw::random_innovation_matrix) report.innovation_matrix(1, 1) *= 1 + little;
    if (flaw == Flaw::x_not_finite) next.x(1) = std::nan("");
    if (flaw == Flaw::P_not_symmetric) next.P(0, 1) += 1e-6;
    if (flaw == Flaw::P_negative) next.P(1, 1) = -next.P(1, 1);
    if (flaw == Flaw::P_not_finite) next.P(0, 1) = next.P(1, 0) = std::nan("");
    if (flaw == Flaw::uses_what_it_rejects && far) report.gate = jml::Verdict::rejected;
    if (flaw == Flaw::refuses_what_the_gate_stops && far) report.status = jml::Status::not_converged;
    if (flaw == Flaw::rejects_without_matrix) report.innovation_matrix.setZero();
    const bool used = report.gate != jml::Verdict::rejected;
    if (flaw == Flaw::wrong_P && used) next.P(0, 1) = next.P(1, 0) = next.P(1, 0) + 1e-6;
    if (flaw == Flaw::wrong_x && used) next.x(1) += 1e-6;
    if (flaw == Flaw::late_drift && used && sample.at.time > 1.2) next.x(1) += 1e-6;
    if (flaw == Flaw::refuses_zero && sample.y.isZero()) report.status = jml::Status::not_converged;
    if (flaw == Flaw::update_refuses) report.status = jml::Status::not_converged;
    if (flaw == Flaw::update_spoils) next.P(0, 1) += 1;
    if (flaw == Flaw::update_uses_what_it_rejects && !used) next.x(0) += 1;
    if (flaw == Flaw::update_ignores_gate) report.gate = jml::Verdict::accepted;
  }

  template <typename Model, typename Belief, typename Sample, typename Report>
  void step(const Model& model, const Belief& prior, const Sample& sample, Belief& next,
            Report& report) const {
    ++steps;
    if (flaw < Flaw::counts_predictions) {
      Belief predicted;
      report.status = predict(model, prior, sample.at, predicted);
      if (report.status != jml::Status::ok) return;
      const auto end = jml::end_of(sample.at);
      correct(model, predicted, jml::Sample{sample.sensor, sample.y, end, sample.gate}, next, report);
      return;
    }
    sound.step(model, prior, sample, next, report);
    if (flaw == Flaw::step_spoils) next.P(0, 1) += 1;
    if (flaw == Flaw::step_ignores_gate) report.gate = jml::Verdict::accepted;
    if (flaw == Flaw::counts_predictions) next.x(0) += 1e-12 * predictions;
    if (flaw == Flaw::counts_corrections) next.x(0) += 1e-12 * corrections;
    if (flaw == Flaw::counts_steps) next.x(0) += 1e-12 * steps;
  }
};

template <typename M>
jml::MethodCheck check_on_track(const M& method) {
  return jml::check_method(jml::Filter{method, models::ConstantVelocity{}, track_start()}, positions(), track,
                           dt);
}
jml::MethodCheck check_flawed(Flaw flaw) { return check_on_track(Flawed<>{flaw}); }

TEST(CheckMethod, NamesWhatDoesNotRepeat) {
  expect_sound(check_flawed(Flaw::none));
  constexpr const char* what = "two copies differ";
  expect_fault(check_flawed(Flaw::random_x), what);
  expect_fault(check_flawed(Flaw::random_P), what);
  expect_fault(check_flawed(Flaw::random_status), what);
  expect_fault(check_flawed(Flaw::random_gate), what);
  expect_fault(check_flawed(Flaw::random_innovation), what);
  expect_fault(check_flawed(Flaw::random_innovation_matrix), what);
}
TEST(CheckMethod, NamesAMemoryInTheMethod) {
  constexpr const char* what = "beside the belief";
  expect_fault(check_flawed(Flaw::counts_predictions), what);
  expect_fault(check_flawed(Flaw::counts_corrections), what);
  expect_fault(check_flawed(Flaw::counts_steps), what);
}
TEST(CheckMethod, NamesAnEstimateThatIsNone) {
  expect_fault(check_flawed(Flaw::x_not_finite), "x is not finite");
  expect_fault(check_flawed(Flaw::P_not_symmetric), "says `symmetric`");
  expect_fault(check_flawed(Flaw::P_negative), "says `symmetric`");
  expect_fault(check_flawed(Flaw::P_not_finite), "says `symmetric`");
  expect_fault(check_flawed(Flaw::predict_spoils), "says `symmetric`");
  expect_fault(check_flawed(Flaw::update_spoils), "says `symmetric`");
  expect_fault(check_flawed(Flaw::step_spoils), "says `symmetric`");
}
TEST(CheckMethod, NamesAMeasurementThatShouldHaveBeenRefused) {
  constexpr const char* what = "a measurement that is not finite is accepted";
  expect_fault(check_flawed(Flaw::accepts_nan), what);
  expect_fault(check_flawed(Flaw::accepts_infinity), what);
  expect_fault(check_flawed(Flaw::accepts_last_row), what);
  expect_fault(check_flawed(Flaw::update_accepts), what);
}
TEST(CheckMethod, NamesAVerbThatRefuses) {
  expect_fault(check_flawed(Flaw::predict_refuses), "predict() refuses what step() accepts");
  expect_fault(check_flawed(Flaw::update_refuses), "update() refuses what step() accepts");
}
TEST(CheckMethod, CorrectsWithTheFlightsOwnMeasurements) { expect_sound(check_flawed(Flaw::refuses_zero)); }
TEST(CheckMethod, NamesAGateThatIsNotObeyed) {
  expect_fault(check_flawed(Flaw::ignores_gate), "far outside the gate");
  expect_fault(check_flawed(Flaw::update_ignores_gate), "far outside the gate");
  expect_fault(check_flawed(Flaw::step_ignores_gate), "far outside the gate");
  expect_fault(check_flawed(Flaw::refuses_what_the_gate_stops), "far outside the gate");
  expect_fault(check_flawed(Flaw::uses_what_it_rejects), "does not leave what predict() does");
  expect_fault(check_flawed(Flaw::update_uses_what_it_rejects), "does not leave what predict() does");
  expect_fault(check_flawed(Flaw::rejects_without_matrix), "without a finite nis()");
}
TEST(CheckMethod, NamesWhatIsNotOptimal) {
  constexpr const char* what = "optimal_on_linear";
  expect_fault(check_flawed(Flaw::wrong_P), what);
  expect_fault(check_flawed(Flaw::wrong_x), what);
  expect_fault(check_flawed(Flaw::forgets_dt), what);
  expect_fault(check_flawed(Flaw::late_drift), what, 2);
  expect_fault(check_on_track(Flawed<false>{Flaw::not_a_covariance}), what);
  expect_sound(check_on_track(Flawed<true, false>{Flaw::wrong_x}));  // does not claim it
  // Nobody claims it of a nonlinear model.
  expect_sound(
      jml::check_method(jml::Filter{Flawed<>{Flaw::wrong_x}, models::VanDerPol{}, oscillator_start()},
                        models::SaturatingPosition{}, {0.6}));
}

/// The EKF with a workspace in its model, where it finds what another step has left.
struct Warm {
  template <typename Scalar, typename D>
  using Belief = jml::Estimate<Scalar, jml::states_of<D>>;
  template <typename Scalar, typename D>
  struct Model : jml::NoisyDynamics<Scalar, D> {
    using jml::NoisyDynamics<Scalar, D>::NoisyDynamics;
    Scalar warm = 0;
  };
  jml::OnePass<jml::Ekf<>> sound{};
  template <typename Model, typename Belief>
  jml::Status start(const Model& model, const Belief& given, Belief& belief) const {
    return sound.start(model, given, belief);
  }
  template <typename Model, typename Belief, typename At>
  jml::Status predict(Model& model, const Belief& prior, const At& at, Belief& next) const {
    const jml::Status status = sound.predict(model, prior, at, next);
    next.x(0) += 1e-9 * (model.warm - next.x(0));
    return status;
  }
  template <typename Model, typename Belief, typename Sample, typename Report>
  void correct(Model& model, const Belief& prior, const Sample& sample, Belief& next, Report& report) const {
    sound.correct(model, prior, sample, next, report);
    if (jml::usable(report.status)) model.warm = next.x(0);
  }
};
TEST(CheckMethod, NamesAMemoryInTheModel) { expect_fault(check_on_track(Warm{}), "beside the belief"); }

/// What a belief that rolls back by itself may have forgotten to bring back, or to keep out.
enum class Slip {
  none,
  x,
  P,
  past_x,
  past_P,
  past_time,
  depth,
  box_lower,
  box_upper,
  hidden,
  keeps_rejected,
  clock
};

/// The EKF in a belief with two verbs that bring it back: with a step of the past, a box and a part that is
/// not seen.
struct RollsBack {
  static constexpr bool rolls_back = true;
  template <typename Scalar, typename D>
  struct Belief {
    explicit Belief(const D& d) : model(d) {}
    jml::NoisyDynamics<Scalar, D> model;
    jml::Estimate<Scalar, jml::states_of<D>> now, before;
    double time_now = 0, time_before = 0;
    Scalar hidden = 0;
    int steps = 1;
    jml::Box<Scalar, jml::states_of<D>> box;

    const D& dynamics() const { return model.dynamics; }
    const auto& x(int age = 0) const { return age == 0 ? now.x : before.x; }
    const auto& P(int age = 0) const { return age == 0 ? now.P : before.P; }
    double time(int age) const { return age == 0 ? time_now : time_before; }
    int depth() const { return steps; }
  };

  Slip slip{};
  jml::OnePass<jml::Ekf<>> sound{};

  template <typename B, typename Start>
  jml::Status start(B& belief, const Start& given, double time) const {
    belief.before = given;
    belief.time_now = belief.time_before = time;
    return sound.start(belief.model, given, belief.now);
  }
  template <typename B, typename At>
  jml::Status predict(B& belief, const At& at) const {
    auto next = belief.now;
    const jml::Status status = sound.predict(belief.model, belief.now, at, next);
    if (status != jml::Status::ok) return status;
    belief.before = belief.now;
    belief.time_before = belief.time_now;
    belief.now = next;
    belief.now.x(0) += belief.hidden;
    if (slip != Slip::clock) belief.time_now += at.dt;
    return status;
  }
  template <typename B, typename Sample, typename Report>
  void correct(B& belief, const Sample& sample, Report& report) const {
    auto next = belief.now;
    sound.correct(belief.model, belief.now, sample, next, report);
    if (slip == Slip::keeps_rejected && report.gate == jml::Verdict::rejected) belief.hidden += 1;
    if (jml::usable(report.status)) {
      belief.now = next;
      return;
    }
    spoil(belief);
  }
  template <typename B, typename Sample, typename Report>
  void step(B& belief, const Sample& sample, Report& report) const {
    const B good = belief;
    report.status = predict(belief, sample.at);
    if (report.status != jml::Status::ok) return;
    const auto end = jml::end_of(sample.at);
    correct(belief, jml::Sample{sample.sensor, sample.y, end, sample.gate}, report);
    if (jml::usable(report.status)) return;
    belief = good;
    spoil(belief);
  }

 private:
  template <typename B>
  void spoil(B& belief) const {
    if (slip == Slip::x) belief.now.x(1) += 1;
    if (slip == Slip::P) belief.now.P(1, 1) += 1;
    if (slip == Slip::past_x) belief.before.x(1) += 1;
    if (slip == Slip::past_P) belief.before.P(1, 1) += 1;
    if (slip == Slip::past_time) belief.time_before += 1;
    if (slip == Slip::depth) belief.steps = 0;
    if (slip == Slip::box_lower) belief.box.lower(1) = 0;
    if (slip == Slip::box_upper) belief.box.upper(1) = 0;
    if (slip == Slip::hidden) belief.hidden += 1;
  }
};
TEST(CheckMethod, NamesWhatARefusalLeavesBehind) {
  expect_sound(check_on_track(RollsBack{}));
  for (const Slip slip : {Slip::x, Slip::P, Slip::past_x, Slip::past_P, Slip::past_time, Slip::depth,
                          Slip::box_lower, Slip::box_upper})
    expect_fault(check_on_track(RollsBack{slip}), "a refusal changes x, P, box or time");
  expect_fault(check_on_track(RollsBack{Slip::hidden}), "a refusal changes the next step");
  expect_fault(check_on_track(RollsBack{Slip::keeps_rejected}),
               "a rejected measurement changes the next step");
  expect_fault(check_on_track(RollsBack{Slip::clock}), "the time after a verb");
}

/// A box around the model's own path: no P, no innovation matrix, no gate.
struct Boxed {
  template <typename Scalar, typename D>
  struct Belief {
    jml::Vector<Scalar, jml::states_of<D>> x;
    jml::Box<Scalar, jml::states_of<D>> box;
  };
  double width = 1;
  template <typename Model, typename Start, typename B>
  jml::Status start(const Model&, const Start& given, B& belief) const {
    belief.x = given.x;
    belief.x(0) = std::nan("");  // the centre of what has no bound
    return jml::Status::ok;
  }
  template <typename Model, typename B, typename At>
  jml::Status predict(const Model& model, const B& prior, const At& at, B& next) const {
    next.x = jml::dynamics(model.dynamics, prior.x, at);
    for (int i = 1; i < 2; ++i) {
      next.box.lower(i) = next.x(i) - width;
      next.box.upper(i) = next.x(i) + width;
    }
    return jml::Status::ok;
  }
  template <typename Model, typename B, typename Sample, typename Report>
  void correct(const Model&, const B& prior, const Sample& sample, B& next, Report& report) const {
    next = prior;
    report.innovation = sample.y;
    if (!jml::all_finite(sample.y)) report.status = jml::Status::invalid_measurement;
  }
};
TEST(CheckMethod, TakesAMethodOfBoxes) {
  expect_sound(check_on_track(Boxed{}));
  expect_fault(check_on_track(Boxed{-1}), "box is not valid()");
}

/// ẋ = -x + w, and x itself measured all the time.
struct Decay {
  using time_domain = jml::ContinuousTime;
  static constexpr int states = 1;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return -x;
  }
};
struct Always {
  static constexpr int measurements = 1;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_spectral_density() const { return jml::Matrix<double, 1, 1>(1.0); }
};
/// An observer with a fixed gain, one Euler step long. It has no correction at an instant.
struct Observer {
  bool trusts_y = false;
  template <typename Scalar, typename D>
  struct Belief {
    jml::Vector<Scalar, jml::states_of<D>> x;
  };
  template <typename Model, typename Start, typename B>
  jml::Status start(const Model&, const Start& given, B& belief) const {
    belief.x = given.x;
    return jml::Status::ok;
  }
  template <typename Model, typename B, typename At>
  jml::Status predict(const Model& model, const B& prior, const At& at, B& next) const {
    next.x = prior.x + at.dt * jml::dynamics(model.dynamics, prior.x, at);
    return jml::Status::ok;
  }
  template <typename Model, typename B, typename Sample, typename Report>
  void step(const Model& model, const B& prior, const Sample& sample, B& next, Report& report) const {
    report.status = predict(model, prior, sample.at, next);
    jml::Vector<double, 1> y;
    if constexpr (requires { sample.y(0.0); } && !requires { sample.y.size(); })
      y = sample.y(sample.at.time);
    else
      y = sample.y;
    if (!trusts_y && !jml::all_finite(y)) report.status = jml::Status::invalid_measurement;
    if (jml::all_finite(y)) next.x += sample.at.dt * (y - prior.x);
  }
};
struct Sine {
  double phase;
  jml::Vector<double, 1> operator()(double time) const {
    return jml::Vector<double, 1>(std::sin(time + phase));
  }
};
TEST(CheckMethod, TakesASensorThatMeasuresAllTheTime) {
  const jml::Estimate start{jml::Vector<double, 1>(0), jml::Matrix<double, 1, 1>(1)};
  expect_sound(jml::check_method(jml::Filter{Observer{}, Decay{}, start}, Always{}, {0.6, 1.2}, 0.1));
  const std::array<Sine, 2> signals{{{0}, {0.1}}};
  expect_sound(jml::check_method(jml::Filter{Observer{}, Decay{}, start}, Always{}, signals, 0.1));
  expect_fault(jml::check_method(jml::Filter{Observer{true}, Decay{}, start}, Always{}, signals, 0.1),
               "not finite is accepted");
}

/// A method that must know its sensors beforehand.
template <typename List = void>
struct Listed : Boxed {
  template <typename Sensors>
  using With = Listed<Sensors>;
  Listed() = default;
  template <typename Other>
  explicit Listed(const Listed<Other>&) {}
  template <typename S>
  static consteval bool accepts_sensor() {
    return jml::detail::require_listed<List, S>();
  }
};
TEST(CheckMethod, TakesAMethodWithAListOfSensors) {
  expect_sound(jml::check_method(jml::Filter{Listed<>{}, models::ConstantVelocity{},
                                             jml::sensors<models::LinearSensor<4, 2>>, track_start()},
                                 positions(), track, dt));
}

enum class Gap { none, step_dt, predict_dt, nan_dt, rows, time };
/// Not a method: says which of the filter's own guards is missing.
struct Lax : jml::Ekf<> {};

}  // namespace

template <typename D>
class jml::Filter<Lax, D, double> : public jml::Filter<jml::Ekf<>, D, double> {
  using Sound = jml::Filter<jml::Ekf<>, D, double>;

 public:
  using Sound::Sound;
  Gap gap = Gap::none;

  template <typename S>
  auto step(const S& sensor, const typename Sound::template Measurement<S>& y, double length,
            const auto& control) {
    return Sound::step(sensor, y, gap == Gap::step_dt && length < 0 ? 0 : length, control);
  }
  jml::Status predict(double length, const auto& control) {
    if (gap == Gap::time) length *= 1 + 1e-14;
    return Sound::predict(
        (gap == Gap::predict_dt && length < 0) || (gap == Gap::nan_dt && std::isnan(length)) ? 0 : length,
        control);
  }
  template <typename S, typename... Which>
  auto update(const S& sensor, const typename Sound::template Measurement<S>& y, const Which&... which) {
    if constexpr (sizeof...(Which) > 0) {
      if (gap == Gap::rows) return Sound::update(sensor, y);
    }
    return Sound::update(sensor, y, which...);
  }
};

namespace {

TEST(CheckMethod, NamesAGuardThatTheFilterHasLost) {
  const auto check = [](Gap gap) {
    jml::Filter<Lax, models::ConstantVelocity, double> filter{jml::Ekf{}, models::ConstantVelocity{},
                                                              track_start(), 1.0};
    filter.gap = gap;
    return jml::check_method(filter, positions(), track, dt);
  };
  expect_sound(check(Gap::none));
  expect_fault(check(Gap::step_dt), "a dt that is negative or a NaN is accepted");
  expect_fault(check(Gap::predict_dt), "a dt that is negative or a NaN is accepted");
  expect_fault(check(Gap::nan_dt), "a dt that is negative or a NaN is accepted");
  expect_fault(check(Gap::rows), "a row that the sensor has not is accepted");
  expect_fault(check(Gap::time), "the time after a verb");
}

}  // namespace
