// SPDX-License-Identifier: BSD-3-Clause
// Theorem 1 and Conjectures 1 and 2 of Rusnak 2018, section 5, put to random pairs of two states, one sensor
// and one disturbance (R = Q = 1): does the P of the steady equation (29) stabilise what the chapter says?
//
// Random: all entries of F, f_x, M, m_x and G are standard normal numbers; where a gap ε is given,
// f_x = F + ε N and m_x = M + ε N. Looked at are pairs whose four matrices of the Remark, two of
// observability, two of controllability, all have a determinant above 0.1.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <jml/campaign/noise.hpp>
#include <jml/riccati/algebraic.hpp>

namespace demo::claims {

using Square = jml::Matrix<double, 2, 2>;
using Row = jml::Matrix<double, 1, 2>;
using Column = jml::Matrix<double, 2, 1>;

/// Coefficients of (29) at one point.
struct Pair {
  Square F, f_x;
  Row M, m_x;
  Column G;
};

/// How f_x and m_x come from F and M.
struct Draw {
  double gap = -1;                         ///< ε; negative: independent
  bool same_dynamics = false;              ///< f_x = F
  double least_ratio = 0, most_ratio = 0;  ///< m_x = s M with s uniform between them, if most_ratio > 0
};

inline Square normal_square(jml::Noise& noise) {
  const double a = noise.normal(), b = noise.normal(), c = noise.normal(), d = noise.normal();
  return Square{{a, b}, {c, d}};
}
inline Row normal_row(jml::Noise& noise) {
  const double a = noise.normal(), b = noise.normal();
  return Row{{a, b}};
}

inline Pair draw_pair(const Draw& how, jml::Noise& noise) {
  Pair out;
  out.F = normal_square(noise);
  const Square other = normal_square(noise);
  out.M = normal_row(noise);
  const Row other_row = normal_row(noise);
  out.G = Column(normal_row(noise).transpose());
  out.f_x = how.same_dynamics ? out.F : how.gap < 0 ? other : Square(out.F + how.gap * other);
  if (how.most_ratio > 0)
    out.m_x = (how.least_ratio + (how.most_ratio - how.least_ratio) * noise.uniform()) * out.M;
  else
    out.m_x = how.gap < 0 ? other_row : Row(out.M + how.gap * other_row);
  return out;
}

/// Smallest magnitude of the four determinants of the Remark.
inline double least_determinant(const Pair& pair) {
  const auto seen = [](const Square& F, const Row& M) {
    const Row MF = M * F;
    return std::abs(M(0) * MF(1) - M(1) * MF(0));
  };
  const auto reached = [](const Square& F, const Column& G) {
    const Column FG = F * G;
    return std::abs(G(0) * FG(1) - G(1) * FG(0));
  };
  return std::min(
      {seen(pair.F, pair.M), seen(pair.f_x, pair.m_x), reached(pair.F, pair.G), reached(pair.f_x, pair.G)});
}

/// Both eigenvalues in the left half plane.
inline bool stable(const Square& A) { return A(0, 0) + A(1, 1) < 0 && A(0, 0) * A(1, 1) > A(0, 1) * A(1, 0); }

inline jml::AlgebraicSolution<double, 2, 2> steady(const Pair& pair) {
  const jml::AlgebraicRiccati<double, 2, 2> equation{
      pair.F, pair.f_x.transpose(), pair.G * pair.G.transpose(), pair.m_x.transpose() * pair.M};
  return jml::solve_algebraic_riccati(equation);
}

/// 2 ‖X‖ max(‖E₁‖, ‖E₂‖), Frobenius, with C = F - P m_xᵀR⁻¹M, X of Cᵀ X + X C = -I, and E what must be added
/// to C to have F - K₁ M and f_x - K₂ m_x. Below one both are stable: xᵀ X x is a Lyapunov function of them.
inline double load(const Pair& pair, const Square& P) {
  const Square C = pair.F - P * pair.m_x.transpose() * pair.M;
  const Row gap = pair.m_x - pair.M;
  const Square E1 = P * gap.transpose() * pair.M;
  const Square E2 = pair.f_x - pair.F - P * pair.m_x.transpose() * gap;
  // For n = 2: X = (I + adj(C)ᵀ adj(C) / det C) / (-2 tr C).
  const double trace = C(0, 0) + C(1, 1), determinant = C(0, 0) * C(1, 1) - C(0, 1) * C(1, 0);
  const Square adjugate{{C(1, 1), -C(0, 1)}, {-C(1, 0), C(0, 0)}};
  const Square X = (Square::Identity() + adjugate.transpose() * adjugate / determinant) / (-2 * trace);
  return 2 * X.norm() * std::max(E1.norm(), E2.norm());
}

struct PairCount {
  long pairs = 0;      ///< all determinants above 0.1
  long solved = 0;     ///< a stabilising P exists: F - P m_xᵀR⁻¹M and f_x - Pᵀ MᵀR⁻¹m_x stable
  long first = 0;      ///< F - K₁ M unstable, K₁ = P MᵀR⁻¹
  long second = 0;     ///< f_x - K₂ m_x unstable, K₂ = P m_xᵀR⁻¹
  long either = 0;     ///< one of them
  long mixed = 0;      ///< F - P m_xᵀR⁻¹M or f_x - Pᵀ MᵀR⁻¹m_x unstable
  long light = 0;      ///< of a load() below one
  long light_bad = 0;  ///< one of the first two unstable all the same
};

/// Draws until `wanted` pairs have determinants above 0.1.
inline PairCount count_pairs(const Draw& how, long wanted, std::uint64_t seed) {
  PairCount out;
  jml::Noise noise(seed);
  while (out.pairs < wanted) {
    const Pair pair = draw_pair(how, noise);
    if (!(least_determinant(pair) > 0.1)) continue;
    ++out.pairs;
    const auto solution = steady(pair);
    if (!jml::usable(solution.status)) continue;
    ++out.solved;
    const Square& P = solution.X;
    const bool first = !stable(pair.F - P * pair.M.transpose() * pair.M);
    const bool second = !stable(pair.f_x - P * pair.m_x.transpose() * pair.m_x);
    out.first += first;
    out.second += second;
    out.either += first || second;
    out.mixed += !stable(pair.F - P * pair.m_x.transpose() * pair.M) ||
                 !stable(pair.f_x - P.transpose() * pair.M.transpose() * pair.m_x);
    if (load(pair, P) < 1) {
      ++out.light;
      out.light_bad += first || second;
    }
  }
  return out;
}

}  // namespace demo::claims
