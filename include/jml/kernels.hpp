// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Products of compile-time size, for the recursion's inner lines.
///
/// Fixed-size Eigen leaves a factor of two on odd sizes (15 columns of doubles cannot be split into whole
/// packets) and a symmetric product is computed twice. Here a column of the result stays in registers, an
/// odd length is covered by ever smaller packets, and a symmetric result is computed
/// as one triangle of blocks and mirrored: exactly symmetric. bench/ holds the figures.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/column.hpp>
#include <jml/linear_algebra.hpp>

namespace jml::kernel {

/// Rows [first, rows) of one column of out = start + sign · Σ_k a.col(k) coefficient(k), held in registers:
/// up to eight packets and what is left behind them in one pass over k. With `from_zero` there is no start.
template <int rows, int inner, int first, int sign, bool from_zero, typename Scalar, typename Coefficient>
JML_INLINE inline void column(Scalar* out, const Scalar* start, const Scalar* a,
                              const Coefficient& coefficient) {
  if constexpr (rows > 0) {
    constexpr int width = lanes<Scalar, rows>(rows - first);
    constexpr int span = rows - first < 8 * width ? rows - first : 8 * width;
    constexpr bool begins = from_zero && inner > 0;  // with its first term: 0 + ab is an addition to GCC
    Column<Scalar, span, width> sum;
    if constexpr (!from_zero) {
      sum.load(start + first);
    } else if constexpr (begins) {
      sum.load(a + first);
      sum.scale(sign > 0 ? coefficient(0) : -coefficient(0));
    } else {
      sum.clear();
    }
    repeat<inner - begins>([&](int turn) JML_INLINE {
      const int k = turn + begins;
      const Scalar factor = sign > 0 ? coefficient(k) : -coefficient(k);
      Column<Scalar, span, width> term;
      term.load(a + k * rows + first);
      sum.add(term, factor);
    });
    sum.store(out + first);
    if constexpr (first + span < rows) {
      column<rows, inner, first + span, sign, from_zero>(out, start, a, coefficient);
    }
  }
}

/// Column `to` of b = column `from` of a; the same times a factor; less that. In packets, which a loop over
/// entries of two matrices that might overlap does not get.
template <typename Scalar, int rows, int cols, int others>
JML_INLINE inline void copy_column(const Matrix<Scalar, rows, cols>& a, int from,
                                   Matrix<Scalar, rows, others>& b, int to) {
  column<rows, 0, 0, 1, false>(b.data() + to * rows, a.data() + from * rows, a.data(),
                               [](int) { return Scalar(0); });
}
template <typename Scalar, int rows, int cols, int others>
JML_INLINE inline void scale_column(const Matrix<Scalar, rows, cols>& a, int from, Scalar factor,
                                    Matrix<Scalar, rows, others>& b, int to) {
  column<rows, 1, 0, 1, true>(b.data() + to * rows, static_cast<const Scalar*>(nullptr),
                              a.data() + from * rows, [factor](int) { return factor; });
}
template <typename Scalar, int rows, int cols, int others>
JML_INLINE inline void subtract_column(const Matrix<Scalar, rows, cols>& a, int from, Scalar factor,
                                       Matrix<Scalar, rows, others>& b, int to) {
  column<rows, 1, 0, -1, false>(b.data() + to * rows, b.data() + to * rows, a.data() + from * rows,
                                [factor](int) { return factor; });
}

/// out = a b.
template <typename Scalar, int rows, int inner, int cols>
JML_INLINE inline void product(const Matrix<Scalar, rows, inner>& a, const Matrix<Scalar, inner, cols>& b,
                               Matrix<Scalar, rows, cols>& out) {
  repeat<cols>([&](int j) JML_INLINE {
    column<rows, inner, 0, 1, true>(out.data() + j * rows, static_cast<const Scalar*>(nullptr), a.data(),
                                    [&](int k) { return b(k, j); });
  });
}

/// out = a bᵀ.
template <typename Scalar, int rows, int inner, int cols>
JML_INLINE inline void product_transposed(const Matrix<Scalar, rows, inner>& a,
                                          const Matrix<Scalar, cols, inner>& b,
                                          Matrix<Scalar, rows, cols>& out) {
  repeat<cols>([&](int j) JML_INLINE {
    column<rows, inner, 0, 1, true>(out.data() + j * rows, static_cast<const Scalar*>(nullptr), a.data(),
                                    [&](int k) { return b(j, k); });
  });
}

/// out = start + sign · a b. `out` may be `start`.
template <int sign, typename Scalar, int rows, int inner, int cols>
JML_INLINE inline void add_product(const Matrix<Scalar, rows, cols>& start,
                                   const Matrix<Scalar, rows, inner>& a, const Matrix<Scalar, inner, cols>& b,
                                   Matrix<Scalar, rows, cols>& out) {
  repeat<cols>([&](int j) JML_INLINE {
    column<rows, inner, 0, sign, false>(out.data() + j * rows, start.data() + j * rows, a.data(),
                                        [&](int k) { return b(k, j); });
  });
}

/// out = start + sign · a bᵀ. `out` may be `start`.
template <int sign, typename Scalar, int rows, int inner, int cols>
JML_INLINE inline void add_product_transposed(const Matrix<Scalar, rows, cols>& start,
                                              const Matrix<Scalar, rows, inner>& a,
                                              const Matrix<Scalar, cols, inner>& b,
                                              Matrix<Scalar, rows, cols>& out) {
  repeat<cols>([&](int j) JML_INLINE {
    column<rows, inner, 0, sign, false>(out.data() + j * rows, start.data() + j * rows, a.data(),
                                        [&](int k) { return b(j, k); });
  });
}

/// The lower triangle copied over the upper one.
template <typename Scalar, int n>
JML_INLINE inline void mirror(Matrix<Scalar, n, n>& a) {
  repeat<n>([&](int j) JML_INLINE { JML_TWICE for (int i = 0; i < j; ++i) a(i, j) = a(j, i); });
}

/// The lower triangle of out = start + sign · a bᵀ, where the result is known to be symmetric; entries above
/// the diagonal that its blocks hold are right too.
template <int sign, typename Scalar, int n, int inner>
JML_INLINE inline void add_lower_product(const Matrix<Scalar, n, n>& start, const Matrix<Scalar, n, inner>& a,
                                         const Matrix<Scalar, n, inner>& b, Matrix<Scalar, n, n>& out) {
  constexpr int block = lanes<Scalar, n>(n);
  constexpr int blocks = (n + block - 1) / block;
  [&]<int... c>(std::integer_sequence<int, c...>) JML_INLINE {
    const auto one_block = [&]<int first>(std::integral_constant<int, first>) JML_INLINE {
      repeat<(first + block < n ? block : n - first)>([&](int step) JML_INLINE {
        const int j = first + step;
        column<n, inner, first, sign, false>(out.data() + j * n, start.data() + j * n, a.data(),
                                             [&](int k) { return b(j, k); });
      });
    };
    (one_block(std::integral_constant<int, c * block>{}), ...);
  }(std::make_integer_sequence<int, blocks>{});
}

/// out = start + sign · a bᵀ where the result is known to be symmetric: the lower blocks, mirrored.
template <int sign, typename Scalar, int n, int inner>
JML_INLINE inline void add_symmetric_product(const Matrix<Scalar, n, n>& start,
                                             const Matrix<Scalar, n, inner>& a,
                                             const Matrix<Scalar, n, inner>& b, Matrix<Scalar, n, n>& out) {
  add_lower_product<sign>(start, a, b, out);
  mirror(out);
}

/// out = start + sign · aᵀ b. `out` may be `start`.
template <int sign, typename Scalar, int rows, int inner, int cols>
JML_INLINE inline void add_transposed_product(const Matrix<Scalar, rows, cols>& start,
                                              const Matrix<Scalar, inner, rows>& a,
                                              const Matrix<Scalar, inner, cols>& b,
                                              Matrix<Scalar, rows, cols>& out) {
  if constexpr (rows <= 3 && inner <= 3 && cols <= 3) {
    repeat<cols>([&](int j) JML_INLINE {
      repeat<rows>([&](int i) JML_INLINE {
        Scalar sum = start(i, j);
        repeat<inner>([&](int k) JML_INLINE { sum += sign > 0 ? a(k, i) * b(k, j) : -(a(k, i) * b(k, j)); });
        out(i, j) = sum;
      });
    });
  } else {
    add_product<sign>(start, transposed(a), b, out);
  }
}

/// out = aᵀ b.
template <typename Scalar, int rows, int inner, int cols>
JML_INLINE inline void transposed_product(const Matrix<Scalar, inner, rows>& a,
                                          const Matrix<Scalar, inner, cols>& b,
                                          Matrix<Scalar, rows, cols>& out) {
  if constexpr (rows <= 3 && inner > 0 && inner <= 3 && cols <= 3) {
    repeat<cols>([&](int j) JML_INLINE {
      repeat<rows>([&](int i) JML_INLINE {
        Scalar sum = a(0, i) * b(0, j);
        repeat<inner - 1>([&](int k) JML_INLINE { sum += a(k + 1, i) * b(k + 1, j); });
        out(i, j) = sum;
      });
    });
  } else {
    product(transposed(a), b, out);
  }
}

/// out = start + sign · aᵀ b where the result is known to be symmetric.
template <int sign, typename Scalar, int n, int inner>
JML_INLINE inline void add_symmetric_transposed_product(const Matrix<Scalar, n, n>& start,
                                                        const Matrix<Scalar, inner, n>& a,
                                                        const Matrix<Scalar, inner, n>& b,
                                                        Matrix<Scalar, n, n>& out) {
  if constexpr (n <= 3 && inner <= 3) {
    repeat<n>([&](int j) JML_INLINE {
      repeat<n>([&](int i) JML_INLINE {
        if (i < j) return;
        Scalar sum = start(i, j);
        repeat<inner>([&](int k) JML_INLINE { sum += sign > 0 ? a(k, i) * b(k, j) : -(a(k, i) * b(k, j)); });
        out(i, j) = sum;
        out(j, i) = sum;
      });
    });
  } else {
    add_symmetric_product<sign>(start, transposed(a), transposed(b), out);
  }
}

/// out = aᵀ b where the result is known to be symmetric.
template <typename Scalar, int n, int inner>
JML_INLINE inline void symmetric_transposed_product(const Matrix<Scalar, inner, n>& a,
                                                    const Matrix<Scalar, inner, n>& b,
                                                    Matrix<Scalar, n, n>& out) {
  if constexpr (n <= 3 && inner > 0 && inner <= 3) {
    repeat<n>([&](int j) JML_INLINE {
      repeat<n>([&](int i) JML_INLINE {
        if (i < j) return;
        Scalar sum = a(0, i) * b(0, j);
        repeat<inner - 1>([&](int k) JML_INLINE { sum += a(k + 1, i) * b(k + 1, j); });
        out(i, j) = sum;
        out(j, i) = sum;
      });
    });
  } else {
    add_symmetric_transposed_product<1>(zeros<Matrix<Scalar, n, n>>(), a, b, out);
  }
}

// Products apart from the code around them, for what is not worth a copy of its own.

/// out = a b.
template <typename Scalar, int rows, int inner, int cols>
JML_NOINLINE void multiply(const Matrix<Scalar, rows, inner>& a, const Matrix<Scalar, inner, cols>& b,
                           Matrix<Scalar, rows, cols>& out) {
  product(a, b, out);
}

/// out += a b.
template <typename Scalar, int rows, int inner, int cols>
JML_NOINLINE void accumulate(const Matrix<Scalar, rows, inner>& a, const Matrix<Scalar, inner, cols>& b,
                             Matrix<Scalar, rows, cols>& out) {
  add_product<1>(out, a, b, out);
}

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
