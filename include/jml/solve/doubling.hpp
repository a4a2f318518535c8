// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Structure-preserving doubling for an algebraic Riccati equation, symmetric or not, square or not:
/// 0 = A Z + Z B + R - Z S Z.
///
/// K = [-B S; R A] has K [I; Z] = [I; Z](-B + S Z). The Cayley transform with γ > 0 turns "right and left
/// half plane" into "inside and outside the unit circle"; written as a pencil [E 0; -H I] - λ [I -G; 0 F] it
/// can be squared without losing its form (Guo, Lin, Xu 2006):
///   E⁺ = E (I-GH)⁻¹E, F⁺ = F (I-HG)⁻¹F, G⁺ = G + E (I-GH)⁻¹G F, H⁺ = H + F H (I-GH)⁻¹E,
/// where F (I-HG)⁻¹F = F (F + H (I-GH)⁻¹G F), so that one elimination serves all four. For any solution Z,
/// with M = -B + S Z and C = (M - γ)(M + γ)⁻¹,
///   E_k = (I - G_k Z) C^(2^k)  and  Z - H_k = F_k Z C^(2^k):
/// E_k and F_k both go to zero for the solution that leaves B - S Z and A - Z S stable, and for no other. So
/// their norms are the certificate, wherever the iteration was started.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/kernels.hpp>
#include <jml/solve/elimination.hpp>

namespace jml {

/// What a doubling iteration found.
template <typename Scalar, int n1, int n2>
struct DoublingResult {
  Matrix<Scalar, n1, n2> Z;  ///< n1×n2
  bool converged = false;    ///< its certificate is small
  int iterations = 0;        ///< doublings made
  Scalar gain = 0;           ///< estimate from above of ‖Z‖/‖R‖ in the linearised equation: 1/sep
};

namespace kernel {

/// sqrt(‖M‖₁ ‖M‖_∞), not less than the 2-norm.
template <typename Scalar, int rows, int cols>
inline Scalar norm_bound(const Matrix<Scalar, rows, cols>& M) {
  return std::sqrt(largest_column_sum(M) * largest(row_sums(M)));
}

}  // namespace kernel

/// The Z of 0 = A Z + Z B + R - Z S Z that leaves A - Z S and B - S Z stable. Quadratic convergence, faster
/// the wider the gap of K's eigenvalues at the imaginary axis; linear where they touch it.
///
/// `size`: the norm beside which an error of Z is judged. Not converged after `max_iterations`, or where A or
/// B are so far from stable that a norm grows: Z is then of no use.
template <typename Scalar, int n1, int n2>
[[nodiscard]] DoublingResult<Scalar, n1, n2> solve_by_doubling(const Matrix<Scalar, n1, n1>& A,
                                                               const Matrix<Scalar, n2, n2>& B,
                                                               const Matrix<Scalar, n1, n2>& R,
                                                               const Matrix<Scalar, n2, n1>& S, Scalar size,
                                                               int max_iterations) {
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  constexpr int m = n1 + n2;
  DoublingResult<Scalar, n1, n2> out;
  kernel::set_zero(out.Z);
  // γ between the slow and the fast: the geometric mean of all moduli.
  const Scalar largest_a = kernel::largest(A), largest_b = kernel::largest(B);
  const Scalar floor = Scalar(1e-4) * (largest_a > largest_b ? largest_a : largest_b);
  const Scalar gamma = std::sqrt(kernel::mean_modulus(A, floor) * kernel::mean_modulus(B, floor));
  if (!(gamma > Scalar(0)) || !std::isfinite(gamma)) return out;

  // [γ-B S; -R γ-A]⁻¹ = [V⁻¹ …; … W⁻¹] holds the four starting matrices.
  Matrix<Scalar, m, m> K, inverse = kernel::identity<Matrix<Scalar, m, m>>();
  kernel::set_block(K, 0, 0, -B);
  kernel::set_block(K, 0, n2, S);
  kernel::set_block(K, n2, 0, -R);
  kernel::set_block(K, n2, n2, -A);
  kernel::add_to_diagonal(K, gamma);
  if (!(kernel::eliminate(K, inverse) > epsilon)) return out;
  const Scalar twice = Scalar(2) * gamma;
  Matrix<Scalar, n2, n2> E = -twice * kernel::block<n2, n2>(inverse, 0, 0);
  Matrix<Scalar, n2, n1> G = twice * kernel::block<n2, n1>(inverse, 0, n2);
  Matrix<Scalar, n1, n2> H = twice * kernel::block<n1, n2>(inverse, n2, 0);
  Matrix<Scalar, n1, n1> F = -twice * kernel::block<n1, n1>(inverse, n2, n2);
  // ‖Σ F^i (2γ W⁻¹ R V⁻¹) E^i‖, the powers from 2^k to 2^(k+1) taken as the first of them
  const Scalar first = kernel::norm_bound(E) * kernel::norm_bound(F) / twice;
  Scalar sum = 1, power = 1;
  kernel::add_to_diagonal(E, Scalar(1));
  kernel::add_to_diagonal(F, Scalar(1));

  Scalar norm_e = kernel::norm_bound(E), norm_f = kernel::norm_bound(F);
  Matrix<Scalar, n2, n2> M, T1, next_e;
  Matrix<Scalar, n2, n1> T2, TF;
  Matrix<Scalar, n1, n2> HT;
  Matrix<Scalar, n1, n1> inner, next_f;
  // A power that shrinks, or stands at a simple eigenvalue on the axis; one that grows is not this solution.
  const auto settled = [](Scalar now, Scalar before) {
    return now < Scalar(1) || std::abs(now - before) <= Scalar(1e-3) * before;
  };
  for (; out.iterations < max_iterations; ++out.iterations) {
    sum += power * norm_e * norm_f;
    power *= Scalar(2);
    M = kernel::identity<Matrix<Scalar, n2, n2>>();
    kernel::add_product<-1>(M, G, H, M);  // I - G H
    T1 = E;
    T2 = G;
    if (!(kernel::eliminate(M, T1, T2) > epsilon)) return out;  // T1 = (I-GH)⁻¹E, T2 = (I-GH)⁻¹G
    kernel::multiply(T2, F, TF);                                // (I-GH)⁻¹G F
    inner = F;
    kernel::accumulate(H, TF, inner);    // F + H (I-GH)⁻¹G F
    kernel::multiply(F, inner, next_f);  // F⁺ = F (I-HG)⁻¹F
    kernel::multiply(H, T1, HT);         // H (I-GH)⁻¹E
    kernel::accumulate(F, HT, H);        // H⁺ = H + F H (I-GH)⁻¹E
    kernel::accumulate(E, TF, G);        // G⁺ = G + E (I-GH)⁻¹G F
    kernel::multiply(E, T1, next_e);     // E⁺ = E (I-GH)⁻¹E
    E = next_e;
    F = next_f;
    const Scalar last_e = norm_e, last_f = norm_f;
    norm_e = kernel::norm_bound(E);
    norm_f = kernel::norm_bound(F);
    const Scalar norm_h = kernel::norm(H);
    if (!std::isfinite(norm_e + norm_f + norm_h)) return out;
    // Z - H = F Z C^(2^k), and C^(2^k) is E up to a bounded factor.
    if (norm_e * norm_f * norm_h <= epsilon / Scalar(4) * (size + norm_h) && norm_e * norm_f < Scalar(0.1) &&
        settled(norm_e, last_e) && settled(norm_f, last_f)) {
      ++out.iterations;
      out.converged = true;
      break;
    }
  }
  out.gain = first * sum;
  out.Z = H;
  return out;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
