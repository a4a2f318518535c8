// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The two solvers behind solve_algebraic_riccati: doubling from a start, and the ordered Schur form.
///
/// Critical equations: K has eigenvalues of even multiplicity at the split (at zero, or at ±iω), one half of
/// each Jordan block wanted. Rounding splits such an eigenvalue by √ε, and the subspace is lost to half the
/// digits. But their mean µ = iω is good to rounding, and so are the eigenvectors of K at µ:
/// the right ones, V, belong to the wanted subspace, the left ones, W, are orthogonal to it. With orthonormal
/// real bases K + η V Vᵀ - η W Wᵀ has the same wanted subspace and a gap, half of the eigenvalues moved right
/// by η and half of them left (Guo, Iannazzo, Meini 2007, for one null vector). Repeated for longer blocks.
/// An equation near a critical one is then solved from there without the shift: R of the shifted X is small
/// in twice the digits, so that doubling sees a gap of ε where K has one of √ε.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/riccati/algebraic_equation.hpp>
#include <jml/riccati/algebraic_error.hpp>
#include <jml/solve/doubling.hpp>
#include <jml/solve/ordered_schur.hpp>

namespace jml::detail {

/// The backward error beyond which an answer is not taken as solved to rounding.
template <typename Scalar, int m>
inline constexpr Scalar backward_limit = Scalar(16 * m) * std::numeric_limits<Scalar>::epsilon();

/// ‖Z‖ of 0 = A₀ Z + Z B₀ + R - Z S Z by the norm of R, at most twice that without the last term
/// (algebraic_error.hpp).
template <typename Scalar, int n1, int n2>
[[nodiscard]] Scalar error_bound(const RiccatiBlocks<Scalar, n1, n2>& k, Scalar gain, Scalar residual) {
  const Scalar error = gain * residual, curved = Scalar(4) * gain * kernel::norm(k.S) * error;
  return curved < Scalar(1) ? (Scalar(1) + curved) * error : Scalar(2) * error;
}

template <typename Scalar, int n1, int n2>
[[nodiscard]] bool solve_warm(const BalancedRiccati<Scalar, n1, n2>& balanced,
                              const Matrix<Scalar, n1, n2>& start, AlgebraicSolution<Scalar, n1, n2>& out) {
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  const RiccatiBlocks<Scalar, n1, n2> k(balanced.K);
  Matrix<Scalar, n1, n2> X = balanced.into(start), R;
  Matrix<Scalar, n1, n1> A0;
  Matrix<Scalar, n2, n2> B0;
  Scalar terms = k.residual(X, A0, B0, R);
  for (int pass = 0; pass < 2; ++pass) {
    const auto step = solve_by_doubling(A0, B0, R, k.S, kernel::norm(X), 20);
    out.iterations += step.iterations;
    if (!step.converged) return false;
    X += step.Z;
    terms = k.residual(X, A0, B0, R);
    const Scalar left = kernel::norm(R), weight = k.weight(X);
    out.error = error_bound(k, step.gain, left + epsilon * weight);
    const bool first = pass == 0, hard = out.error > std::cbrt(epsilon) * kernel::norm(X);
    if (left <= (first ? Scalar(4) * epsilon : backward_limit<Scalar, n1 + n2>)*weight && !(first && hard)) {
      out.X = X;
      out.residual = terms > Scalar(0) ? left / terms : Scalar(0);
      out.status = Status::ok;
      return true;
    }
    if (hard) R = k.accurate_residual(X);
  }
  return false;
}

/// K += η V Vᵀ, V an orthonormal real basis of the first `dimension` columns.
template <typename Scalar, int m>
JML_NOINLINE void add_projection(const Matrix<std::complex<Scalar>, m, m>& basis, int dimension,
                                 bool imaginary_too, Scalar shift, Matrix<Scalar, m, m>& K) {
  Matrix<Scalar, m, m> V;
  int columns = 0;
  for (int j = 0; j < dimension; ++j) {
    for (int part = 0; part < (imaginary_too ? 2 : 1) && columns < m; ++part) {
      Vector<Scalar, m> v;
      for (int i = 0; i < m; ++i) v(i) = part == 1 ? basis(i, j).imag() : basis(i, j).real();
      v = kernel::normalised(v);
      for (int twice = 0; twice < 2; ++twice) {  // Gram and Schmidt, once more for orthogonality to rounding
        for (int i = 0; i < columns; ++i) {
          const Vector<Scalar, m> direction = kernel::column_of(V, i);
          v -= kernel::dot(direction, v) * direction;
        }
      }
      kernel::set_column(V, columns++, kernel::normalised(v));
    }
  }
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < m; ++j) {
      for (int k = 0; k < m; ++k) K(k, j) += V(k, i) * (shift * V(j, i));
    }
  }
}

/// Moves the right half by +η and the left half by -η where the eigenvalues at the split are double to
/// rounding; false where they are not, or where their eigenvectors do not say which half is wanted.
template <typename Scalar, int n1, int n2>
[[nodiscard]] JML_NOINLINE bool shift_critical(const kernel::OrderedSchur<Scalar, n1 + n2>& schur,
                                               Scalar size, Scalar shift,
                                               Matrix<Scalar, n1 + n2, n1 + n2>& K) {
  constexpr int m = n1 + n2;
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  using Complex = std::complex<Scalar>;
  const Complex last = schur.last_right();
  // A double eigenvalue is split by √ε, a quadruple one by the fourth root.
  for (const Scalar radius : {Scalar(10) * std::sqrt(Scalar(m) * epsilon) * size,
                              Scalar(4) * std::sqrt(std::sqrt(epsilon)) * size}) {
    Complex mean = 0;
    int count = 0;
    for (int i = 0; i < m; ++i) {
      if (std::abs(schur.eigenvalue(i) - last) > Scalar(2) * radius) continue;
      mean += schur.eigenvalue(i);
      ++count;
    }
    if (count < 2) continue;
    mean /= Scalar(count);
    const bool real = std::abs(mean.imag()) <= radius;
    // Elsewhere than on the axis no answer would stabilise.
    if (std::abs(mean.real()) > Scalar(1000 * m) * epsilon * size) continue;
    mean = Complex(0, real ? Scalar(0) : mean.imag());
    Matrix<Complex, m, m> singular = kernel::cast<Complex>(K), right, left;
    kernel::add_to_diagonal(singular, -mean);
    constexpr Scalar slack = Scalar(8 * m) * epsilon;
    const int dimension = kernel::null_space(singular, slack, right);
    if (dimension == 0 || 2 * dimension > count) continue;
    singular = kernel::transposed(singular);
    if (kernel::null_space(singular, slack, left) != dimension) continue;
    // Eigenvectors from the left and from the right are orthogonal in a Jordan block, and only there.
    bool defective = true;
    for (int i = 0; i < dimension; ++i) {
      for (int j = 0; j < dimension; ++j) {
        Complex product = 0;
        Scalar left_size = 0, right_size = 0;
        for (int l = 0; l < m; ++l) {
          product += left(l, i) * right(l, j);
          left_size += std::norm(left(l, i));
          right_size += std::norm(right(l, j));
        }
        defective &= std::abs(product) <= Scalar(1e-2) * std::sqrt(left_size) * std::sqrt(right_size);
      }
    }
    if (!defective) continue;
    add_projection(right, dimension, !real, shift, K);
    add_projection(left, dimension, !real, -shift, K);
    return true;
  }
  return false;
}

/// X = U21 U11⁻¹ of the leading columns; false where U11 is singular to rounding.
template <typename Scalar, int n1, int n2>
[[nodiscard]] bool graph_of_subspace(const kernel::OrderedSchur<Scalar, n1 + n2>& schur,
                                     Matrix<Scalar, n1, n2>& X) {
  using Complex = std::complex<Scalar>;
  // X U11 = U21, transposed for an elimination from the left.
  Matrix<Complex, n2, n2> U11 = kernel::transposed(kernel::block<n2, n2>(schur.U(), 0, 0));
  Matrix<Complex, n2, n1> W = kernel::transposed(kernel::block<n1, n2>(schur.U(), n2, 0));
  const Scalar largest = kernel::largest(U11);
  const Scalar pivot = largest * kernel::eliminate(U11, W);
  for (int j = 0; j < n2; ++j) {
    for (int i = 0; i < n1; ++i) X(i, j) = W(j, i).real();
  }
  return pivot > Scalar(256 * (n1 + n2)) * std::numeric_limits<Scalar>::epsilon();
}

/// Moves X, near a solution that is nearly critical, to the one that leaves A - X S and B - S X stable; false
/// where there is none further away than `rounding`. `distance`: how far from X it looked.
template <typename Scalar, int n1, int n2>
[[nodiscard]] JML_NOINLINE bool resolve(const RiccatiBlocks<Scalar, n1, n2>& k, Scalar rounding,
                                        Matrix<Scalar, n1, n2>& X, Scalar& gain, Scalar& distance,
                                        int& iterations) {
  constexpr Scalar still = Scalar(4 * (n1 + n2)) * std::numeric_limits<Scalar>::epsilon();
  Matrix<Scalar, n1, n2> moved = X, R;
  Matrix<Scalar, n1, n1> A0;
  Matrix<Scalar, n2, n2> B0;
  for (int pass = 0; pass < 6; ++pass) {
    k.residual(moved, A0, B0, R);
    const auto step = solve_by_doubling(A0, B0, k.accurate_residual(moved), k.S, kernel::norm(moved), 60);
    iterations += step.iterations;
    moved += step.Z;
    distance = kernel::norm(Matrix<Scalar, n1, n2>(moved - X));
    if (!step.converged) return false;
    if (kernel::norm(step.Z) > still * kernel::norm(moved)) continue;
    if (distance <= rounding) return false;
    X = moved;
    gain = step.gain;
    return true;
  }
  return false;
}

template <typename Scalar, int n1, int n2>
JML_NOINLINE void solve_cold(const BalancedRiccati<Scalar, n1, n2>& balanced,
                             AlgebraicSolution<Scalar, n1, n2>& out) {
  constexpr int m = n1 + n2;
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon(), rounding = Scalar(100 * m) * epsilon;
  const auto answer = [&out](Status status) { out.status = status; };
  Matrix<Scalar, m, m> K = balanced.K;
  const Scalar size = kernel::norm(K), critical = Scalar(8) * std::sqrt(std::sqrt(epsilon)) * size;
  kernel::OrderedSchur<Scalar, m> schur;
  Scalar gap = 0;
  out.shifted = false;
  for (int pass = 0;; ++pass) {
    if (!schur.compute(K, n2)) return answer(Status::not_converged);
    gap = schur.last_right().real() - schur.first_left().real();
    if (gap > critical || pass == n2) break;
    if (!shift_critical<Scalar, n1, n2>(schur, size, size / std::sqrt(Scalar(m)), K)) break;
    out.shifted = true;
  }
  if (!(gap > rounding * size)) return answer(Status::eigenvalues_on_axis);
  const Scalar neutral = out.shifted ? critical : Scalar(100) * rounding * size;
  if (schur.last_right().real() < -neutral || schur.first_left().real() > neutral)
    return answer(Status::no_stabilizing_solution);

  Matrix<Scalar, n1, n2> X, R;
  const bool regular = graph_of_subspace(schur, X);
  if (!all_finite(X)) return answer(Status::no_stabilizing_solution);

  const RiccatiBlocks<Scalar, n1, n2> original(balanced.K), k(K);
  Matrix<Scalar, n1, n1> A0;
  Matrix<Scalar, n2, n2> B0;
  Scalar terms = 0, gain = 0, distance = 0;
  bool converged = false;
  for (int pass = 0; pass < 2; ++pass) {
    terms = k.residual(X, A0, B0, R);
    const auto step = solve_by_doubling(A0, B0, k.accurate_residual(X), k.S, kernel::norm(X), 60);
    out.iterations += step.iterations;
    if (!step.converged) break;
    X += step.Z;
    gain = step.gain;
    converged = true;
    if (kernel::norm(step.Z) <= Scalar(1e-3) * std::sqrt(epsilon) * kernel::norm(X)) break;
  }
  const Scalar s = kernel::norm(original.S), unit = s > Scalar(0) ? size / s : Scalar(1);
  if (out.shifted && resolve(original, Scalar(10) * epsilon * unit, X, gain, distance, out.iterations)) {
    converged = true;
    out.shifted = false;
  }
  // Without Q zero is a solution, and a tolerance relative to it is none.
  if (!(kernel::largest(original.Q) > Scalar(0)) &&
      kernel::norm(X) <= (out.shifted ? std::sqrt(epsilon) : rounding) * unit) {
    kernel::set_zero(X);
    converged = true;
  }
  R = original.accurate_residual(X);
  out.residual = terms > Scalar(0) ? kernel::norm(R) / terms : Scalar(0);
  const Scalar weight = original.weight(X);
  out.error = error_bound(original, gain, kernel::norm(R) + epsilon * weight);
  // A gap of less than rounding would not have been seen.
  if (out.shifted)
    out.error += Scalar(10) * epsilon * unit + (std::isfinite(distance) ? distance : Scalar(0));
  // Not critical to rounding: the shifted equation's X is one of a neighbour.
  if (out.shifted && kernel::norm(R) > Scalar(4) * epsilon * weight)
    out.error += std::sqrt(kernel::norm(R) / kernel::norm(k.S));
  const bool solved =
      converged && kernel::norm(R) <= (out.shifted ? std::sqrt(epsilon) : backward_limit<Scalar, m>)*weight;
  // A singular U11 may stand for a large X; then all that follows is valid. Else it was an unseen mode.
  if (!regular && !(solved && out.error <= Scalar(1e-2) * kernel::norm(X)))
    return answer(Status::no_stabilizing_solution);
  if (!solved) return answer(gap > critical ? Status::not_converged : Status::eigenvalues_on_axis);
  out.X = X;
  out.status = out.shifted ? Status::accepted_critical : Status::ok;
}

/// Back to the caller's coordinates.
template <typename Scalar, int n1, int n2>
void finish(const AlgebraicRiccati<Scalar, n1, n2>& equation, const BalancedRiccati<Scalar, n1, n2>& balanced,
            AlgebraicSolution<Scalar, n1, n2>& out) {
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  if (!usable(out.status)) return kernel::set_zero(out.X);
  const Matrix<Scalar, n1, n2> X = out.X;
  out.X = balanced.out_of(X);
  const Scalar norm = kernel::norm(out.X);
  out.error *= balanced.unit();
  if (norm > Scalar(0)) out.error = out.error / norm + epsilon;
  // A bound by norms is quick; where it says little, or not enough, entry by entry.
  if (norm > Scalar(0) && !out.shifted && !(out.error <= Scalar(32) * std::sqrt(epsilon))) {
    const RiccatiBlocks<Scalar, n1, n2> k(balanced.K);
    Matrix<Scalar, n1, n2> bound;
    if (AlgebraicError<Scalar, n1, n2>(k, X).bound(bound))
      out.error = kernel::norm(balanced.out_of(bound)) / norm + epsilon;
  }
  if (norm > Scalar(0) && !(out.error < Scalar(1))) {
    out.status = Status::not_converged;
    return kernel::set_zero(out.X);
  }
  if constexpr (n1 == n2) {
    bool symmetric = equation.signs.AX == equation.signs.XB;
    for (int j = 0; j < n1; ++j) {
      for (int i = 0; i < n1; ++i) {
        symmetric &= equation.B(i, j) == equation.A(j, i) && equation.Q(i, j) == equation.Q(j, i) &&
                     equation.S(i, j) == equation.S(j, i);
      }
    }
    if (!symmetric) return;
    for (int j = 0; j < n1; ++j) {
      for (int i = 0; i < j; ++i) out.X(i, j) = out.X(j, i) = (out.X(i, j) + out.X(j, i)) / Scalar(2);
    }
  }
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
