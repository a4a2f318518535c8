// SPDX-License-Identifier: BSD-3-Clause
// Shared by the kernel tests: the products against triple loops in long double, for row counts that split
// into packets in every way.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <jml/strips.hpp>
#include <jml/campaign/noise.hpp>
#include <utility>

namespace kernel_test {

/// out must be start + sign · a b (or a bᵀ) to rounding: (inner + 1) ε times the sum of the terms' sizes.
template <typename Scalar>
struct Check {
  int rows, inner, cols;
  const Scalar *a, *b;
  bool transposed;  // b is cols×inner

  void operator()(const char* what, const Scalar* out, int sign, const Scalar* start) const {
    for (int j = 0; j < cols; ++j) {
      for (int i = 0; i < rows; ++i) {
        const long double first = start == nullptr ? 0.0L : start[i + j * rows];
        long double sum = first, size = std::abs(first);
        for (int k = 0; k < inner; ++k) {
          const long double term =
              static_cast<long double>(a[i + k * rows]) * (transposed ? b[j + k * cols] : b[k + j * inner]);
          sum += sign * term;
          size += std::abs(term);
        }
        const long double bound =
            (inner + 1) * static_cast<long double>(std::numeric_limits<Scalar>::epsilon()) * size;
        ASSERT_LE(std::abs(out[i + j * rows] - sum), bound)
            << what << " " << rows << "x" << inner << "x" << cols << " at " << i << ", " << j;
      }
    }
  }
};

/// A matrix with a fence behind it: a packet that writes too far breaks the fence.
template <typename Scalar, int rows, int cols>
struct Fenced {
  jml::Matrix<Scalar, rows, cols> matrix;
  Scalar fence[16];
  Fenced() {
    std::fill_n(matrix.data(), rows * cols,
                std::numeric_limits<Scalar>::quiet_NaN());  // an entry not written shows
    for (Scalar& f : fence) f = Scalar(7);
  }
  bool whole() const {
    for (const Scalar& f : fence) {
      if (f != Scalar(7)) return false;
    }
    return true;
  }
};

template <typename Scalar>
void fill(Scalar* begin, int count, jml::Noise& noise) {
  for (int i = 0; i < count; ++i) begin[i] = static_cast<Scalar>(noise.uniform(-1, 1));
}

template <typename Scalar>
bool is_exactly_symmetric(const Scalar* a, int n) {
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < j; ++i) {
      if (a[i + j * n] != a[j + i * n]) return false;
    }
  }
  return true;
}

template <typename Scalar, int rows>
void check_rows() {
  // Three widths of the sum and of the result, so that no size is a multiple of another.
  constexpr int inner = rows % 5 + 1, cols = (3 * rows) % 7 + 1;
  jml::Noise noise(100 + rows);
  jml::Matrix<Scalar, rows, inner> a;
  jml::Matrix<Scalar, inner, cols> b;
  jml::Matrix<Scalar, cols, inner> bt;
  jml::Matrix<Scalar, rows, cols> start;
  fill(a.data(), rows * inner, noise);
  fill(b.data(), inner * cols, noise);
  fill(bt.data(), cols * inner, noise);
  fill(start.data(), rows * cols, noise);
  const Check<Scalar> plain{rows, inner, cols, a.data(), b.data(), false};
  const Check<Scalar> transposed{rows, inner, cols, a.data(), bt.data(), true};

  Fenced<Scalar, rows, cols> out;
  jml::kernel::product(a, b, out.matrix);
  plain("product", out.matrix.data(), 1, nullptr);
  jml::kernel::product_transposed(a, bt, out.matrix);
  transposed("product_transposed", out.matrix.data(), 1, nullptr);
  jml::kernel::add_product<1>(start, a, b, out.matrix);
  plain("add_product<1>", out.matrix.data(), 1, start.data());
  jml::kernel::add_product<-1>(start, a, b, out.matrix);
  plain("add_product<-1>", out.matrix.data(), -1, start.data());
  jml::kernel::add_product_transposed<1>(start, a, bt, out.matrix);
  transposed("add_product_transposed<1>", out.matrix.data(), 1, start.data());
  out.matrix = start;  // in place
  jml::kernel::add_product_transposed<-1>(out.matrix, a, bt, out.matrix);
  transposed("add_product_transposed<-1>", out.matrix.data(), -1, start.data());
  EXPECT_TRUE(out.whole()) << rows;
}

template <typename Scalar, int n>
void check_symmetric() {
  constexpr int inner = n % 4 + 1;
  jml::Noise noise(200 + n);
  // b and a = b diag(d): a bᵀ is symmetric, to the rounding of a, which the exact product below knows.
  jml::Matrix<Scalar, n, inner> a, b;
  fill(b.data(), n * inner, noise);
  for (int i = 0; i < n * inner; ++i) a.data()[i] = b.data()[i] * Scalar(1 << (i / n));
  jml::Matrix<Scalar, n, n> start;
  fill(start.data(), n * n, noise);
  for (int i = 0; i < n * n; ++i)
    start.data()[i] = start.data()[std::max(i / n, i % n) + n * std::min(i / n, i % n)];
  const Check<Scalar> check{n, inner, n, a.data(), b.data(), true};
  Fenced<Scalar, n, n> out;
  jml::kernel::add_symmetric_product<1>(start, a, b, out.matrix);
  check("add_symmetric_product<1>", out.matrix.data(), 1, start.data());
  EXPECT_TRUE(is_exactly_symmetric(out.matrix.data(), n)) << n;
  out.matrix = start;
  jml::kernel::add_symmetric_product<-1>(out.matrix, a, b, out.matrix);
  check("add_symmetric_product<-1>", out.matrix.data(), -1, start.data());
  EXPECT_TRUE(is_exactly_symmetric(out.matrix.data(), n)) << n;
  EXPECT_TRUE(out.whole()) << n;
}

/// out += Σ_j a_ij² w_j is start + (a∘a) w: what the proof of a covariance begins with.
template <typename Scalar, int n>
void check_weighted_squares() {
  jml::Noise noise(300 + n);
  jml::Matrix<Scalar, n, n> a, squares;
  jml::Vector<Scalar, n> weights, start;
  fill(a.data(), n * n, noise);
  fill(weights.data(), n, noise);
  fill(start.data(), n, noise);
  for (int i = 0; i < n * n; ++i) squares.data()[i] = a.data()[i] * a.data()[i];
  Fenced<Scalar, n, 1> out;
  for (int i = 0; i < n; ++i) out.matrix(i) = start(i);
  jml::kernel::add_weighted_squares(a, weights, out.matrix);
  const Check<Scalar> check{n, n, 1, squares.data(), weights.data(), false};
  check("add_weighted_squares", out.matrix.data(), 1, start.data());
  EXPECT_TRUE(out.whole()) << n;
}

/// Sizes first..first + count - 1.
template <typename Scalar, int first, int... i>
void check_sizes(std::integer_sequence<int, i...>) {
  (check_rows<Scalar, first + i>(), ...);
  (check_symmetric<Scalar, first + i>(), ...);
  (check_weighted_squares<Scalar, first + i>(), ...);
}

}  // namespace kernel_test
