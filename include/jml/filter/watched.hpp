// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The belief of a symmetric rule in the plain form: x and P, and how far P is from singular.
#pragma once

#include <jml/estimate.hpp>
#include <jml/rounding.hpp>

namespace jml {

/// An estimate by a symmetric rule, and how far its P is from singular.
template <typename Scalar, int n>
struct WatchedEstimate : Estimate<Scalar, n> {
  Scalar spread = 0;  ///< largest variance over its Cholesky pivot, ≥ 1; 0: not known yet

  /// *this = next, part by part: what was just stored in pieces is slow to load back as a whole.
  JML_INLINE void take(const WatchedEstimate& next) {
    kernel::assign(this->x, next.x);
    kernel::assign(this->P, next.P);
    spread = next.spread;
  }
};

namespace detail {

template <typename Scalar, int n>
JML_NOINLINE Scalar find_spread(const Matrix<Scalar, n, n>& P) {
  const Pivots<Scalar> found = pivots_with_zeros<Scalar, n>(P, P);
  return found.positive ? found.spread : std::numeric_limits<Scalar>::infinity();
}
template <typename Scalar, int n>
[[nodiscard]] Scalar spread_of(const Estimate<Scalar, n>& estimate) {
  return find_spread(estimate.P);
}
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Scalar spread_of(const WatchedEstimate<Scalar, n>& estimate) {
  return estimate.spread > Scalar(0) ? estimate.spread : find_spread(estimate.P);
}
template <typename Scalar, int n>
void note_spread(Estimate<Scalar, n>&, Scalar) {}
template <typename Scalar, int n>
JML_INLINE inline void note_spread(WatchedEstimate<Scalar, n>& estimate, Scalar spread) {
  estimate.spread = spread;
}

/// The largest |N_ii| over |P_ii|, where N_ii is not zero.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline Scalar largest_loss(const Matrix<Scalar, n, n>& N,
                                                    const Matrix<Scalar, n, n>& P) {
  Scalar most = 1;
  kernel::repeat<n>([&](int i) JML_INLINE {
    const Scalar loss = std::abs(N(i, i)) / std::abs(P(i, i));
    most = loss > most ? loss : most;  // 0/0 is no loss
  });
  return most;
}

/// P is a covariance, or of a nonsymmetric rule a Riccati matrix, with digits left: what it came from is N,
/// in which rounding had grown by `growth`.
template <typename Rule, typename Scalar, int n>
[[nodiscard]] JML_INLINE inline bool has_digits(const Matrix<Scalar, n, n>& N, const Matrix<Scalar, n, n>& P,
                                                Scalar growth, Scalar& spread, Scalar& rounding) {
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  if constexpr (Rule::symmetric) {
    Pivots<Scalar> found = pivots_of(P, N);
    if (!found.positive) found = pivots_with_zeros<Scalar, n>(P, N);
    spread = found.spread;
    rounding = epsilon * (growth * found.loss);
    return found.positive && rounding <= plain_error<Scalar>;
  } else {
    rounding = epsilon * (growth * largest_loss(N, P));
    return rounding <= plain_error<Scalar> && all_finite(P);
  }
}

}  // namespace detail

}  // namespace jml
