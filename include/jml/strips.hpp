// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Columns of a compile-time length, walked in packets from or to a row that is known at run time only: what
/// factorisations need beside the products of kernels.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstdint>
#include <cstring>
#include <jml/kernels.hpp>

namespace jml::kernel {

/// How the rows of a column of n numbers are walked: four packets at a time, then what is left of them, and
/// smaller ones at an end that no packet fits.
template <typename Scalar, int n>
struct Strip {
  static constexpr int width = lanes<Scalar, n>(n);
  using P = typename Packet<Scalar, width>::type;
  static constexpr int padded = (n + width - 1) / width * width;  ///< rows that whole packets cover

  /// use(i, block) for blocks from row 0 on that hold at least rows [0, rows).
  template <typename Use>
  JML_INLINE static void each(int rows, const Use& use) {
    int i = 0;
    if constexpr (4 * width <= n) {
      for (; i + 3 * width < rows && i + 4 * width <= n; i += 4 * width) use(i, Block<P, 4>{});
    }
    if constexpr (3 * width <= n) {
      if (i + 2 * width < rows && i + 3 * width <= n) {
        use(i, Block<P, 3>{});
        i += 3 * width;
      }
    }
    if constexpr (2 * width <= n) {
      if (i + width < rows && i + 2 * width <= n) {
        use(i, Block<P, 2>{});
        i += 2 * width;
      }
    }
    if (i < rows && i + width <= n) {
      use(i, Block<P, 1>{});
      i += width;
    }
    if constexpr (n % width >= 2 && width > 2) {
      if (i < rows && i + 2 <= n) {
        use(i, Block<typename Packet<Scalar, 2>::type, 1>{});
        i += 2;
      }
    }
    if constexpr (n % width != 0) {
      for (; i < rows; ++i) use(i, Block<Scalar, 1>{});
    }
  }

  /// use(i, block) for blocks that hold at least rows [first, n), each row of them once.
  template <typename Use>
  JML_INLINE static void each_from(int first, const Use& use) {
    int i = first / width * width;
    if constexpr (4 * width <= n) {
      for (; i + 4 * width <= n; i += 4 * width) use(i, Block<P, 4>{});
    }
    if constexpr (2 * width <= n) {
      if (i + 2 * width <= n) {
        use(i, Block<P, 2>{});
        i += 2 * width;
      }
    }
    if (i + width <= n) {
      use(i, Block<P, 1>{});
      i += width;
    }
    if constexpr (n % width >= 2 && width > 2) {
      if (i + 2 <= n) {
        use(i, Block<typename Packet<Scalar, 2>::type, 1>{});
        i += 2;
      }
    }
    if constexpr (n % width != 0) {
      for (; i < n; ++i) use(i, Block<Scalar, 1>{});
    }
  }

  /// Σ a_i b_i over at least the first `rows`.
  [[nodiscard]] JML_INLINE static Scalar dot(int rows, const Scalar* a, const Scalar* b) {
    P sums = P{}, others = P{};
    int i = 0;
    const auto term = [&](int at) JML_INLINE {
      P x, y;
      std::memcpy(&x, a + at, sizeof(P));
      std::memcpy(&y, b + at, sizeof(P));
      return P(x * y);
    };
    for (; i + width < rows && i + 2 * width <= n; i += 2 * width) {
      sums += term(i);
      others += term(i + width);
    }
    if (i < rows && i + width <= n) {
      sums += term(i);
      i += width;
    }
    sums += others;
    Scalar sum = 0;
    if constexpr (width == 1) {
      sum = sums;
    } else {
      JML_WRITTEN_OUT for (int c = 0; c < width; ++c) sum += sums[c];
    }
    if constexpr (n % width != 0) {
      for (; i < rows; ++i) sum += a[i] * b[i];
    }
    return sum;
  }

  /// out_i = a_i b_i.
  JML_INLINE static void product(const Scalar* a, const Scalar* b, Scalar* out) {
    each(n, [&](int i, auto x) JML_INLINE {
      auto y = x;
      x.load(a + i);
      y.load(b + i);
      x.multiply(y);
      x.store(out + i);
    });
  }
  /// a_i -= factor b_i.
  JML_INLINE static void subtract(Scalar* a, const Scalar* b, Scalar factor) {
    each(n, [&](int i, auto x) JML_INLINE {
      auto y = x;
      x.load(a + i);
      y.load(b + i);
      x.subtract(y, factor);
      x.store(a + i);
    });
  }

  /// `count` packets of consecutive rows.
  template <typename T, int count>
  struct Block {
    T part[count];

    static constexpr int each = static_cast<int>(sizeof(T) / sizeof(Scalar));
    // One by one: a copy of the whole array would go through memory.
    JML_INLINE void load(const Scalar* from) {
      JML_WRITTEN_OUT for (int c = 0; c < count; ++c) std::memcpy(&part[c], from + c * each, sizeof(T));
    }
    JML_INLINE void store(Scalar* to) const {
      JML_WRITTEN_OUT for (int c = 0; c < count; ++c) std::memcpy(to + c * each, &part[c], sizeof(T));
    }
    JML_INLINE void clear() { JML_WRITTEN_OUT for (int c = 0; c < count; ++c) part[c] = T{}; }
    JML_INLINE void scale(Scalar factor) {
      JML_WRITTEN_OUT for (int c = 0; c < count; ++c) part[c] *= factor;
    }
    JML_INLINE void make_positive() {
      if constexpr (std::is_arithmetic_v<T>) {
        part[0] = std::abs(part[0]);
        JML_WRITTEN_OUT for (int c = 1; c < count; ++c) part[c] = std::abs(part[c]);
      } else {
        using Bits = std::conditional_t<sizeof(Scalar) == 8, std::int64_t, std::int32_t>;
        using Mask = typename Packet<Bits, each>::type;
        JML_WRITTEN_OUT for (int c = 0; c < count; ++c) part[c] =
            T(Mask(part[c]) & std::numeric_limits<Bits>::max());  // the sign bit away
      }
    }
    JML_INLINE void multiply(const Block& a) {
      JML_WRITTEN_OUT for (int c = 0; c < count; ++c) part[c] *= a.part[c];
    }
    /// += a factor.
    JML_INLINE void add(const Block& a, Scalar factor) {
      JML_WRITTEN_OUT for (int c = 0; c < count; ++c) part[c] += a.part[c] * factor;
    }
    JML_INLINE void add(const Block& a, const Block& factors) {
      JML_WRITTEN_OUT for (int c = 0; c < count; ++c) part[c] += a.part[c] * factors.part[c];
    }
    JML_INLINE void subtract(const Block& a, Scalar factor) {
      JML_WRITTEN_OUT for (int c = 0; c < count; ++c) part[c] -= a.part[c] * factor;
    }
    JML_INLINE void subtract(const Block& a, const Block& factors) {
      JML_WRITTEN_OUT for (int c = 0; c < count; ++c) part[c] -= a.part[c] * factors.part[c];
    }
  };
};

/// out_i += Σ_j a_ij² weights_j, of rows from `first` on: eight packets and what is left behind them in one
/// pass.
template <int first = 0, typename Scalar, int n>
JML_INLINE inline void add_weighted_squares(const Matrix<Scalar, n, n>& a, const Vector<Scalar, n>& weights,
                                            Vector<Scalar, n>& out) {
  if constexpr (n <= 3) {
    repeat<n>([&](int i) JML_INLINE {
      repeat<n>([&](int j) JML_INLINE { out(i) += a(i, j) * a(i, j) * weights(j); });
    });
  } else {
    constexpr int width = lanes<Scalar, n>(n - first);
    constexpr int most = width > 1 ? 8 * width : 4;  // packets in registers; without them a short loop
    constexpr int span = n - first < most ? n - first : most;
    Column<Scalar, span, width> sum;
    sum.load(&out(first));
    const auto add_column = [&](int j) JML_INLINE {
      Column<Scalar, span, width> entry, weighted;
      entry.load(&a(first, j));
      weighted = entry;
      weighted.scale(weights(j));
      sum.add(weighted, entry);
    };
    if constexpr (width > 1) {
      repeat<n>(add_column);
    } else {
      JML_TWICE for (int j = 0; j < n; ++j) add_column(j);
    }
    sum.store(&out(first));
    if constexpr (first + span < n) add_weighted_squares<first + span>(a, weights, out);
  }
}

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
