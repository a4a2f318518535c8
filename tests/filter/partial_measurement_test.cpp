// SPDX-License-Identifier: BSD-3-Clause
// A part of a measurement is the same as a sensor that has no more than these rows: in every method, with R that
// correlates what was measured with what was not.
#include <gtest/gtest.h>

#include <jml/jml.hpp>
#include <limits>

namespace {

using jml::Matrix, jml::Vector, jml::Status;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// A damped oscillator beside a random walk, a little nonlinear where `bent`.
template <bool bent>
struct Motion {
  static constexpr int states = 3;
  static constexpr bool linear = !bent;
  template <typename T>
  Vector<T, 3> dynamics(const Vector<T, 3>& x) const {
    Vector<T, 3> next{x(0) + 0.1 * x(1), x(1) - 0.1 * x(0) - 0.05 * x(1), x(2)};
    if constexpr (bent) next(1) -= 0.02 * x(0) * x(0) * x(0);
    return next;
  }
  Matrix<double, 3, 3> disturbance_covariance() const {
    return Vector<double, 3>(1e-3, 2e-2, 1e-2).asDiagonal();
  }
  Vector<double, 3> disturbance_bound() const { return {1e-3, 2e-2, 1e-2}; }
};

/// Row `row` of what the sensors see.
template <bool bent, typename T>
T seen(const Vector<T, 3>& x, int row) {
  if (row == 0) return bent ? T(x(0) + 0.1 * x(0) * x(0)) : x(0);
  if (row == 1) return x(0) + 2.0 * x(2);
  return x(1) - x(2);
}
Matrix<double, 3, 3> full_noise() {
  Matrix<double, 3, 3> R;
  R << 0.04, 0.01, -0.005, 0.01, 0.09, 0.02, -0.005, 0.02, 0.02;
  return R;
}

/// The rows named, as a sensor of its own: the oracle. All three: the sensor of which parts are measured.
template <bool bent, int... rows>
struct Seen {
  static constexpr int measurements = sizeof...(rows);
  static constexpr bool linear = !bent;
  template <typename T>
  Vector<T, measurements> measurement(const Vector<T, 3>& x) const {
    Vector<T, measurements> y;
    int i = 0;
    ((y(i++) = seen<bent>(x, rows)), ...);
    return y;
  }
  Matrix<double, measurements, measurements> noise_covariance() const {
    constexpr int row[] = {rows...};
    Matrix<double, measurements, measurements> R;
    for (int i = 0; i < measurements; ++i) {
      for (int j = 0; j < measurements; ++j) R(i, j) = full_noise()(row[i], row[j]);
    }
    return R;
  }
  Vector<double, measurements> noise_bound() const {
    constexpr double bound[] = {0.2, 0.3, 0.15};
    return Vector<double, measurements>(bound[rows]...);
  }
};
template <bool bent>
using All = Seen<bent, 0, 1, 2>;

const jml::Estimate<double, 3> start{Vector<double, 3>(0.3, -0.2, 0.5),
                                     Matrix<double, 3, 3>(Vector<double, 3>(0.2, 0.3, 0.4).asDiagonal())};
const Vector<double, 3> y(0.5, 1.2, -0.9);

template <int... rows, typename Report, typename Wanted>
void same_report(const Report& part, const Wanted& own) {
  ASSERT_EQ(part.status, own.status);
  EXPECT_EQ(part.degrees, int(sizeof...(rows)));
  EXPECT_NEAR(part.nis(), own.nis(), 1e-11 * (1 + own.nis()));
  EXPECT_NEAR(part.log_likelihood(), own.log_likelihood(), 1e-11 * (1 + std::abs(own.log_likelihood())));
  const int row[] = {rows...};
  for (int i = 0; i < int(sizeof...(rows)); ++i) EXPECT_NEAR(part.innovation(row[i]), own.innovation(i), 1e-13);
}

/// update(), step() and the sensor adaptor, with NaN where nothing was measured.
template <bool bent, int... rows, typename Rule>
void check(const Rule& rule) {
  SCOPED_TRACE(::testing::Message() << "rows" << ::testing::PrintToString(std::array{rows...}));
  jml::Filter part{rule, Motion<bent>{}, start}, own = part;
  Vector<double, 3> given = Vector<double, 3>::Constant(nan);
  ((given(rows) = y(rows)), ...);
  const Vector<double, sizeof...(rows)> few(y(rows)...);
  const All<bent> sensor;
  const Seen<bent, rows...> small;
  for (int k = 0; k < 3; ++k) {
    same_report<rows...>(part.update(sensor, given, jml::only(rows...)), own.update(small, few));
    same_report<rows...>(part.step(jml::part(sensor, jml::finite_rows(given)), given), own.step(small, few));
    EXPECT_LT((part.x() - own.x()).norm(), 1e-11);
    EXPECT_LT((part.P() - own.P()).norm(), 1e-11);
  }
}
template <bool bent, typename Rule>
void check_rows(const Rule& rule) {
  check<bent, 0>(rule);
  check<bent, 2>(rule);
  check<bent, 0, 2>(rule);
  check<bent, 1, 2>(rule);
}

TEST(PartialMeasurement, IsTheMarginalOneForEveryRule) {
  check_rows<false>(jml::Kalman{});
  check_rows<true>(jml::Ekf{});
  check_rows<true>(jml::Sddre{});
  check_rows<true>(jml::Jml{});
  check_rows<true>(jml::Iekf{});
  check_rows<true>(jml::IteratedJml{});
}

// log N(ν; 0, S) written out for two rows.
TEST(LogLikelihood, IsThatOfTheNormalDistribution) {
  jml::Filter filter{jml::Kalman{}, Motion<false>{}, start};
  const auto report = filter.update(Seen<false, 0, 2>{}, Vector<double, 2>(y(0), y(2)));
  const Matrix<double, 2, 2>& S = report.innovation_matrix;
  const double det = S(0, 0) * S(1, 1) - S(0, 1) * S(1, 0), a = report.innovation(0), b = report.innovation(1);
  const double nis = (S(1, 1) * a * a - 2 * S(0, 1) * a * b + S(0, 0) * b * b) / det;
  EXPECT_NEAR(S(0, 0), start.P(0, 0) + 0.04, 1e-15);
  EXPECT_NEAR(S(1, 1), start.P(1, 1) + start.P(2, 2) + 0.02, 1e-15);
  EXPECT_NEAR(report.nis(), nis, 1e-13);
  EXPECT_NEAR(report.log_likelihood(), -0.5 * nis - std::log(2 * 3.14159265358979324 * std::sqrt(det)), 1e-13);
}

// Of a rejected measurement too.
TEST(LogLikelihood, IsThereWhereTheGateRejects) {
  jml::Filter filter{jml::Ekf{}, Motion<true>{}, start};
  filter.gate.probability = 0.9;
  const auto report = filter.update(Seen<true, 0>{}, 100.0);
  EXPECT_EQ(report.gate, jml::Verdict::rejected);
  const double s = report.innovation_matrix(0, 0), nu = report.innovation(0);
  EXPECT_GT(nu, 90);
  EXPECT_NEAR(report.nis(), nu * nu / s, 1e-9 * nu * nu / s);
  EXPECT_TRUE(std::isfinite(report.log_likelihood()));
}

TEST(PartialMeasurement, NumberKnownAtRunTime) {
  jml::Filter part{jml::Ekf{}, Motion<true>{}, start}, own = part;
  same_report<0>(part.update(All<true>{}, y, jml::first(1)), own.update(Seen<true, 0>{}, y(0)));
  same_report<0, 1>(part.update(All<true>{}, y, jml::first(2)), own.update(Seen<true, 0, 1>{}, y.head<2>()));
  same_report<0, 1, 2>(part.update(All<true>{}, y, jml::first(3)), own.update(All<true>{}, y));
  EXPECT_LT((part.P() - own.P()).norm(), 1e-13);
}

TEST(PartialMeasurement, NothingMeasuredIsNothingLearnt) {
  jml::Filter filter{jml::Ekf{}, Motion<true>{}, start};
  const auto report = filter.update(All<true>{}, Vector<double, 3>::Constant(nan), jml::first(0));
  EXPECT_EQ(report.status, Status::ok);
  EXPECT_EQ(report.degrees, 0);
  EXPECT_EQ(report.nis(), 0);
  EXPECT_EQ(report.log_likelihood(), 0);
  EXPECT_EQ(filter.x(), start.x);
  EXPECT_LT((filter.P() - start.P).norm(), 1e-16);
}

TEST(PartialMeasurement, ANaNThatNobodyAnnouncedIsRefused) {
  jml::Filter filter{jml::Ekf{}, Motion<true>{}, start};
  const Vector<double, 3> bad(0.5, nan, -0.9);
  EXPECT_EQ(filter.update(All<true>{}, bad).status, Status::invalid_measurement);
  EXPECT_EQ(filter.update(All<true>{}, bad, jml::only(0, 1)).status, Status::invalid_measurement);
  EXPECT_EQ(filter.update(All<true>{}, bad, jml::only(0, 3)).status, Status::invalid_measurement) << "no such row";
  EXPECT_EQ(filter.update(All<true>{}, bad, jml::only(-1)).status, Status::invalid_measurement);
  EXPECT_EQ(filter.step(jml::part(All<true>{}, jml::only(64)), bad).status, Status::invalid_measurement);
  EXPECT_EQ(filter.x(), start.x);
  EXPECT_EQ(filter.update(All<true>{}, bad, jml::finite_rows(bad)).status, Status::ok);
}

// 6.6 is beyond the 99 % quantile of one degree of freedom, 6.63, by a little less, and far within that of three, 11.3.
TEST(PartialMeasurement, GateHasTheDegreesThatWereMeasured) {
  for (const double nis : {6.5, 6.8}) {
    jml::Filter filter{jml::Ekf{}, Motion<false>{}, start};
    filter.gate.probability = 0.99;
    const double deviation = std::sqrt(nis * (start.P(0, 0) + 0.04));
    const auto report =
        filter.update(All<false>{}, Vector<double, 3>(start.x(0) + deviation, nan, nan), jml::only(0));
    EXPECT_NEAR(report.nis(), nis, 1e-12);
    EXPECT_EQ(report.gate, nis > 6.64 ? jml::Verdict::rejected : jml::Verdict::accepted) << nis;
  }
}

TEST(PartialMeasurement, Boxes) {
  const jml::Box<double, 3> box{Vector<double, 3>(-1, -1, -1), Vector<double, 3>(1, 1, 1)};
  const auto compare = [&](const auto& rule) {
    jml::Filter part{rule, Motion<true>{}, box}, own = part;
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(part.update(All<true>{}, y, jml::only(1)).status, own.update(Seen<true, 1>{}, y(1)).status);
      EXPECT_EQ(part.step(jml::part(All<true>{}, jml::only(0, 2)), y).status,
                own.step(Seen<true, 0, 2>{}, Vector<double, 2>(y(0), y(2))).status);
      EXPECT_LT((part.box().lower - own.box().lower).norm(), 1e-12);
      EXPECT_LT((part.box().upper - own.box().upper).norm(), 1e-12);
    }
  };
  compare(jml::Linearised{});
  compare(jml::Guaranteed{});
}

/// A sensor of which one channel is dead: neither its value nor its noise means anything.
struct Dying : All<true> {
  Matrix<double, 3, 3> noise_covariance() const {
    Matrix<double, 3, 3> R = full_noise();
    R.row(1).setConstant(nan);
    R.col(1).setConstant(nan);
    return R;
  }
  Vector<double, 3> noise_bound() const { return {0.2, nan, 0.15}; }
};
TEST(PartialMeasurement, NothingIsReadOfADeadRow) {
  const Vector<double, 3> given(y(0), nan, y(2));
  const Vector<double, 2> few(y(0), y(2));
  jml::Filter part{jml::Ekf{}, Motion<true>{}, start}, own = part;
  EXPECT_EQ(part.update(Dying{}, y), Status::invalid_noise_covariance);
  same_report<0, 2>(part.update(Dying{}, given, jml::only(0, 2)), own.update(Seen<true, 0, 2>{}, few));
  EXPECT_LT((part.P() - own.P()).norm(), 1e-13);
  const jml::Box<double, 3> box{Vector<double, 3>(-1, -1, -1), Vector<double, 3>(1, 1, 1)};
  const auto boxes = [&](const auto& rule) {
    jml::Filter a{rule, Motion<true>{}, box}, b = a;
    EXPECT_EQ(a.update(Dying{}, given, jml::only(0, 2)).status, b.update(Seen<true, 0, 2>{}, few).status);
    EXPECT_LT((a.box().lower - b.box().lower).norm() + (a.box().upper - b.box().upper).norm(), 1e-12);
  };
  boxes(jml::Linearised{});
  boxes(jml::Guaranteed{});
}

// A list that names Part<S> makes room for S too.
TEST(PartialMeasurement, WindowAndBatch) {
  const All<true> sensor;
  jml::Filter part{jml::FixedLag<4>{}, Motion<true>{}, jml::sensors<jml::Part<All<true>>>, start};
  jml::Filter own{jml::FixedLag<4>{}, Motion<true>{}, jml::sensors<Seen<true, 0, 2>, All<true>>, start};
  jml::Batch parts{Motion<true>{}, jml::sensors<jml::Part<All<true>>>, start, {10}};
  jml::Batch whole{Motion<true>{}, jml::sensors<Seen<true, 0, 2>, All<true>>, start, {10}};
  for (int k = 0; k < 8; ++k) {
    const Vector<double, 3> now = y + 0.1 * Vector<double, 3>(std::sin(k), std::cos(k), std::sin(2 * k));
    if (k % 2 == 0) {
      EXPECT_TRUE(jml::usable(part.step(sensor, now)));
      EXPECT_TRUE(jml::usable(own.step(sensor, now)));
      EXPECT_EQ(parts.step(sensor, now), Status::ok);
      EXPECT_EQ(whole.step(sensor, now), Status::ok);
    } else {
      const Seen<true, 0, 2> small;
      const Vector<double, 2> few(now(0), now(2));
      EXPECT_TRUE(jml::usable(part.step(jml::part(sensor, jml::only(0, 2)), Vector<double, 3>(now(0), nan, now(2)))));
      EXPECT_TRUE(jml::usable(own.step(small, few)));
      EXPECT_EQ(parts.predict(), Status::ok);
      EXPECT_EQ(parts.update(sensor, Vector<double, 3>(now(0), nan, now(2)), jml::only(0, 2)), Status::ok);
      EXPECT_EQ(whole.step(small, few), Status::ok);
    }
    EXPECT_LT((part.x() - own.x()).norm(), 1e-11) << k;
    EXPECT_LT((part.P() - own.P()).norm(), 1e-11) << k;
  }
  const auto a = parts.solve(), b = whole.solve();
  EXPECT_EQ(a.status, Status::ok);
  EXPECT_NEAR(a.cost, b.cost, 1e-12 * b.cost);
  for (int k = 0; k <= 8; ++k) EXPECT_LT((parts.x(k) - whole.x(k)).norm(), 1e-9) << k;
}

}  // namespace
