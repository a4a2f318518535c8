// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Anderson acceleration of a fixed-point map z = g(z), depth 2 (Walker and Ni 2011, SIAM J. Numer. Anal.
/// 49).
#pragma once

#include <jml/linear_algebra.hpp>
#include <limits>

namespace jml {

/// Holds the last two differences of g and of f = g(z) - z, and proposes the next point
/// g - ΔG γ with γ = argmin |f - ΔF γ| in the norm Σ weight_i f_i². Plain g where the differences say
/// nothing.
template <typename Scalar, int size>
class Anderson {
 public:
  /// `weights`: positive, 1/unit² of each component, so that units do not matter.
  explicit Anderson(const Vector<Scalar, size>& weights) : weights_(weights) {}

  /// The next point after g was found at z.
  Vector<Scalar, size> propose(const Vector<Scalar, size>& z, const Vector<Scalar, size>& g) {
    const Vector<Scalar, size> f = g - z;
    if (calls_ > 0) {
      const int slot = calls_ % 2;
      change_f_[slot] = f - last_f_;
      change_g_[slot] = g - last_g_;
    }
    last_f_ = f;
    last_g_ = g;
    ++calls_;
    if (calls_ == 1) return g;

    constexpr Scalar flat = Scalar(64) * std::numeric_limits<Scalar>::epsilon();
    const int newest = (calls_ - 1) % 2, other = calls_ % 2;
    const Vector<Scalar, size> weighted = weights_.cwiseProduct(change_f_[newest]);
    const Scalar a11 = weighted.dot(change_f_[newest]), b1 = weighted.dot(f);
    if (!(a11 > Scalar(0)) || !std::isfinite(a11)) return g;
    if (calls_ > 2) {
      const Scalar a12 = weighted.dot(change_f_[other]);
      const Vector<Scalar, size> weighted_other = weights_.cwiseProduct(change_f_[other]);
      const Scalar a22 = weighted_other.dot(change_f_[other]), b2 = weighted_other.dot(f);
      const Scalar determinant = a11 * a22 - a12 * a12;
      if (determinant > flat * a11 * a22) {
        const Scalar scale = Scalar(1) / determinant;
        return g - change_g_[newest] * ((b1 * a22 - b2 * a12) * scale) -
               change_g_[other] * ((b2 * a11 - b1 * a12) * scale);
      }
    }
    return g - change_g_[newest] * (b1 / a11);
  }

  /// Forgets the past; the next proposal is g itself.
  void restart() { calls_ = 0; }

 private:
  Vector<Scalar, size> weights_, last_f_, last_g_;
  Vector<Scalar, size> change_f_[2], change_g_[2];
  int calls_ = 0;
};

}  // namespace jml
