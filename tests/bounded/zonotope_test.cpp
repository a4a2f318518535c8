// SPDX-License-Identifier: BSD-3-Clause
// The zonotope beside the guaranteed box, alone: no point is lost, in any direction; and where nothing has to
// be given up it is exact.
#include <gtest/gtest.h>

#include <jml/bounded/zonotope.hpp>
#include <vector>

#include "models/bounded.hpp"

namespace {

using namespace jml::operators;

template <int n, int columns>
using Zonotope = jml::detail::Zonotope<double, n, columns>;

/// True where no direction separates x from the zonotope, of `tries` random ones and the axes: a strip of no
/// width through x must meet it.
template <int n, int columns>
bool holds(const Zonotope<n, columns>& shape, const jml::Vector<double, n>& x, jml::Noise& noise, int tries) {
  const jml::Vector<double, n> off = x - shape.centre();
  const double slack = 1e-13 * (1 + x.cwiseAbs().maxCoeff());  // of the sample's own arithmetic
  bool inside = ((shape.reach() - off.cwiseAbs()).array() >= -slack).all();
  for (int k = 0; k < tries; ++k) {
    const jml::Vector<double, n> h = models::random_matrix<n, 1>(noise);
    auto copy = shape;
    inside &= copy.intersect(h, h.dot(off), 0.0) <= slack;
  }
  return inside;
}

/// sup h (x - c): where a strip begins to miss.
template <int n, int columns>
double support(const Zonotope<n, columns>& shape, const jml::Vector<double, n>& h) {
  auto copy = shape;
  const double far = 1e3;
  return far - copy.intersect(h, far, 0.0);
}

template <int n>
jml::Box<double, n> random_box(jml::Noise& noise) {
  jml::Box<double, n> box;
  for (int i = 0; i < n; ++i) {
    box.lower(i) = noise.uniform(-2, 1);
    box.upper(i) = box.lower(i) + noise.uniform(0, 2);
  }
  return box;
}

// Maps and strips in turn. The samples that honour every strip stay inside; half of them are extreme.
template <int n, int columns, int inputs>
void keeps_every_point(std::uint64_t seed) {
  jml::Noise noise(seed);
  long checked = 0;
  for (int run = 0; run < 40; ++run) {
    const auto box = random_box<n>(noise);
    Zonotope<n, columns> shape;
    shape.reset(box);
    std::vector<jml::Vector<double, n>> points;
    for (int i = 0; i < 60; ++i) points.push_back(models::point_of(box, noise, i % 2 == 1));
    for (int k = 0; k < 15; ++k) {
      const jml::Matrix<double, n, n> A = models::random_matrix<n, n>(noise);
      const jml::Matrix<double, n, inputs> input = 0.3 * models::random_matrix<n, inputs>(noise);
      const jml::Vector<double, n> to = models::random_matrix<n, 1>(noise);
      const jml::Vector<double, n> error = 0.1 * models::random_matrix<n, 1>(noise).cwiseAbs();
      const jml::Vector<double, n> centre = shape.centre();
      for (std::size_t i = 0; i < points.size(); ++i) {
        const bool corner = i % 3 > 0;
        const jml::Vector<double, inputs> s =
            models::within<inputs>(jml::Vector<double, inputs>::Ones(), noise, corner);
        points[i] = A * (points[i] - centre) + to + input * s + models::within<n>(error, noise, corner);
      }
      shape.map(A, to, input, error);
      ASSERT_EQ(shape.centre(), to);
      for (const auto& x : points) ASSERT_TRUE(holds(shape, x, noise, 5)) << run << ' ' << k;

      jml::Vector<double, n> h = models::random_matrix<n, 1>(noise);
      if (k % 2 == 0) h(k % n) = 0;  // a state that the strip does not see
      const double width = noise.uniform(0.05, 0.5), at = h.dot(points[0]) + noise.uniform(-width, width);
      ASSERT_EQ(shape.intersect(h, at - h.dot(shape.centre()), width), 0);
      std::vector<jml::Vector<double, n>> kept;
      for (const auto& x : points) {
        if (std::abs(h.dot(x) - at) > width) continue;
        ASSERT_TRUE(holds(shape, x, noise, 5)) << run << ' ' << k;
        ++checked;
        kept.push_back(x);
      }
      const std::size_t alive = kept.size();
      for (std::size_t i = 0; kept.size() < points.size(); ++i) kept.push_back(kept[i % alive]);
      points = kept;
    }
  }
  EXPECT_GT(checked, 10'000);
}
TEST(Zonotope, KeepsEveryPoint) {
  keeps_every_point<2, 12, 1>(1);
  keeps_every_point<2, 2, 2>(2);
  keeps_every_point<3, 5, 1>(3);  // no whole number of packets
}

// Room for all generators: the support in any direction is the sum over them.
TEST(Zonotope, ExactWhileThereIsRoom) {
  using X = jml::Vector<double, 2>;
  jml::Noise noise(4);
  for (int run = 0; run < 50; ++run) {
    const auto box = random_box<2>(noise);
    Zonotope<2, 12> shape;
    shape.reset(box);
    jml::Matrix<double, 2, 12> generators = jml::Matrix<double, 2, 12>::Zero();
    generators.leftCols<2>() = X(box.width() / 2).asDiagonal();
    const X h = models::random_matrix<2, 1>(noise);
    EXPECT_NEAR(support(shape, h), (h.transpose() * generators).cwiseAbs().sum(), 1e-12);
    for (int k = 0; k < 5; ++k) {
      const jml::Matrix<double, 2, 2> A = 2 * models::random_matrix<2, 2>(noise);
      const X input = models::random_matrix<2, 1>(noise);
      shape.map<1>(A, X(0, 0), input, X(0, 0));
      generators = (A * generators).eval();
      generators.col(2 + k) = input;
      const X direction = models::random_matrix<2, 1>(noise);
      const double wanted = (direction.transpose() * generators).cwiseAbs().sum();
      EXPECT_NEAR(support(shape, direction), wanted, 1e-12 * (1 + wanted));
      const X reach = generators.cwiseAbs().rowwise().sum();
      EXPECT_LT((shape.reach() - reach).norm(), 1e-12 * reach.norm());
    }
  }
}

// The reach, to the last bit: of a point, a box and a chain of maps it is never below the exact one, in long
// double.
TEST(Zonotope, ReachIsRoundedOutward) {
  using X = jml::Vector<double, 2>;
  using Exact = jml::Matrix<long double, 2, 12>;
  jml::Noise noise(6);
  for (int run = 0; run < 2000; ++run) {
    const auto box = random_box<2>(noise);
    Zonotope<2, 12> shape;
    shape.reset(box);
    Exact generators = Exact::Zero();
    for (int i = 0; i < 2; ++i) {
      generators(i, i) = std::max(static_cast<long double>(box.upper(i)) - shape.centre()(i),
                                  static_cast<long double>(shape.centre()(i)) - box.lower(i));
    }
    for (int k = 0; k < 3; ++k) {
      const jml::Vector<long double, 2> exact = generators.cwiseAbs().rowwise().sum();
      for (int i = 0; i < 2; ++i) {
        ASSERT_GE(shape.reach()(i), exact(i)) << run << ' ' << k;
        ASSERT_LE(shape.reach()(i), exact(i) * (1 + 1e-12L) + 1e-12L) << run << ' ' << k;
      }
      const jml::Matrix<double, 2, 2> A = models::random_matrix<2, 2>(noise);
      const X input = models::random_matrix<2, 1>(noise);
      shape.map<1>(A, X(0, 0), input, X(0, 0));
      generators = (A.cast<long double>() * generators).eval();
      generators.col(2 + k) = input.cast<long double>();
    }
  }
}

// One strip: gain λ = T Tᵀ hᵀ / (h T Tᵀ hᵀ + β²), centre c + λ ρ, generators [(I - λ h) T, λ β] (Alamo, Bravo
// and Camacho 2005, eq. (9)).
TEST(Zonotope, OneStrip) {
  using X = jml::Vector<double, 2>;
  jml::Noise noise(5);
  for (int run = 0; run < 50; ++run) {
    const auto box = random_box<2>(noise);
    Zonotope<2, 12> shape;
    shape.reset(box);
    jml::Matrix<double, 2, 3> T = jml::Matrix<double, 2, 3>::Zero();
    T.leftCols<2>() = X(box.width() / 2).asDiagonal();
    const jml::Matrix<double, 2, 2> turn = models::random_matrix<2, 2>(noise);
    const X input = models::random_matrix<2, 1>(noise), to(0.3, -0.7);
    shape.map<1>(turn, to, input, X(0, 0));
    T = (turn * T).eval();
    T.col(2) = input;
    const X h = models::random_matrix<2, 1>(noise);
    const double reach = (h.transpose() * T).cwiseAbs().sum();
    const double width = reach * noise.uniform(0.01, 0.5), offset = reach * noise.uniform(-1, 1);
    ASSERT_EQ(shape.intersect(h, offset, width), 0);
    const X gain = T * (T.transpose() * h) / (h.dot(T * (T.transpose() * h)) + width * width);
    EXPECT_LT((shape.centre() - (to + gain * offset)).norm(), 1e-13);
    const jml::Matrix<double, 2, 3> left = T - gain * (h.transpose() * T);
    for (int k = 0; k < 5; ++k) {
      const X direction = models::random_matrix<2, 1>(noise);
      const double wanted =
          (direction.transpose() * left).cwiseAbs().sum() + std::abs(direction.dot(gain)) * width;
      EXPECT_NEAR(support(shape, direction), wanted, 1e-12);
    }
  }
}

TEST(Zonotope, StripsThatSayNothingOrContradict) {
  using X = jml::Vector<double, 2>;
  Zonotope<2, 4> shape;
  shape.reset(jml::Box<double, 2>{X(-1, 2), X(3, 4)});  // (1, 3) ± (2, 1)
  const X h(1, -2);                                     // reaches 4
  auto copy = shape;
  EXPECT_EQ(copy.intersect(h, 0.5, 5.0), 0);  // all of it is inside
  EXPECT_EQ(copy.centre(), shape.centre());
  EXPECT_EQ(copy.reach(), shape.reach());
  EXPECT_NEAR(copy.intersect(h, 5.0, 0.25), 0.75, 1e-13);
  EXPECT_NEAR(copy.intersect(h, -5.0, 0.25), 0.75, 1e-13);
  EXPECT_EQ(copy.intersect(X(0, 0), 0.0, 0.0), 0);
  EXPECT_NEAR(copy.intersect(X(0, 0), 1.0, 0.25), 0.75, 1e-13);
  EXPECT_EQ(copy.intersect(h, 4.25, 0.25), 0);  // the corner (3, 2)
  EXPECT_TRUE(((copy.reach() - (X(3, 2) - copy.centre()).cwiseAbs()).array() >= -1e-14).all());
}

}  // namespace
