// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Two filters side by side: do they stand at the same place, bit for bit, and does one fly as the Kalman
/// filter?
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <cstring>
#include <jml/filter/filter.hpp>
#include <jml/filter/one_pass.hpp>

namespace jml {

/// The same numbers: 0 is not -0, a NaN is itself.
template <typename Scalar, int rows, int cols>
[[nodiscard]] bool same_bits(const Matrix<Scalar, rows, cols>& a, const Matrix<Scalar, rows, cols>& b) {
  return std::memcmp(a.data(), b.data(), sizeof(Scalar) * static_cast<std::size_t>(rows * cols)) == 0;
}

/// Of two reports: status, verdict, innovation and its matrix.
template <typename R>
  requires requires(const R& report) { report.innovation_matrix; }
[[nodiscard]] bool same_bits(const R& a, const R& b) {
  return a.status == b.status && a.gate == b.gate && same_bits(a.innovation, b.innovation) &&
         same_bits(a.innovation_matrix, b.innovation_matrix);
}

/// All that two filters show of their beliefs, and their times: x, and where they are, P, box, and the
/// window.
template <typename M, typename D, typename Scalar>
[[nodiscard]] bool same_bits(const Filter<M, D, Scalar>& a, const Filter<M, D, Scalar>& b) {
  using State = typename Filter<M, D, Scalar>::State;
  using Covariance = typename Filter<M, D, Scalar>::Covariance;
  bool same = same_bits(State(a.x()), State(b.x())) && a.time() == b.time();
  if constexpr (requires { a.P(); }) same = same && same_bits(Covariance(a.P()), Covariance(b.P()));
  if constexpr (requires { a.box(); })
    same = same && same_bits(a.box().lower, b.box().lower) && same_bits(a.box().upper, b.box().upper);
  if constexpr (requires { a.depth(); }) {
    same = same && a.depth() == b.depth();
    for (int age = 0; same && age <= a.depth(); ++age)
      same = same_bits(State(a.x(age)), State(b.x(age))) && same_bits(a.P(age), b.P(age)) &&
             a.time(age) == b.time(age);
  }
  return same;
}

/// x and P of `a` are those of `b`, to 1e-9 (float: 1e-3) of |x| and of the standard deviations in N: P
/// itself, or what P was corrected from, whose rounding it has. The same in any units.
template <typename A, typename B, typename Scalar, int n>
[[nodiscard]] bool near(const A& a, const B& b, const Matrix<Scalar, n, n>& N) {
  constexpr Scalar tolerance = std::is_same_v<Scalar, float> ? Scalar(1e-3) : Scalar(1e-9);
  const Vector<Scalar, n> x = a.x(), expected_x = b.x();
  const Matrix<Scalar, n, n> P = a.P(), expected = b.P();
  const auto scale = [&](int i) { return std::sqrt(std::abs(N(i, i))); };
  bool all = true;
  for (int i = 0; i < n; ++i) {
    all &= std::abs(x(i) - expected_x(i)) <= tolerance * (std::abs(expected_x(i)) + scale(i));
    for (int j = 0; j < n; ++j) all &= std::abs(P(i, j) - expected(i, j)) <= tolerance * scale(i) * scale(j);
  }
  return all;
}

/// Two filters that came to the same place by two ways: same_bits(), but where the compiler may fuse a·b + c,
/// which rounds one formula in two ways in two places, only near().
template <typename F>
[[nodiscard]] bool same_place(const F& a, const F& b) {
#if defined(__FMA__) || defined(__FP_FAST_FMA) || defined(__ARM_FEATURE_FMA)
  if constexpr (requires { a.P(); }) return a.time() == b.time() && near(a, b, typename F::Covariance(b.P()));
#endif
  return same_bits(a, b);
}

/// Flies `filter` beside the Kalman filter of the same start. The measurement, from 0, after which they are
/// not near(); -1 where that does not happen before the Kalman filter itself refuses a measurement.
template <typename F, typename S, typename Flight, typename Step>
[[nodiscard]] int leaves_kalman(F filter, const S& sensor, const Flight& flight, const Step& dt,
                                const typename F::Control& control) {
  using Scalar = typename F::State::Scalar;
  Filter kalman{Kalman{}, filter.dynamics(), Estimate<Scalar, F::states>{filter.x(), filter.P()},
                filter.time()};
  kalman.gate = filter.gate;
  if (kalman.status() != Status::ok) return 0;
  int at = 0;
  for (const auto& y : flight) {
    auto predicted = kalman;
    if (!usable(predicted.predict(dt, control)) || !usable(kalman.step(sensor, y, dt, control).status))
      return -1;
    static_cast<void>(filter.step(sensor, y, dt, control));
    if (!near(filter, kalman, predicted.P())) return at;
    ++at;
  }
  return -1;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
