// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A sum of products in twice the working precision, for residuals whose terms cancel (Ogita, Rump, Oishi
/// 2005: error-free sum and product, the errors summed beside).
#include <jml/warnings_begin.hpp>
#pragma once

#include <cmath>
#include <limits>

namespace jml::kernel {

template <typename Scalar>
class CompensatedSum {
 public:
  void add(Scalar x) {
    const Scalar next = sum_ + x, part = next - sum_;
    error_ += (sum_ - (next - part)) + (x - part);
    sum_ = next;
  }

  void add_product(Scalar a, Scalar b) {
    const Scalar p = a * b;
    error_ += product_error(a, b, p);
    add(p);
  }

  /// The sum, rounded once; what that leaves over.
  [[nodiscard]] Scalar value() const { return sum_ + error_; }
  [[nodiscard]] Scalar rest() const { return error_ - (value() - sum_); }

 private:
  /// a b - p exactly.
  static Scalar product_error(Scalar a, Scalar b, Scalar p) {
#if defined(__FP_FAST_FMA) && defined(__FP_FAST_FMAF)
    return std::fma(a, b, -p);
#else
    const Halves x = split(a), y = split(b);
    return x.low * y.low - (((p - x.high * y.high) - x.low * y.high) - x.high * y.low);
#endif
  }

  struct Halves {
    Scalar high, low;
  };
  static Halves split(Scalar a) {
    constexpr Scalar factor = Scalar((1LL << ((std::numeric_limits<Scalar>::digits + 1) / 2)) + 1);
    const Scalar wide = factor * a, high = wide - (wide - a);
    return {high, a - high};
  }

  Scalar sum_ = 0, error_ = 0;
};

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
