// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Anderson acceleration of a fixed-point map z = g(z), depth 2 (Walker and Ni 2011, SIAM J. Numer. Anal.
/// 49).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/linear_algebra.hpp>
#include <limits>

namespace jml {

/// Holds the last two differences of g and of f = g(z) - z, and proposes the next point
/// g - ΔG γ with γ = argmin |f - ΔF γ|, components in units of 1/weight. Plain g where the differences say
/// nothing.
template <typename Scalar, int size>
class Anderson {
  using Z = Vector<Scalar, size>;

 public:
  /// The next point after g was found at z. `weights`: positive, one over the unit of each component.
  JML_INLINE Z propose(const Z& z, const Z& g, const Z& weights) {
    Z f, out;
    kernel::assign(out, g);
    each([&](int i) JML_INLINE { f(i) = weights(i) * (g(i) - z(i)); });
    if (calls_ > 0) {
      each([&](int i) JML_INLINE {
        older_f_(i) = newer_f_(i);
        older_g_(i) = newer_g_(i);
        newer_f_(i) = f(i) - last_f_(i);
        newer_g_(i) = g(i) - last_g_(i);
      });
      constexpr Scalar flat = Scalar(64) * std::numeric_limits<Scalar>::epsilon();
      const Scalar a11 = dot(newer_f_, newer_f_), b1 = dot(newer_f_, f);
      const bool two = calls_ > 1;
      const Scalar a12 = two ? dot(newer_f_, older_f_) : Scalar(0),
                   a22 = two ? dot(older_f_, older_f_) : Scalar(0);
      const Scalar b2 = two ? dot(older_f_, f) : Scalar(0);
      const Scalar determinant = a11 * a22 - a12 * a12;
      if (determinant > flat * a11 * a22) {
        const Scalar scale = Scalar(1) / determinant;
        const Scalar newer = (b1 * a22 - b2 * a12) * scale, older = (b2 * a11 - b1 * a12) * scale;
        each([&](int i) JML_INLINE { out(i) = g(i) - newer_g_(i) * newer - older_g_(i) * older; });
      } else if (a11 > Scalar(0)) {
        const Scalar newer = b1 / a11;
        each([&](int i) JML_INLINE { out(i) = g(i) - newer_g_(i) * newer; });
      }
    }
    kernel::assign(last_f_, f);
    kernel::assign(last_g_, g);
    ++calls_;
    return out;
  }

  /// Forgets the past; the next proposal is g itself.
  void restart() { calls_ = 0; }

 private:
  template <typename F>
  JML_INLINE static void each(const F& f) {
    kernel::repeat<size, 6>(f);
  }

  /// Two partial sums: half the wait of one.
  JML_INLINE static Scalar dot(const Z& a, const Z& b) {
    Scalar even = 0, odd = 0;
    kernel::repeat<size / 2, 3>([&](int i) JML_INLINE {
      even += a(2 * i) * b(2 * i);
      odd += a(2 * i + 1) * b(2 * i + 1);
    });
    if constexpr (size % 2 == 1) even += a(size - 1) * b(size - 1);
    return even + odd;
  }

  Z last_f_ = kernel::zeros<Z>(), last_g_ = kernel::zeros<Z>(), newer_f_ = kernel::zeros<Z>(),
    newer_g_ = kernel::zeros<Z>(), older_f_ = kernel::zeros<Z>(), older_g_ = kernel::zeros<Z>();
  int calls_ = 0;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
