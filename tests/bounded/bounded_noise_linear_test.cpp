// SPDX-License-Identifier: BSD-3-Clause
// The bounded-noise estimator on linear systems: against the source's algorithm written out with its decision
// matrices, against the vertices of the boxes, and against exact polytopes.
#include <gtest/gtest.h>

#include <jml/bounded/bounded_noise.hpp>
#include <vector>

#include "models/bounded.hpp"

namespace {

using namespace jml::operators;

using jml::Box, jml::Filter, jml::Guaranteed, jml::Linearised, jml::Status, jml::usable;
using Vector1 = jml::Vector<double, 1>;
using Vector2 = jml::Vector<double, 2>;
constexpr double inf = std::numeric_limits<double>::infinity();

/// Eqs. (2.17)-(2.34) literally, with |G| ū for G ū and the sign of (3.31) before F⁻. H is n×n, of zeros and
/// ones on the diagonal; y and b stand in the places of the measured states.
template <int n, int q>
struct DecisionMatrices {
  using X = jml::Vector<double, n>;
  using Square = jml::Matrix<double, n, n>;
  Square F;
  jml::Matrix<double, n, q> G;
  jml::Vector<double, q> u;
  Square H = Square::Zero();
  X x = X::Zero(), upper = X::Zero(), lower = X::Zero(), variance = X::Zero();  // x̂(i), d(i), c(i), E(i)
  int decisions[4] = {};  // 2 Kc + Kd of each measured state

  void step(const X& y, const X& b) {
    const Square I = Square::Identity();
    Square F_plus = Square::Zero(), F_minus = Square::Zero(), Kc = Square::Zero(), Kd = Square::Zero();
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) (F(i, j) > 0 ? F_plus : F_minus)(i, j) = F(i, j);
    }
    const X delta = upper - x, nominal = F * x;
    const X spread = F_plus * delta - F_minus * delta + G.cwiseAbs() * u;
    const X first_lower = nominal - spread, first_upper = nominal + spread;  // c', d'
    for (int j = 0; j < n; ++j) {
      if (H(j, j) == 0) continue;
      Kc(j, j) = y(j) <= first_lower(j) + b(j) ? 1 : 0;  // (2.17)
      Kd(j, j) = y(j) >= first_upper(j) - b(j) ? 1 : 0;  // (2.18)
      ++decisions[static_cast<int>(2 * Kc(j, j) + Kd(j, j))];
    }
    lower = (I - H) * first_lower + Kc * H * first_lower + (I - Kc) * H * (y - b);  // (2.29)
    upper = (I - H) * first_upper + Kd * H * first_upper + (I - Kd) * H * (y + b);  // (2.30)
    x = (I - H) * nominal + 0.5 * (Kd + Kc) * nominal + 0.5 * (Kd - Kc) * spread +
        0.5 * (I - Kc) * H * (y - b) + 0.5 * (I - Kd) * H * (y + b);  // (2.33)
    variance = (upper - lower).cwiseAbs2() / 12;                      // (2.34)
  }
};

/// Random stable systems of which the states `measured` are measured.
template <int n, int q, int p>
void source_algorithm(const jml::Vector<int, p>& measured, std::uint64_t seed) {
  SCOPED_TRACE(seed);
  jml::Noise noise(seed);
  int decisions[4] = {};
  for (int run = 0; run < 20; ++run) {
    const auto random = models::random_linear_dynamics<n, q>(noise);
    jml::Vector<double, q> u;
    for (int j = 0; j < q; ++j) u(j) = noise.uniform(0.05, 1);
    const models::BoundedLinear<n, q> plant(random.F, random.G, u);
    jml::Matrix<double, p, n> rows = jml::Matrix<double, p, n>::Zero();
    jml::Vector<double, p> b;
    DecisionMatrices<n, q> source{.F = random.F, .G = random.G, .u = u};
    for (int j = 0; j < p; ++j) {
      rows(j, measured(j)) = source.H(measured(j), measured(j)) = 1;
      b(j) = std::exp(noise.uniform(-3, 3));
    }
    const models::BoundedLinearSensor<n, p> sensor(rows, b);
    Box<double, n> box;
    for (int i = 0; i < n; ++i) {
      box.lower(i) = noise.uniform(-2, 1);
      box.upper(i) = box.lower(i) + noise.uniform(0, 2);
    }
    source.x = box.centre();
    source.upper = box.upper;
    Filter filter{Linearised{}, plant, box};
    jml::Vector<double, n> truth = models::point_of(box, noise);
    for (int k = 0; k < 100; ++k) {
      truth = plant.F * truth + plant.G * models::within(u, noise);
      const jml::Vector<double, p> y = rows * truth + models::within(b, noise);
      source.step(rows.transpose() * y, rows.transpose() * b);
      ASSERT_EQ(filter.step(sensor, y).status, Status::ok);
      // To 1e-12 of the widths, which reach hundreds: each step rounds outward by some ε, and F forgets
      // slowly.
      const double near = 1e-12 * (1 + source.upper.maxCoeff() - source.lower.minCoeff());
      ASSERT_LT((filter.x() - source.x).cwiseAbs().maxCoeff(), near) << k;
      ASSERT_LT((filter.box().lower - source.lower).cwiseAbs().maxCoeff(), near) << k;
      ASSERT_LT((filter.box().upper - source.upper).cwiseAbs().maxCoeff(), near) << k;
      ASSERT_LT((filter.box().error_variance() - source.variance).cwiseAbs().maxCoeff(), near * near * 1e12) << k;
      ASSERT_TRUE(filter.box().contains(truth)) << k;
    }
    for (int i = 0; i < 4; ++i) decisions[i] += source.decisions[i];
  }
  for (const int count : decisions) EXPECT_GT(count, 20);  // each of the four cases was met
}
TEST(BoundedNoiseLinear, SourceAlgorithmTwoStates) {
  source_algorithm<2, 1, 1>(jml::Vector<int, 1>(0), 1);
  source_algorithm<2, 2, 1>(jml::Vector<int, 1>(1), 2);
  source_algorithm<2, 2, 2>(jml::Vector<int, 2>(1, 0), 3);
}
TEST(BoundedNoiseLinear, SourceAlgorithmThreeStates) {
  source_algorithm<3, 2, 1>(jml::Vector<int, 1>(1), 4);
  source_algorithm<3, 2, 2>(jml::Vector<int, 2>(0, 2), 5);
}

// Example 2 of the source: its own plant.
TEST(BoundedNoiseLinear, SecondOrderPlant) {
  const auto plant = models::second_order_plant();
  const auto sensor = models::first_state();
  const Box<double, 2> box{Vector2(-1.5, -1), Vector2(1.5, 1)};
  DecisionMatrices<2, 1> source{.F = plant.F, .G = plant.G, .u = plant.bound};
  source.upper = box.upper;
  source.H << 1, 0, 0, 0;
  Filter filter{Linearised{}, plant, box};
  Filter guaranteed{Guaranteed{}, plant, box};
  jml::Noise noise(6);
  Vector2 truth(0.3, -0.2);
  for (int k = 0; k < 200; ++k) {
    truth = plant.F * truth + plant.G * models::within(plant.bound, noise);
    const Vector1 y(truth(0) + noise.uniform(-1, 1));
    source.step(Vector2(y(0), 0), Vector2(1, 0));
    ASSERT_EQ(filter.step(sensor, y).status, Status::ok);
    ASSERT_EQ(guaranteed.step(sensor, y).status, Status::ok);
    ASSERT_LT((filter.box().lower - source.lower).cwiseAbs().maxCoeff(), 1e-12) << k;
    ASSERT_LT((filter.box().upper - source.upper).cwiseAbs().maxCoeff(), 1e-12) << k;
    // The guaranteed box has the truth too, and is never the wider one.
    ASSERT_TRUE(guaranteed.box().contains(truth)) << k;
    ASSERT_LT((filter.box().lower - guaranteed.box().lower).maxCoeff(), 1e-12) << k;
    ASSERT_LT((guaranteed.box().upper - filter.box().upper).maxCoeff(), 1e-12) << k;
  }
}

/// The smallest box around A x + G w over all vertices of `box` and |w| ≤ u, plus `shift`.
template <int n, int q>
Box<double, n> image_of_vertices(const jml::Matrix<double, n, n>& A, const jml::Vector<double, n>& shift,
                                 const jml::Matrix<double, n, q>& G, const Box<double, n>& box,
                                 const jml::Vector<double, q>& u) {
  Box<double, n> out{jml::Vector<double, n>::Constant(inf), jml::Vector<double, n>::Constant(-inf)};
  for (int vertex = 0; vertex < 1 << (n + q); ++vertex) {
    jml::Vector<double, n> x;
    jml::Vector<double, q> w;
    for (int i = 0; i < n; ++i) x(i) = vertex >> i & 1 ? box.upper(i) : box.lower(i);
    for (int j = 0; j < q; ++j) w(j) = vertex >> (n + j) & 1 ? u(j) : -u(j);
    const jml::Vector<double, n> image = shift + A * x + G * w;
    out.lower = out.lower.cwiseMin(image);
    out.upper = out.upper.cwiseMax(image);
  }
  return out;
}

template <int n>
void expect_same(const Box<double, n>& box, const Box<double, n>& wanted, double tolerance) {
  EXPECT_LT((box.lower - wanted.lower).cwiseAbs().maxCoeff(), tolerance);
  EXPECT_LT((box.upper - wanted.upper).cwiseAbs().maxCoeff(), tolerance);
}

// (3.7)-(3.8): exact for a linear model, whatever the signs of F and G; sides up to 10, a few roundings each.
TEST(BoundedNoiseLinear, PredictedBoxIsThatOfAllVertices) {
  jml::Noise noise(7);
  int negative = 0;
  for (int run = 0; run < 200; ++run) {
    const jml::Matrix<double, 3, 3> F = models::random_matrix<3, 3>(noise);
    const jml::Matrix<double, 3, 2> G = models::random_matrix<3, 2>(noise);
    negative += static_cast<int>((G.array() < 0).count());
    const Vector2 u(noise.uniform(), noise.uniform());
    const models::BoundedLinear<3, 2> plant(F, G, u);
    Box<double, 3> box;
    for (int i = 0; i < 3; ++i) {
      box.lower(i) = noise.uniform(-2, 2);
      box.upper(i) = box.lower(i) + noise.uniform(0, 2);
    }
    const auto wanted = image_of_vertices<3, 2>(F, jml::Vector<double, 3>::Zero(), G, box, u);
    Filter linearised{Linearised{}, plant, box};
    Filter guaranteed{Guaranteed<0>{}, plant, box};
    ASSERT_EQ(linearised.predict(), Status::ok);
    ASSERT_EQ(guaranteed.predict(), Status::ok);
    expect_same(linearised.box(), wanted, 4e-14);
    expect_same(guaranteed.box(), wanted, 4e-14);
  }
  EXPECT_GT(negative, 300);
}

// Of a nonlinear model the vertices of its linearisation at the centre.
TEST(BoundedNoiseLinear, PredictedBoxOfALinearisation) {
  const models::BoundedPendulum plant{{.dt = 0.2}};
  const Box<double, 2> box{Vector2(0.4, -1.5), Vector2(1.2, 0.5)};
  const Vector2 x(0.8, -0.5);
  jml::Matrix<double, 2, 2> A;
  const double slope = -0.2 * 9.80665 * std::cos(0.8);
  A << 1 + 0.2 * slope, 0.2 * 0.98, slope, 0.98;
  const double rate = 0.98 * -0.5 - 0.2 * 9.80665 * std::sin(0.8);
  const Vector2 f(0.8 + 0.2 * rate, rate);
  Filter filter{Linearised{}, plant, box};
  ASSERT_EQ(filter.predict(), Status::ok);
  const auto wanted =
      image_of_vertices<2, 1>(A, f - A * x, Vector2(0.04, 0.2), box, Vector1(std::sqrt(0.15)));
  expect_same(filter.box(), wanted, 1e-13);
  EXPECT_LT((filter.x() - f).norm(), 1e-15);
}

/// x⁺ = 0.5 x + 0.25 control + w, its bound a function of time, dt, control and state.
struct Varying {
  static constexpr int states = 1, disturbances = 1, controls = 1;
  static constexpr bool linear = true;
  template <typename T, typename At>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x, const At& at) const {
    return jml::Vector<T, 1>(0.5 * x(0) + 0.25 * at.control(0));
  }
  template <typename At>
  Vector1 disturbance_bound(const Vector1& x, const At& at) const {
    return Vector1(at.time + 100 * at.dt + 10 * at.control(0) * at.control(0) + 0.125 * std::abs(x(0)));
  }
};
struct VaryingReading {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  template <typename At>
  Vector1 noise_bound(const Vector1&, const At& at) const {
    return Vector1(at.time / 4 + at.dt + at.control(0));
  }
};

template <typename Rule>
void varying_bounds(const Rule& rule) {
  Filter filter{rule, Varying{}, Box{Vector1(8.0), Vector1(16.0)}, 3.0};
  ASSERT_EQ(filter.predict(0.25, Vector1(2.0)), Status::ok);
  // 6 + 0.5 ± (2 + 3 + 25 + 40 + 1.5): the bound is read at the start of the step.
  expect_same(filter.box(), Box<double, 1>{Vector1(-65.0), Vector1(78.0)}, 1e-12);
  EXPECT_EQ(filter.time(), 3.25);
  // update(): at the present time, dt 0, the control of the last step: 0.8125 + 2.
  ASSERT_EQ(filter.update(VaryingReading{}, 5.0).status, Status::ok);
  expect_same(filter.box(), Box<double, 1>{Vector1(2.1875), Vector1(7.8125)}, 1e-12);
  // step(): the sensor's bound at its end, 3.75 / 4 + 0.5 + 1 about 2; before it ±(3.25 + 50 + …).
  ASSERT_EQ(filter.step(VaryingReading{}, Vector1(2.0), 0.5, Vector1(1.0)).status, Status::ok);
  expect_same(filter.box(), Box<double, 1>{Vector1(-0.4375), Vector1(4.4375)}, 1e-12);
}
TEST(BoundedNoiseLinear, BoundsThatVary) {
  varying_bounds(Linearised{});
  varying_bounds(Guaranteed<0>{});
}

/// The smallest box around {x in box : low ≤ h x ≤ high}: its vertices are those of the box inside the strip,
/// and where an edge of the box meets a side of it.
template <int n>
Box<double, n> hull_of_strip(const Box<double, n>& box, const jml::Vector<double, n>& h, double low,
                             double high) {
  Box<double, n> out{jml::Vector<double, n>::Constant(inf), jml::Vector<double, n>::Constant(-inf)};
  const auto add = [&out](const jml::Vector<double, n>& x) {
    out.lower = out.lower.cwiseMin(x);
    out.upper = out.upper.cwiseMax(x);
  };
  for (int vertex = 0; vertex < 1 << n; ++vertex) {
    jml::Vector<double, n> x;
    for (int i = 0; i < n; ++i) x(i) = vertex >> i & 1 ? box.upper(i) : box.lower(i);
    const double at = h.dot(x);
    if (low <= at && at <= high) add(x);
    for (int edge = 0; edge < n; ++edge) {
      if (h(edge) == 0) continue;
      for (const double side : {low, high}) {
        jml::Vector<double, n> crossing = x;
        crossing(edge) += (side - at) / h(edge);
        if (box.lower(edge) <= crossing(edge) && crossing(edge) <= box.upper(edge)) add(crossing);
      }
    }
  }
  return out;
}

template <typename Rule, int n>
void combining_rows(const Rule& rule, std::uint64_t seed) {
  jml::Noise noise(seed);
  int cut = 0;
  for (int run = 0; run < 500; ++run) {
    jml::Vector<double, n> h = models::random_matrix<n, 1>(noise);
    if (run % 5 == 0) h(run / 5 % n) = 0;
    if (run % 5 == 1) h.setOnes();  // the sum of the states
    const Vector1 b(noise.uniform(0.01, 0.5));
    const models::BoundedLinearSensor<n, 1> sensor(h.transpose(), b);
    const models::BoundedLinear<n, 1> plant(jml::Matrix<double, n, n>::Identity(),
                                            jml::Vector<double, n>::Zero(), Vector1(1.0));
    Box<double, n> box;
    for (int i = 0; i < n; ++i) {
      box.lower(i) = noise.uniform(-2, 2);
      box.upper(i) = box.lower(i) + noise.uniform(0, 2);
    }
    const Vector1 y(h.dot(models::point_of(box, noise, run % 2 == 0)) + noise.uniform(-b(0), b(0)));
    Filter filter{rule, plant, box};
    ASSERT_EQ(filter.update(sensor, y).status, Status::ok);
    const auto wanted = hull_of_strip<n>(box, h, y(0) - b(0), y(0) + b(0));
    // Sides up to 5; that of the strip over a small entry of h has rounding of the size of ε/|h|.
    double smallest = 1;
    for (int i = 0; i < n; ++i) smallest = h(i) == 0 ? smallest : std::min(smallest, std::abs(h(i)));
    expect_same(filter.box(), wanted, 1e-13 / smallest);
    cut += wanted.width().sum() < 0.9 * box.width().sum();
  }
  EXPECT_GT(cut, 200);
}
TEST(BoundedNoiseLinear, RowThatCombinesStates) {
  combining_rows<Linearised, 2>({}, 8);
  combining_rows<Linearised, 3>({}, 9);
  combining_rows<Guaranteed<>, 2>({}, 8);
  combining_rows<Guaranteed<0>, 3>({}, 9);
}

// Several rows at once: no point that honours them all is lost, and each alone is honoured as above.
TEST(BoundedNoiseLinear, SeveralRowsLoseNothing) {
  jml::Noise noise(10);
  int kept = 0;
  for (int run = 0; run < 100; ++run) {
    const jml::Matrix<double, 3, 3> M = models::random_matrix<3, 3>(noise);
    const jml::Vector<double, 3> b = jml::Vector<double, 3>::Constant(0.3);
    const models::BoundedLinearSensor<3, 3> sensor(M, b);
    const models::BoundedLinear<3, 1> plant(jml::Matrix<double, 3, 3>::Identity(),
                                            jml::Vector<double, 3>::Zero(), Vector1(1.0));
    const Box<double, 3> box{jml::Vector<double, 3>(-1, -2, -1), jml::Vector<double, 3>(2, 1, 1)};
    const jml::Vector<double, 3> y = M * models::point_of(box, noise) + models::within(b, noise);
    Filter linearised{Linearised{}, plant, box};
    Filter guaranteed{Guaranteed<0>{}, plant, box};
    ASSERT_EQ(linearised.update(sensor, y).status, Status::ok);
    ASSERT_EQ(guaranteed.update(sensor, y).status, Status::ok);
    for (int i = 0; i < 3; ++i) {
      const auto alone = hull_of_strip<3>(box, M.row(i).transpose(), y(i) - b(i), y(i) + b(i));
      ASSERT_GE((linearised.box().lower - alone.lower).minCoeff(), -1e-12);
      ASSERT_LE((linearised.box().upper - alone.upper).maxCoeff(), 1e-12);
    }
    for (int k = 0; k < 1000; ++k) {
      const jml::Vector<double, 3> x = models::point_of(box, noise);
      if (((M * x - y).cwiseAbs() - b).maxCoeff() > 0) continue;
      ++kept;
      ASSERT_TRUE(linearised.box().contains(x));
      ASSERT_TRUE(guaranteed.box().contains(x));
    }
  }
  EXPECT_GT(kept, 2000);
}

template <typename Rule>
void without_prior(const Rule& rule) {
  const auto plant = models::second_order_plant();
  const models::BoundedLinearSensor<2, 1> other({0, 2}, Vector1(0.5));
  Filter filter{rule, plant};
  EXPECT_EQ(filter.status(), Status::ok);
  EXPECT_TRUE(filter.x().array().isNaN().all());
  EXPECT_EQ(filter.predict(), Status::state_unbounded);
  EXPECT_EQ(filter.step(models::first_state(), 3.0).status, Status::state_unbounded);
  // (2.13), (2.16): [y - b, y + b].
  EXPECT_EQ(filter.update(models::first_state(), 3.0).status, Status::ok);
  EXPECT_NEAR(filter.box().lower(0), 2, 1e-13);
  EXPECT_NEAR(filter.box().upper(0), 4, 1e-13);
  EXPECT_EQ(filter.box().lower(1), -inf);
  EXPECT_EQ(filter.box().upper(1), inf);
  EXPECT_EQ(filter.predict(), Status::state_unbounded);
  EXPECT_EQ(filter.step(models::first_state(), 3.0).status, Status::state_unbounded);
  EXPECT_EQ(filter.time(), 0);
  // 2 x₂ = 5 ± 0.5.
  EXPECT_EQ(filter.update(other, 5.0).status, Status::ok);
  EXPECT_NEAR(filter.box().lower(1), 2.25, 1e-13);
  EXPECT_NEAR(filter.box().upper(1), 2.75, 1e-13);
  EXPECT_NEAR(filter.box().lower(0), 2, 1e-13);
  EXPECT_EQ(filter.predict(), Status::ok);
  EXPECT_EQ(filter.update(models::first_state(), filter.x()(0)).status, Status::ok);

  // One sum cannot bound two states; with one of them known it bounds the other.
  const models::BoundedLinearSensor<2, 1> sum({1, 1}, Vector1(0.5));
  Filter of_sum{rule, plant};
  EXPECT_EQ(of_sum.update(sum, 5.0).status, Status::ok);
  EXPECT_EQ(of_sum.box().upper, Vector2(inf, inf));
  EXPECT_EQ(of_sum.box().lower, Vector2(-inf, -inf));
  EXPECT_EQ(of_sum.update(models::first_state(), 3.0).status, Status::ok);
  EXPECT_EQ(of_sum.update(sum, 5.0).status, Status::ok);
  expect_same(of_sum.box(), Box<double, 2>{Vector2(2, 0.5), Vector2(4, 3.5)}, 1e-13);
}
TEST(BoundedNoiseLinear, WithoutPriorBox) {
  without_prior(Linearised{});
  without_prior(Guaranteed{});
}

template <typename Rule>
void half_infinite(const Rule& rule) {
  const auto plant = models::second_order_plant();
  const models::BoundedLinearSensor<2, 1> sum({1, 1}, Vector1(0.5));
  // x₁ ≥ 5, x₂ ≤ -2, and x₁ + x₂ = 4 ± 0.5: x₁ = 4.5 - x₂ ≥ 6.5 ≥ … nothing more is known.
  Filter filter{rule, plant, Box<double, 2>{Vector2(5, -inf), Vector2(inf, -2)}};
  EXPECT_EQ(filter.status(), Status::ok);
  EXPECT_EQ(filter.update(sum, 4.0).status, Status::ok);
  EXPECT_NEAR(filter.box().lower(0), 5.5, 1e-13);
  EXPECT_EQ(filter.box().upper(0), inf);
  EXPECT_EQ(filter.box().lower(1), -inf);
  EXPECT_EQ(filter.box().upper(1), -2);
  EXPECT_EQ(filter.predict(), Status::state_unbounded);
  // x₁ = 8 ± 1, so x₂ in [3.5 - 9, 4.5 - 7].
  EXPECT_EQ(filter.update(models::first_state(), 8.0).status, Status::ok);
  EXPECT_EQ(filter.update(sum, 4.0).status, Status::ok);
  expect_same(filter.box(), Box<double, 2>{Vector2(7, -5.5), Vector2(9, -2.5)}, 1e-13);
  EXPECT_EQ(filter.predict(), Status::ok);
  // A measurement below all that is possible contradicts also where the other side is open.
  Filter above{rule, plant, Box<double, 2>{Vector2(5, 0), Vector2(inf, 1)}};
  const auto report = above.update(models::first_state(), 3.5);
  EXPECT_EQ(report.status, Status::accepted_without_measurement);
  EXPECT_EQ(report.violation.row, 0);
  EXPECT_NEAR(report.violation.excess, 0.5, 1e-13);
}
TEST(BoundedNoiseLinear, HalfInfinitePrior) {
  half_infinite(Linearised{});
  half_infinite(Guaranteed{});
}

// A linear model's box is a guarantee also where the sums of F x cancel: the exact image of a point, in long
// double.
template <typename Rule>
void rounding(const Rule& rule) {
  jml::Noise noise(11);
  for (int run = 0; run < 1000; ++run) {
    models::BoundedLinear<2, 1> plant(models::random_matrix<2, 2>(noise), {0, 0}, Vector1(0.0));
    const Vector2 x(noise.uniform(1, 2), noise.uniform(1, 2));
    plant.F(0, 1) = -plant.F(0, 0) * x(0) / x(1);
    Filter filter{rule, plant, Box<double, 2>{x, x}};
    ASSERT_EQ(filter.predict(), Status::ok);
    const jml::Vector<long double, 2> image = plant.F.cast<long double>() * x.cast<long double>();
    for (int i = 0; i < 2; ++i) {
      ASSERT_LE(filter.box().lower(i), image(i)) << run << ' ' << i;
      ASSERT_GE(filter.box().upper(i), image(i)) << run << ' ' << i;
    }
  }
}
TEST(BoundedNoiseLinear, EnclosesItsOwnRounding) {
  rounding(Linearised{});
  rounding(Guaranteed{});
}

// The same of a row whose sum cancels: y exact to its own rounding, no noise, is no violation.
template <typename Rule>
void rounding_of_a_row(const Rule& rule) {
  jml::Noise noise(12);
  const models::BoundedLinear<2, 1> plant(jml::Matrix<double, 2, 2>::Identity(), {0, 0}, Vector1(0.0));
  int violations = 0;
  for (int run = 0; run < 1000; ++run) {
    const Vector2 x(noise.uniform(1, 2), noise.uniform(1, 2));
    Vector2 h(noise.uniform(-1, 1), 0);
    h(1) = -h(0) * x(0) / x(1);
    const long double y = h.cast<long double>().dot(x.cast<long double>());
    Filter filter{rule, plant, Box<double, 2>{x, x}};
    const models::BoundedLinearSensor<2, 1> sensor(h.transpose(), Vector1(0.0));
    violations += filter.update(sensor, static_cast<double>(y)).status != Status::ok;
    ASSERT_TRUE(filter.box().contains(x));
  }
  EXPECT_EQ(violations, 0);
}
TEST(BoundedNoiseLinear, RoundingOfARowIsNoViolation) {
  rounding_of_a_row(Linearised{});
  rounding_of_a_row(Guaranteed{});
}

// (2.31) and (2.34).
TEST(BoundedNoiseLinear, CentreAndVariance) {
  const Box<double, 2> box{Vector2(-1, 2), Vector2(3, 2.5)};
  Filter filter{Linearised{}, models::second_order_plant(), box, 7.0};
  EXPECT_EQ(filter.x(), Vector2(1, 2.25));
  EXPECT_LT((filter.box().error_variance() - Vector2(16.0 / 12, 0.25 / 12)).norm(), 1e-16);
  EXPECT_EQ(filter.time(), 7);
  ASSERT_EQ(filter.update(models::first_state(), 3.0).status, Status::ok);  // [2, 3]
  EXPECT_NEAR(filter.x()(0), 2.5, 1e-13);
  EXPECT_NEAR(filter.box().error_variance()(0), 1.0 / 12, 1e-13);
  EXPECT_EQ(filter.x()(1), 2.25);
  EXPECT_EQ(filter.time(), 7);
  EXPECT_EQ(filter.reset(box, 1.0), Status::ok);
  EXPECT_EQ(filter.x(), Vector2(1, 2.25));
  EXPECT_EQ(filter.time(), 1);
}

}  // namespace
