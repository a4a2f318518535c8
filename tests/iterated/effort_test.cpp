// SPDX-License-Identifier: BSD-3-Clause
// One epoch of pseudoranges, from the centre of the Earth with P = 1e14 m² and R = 10 m²: sixteen digits of P
// are about to go. The answer is that of least squares, and an iteration that rounding keeps from its
// tolerance knows it.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <jml/campaign/noise.hpp>
#include <jml/interval/batch.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <jml/iterated/factored_iterated.hpp>
#include <jml/iterated/iterated.hpp>
#include <vector>

namespace {

constexpr int satellites = 7;
using V3 = jml::Vector<double, 3>;
using V4 = jml::Vector<double, 4>;
using Y = jml::Vector<double, satellites>;

struct Rest {
  static constexpr int states = 4, disturbances = 0;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 4> dynamics(const jml::Vector<T, 4>& x) const {
    return x;
  }
};

/// Distance and the clock's error, m.
struct Pseudoranges {
  static constexpr int measurements = satellites;
  jml::Matrix<double, 3, satellites> at;
  template <typename T>
  jml::Vector<T, satellites> measurement(const jml::Vector<T, 4>& x) const {
    using std::sqrt;
    jml::Vector<T, satellites> out;
    for (int i = 0; i < satellites; ++i) {
      const T a = x(0) - at(0, i), b = x(1) - at(1, i), c = x(2) - at(2, i);
      out(i) = sqrt(a * a + b * b + c * c) + x(3);
    }
    return out;
  }
  jml::Matrix<double, satellites, satellites> noise_covariance() const {
    return 10 * jml::Matrix<double, satellites, satellites>::Identity();
  }
};

/// Gauss-Newton by QR, without the prior, which says nothing beside them.
V4 least_squares(const Pseudoranges& sensor, const Y& y, V4 x) {
  for (int iteration = 0; iteration < 12; ++iteration) {
    Eigen::Matrix<double, satellites, 4> H;
    for (int i = 0; i < satellites; ++i)
      H.row(i) << (x.head<3>() - sensor.at.col(i)).normalized().transpose(), 1;
    x += H.colPivHouseholderQr().solve(y - sensor.measurement<double>(x));
  }
  return x;
}

struct Effort {
  std::vector<int> iterations;
  int refused = 0;
  double farthest = 0;  // from least squares, m
  template <typename Report>
  void note(const Report& report, int count, const V4& x, const V4& right) {
    refused += !jml::usable(report.status);
    iterations.push_back(count);
    farthest = std::max(farthest, (x - right).norm());
  }
  [[nodiscard]] int quantile(double share) {
    std::sort(iterations.begin(), iterations.end());
    return iterations[static_cast<std::size_t>(share * static_cast<double>(iterations.size() - 1))];
  }
};

TEST(Effort, S21PseudorangesFromTheCentreOfTheEarth) {
  jml::Noise noise(3);
  const auto direction = [&] {
    V3 out;
    for (int i = 0; i < 3; ++i) out(i) = noise.normal();
    return V3(out.normalized());
  };
  const jml::Estimate<double, 4> start{
      V4(V4::Zero()), jml::Matrix<double, 4, 4>(1e14 * jml::Matrix<double, 4, 4>::Identity())};
  Effort iekf, factored, iterated, lag, batch;
  for (int k = 0; k < 200; ++k) {
    const V3 up = direction();
    Pseudoranges sensor;
    for (int i = 0; i < satellites;) {
      const V3 to = direction();
      if (to.dot(up) < 0.5) continue;
      sensor.at.col(i++) = 26'560'000 * to;
    }
    V4 truth;
    truth << 6'371'000 * up, 300 * noise.normal();
    Y y = sensor.measurement<double>(truth);
    for (int i = 0; i < satellites; ++i) y(i) += std::sqrt(10) * noise.normal();
    const V4 right = least_squares(sensor, y, truth);
    const auto by = [&](const auto& method, Effort& effort) {
      jml::Filter filter{method, Rest{}, start};
      const auto report = filter.update(sensor, y);
      effort.note(report, report.iterations, filter.x(), right);
    };
    by(jml::Iekf{}, iekf);
    by(jml::Factored{jml::Iekf{}}, factored);
    by(jml::IteratedJml{}, iterated);
    jml::Filter window{jml::FixedLag<1>{{.sweeps = 20}}, Rest{}, jml::sensors<Pseudoranges>, start};
    const auto report = window.update(sensor, y);
    lag.note(report, report.sweeps, window.x(), right);
    jml::Batch whole{Rest{}, jml::sensors<Pseudoranges>, start, {.steps = 1}};
    ASSERT_EQ(whole.update(sensor, y).status, jml::Status::ok);
    const auto solved = whole.solve();
    batch.note(solved, solved.iterations, whole.x(0), right);
  }
  for (Effort* effort : {&iekf, &factored, &iterated, &lag, &batch}) {
    EXPECT_EQ(effort->refused, 0);
    EXPECT_LT(effort->farthest, 0.2);  // a deviation is 10 m and more
  }
  EXPECT_LE(iekf.quantile(1), 10);
  EXPECT_LE(factored.quantile(0.98), 10);
  EXPECT_LE(lag.quantile(0.97), 10);
  EXPECT_LE(batch.quantile(0.98), 10);
  EXPECT_LE(iterated.quantile(1), 10);
}

}  // namespace
