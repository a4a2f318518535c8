// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Products and small factorisations of compile-time size, for the recursion's inner lines.
///
/// Fixed-size Eigen leaves a factor of two on odd sizes (15 columns of doubles cannot be split into whole
/// packets) and a symmetric product is computed twice. Here a column of the result stays in registers, an
/// odd length is covered by a last packet that overlaps its neighbour, and a symmetric result is computed
/// as one triangle of blocks and mirrored: exactly symmetric. bench/ holds the figures.
#pragma once

#include <cstring>
#include <jml/linear_algebra.hpp>
#include <utility>

namespace jml::kernel {

#if defined(__AVX__)
inline constexpr int packet_bytes = 32;
#elif defined(__SSE2__) || defined(__aarch64__)
inline constexpr int packet_bytes = 16;
#else
inline constexpr int packet_bytes = 0;  // no vector registers, or a compiler without vector extensions
#endif

/// Lanes of the widest packet that fits into what is left of a column; 1 means plain scalars. Columns of up
/// to three stay scalars: the compiler then keeps whole matrices in registers.
template <typename Scalar, int rows>
constexpr int lanes(int left) {
  int width = rows < 4 ? 1 : packet_bytes / static_cast<int>(sizeof(Scalar));
  while (width > left) width /= 2;
  return width < 1 ? 1 : width;
}

template <typename Scalar, int width>
struct Packet {
#if defined(__GNUC__)
  typedef Scalar type __attribute__((vector_size(width * sizeof(Scalar))));
#else
  using type = Scalar;
#endif
};
template <typename Scalar>
struct Packet<Scalar, 1> {
  using type = Scalar;
};

/// Rows [first, rows) of one column of out = start + sign · Σ_k a.col(k) coefficient(k), held in registers.
///
/// Packets never overlap, 15 = 4+4+4+2+1: a load that spans two earlier stores would wait for both.
template <int rows, int inner, int first, int sign, bool from_zero, typename Scalar, typename Coefficient>
[[gnu::always_inline]] inline void column(Scalar* out, const Scalar* start, const Scalar* a,
                                          const Coefficient& coefficient) {
  constexpr int width = lanes<Scalar, rows>(rows - first);
  constexpr int packets = (rows - first) / width < 8 ? (rows - first) / width : 8;
  using P = typename Packet<Scalar, width>::type;
  [&]<int... c>(std::integer_sequence<int, c...>) __attribute__((always_inline)) {
    P sum[packets];
    if constexpr (from_zero)
      ((sum[c] = P{}), ...);
    else
      (std::memcpy(&sum[c], start + first + c * width, sizeof(P)), ...);
    repeat<inner>([&](int k) __attribute__((always_inline)) {
      const Scalar factor = sign > 0 ? coefficient(k) : -coefficient(k);
      P term[packets];
      (std::memcpy(&term[c], a + k * rows + first + c * width, sizeof(P)), ...);
      ((sum[c] += term[c] * factor), ...);
    });
    (std::memcpy(out + first + c * width, &sum[c], sizeof(P)), ...);
  }(std::make_integer_sequence<int, packets>{});
  if constexpr (first + packets * width < rows) {
    column<rows, inner, first + packets * width, sign, from_zero>(out, start, a, coefficient);
  }
}

/// aᵀ as a matrix of its own, for a product that wants it as its left factor.
template <typename Scalar, int rows, int cols>
inline Matrix<Scalar, cols, rows> transposed(const Matrix<Scalar, rows, cols>& a) {
  Matrix<Scalar, cols, rows> out;
  for (int j = 0; j < cols; ++j) {
    for (int i = 0; i < rows; ++i) out(j, i) = a(i, j);
  }
  return out;
}

/// out = a b.
template <typename Scalar, int rows, int inner, int cols>
[[gnu::always_inline]] inline void product(const Matrix<Scalar, rows, inner>& a,
                                           const Matrix<Scalar, inner, cols>& b,
                                           Matrix<Scalar, rows, cols>& out) {
  repeat<cols>([&](int j) __attribute__((always_inline)) {
    column<rows, inner, 0, 1, true>(out.data() + j * rows, out.data(), a.data(),
                                    [&](int k) { return b(k, j); });
  });
}

/// out = a bᵀ.
template <typename Scalar, int rows, int inner, int cols>
[[gnu::always_inline]] inline void product_transposed(const Matrix<Scalar, rows, inner>& a,
                                                      const Matrix<Scalar, cols, inner>& b,
                                                      Matrix<Scalar, rows, cols>& out) {
  repeat<cols>([&](int j) __attribute__((always_inline)) {
    column<rows, inner, 0, 1, true>(out.data() + j * rows, out.data(), a.data(),
                                    [&](int k) { return b(j, k); });
  });
}

/// out = start + sign · a b. `out` may be `start`.
template <int sign, typename Scalar, int rows, int inner, int cols>
[[gnu::always_inline]] inline void add_product(const Matrix<Scalar, rows, cols>& start,
                                               const Matrix<Scalar, rows, inner>& a,
                                               const Matrix<Scalar, inner, cols>& b,
                                               Matrix<Scalar, rows, cols>& out) {
  repeat<cols>([&](int j) __attribute__((always_inline)) {
    column<rows, inner, 0, sign, false>(out.data() + j * rows, start.data() + j * rows, a.data(),
                                        [&](int k) { return b(k, j); });
  });
}

/// out = start + sign · a bᵀ. `out` may be `start`.
template <int sign, typename Scalar, int rows, int inner, int cols>
[[gnu::always_inline]] inline void add_product_transposed(const Matrix<Scalar, rows, cols>& start,
                                                          const Matrix<Scalar, rows, inner>& a,
                                                          const Matrix<Scalar, cols, inner>& b,
                                                          Matrix<Scalar, rows, cols>& out) {
  repeat<cols>([&](int j) __attribute__((always_inline)) {
    column<rows, inner, 0, sign, false>(out.data() + j * rows, start.data() + j * rows, a.data(),
                                        [&](int k) { return b(j, k); });
  });
}

/// out = start + sign · a bᵀ where the result is known to be symmetric: the lower blocks, mirrored.
template <int sign, typename Scalar, int n, int inner>
[[gnu::always_inline]] inline void add_symmetric_product(const Matrix<Scalar, n, n>& start,
                                                         const Matrix<Scalar, n, inner>& a,
                                                         const Matrix<Scalar, n, inner>& b,
                                                         Matrix<Scalar, n, n>& out) {
  constexpr int block = lanes<Scalar, n>(n);
  constexpr int blocks = (n + block - 1) / block;
  [&]<int... c>(std::integer_sequence<int, c...>) __attribute__((always_inline)) {
    const auto one_block = [&]<int first>(std::integral_constant<int, first>) __attribute__((always_inline)) {
      repeat<(first + block < n ? block : n - first)>([&](int step) __attribute__((always_inline)) {
        const int j = first + step;
        column<n, inner, first, sign, false>(out.data() + j * n, start.data() + j * n, a.data(),
                                             [&](int k) { return b(j, k); });
      });
    };
    (one_block(std::integral_constant<int, c * block>{}), ...);
  }(std::make_integer_sequence<int, blocks>{});
  repeat<n>([&](int j) __attribute__((always_inline)) {
    for (int i = 0; i < j; ++i) out(i, j) = out(j, i);
  });
}

/// S = L D Lᵀ of a symmetric positive definite p×p matrix (lower triangle read). No roots.
template <typename Scalar, int p>
struct SymmetricFactor {
  Matrix<Scalar, p, p> lower;          // unit lower triangle
  Vector<Scalar, p> inverse_diagonal;  // 1/D

  /// False where a pivot is below the rounding of the entry it came from: singular, indefinite or NaN.
  [[nodiscard, gnu::always_inline]] bool factor(const Matrix<Scalar, p, p>& s) {
    constexpr Scalar slack = Scalar(4 * p) * std::numeric_limits<Scalar>::epsilon();
    if constexpr (p == 1) {
      inverse_diagonal(0) = Scalar(1) / s(0, 0);
      return s(0, 0) > Scalar(0);
    }
    lower = s;
    bool positive = true;
    for (int k = 0; k < p; ++k) {
      const Scalar pivot = lower(k, k);
      positive &= pivot > slack * s(k, k) && s(k, k) > Scalar(0);
      const Scalar inverse = Scalar(1) / pivot;
      inverse_diagonal(k) = inverse;
      for (int j = k + 1; j < p; ++j) {
        const Scalar factor = lower(j, k) * inverse;
        for (int i = j; i < p; ++i) lower(i, j) -= lower(i, k) * factor;
      }
      for (int i = k + 1; i < p; ++i) lower(i, k) *= inverse;
    }
    return positive;
  }

  /// bᵀ S⁻¹ b.
  [[nodiscard]] Scalar squared_norm(const Vector<Scalar, p>& b) const {
    Vector<Scalar, p> z = b;
    Scalar sum = 0;
    for (int i = 0; i < p; ++i) {
      for (int k = 0; k < i; ++k) z(i) -= lower(i, k) * z(k);
      sum += z(i) * z(i) * inverse_diagonal(i);
    }
    return sum;
  }

  /// S⁻¹ b.
  [[nodiscard]] Vector<Scalar, p> solve(const Vector<Scalar, p>& b) const {
    Vector<Scalar, p> z = b;
    for (int i = 0; i < p; ++i) {
      for (int k = 0; k < i; ++k) z(i) -= lower(i, k) * z(k);
    }
    for (int i = p - 1; i >= 0; --i) {
      z(i) *= inverse_diagonal(i);
      for (int k = i + 1; k < p; ++k) z(i) -= lower(k, i) * z(k);
    }
    return z;
  }

  /// v = w L⁻ᵀ and gain = w S⁻¹, for n×p w. Then w S⁻¹ wᵀ = (v D⁻¹) vᵀ; `scaled` is v D⁻¹.
  template <int n>
  void right_solve(const Matrix<Scalar, n, p>& w, Matrix<Scalar, n, p>& v, Matrix<Scalar, n, p>& scaled,
                   Matrix<Scalar, n, p>& gain) const {
    if constexpr (p == 1) {
      assign(v, w);
      kernel::scale(scaled, inverse_diagonal(0), w);
      kernel::scale(gain, inverse_diagonal(0), w);
      return;
    }
    for (int j = 0; j < p; ++j) {
      v.col(j) = w.col(j);
      for (int k = 0; k < j; ++k) v.col(j) -= v.col(k) * lower(j, k);
      scaled.col(j) = v.col(j) * inverse_diagonal(j);
    }
    for (int j = p - 1; j >= 0; --j) {
      gain.col(j) = scaled.col(j);
      for (int k = j + 1; k < p; ++k) gain.col(j) -= gain.col(k) * lower(k, j);
    }
  }
};

/// S Π = L U of a general p×p matrix, columns exchanged for the largest pivot.
template <typename Scalar, int p>
struct GeneralFactor {
  Matrix<Scalar, p, p> lu;  // unit lower triangle, and U above it
  Vector<Scalar, p> inverse_diagonal;
  int order[p];

  /// `scale(i)`: the size of a unit of component i (√R_ii; with p = 1 R itself), which makes the pivot test
  /// free of units. False where S is singular to rounding relative to that scale, or not finite.
  [[nodiscard, gnu::always_inline]] bool factor(const Matrix<Scalar, p, p>& s,
                                                const Vector<Scalar, p>& scale) {
    constexpr Scalar slack = Scalar(4 * p) * std::numeric_limits<Scalar>::epsilon();
    if constexpr (p == 1) {
      order[0] = 0;
      inverse_diagonal(0) = Scalar(1) / s(0, 0);
      const Scalar size = std::abs(s(0, 0));
      return size > slack * scale(0) && size <= std::numeric_limits<Scalar>::max();
    }
    lu = s;
    for (int j = 0; j < p; ++j) order[j] = j;
    bool regular = true;
    for (int k = 0; k < p; ++k) {
      int best = k;
      for (int j = k + 1; j < p; ++j) {
        if (std::abs(lu(k, j)) * scale(order[best]) > std::abs(lu(k, best)) * scale(order[j])) best = j;
      }
      if (best != k) {
        lu.col(k).swap(lu.col(best));
        std::swap(order[k], order[best]);
      }
      const Scalar pivot = lu(k, k);
      const Scalar floor = scale(k) * scale(order[k]) + std::abs(s(k, order[k]));
      regular &= std::abs(pivot) > slack * floor && std::isfinite(pivot);
      const Scalar inverse = Scalar(1) / pivot;
      inverse_diagonal(k) = inverse;
      for (int i = k + 1; i < p; ++i) lu(i, k) *= inverse;
      for (int j = k + 1; j < p; ++j) {
        for (int i = k + 1; i < p; ++i) lu(i, j) -= lu(i, k) * lu(k, j);
      }
    }
    return regular;
  }

  /// gain = w S⁻¹, for n×p w.
  template <int n>
  void right_solve(const Matrix<Scalar, n, p>& w, Matrix<Scalar, n, p>& gain) const {
    if constexpr (p == 1) {
      kernel::scale(gain, inverse_diagonal(0), w);
      return;
    }
    for (int j = 0; j < p; ++j) {
      gain.col(j) = w.col(order[j]);
      for (int k = 0; k < j; ++k) gain.col(j) -= gain.col(k) * lu(k, j);
      gain.col(j) *= inverse_diagonal(j);
    }
    for (int j = p - 1; j >= 0; --j) {
      for (int k = j + 1; k < p; ++k) gain.col(j) -= gain.col(k) * lu(k, j);
    }
  }

  /// S⁻¹ b.
  [[nodiscard]] Vector<Scalar, p> solve(const Vector<Scalar, p>& b) const {
    Vector<Scalar, p> z = b;
    for (int i = 0; i < p; ++i) {
      for (int k = 0; k < i; ++k) z(i) -= lu(i, k) * z(k);
    }
    for (int i = p - 1; i >= 0; --i) {
      for (int k = i + 1; k < p; ++k) z(i) -= lu(i, k) * z(k);
      z(i) *= inverse_diagonal(i);
    }
    Vector<Scalar, p> x;
    for (int j = 0; j < p; ++j) x(order[j]) = z(j);
    return x;
  }
};

/// a = L Lᵀ of a symmetric positive semidefinite n×n matrix (lower triangle read), of any rank.
template <typename Scalar, int n>
struct SemidefiniteFactor {
  Matrix<Scalar, n, n> L = Matrix<Scalar, n, n>::Zero();  // columns in pivot order; zero beyond the rank
  int pivot[n];
  int rank = 0;

  /// Cholesky with diagonal pivoting. What is left when no pivot rises above the rounding of its own diagonal
  /// entry is cut to zero, negative parts included; the test is relative to each entry, so units do not
  /// matter.
  explicit SemidefiniteFactor(const Matrix<Scalar, n, n>& a) {
    constexpr Scalar slack = Scalar(4 * n) * std::numeric_limits<Scalar>::epsilon();
    Vector<Scalar, n> left = a.diagonal();
    for (int k = 0; k < n; ++k) {
      int best = -1;
      Scalar largest = slack;  // of what is left of a diagonal entry, relative to the entry
      for (int i = 0; i < n; ++i) {
        if (left(i) > largest * a(i, i)) {
          best = i;
          largest = left(i) / a(i, i);
        }
      }
      if (best < 0) break;
      const Scalar root = std::sqrt(left(best));
      for (int i = 0; i < n; ++i) {
        Scalar sum = i >= best ? a(i, best) : a(best, i);
        for (int j = 0; j < k; ++j) sum -= L(i, j) * L(best, j);
        L(i, k) = i == best ? root : sum / root;
        left(i) = i == best ? Scalar(0) : left(i) - L(i, k) * L(i, k);
      }
      pivot[k] = best;
      rank = k + 1;
    }
  }

  /// out = bᵀ a⁺ b for a b in the range of a; false where some entry of b is farther from it than `slack`
  /// allows.
  [[nodiscard]] bool squared_norm(const Vector<Scalar, n>& b, const Vector<Scalar, n>& slack,
                                  Scalar& out) const {
    Vector<Scalar, n> left = b;
    out = 0;
    for (int k = 0; k < rank; ++k) {
      const Scalar c = left(pivot[k]) / L(pivot[k], k);
      left -= c * L.col(k);
      out += c * c;
    }
    return (left.cwiseAbs().array() <= slack.array()).all();
  }
};

}  // namespace jml::kernel
