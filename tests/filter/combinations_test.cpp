// SPDX-License-Identifier: BSD-3-Clause
// A combination that compiles is a combination that is tested: every discrete method, with SDC matrices and
// Jacobians of the model's own or derived, in double and in float (of its own in float by night), by every verb. Where theory says they are equal
// they agree: own and derived to rounding, float and double to float's.
// (What these methods are right about is tested elsewhere; here none may be missing.)
#include <gtest/gtest.h>

#include "models/combinations.hpp"

namespace {

using jml::Vector, jml::usable;

/// x and P after a flight by every verb.
struct Flown {
  Vector<double, 2> x;
  jml::Matrix<double, 2, 2> P = jml::Matrix<double, 2, 2>::Zero();
};

template <typename Scalar, bool own, typename Filter>
Flown fly(Filter filter) {
  const models::CombinedSensor<Scalar, own, false> sensor;
  const auto y = models::combined_y<Scalar>;
  for (int k = 1; k <= 20; ++k) {
    if (k % 5 == 0) {
      EXPECT_TRUE(usable(filter.predict()));
      EXPECT_TRUE(usable(filter.update(sensor, y(k))));
    } else if (k % 7 == 0) {
      EXPECT_TRUE(usable(filter.step(sensor, Vector<Scalar, 1>(y(k)), Scalar(0.05))));
    } else {
      EXPECT_TRUE(usable(filter.step(sensor, y(k))));
    }
  }
  EXPECT_TRUE(usable(filter.update(sensor, y(20), jml::only(0))));
  EXPECT_EQ(filter.update(sensor, y(20), jml::at_time(filter.time() + 1)).status, jml::Status::invalid_time_step);
  Flown out;
  out.x = filter.x().template cast<double>();
  if constexpr (requires { filter.P(); }) out.P = filter.P().template cast<double>();
  return out;
}

template <typename Scalar, bool own, typename M>
Flown fly_by(const M& method) {
  using D = models::CombinedStep<Scalar, own>;
  using S = models::CombinedSensor<Scalar, own, false>;
  if constexpr (jml::BoxRule<M>) {
    return fly<Scalar, own>(jml::Filter{method, D{},
                                        jml::Box<Scalar, 2>{Vector<Scalar, 2>(Scalar(0.5), Scalar(0)),
                                                            Vector<Scalar, 2>(Scalar(1.2), Scalar(0.6))}});
  } else if constexpr (requires { typename M::template With<jml::Sensors<S>>; }) {
    return fly<Scalar, own>(
        jml::Filter{method, D{}, jml::sensors<jml::Part<S>>, models::combined_start<Scalar>()});
  } else {
    return fly<Scalar, own>(jml::Filter{method, D{}, models::combined_start<Scalar>()});
  }
}

void expect_near(const Flown& a, const Flown& b, double tolerance, const char* what) {
  EXPECT_LT((a.x - b.x).norm(), tolerance * (1 + a.x.norm())) << what;
  EXPECT_LT((a.P - b.P).norm(), tolerance * (1 + a.P.norm())) << what;
}

/// `in_float`: of the rule in float, where it has its own type (a reference point).
template <typename M, typename F>
void check(const char* name, const M& method, const F& in_float) {
  SCOPED_TRACE(name);
  const Flown own = fly_by<double, true>(method);
  expect_near(own, fly_by<double, false>(method), 1e-9, "own and derived");
  const Flown single = fly_by<float, false>(in_float);
  expect_near(own, single, 2e-4, "double and float");
#ifdef JML_BY_NIGHT
  expect_near(single, fly_by<float, true>(in_float), 2e-4, "own and derived in float");
#endif
}
template <typename M>
void check(const char* name, const M& method) {
  check(name, method, method);
}

TEST(Combinations, OnePassRules) {
  check("EKF", jml::Ekf{});
  check("EKF at the prediction", jml::Ekf<jml::EvaluatedAt::prediction>{});
  check("SDDRE", jml::Sddre{});
  check("JML", jml::Jml{});
  const Vector<double, 2> r(0.3, -0.1);
  check("JML about a point", jml::Jml{jml::AboutPoint{r}}, jml::Jml{jml::AboutPoint{Vector<float, 2>(r.cast<float>())}});
  check("JML about the estimate", jml::Jml{jml::AboutEstimate{}});
}

TEST(Combinations, IteratedRules) {
  check("IEKF", jml::Iekf{});
  check("iterated JML", jml::IteratedJml{});
  check("iterated JML, Newton", jml::IteratedJml{{.method = jml::Iteration::newton}});
  check("iterated JML, Picard", jml::IteratedJml{{.method = jml::Iteration::picard}});
}

TEST(Combinations, Boxes) {
  check("linearised", jml::Linearised{});
  check("guaranteed", jml::Guaranteed{});
}

TEST(Combinations, FixedLag) { check("fixed lag", jml::FixedLag<4, 3>{{.sweeps = 20}}); }

// About the estimate the SDC matrices are the Jacobians: the one-pass rules are the EKF.
TEST(Combinations, AboutTheEstimateIsTheEkf) {
  const Flown ekf = fly_by<double, false>(jml::Ekf{});
  expect_near(ekf, fly_by<double, false>(jml::Jml{jml::AboutEstimate{}}), 1e-12, "JML");
  expect_near(ekf, fly_by<double, true>(jml::Sddre{jml::AboutEstimate{}}), 1e-12, "SDDRE");
}

/// Recorders: the same verbs, and an answer afterwards.
template <typename Scalar, bool own>
void record(Vector<double, 2>& smoothed, Vector<double, 2>& whole) {
  using D = models::CombinedStep<Scalar, own>;
  using S = models::CombinedSensor<Scalar, own, false>;
  const auto start = models::combined_start<Scalar>();
  jml::Smoother smoother{jml::Filter{jml::Ekf{}, D{}, start}, 30};
  jml::Batch batch{D{}, jml::sensors<jml::Part<S>>, start, {30}};
  const auto go = [](auto& recorder) {
    const S sensor;
    for (int k = 1; k <= 20; ++k) {
      const Scalar y = models::combined_y<Scalar>(k);
      if (k % 5 == 0) {
        EXPECT_TRUE(usable(recorder.predict()));
        EXPECT_TRUE(usable(recorder.update(sensor, y, jml::only(0))));
      } else {
        EXPECT_TRUE(usable(recorder.step(sensor, y, Scalar(0.05))));
      }
    }
  };
  go(smoother);
  go(batch);
  EXPECT_EQ(smoother.smooth(), jml::Status::ok);
  EXPECT_TRUE(usable(batch.solve().status));
  EXPECT_NEAR(smoother.time(20), batch.time(20), 1e-6);
  smoothed = smoother.x(7).template cast<double>();
  whole = batch.x(7).template cast<double>();
}

TEST(Combinations, Recorders) {
  Vector<double, 2> smoothed[4], whole[4];
  record<double, true>(smoothed[0], whole[0]);
  record<double, false>(smoothed[1], whole[1]);
  record<float, false>(smoothed[2], whole[2]);
  int recorded = 3;
#ifdef JML_BY_NIGHT
  record<float, true>(smoothed[recorded++], whole[3]);
#endif
  for (int i = 1; i < recorded; ++i) {
    EXPECT_LT((smoothed[i] - smoothed[0]).norm(), i == 1 ? 1e-9 : 1e-4) << i;
    EXPECT_LT((whole[i] - whole[0]).norm(), i == 1 ? 1e-7 : 1e-3) << i;
  }
}

}  // namespace
