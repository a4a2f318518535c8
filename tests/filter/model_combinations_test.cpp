// SPDX-License-Identifier: BSD-3-Clause
// The same model in every form that its functions may have: Jacobians of its own or derived × with `at` or
// without × a residual hook or none × double or float, under every discrete method, three steps each. What
// differs is how it is written: the answers agree to rounding. (Ten methods and sixteen models: by night.)
#include <gtest/gtest.h>

#include <jml/jml.hpp>

namespace {

using jml::Vector, jml::Matrix, jml::usable;

template <typename Scalar, bool own, bool context>
struct Motion {
  static constexpr int states = 2, disturbances = 1;
  template <typename T>
  static Vector<T, 2> moved(const Vector<T, 2>& x) {
    return {x(0) + Scalar(0.1) * x(1), x(1) - Scalar(0.1) * (x(0) + Scalar(0.2) * x(0) * x(0) * x(0))};
  }
  template <typename T>
  static Matrix<T, 2, 2> slope(const Vector<T, 2>& x) {
    Matrix<T, 2, 2> J;
    J << T(1), T(Scalar(0.1)), Scalar(-0.1) - Scalar(0.06) * x(0) * x(0), T(1);
    return J;
  }
  template <typename T>
  Vector<T, 2> dynamics(const Vector<T, 2>& x) const
    requires(!context)
  {
    return moved(x);
  }
  template <typename T>
  Vector<T, 2> dynamics(const Vector<T, 2>& x, const auto& at) const
    requires context
  {
    return moved(Vector<T, 2>(x(0) + static_cast<Scalar>(at.time) * Scalar(0), x(1)));
  }
  template <typename T>
  Matrix<T, 2, 2> dynamics_jacobian(const Vector<T, 2>& x) const
    requires(own && !context)
  {
    return slope(x);
  }
  template <typename T>
  Matrix<T, 2, 2> dynamics_jacobian(const Vector<T, 2>& x, const auto&) const
    requires(own && context)
  {
    return slope(x);
  }
  Matrix<Scalar, 2, 1> disturbance_input() const { return {Scalar(0), Scalar(1)}; }
  Matrix<Scalar, 1, 1> disturbance_covariance() const { return Matrix<Scalar, 1, 1>(Scalar(0.01)); }
};

template <typename Scalar, bool own, bool context>
struct Plain {
  static constexpr int measurements = 1;
  template <typename T>
  static Vector<T, 1> seen(const Vector<T, 2>& x) {
    return Vector<T, 1>(x(0) + Scalar(0.1) * x(0) * x(0));
  }
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 2>& x) const
    requires(!context)
  {
    return seen(x);
  }
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 2>& x, const auto&) const
    requires context
  {
    return seen(x);
  }
  template <typename T>
  Matrix<T, 1, 2> measurement_jacobian(const Vector<T, 2>& x) const
    requires(own && !context)
  {
    return {Scalar(1) + Scalar(0.2) * x(0), T(0)};
  }
  template <typename T>
  Matrix<T, 1, 2> measurement_jacobian(const Vector<T, 2>& x, const auto&) const
    requires(own && context)
  {
    return {Scalar(1) + Scalar(0.2) * x(0), T(0)};
  }
  Matrix<Scalar, 1, 1> noise_covariance() const
    requires(!context)
  {
    return Matrix<Scalar, 1, 1>(Scalar(0.04));
  }
  Matrix<Scalar, 1, 1> noise_covariance(const auto& x, const auto&) const
    requires context
  {
    return Matrix<Scalar, 1, 1>(Scalar(0.04) + Scalar(0) * jml::plain_value(x(0)));
  }
};
/// A residual that wraps, far from where it would.
template <typename Scalar, bool own, bool context>
struct Hooked : Plain<Scalar, own, context> {
  template <typename T>
  Vector<T, 1> residual(const Vector<T, 1>& y, const Vector<T, 1>& predicted) const {
    T difference = y(0) - predicted(0);
    if (difference > T(Scalar(100))) difference -= T(Scalar(200));
    return Vector<T, 1>(difference);
  }
};

/// x after three steps.
template <typename Scalar, bool own, bool context, bool hook, typename M>
Vector<double, 2> fly(const M& method) {
  using S = std::conditional_t<hook, Hooked<Scalar, own, context>, Plain<Scalar, own, context>>;
  const jml::Estimate<Scalar, 2> start{Vector<Scalar, 2>(Scalar(0.5), Scalar(-0.2)),
                                       Matrix<Scalar, 2, 2>(Scalar(0.3) * Matrix<Scalar, 2, 2>::Identity())};
  const auto three_steps = [](auto& filter) {
    for (int k = 0; k < 3; ++k)
      EXPECT_TRUE(usable(filter.step(S{}, Scalar(0.4 + 0.1 * k), Scalar(0.1)).status));
  };
  Vector<double, 2> out;
  if constexpr (requires { typename M::template With<jml::Sensors<S>>; }) {
    jml::Filter filter{method, Motion<Scalar, own, context>{}, jml::sensors<S>, start};
    three_steps(filter);
    out = filter.x().template cast<double>();
  } else {
    jml::Filter filter{method, Motion<Scalar, own, context>{}, start};
    three_steps(filter);
    out = filter.x().template cast<double>();
  }
  return out;
}
/// The whole interval, and the smoother of the EKF.
struct Whole {};
struct Smoothed {};
template <typename Scalar, bool own, bool context, bool hook, typename M>
  requires(std::same_as<M, Whole> || std::same_as<M, Smoothed>)
Vector<double, 2> fly(const M&) {
  using S = std::conditional_t<hook, Hooked<Scalar, own, context>, Plain<Scalar, own, context>>;
  using D = Motion<Scalar, own, context>;
  const jml::Estimate<Scalar, 2> start{Vector<Scalar, 2>(Scalar(0.5), Scalar(-0.2)),
                                       Matrix<Scalar, 2, 2>(Scalar(0.3) * Matrix<Scalar, 2, 2>::Identity())};
  const auto three_steps = [](auto& recorder) {
    for (int k = 0; k < 3; ++k)
      EXPECT_TRUE(usable(recorder.step(S{}, Scalar(0.4 + 0.1 * k), Scalar(0.1)).status));
  };
  if constexpr (std::same_as<M, Whole>) {
    jml::Batch batch{D{}, jml::sensors<S>, start, {.steps = 3}};
    three_steps(batch);
    EXPECT_TRUE(usable(batch.solve().status));
    return batch.x(1).template cast<double>();
  } else {
    jml::Smoother smoother{jml::Filter{jml::Ekf{}, D{}, start}, 3};
    three_steps(smoother);
    EXPECT_EQ(smoother.smooth(), jml::Status::ok);
    return smoother.x(1).template cast<double>();
  }
}

template <typename Scalar, typename M>
Vector<double, 2> agree(const M& method, double tolerance) {
  const Vector<double, 2> first = fly<Scalar, true, false, false>(method);
  const Vector<double, 2> others[] = {
      fly<Scalar, true, false, true>(method),  fly<Scalar, true, true, false>(method),
      fly<Scalar, true, true, true>(method),   fly<Scalar, false, false, false>(method),
      fly<Scalar, false, false, true>(method), fly<Scalar, false, true, false>(method),
      fly<Scalar, false, true, true>(method)};
  for (const auto& other : others) EXPECT_LT((other - first).norm(), tolerance);
  return first;
}
template <typename M>
void check(const char* name, const M& method) {
  SCOPED_TRACE(name);
  const Vector<double, 2> x = agree<double>(method, 1e-9);
  EXPECT_LT((agree<float>(method, 1e-4) - x).norm(), 1e-3);
}

TEST(ModelCombinations, OnePassRules) {
  check("EKF", jml::Ekf{});
  check("SDDRE about the estimate", jml::Sddre{jml::AboutEstimate{}});
  check("JML", jml::Jml{});
}
TEST(ModelCombinations, IteratedRules) {
  check("IEKF", jml::Iekf{});
  check("iterated JML", jml::IteratedJml{});
}
TEST(ModelCombinations, Factored) {
  check("EKF", jml::Factored{jml::Ekf{}});
  check("IEKF", jml::Factored{jml::Iekf{}});
}
TEST(ModelCombinations, Intervals) {
  check("fixed lag", jml::FixedLag<2>{{.sweeps = 20}});
  check("batch", Whole{});
  check("smoother", Smoothed{});
}

}  // namespace
