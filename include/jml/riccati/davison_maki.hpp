// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Davison-Maki integration of eqs. (17)-(19) of Rusnak 2018, by Radon's lemma: fixed time, no heap, stiff or
/// not.
///
/// With frozen coefficients, P = Y X⁻¹ and x = q - P r, where (X, Y) and (r, q) obey one linear system,
///   Ẋ = -Bᵀ X + Dᵀ R⁻¹ E Y,    ṙ = -Bᵀ r + Dᵀ R⁻¹ E q - Dᵀ R⁻¹ (y - e),    X = I, r = 0 at the start,
///   Ẏ = G Q Gᵀ X + A Y,         q̇ = G Q Gᵀ r + A q + a,                    Y = P, q = x,
/// for f = A x + a and m = E x + e: differentiate, and (17), (19) appear. So one exponential of a 2n×2n
/// matrix H moves estimate and P together, exactly. Coefficients that vary are taken at the midpoint, which
/// is predicted with the gain of half a step: order 2. It is well conditioned while ‖H‖ h ≤ 1, H balanced:
/// longer steps go in pieces.
///
/// Within a step f and m have the slopes A and E of the rule. Where these are SDC matrices and no Jacobians
/// (SDDRE, RNLS) and the gain is stiff, steps must be short against the filter's own time constant for x to
/// follow a moving y.
///
/// The formula steps through a pole of P without notice. With a symmetric P ≥ 0 there is none. Otherwise a
/// piece is taken only where X stays within 1 of the identity, or where sym(E P Dᵀ) ≥ 0 before and after it
/// and det X > 0; else it is cut in sixteen, and if that does not help, P escapes.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/riccati/differential.hpp>
#include <jml/solve/balance.hpp>
#include <jml/solve/exponential.hpp>

namespace jml {

/// `substeps` equal steps over an interval, each with its own midpoint coefficients; at most `max_pieces`
/// exponentials' lengths a step.
struct DavisonMaki {
  int substeps = 1;       ///< over an interval, each with its own coefficients
  int max_pieces = 4096;  ///< of a step; needs it more: step_limit
};

namespace detail {

/// The frozen flow ż = H z + c + r s of one piece of a step, z the columns of [X Y]ᵀ and of (r, q).
template <typename Scalar, int n>
struct RadonFlow {
  static constexpr int m = 2 * n;
  Matrix<Scalar, m, m> H = kernel::zeros<Matrix<Scalar, m, m>>();
  Vector<Scalar, m> c = kernel::zeros<Vector<Scalar, m>>(), ramp = kernel::zeros<Vector<Scalar, m>>();
  Scalar norm = 0;  ///< of H, balanced

  /// The first of `pieces` equal parts.
  [[nodiscard]] RadonFlow part(int pieces) const {
    const Scalar share = Scalar(1) / Scalar(pieces);
    return {H * share, c * share, ramp * (share * share), norm * share};
  }

  /// What one piece does to the pair.
  struct Piece {
    Vector<Scalar, n> x;
    Matrix<Scalar, n, n> P;
    Scalar distance;  ///< ‖X - I‖₁
    bool positive;    ///< det X > 0
  };

  /// (x, P) after a piece, given E = e^{Hτ} and v = φ τ c. False where X is singular or not finite.
  static bool apply(const Matrix<Scalar, m, m>& E, const Vector<Scalar, m>& v, const Vector<Scalar, n>& x,
                    const Matrix<Scalar, n, n>& P, Piece& out) {
    Matrix<Scalar, n, n> X, Y;
    const Matrix<Scalar, n, n> E11 = E.template block<n, n>(0, 0), E12 = E.template block<n, n>(0, n);
    const Matrix<Scalar, n, n> E21 = E.template block<n, n>(n, 0), E22 = E.template block<n, n>(n, n);
    kernel::add_product<1>(E11, E12, P, X);  // X = E11 + E12 P
    kernel::add_product<1>(E21, E22, P, Y);  // Y = E21 + E22 P
    Vector<Scalar, n> r = kernel::block<n, 1>(v, 0, 0), q = kernel::block<n, 1>(v, n, 0);
    kernel::add_product<1>(r, E12, x, r);  // r = v1 + E12 x
    kernel::add_product<1>(q, E22, x, q);  // q = v2 + E22 x
    out.distance = 0;
    for (int j = 0; j < n; ++j) {
      Scalar sum = 0;
      for (int i = 0; i < n; ++i) sum += std::abs(X(i, j) - Scalar(i == j));
      out.distance = sum > out.distance ? sum : out.distance;
    }
    kernel::GeneralFactor<Scalar, n> factor;
    if (!factor.factor(X, kernel::filled<Vector<Scalar, n>>(1))) return false;
    bool negative = false;
    for (int k = 0; k < n; ++k) {
      negative ^= factor.inverse_diagonal(k) < Scalar(0);
      for (int j = k + 1; j < n; ++j) negative ^= factor.order[k] > factor.order[j];
    }
    out.positive = !negative;
    factor.right_solve(Y, out.P);                 // P = Y X⁻¹
    kernel::add_product<-1>(q, out.P, r, out.x);  // x = q - P r
    return true;
  }
};

/// sym(E P Dᵀ) ≥ 0, with W = Dᵀ R⁻¹: then the quadratic term has no pole ahead.
template <typename Scalar, int n, int p>
bool damps(const RiccatiCoefficients<Scalar, n, p>& at, const Matrix<Scalar, p, p>& R,
           const Matrix<Scalar, n, n>& P) {
  Matrix<Scalar, n, p> DT, PD;
  kernel::product(at.W, R, DT);  // Dᵀ = W R
  kernel::product(P, DT, PD);    // P Dᵀ
  Matrix<Scalar, p, p> feedback;
  kernel::product(at.E, PD, feedback);  // E P Dᵀ
  const Matrix<Scalar, p, p> symmetric_part = kernel::symmetric_part(feedback);
  return is_definite<Definite::positive_or_zero>(symmetric_part);
}

}  // namespace detail

/// Moves (x, P) over dt from `time`; both are touched on refusal too, and not asked to be finite.
template <typename Flow>
[[nodiscard]] Status advance(const DavisonMaki& method, Flow& flow, double time, typename Flow::Scalar dt,
                             typename Flow::X& x, typename Flow::Square& P, typename Flow::Report& report) {
  using Scalar = typename Flow::Scalar;
  using Square = typename Flow::Square;
  using X = typename Flow::X;
  constexpr int n = Flow::n, p = Flow::p, m = 2 * n;
  using Radon = detail::RadonFlow<Scalar, n>;
  constexpr Scalar reach = Scalar(kernel::exponential_reach);
  if (method.substeps < 1 || method.max_pieces < 1) return Status::invalid_option;
  const Scalar h = dt / Scalar(method.substeps);
  for (int step = 0; step < method.substeps; ++step) {
    const double start = time + static_cast<double>(h) * step, middle = start + static_cast<double>(h) / 2;
    typename Flow::Coefficients at;
    X drift;
    Vector<Scalar, p> innovation;

    X between;
    if (const Status status = flow.midpoint(start, x, P, h / 2, between, step == 0 ? &report : nullptr);
        status != Status::ok)
      return status;
    if (const Status status = flow.coefficients(middle, between, at, drift, innovation); status != Status::ok)
      return status;

    Radon radon;
    kernel::set_block(radon.H, 0, 0, -kernel::transposed(at.B));
    kernel::set_block(radon.H, n, 0, at.noise);
    kernel::set_block(radon.H, n, n, at.A);
    {  // at the midpoint
      X affine;
      kernel::add_product<-1>(drift, at.A, between, affine);  // a = f - A x
      kernel::set_block(radon.c, n, 0, affine);
    }
    if constexpr (p > 0) {
      Square WE;
      kernel::product(at.W, at.E, WE);  // Dᵀ R⁻¹ E
      kernel::set_block(radon.H, 0, n, WE);
      kernel::add_product<1>(innovation, at.E, between, innovation);  // y - e = y - m + E x
      X pull;
      kernel::product(at.W, innovation, pull);  // Dᵀ R⁻¹ (y - e)
      kernel::set_block(radon.c, 0, 0, X(-pull));
      // y moves from its value at the start to that at the end, by way of the midpoint
      const Vector<Scalar, p> change = measurement_residual(
          flow.sensor(), Vector<Scalar, p>(flow.measured_at(start + static_cast<double>(h))),
          flow.measured_at(start));
      kernel::product(at.W, change, pull);  // Dᵀ R⁻¹ (y(h) - y(0))
      kernel::set_block(radon.ramp, 0, 0, X(-pull));
      radon.c -= radon.ramp / Scalar(2);
    }
    radon.H *= h;
    radon.c *= h;
    radon.ramp *= h;
    radon.norm = kernel::largest_column_sum(radon.H);
    if (radon.norm > reach) {
      Matrix<Scalar, m, m> balanced = radon.H;
      (void)kernel::balance(balanced);
      radon.norm = kernel::largest_column_sum(balanced);
    }
    if (!(radon.norm <= reach * Scalar(method.max_pieces)))
      return std::isfinite(radon.norm) ? Status::step_limit : Status::dynamics_not_finite;
    const double wanted =
        std::ceil(static_cast<double>(radon.norm / reach));  // beyond int where float rounds
    const int pieces = !(wanted > 1)                ? 1
                       : wanted < method.max_pieces ? static_cast<int>(wanted)
                                                    : method.max_pieces;
    typename Radon::Piece moved;
    const auto sure = [&](const Square& before) {
      if constexpr (Flow::symmetric || p == 0)
        return true;
      else
        return moved.distance < Scalar(1) || (moved.positive && detail::damps(at, flow.R(), before) &&
                                              detail::damps(at, flow.R(), moved.P));
    };
    // Moves through equal parts of `whole`; the first that cannot be taken ends it, with x, P of its start.
    const auto walk = [&](const Radon& whole, int parts, const auto& otherwise) {
      const Radon part = whole.part(parts);
      const kernel::Exponential<Scalar, m> exponential(part.H, part.norm);
      Vector<Scalar, m> v = exponential.phi1(part.c), step_v = kernel::zeros<Vector<Scalar, m>>();
      if (part.ramp != kernel::zeros<Vector<Scalar, m>>()) {
        v += exponential.phi2(part.ramp);
        step_v = exponential.phi1(part.ramp);
      }
      for (int i = 0; i < parts; ++i) {
        if (!Radon::apply(exponential.value(), v, x, P, moved) || !sure(P)) {
          Radon rest = part;
          rest.c += Scalar(i) * part.ramp;
          if (const Status status = otherwise(rest); status != Status::ok) return status;
        } else {
          kernel::assign(x, moved.x);
          kernel::assign(P, moved.P);
        }
        v += step_v;
      }
      return Status::ok;
    };
    const Status status = walk(radon, pieces, [&](const Radon& piece) {
      if (!all_finite(x) || !all_finite(P) || !all_finite(piece.H) || !all_finite(piece.c))
        return Status::dynamics_not_finite;  // the caller finds out what is not
      if (Flow::symmetric || p == 0) return Status::covariance_lost;
      return walk(piece, 16, [](const Radon&) { return Status::riccati_escape; });
    });
    if (status != Status::ok) return status;
    if constexpr (Flow::symmetric) P = kernel::symmetric_part(P);
  }
  report.steps = method.substeps;
  report.evaluations = 2L * method.substeps;
  return Status::ok;
}

}  // namespace jml
#include <jml/warnings_end.hpp>
