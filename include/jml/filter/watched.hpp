// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The belief of a symmetric rule in the plain form, which may keep more digits than it shows; and whether
/// those of its P suffice.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/estimate.hpp>
#include <jml/factors.hpp>
#include <jml/rounding.hpp>

namespace jml {

/// An estimate by a symmetric rule in the plain form: x and P, which may be the rounded parts of numbers with
/// twice as many digits.
template <typename Scalar, int n>
struct WatchedEstimate : Estimate<Scalar, n> {
  bool extended = false;    ///< x_low and P_low hold digits; else they are not to be read
  bool exact = false;       ///< x, with x_low, has never been rounded to Scalar
  bool fine = false;        ///< a measurement has asked for more digits of x: they are kept from then on
  Scalar spread = 0;        ///< of an iterated rule: largest variance over its pivot, ≥ 1; 0: not known yet
  Vector<Scalar, n> x_low;  ///< what x lacks, where `extended`
  Matrix<Scalar, n, n> P_low;  ///< what P lacks, where `extended`

  WatchedEstimate()
      : x_low(kernel::zeros<Vector<Scalar, n>>()), P_low(kernel::zeros<Matrix<Scalar, n, n>>()) {}
  /// What is to be written before it is read is not set.
  explicit WatchedEstimate(Scratch scratch) : Estimate<Scalar, n>(scratch) {}
  /// x and P, without digits beyond them.
  explicit WatchedEstimate(const Estimate<Scalar, n>& estimate) : WatchedEstimate() {
    kernel::assign(this->x, estimate.x);
    kernel::assign(this->P, estimate.P);
  }
  /// Part by part, by take().
  /// @{
  WatchedEstimate(const WatchedEstimate& other) : WatchedEstimate() { take(other); }
  WatchedEstimate& operator=(const WatchedEstimate& other) {
    take(other);
    return *this;
  }
  /// @}

  /// The low part of P; null where it has none, as at a start, of which x alone may get one.
  [[nodiscard]] const Scalar* low_of_P() const {
    return extended && spread > Scalar(0) ? P_low.data() : nullptr;
  }

  /// *this = next, part by part: what was just stored in pieces is slow to load back as a whole.
  JML_INLINE void take(const WatchedEstimate& next) {
    kernel::assign(this->x, next.x);
    kernel::assign(this->P, next.P);
    extended = next.extended;
    exact = next.exact;
    fine = next.fine;
    spread = next.spread;
    if (next.extended) {
      kernel::assign(x_low, next.x_low);
      kernel::assign(P_low, next.P_low);
    }
  }
};

template <typename Scalar, int n>
struct PartsOf<WatchedEstimate<Scalar, n>> {
  static auto each(auto& e, auto&& f) {
    return f(e.x, e.P, e.extended, e.exact, e.fine, e.spread, part_if(e.extended, e.x_low),
             part_if(e.extended, e.P_low));
  }
};

namespace detail {

template <typename Scalar, int n>
JML_NOINLINE Scalar find_spread(const Matrix<Scalar, n, n>& P) {
  const Pivots<Scalar> found = pivots_with_zeros<Scalar, n>(P, kernel::diagonal(P));
  return found.positive ? found.loss : std::numeric_limits<Scalar>::infinity();
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

template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline bool is_extended(const Estimate<Scalar, n>&) {
  return false;
}
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline bool is_extended(const WatchedEstimate<Scalar, n>& estimate) {
  return estimate.extended;
}

/// x of a belief without low parts is what it was rounded to.
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline bool is_exact(const Estimate<Scalar, n>&) {
  return false;
}
template <typename Scalar, int n>
[[nodiscard]] JML_INLINE inline bool is_exact(const WatchedEstimate<Scalar, n>& estimate) {
  return estimate.exact;
}

/// The variance of each row of a measurement given the others, 1/(R⁻¹)_ii; zero where R is singular.
template <typename Scalar, int p>
[[nodiscard]] JML_NOINLINE Vector<Scalar, p> conditional_variances(Matrix<Scalar, p, p> R) {
  Vector<Scalar, p> out = kernel::diagonal(R);
  kernel::SymmetricFactor<Scalar, p> factor;
  if (is_diagonal(R)) return out;
  const bool regular = factor.factor(R);
  for (int i = 0; i < p; ++i)
    out(i) = regular
                 ? Scalar(1) / factor.solve(kernel::column_of(kernel::identity<Matrix<Scalar, p, p>>(), i))(i)
                 : Scalar(0);
  return out;
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

/// x of no known state was rounded.
struct KnownStay {
  template <typename Variances>
  bool operator()(const Variances&) const {
    return true;
  }
};

/// P has digits left. Of a symmetric rule: it is a covariance, what it came from has `sizes`, squared, and
/// the S of its correction the condition `condition`; of another one it came from N. `known`(P_ii), asked
/// where some are zero: x of those has digits left.
template <typename Rule, typename Scalar, int n, typename Sizes, typename Known = KnownStay>
[[nodiscard]] JML_INLINE inline bool has_digits(const Matrix<Scalar, n, n>& P, const Matrix<Scalar, n, n>& N,
                                                const Sizes& sizes, Scalar condition, Scalar& rounding,
                                                const Known& known = {}) {
  constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
  if constexpr (Rule::symmetric) {
    Pivots<Scalar> found = pivots_of(P, sizes);
    if (!found.positive) {
      found = pivots_with_zeros<Scalar, n>(P, sizes);
      found.positive = found.positive && known(kernel::diagonal(P));
    }
    rounding = epsilon * (condition * found.loss);
    return found.positive && rounding <= plain_error<Scalar>;
  } else {
    rounding = epsilon * (condition * largest_loss(N, P));
    return rounding <= plain_error<Scalar> && all_finite(P);
  }
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
