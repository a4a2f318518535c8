// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Schur form of a small real matrix with the rightmost eigenvalues first: an orthonormal basis of their
/// invariant subspace.
///
/// Householder to Hessenberg form, then single-shift QR in complex arithmetic: every step, and every later
/// exchange of neighbours, is one rotation of two rows and two columns. With T = [a b; 0 c] the vector
/// (b, c - a) is the eigenvector of c, and the rotation that makes it the first axis exchanges a and c.
/// Eigen's ComplexSchur does the first two, with dynamic block products behind it: 8 s more to compile.
#include <jml/warnings_begin.hpp>
#pragma once

#include <complex>
#include <jml/linear_algebra.hpp>

namespace jml::kernel {

/// H = U T Uᴴ.
template <typename Scalar, int m>
class OrderedSchur {
 public:
  using Complex = std::complex<Scalar>;

  /// False where the QR iteration does not converge. The `leading` eigenvalues of largest real part come
  /// first.
  [[nodiscard]] JML_NOINLINE bool compute(const Matrix<Scalar, m, m>& H, int leading) {
    reduce(H);
    if (!iterate()) return false;
    order(leading);
    return true;
  }

  [[nodiscard]] Complex eigenvalue(int i) const { return T_(i, i); }
  [[nodiscard]] const Matrix<Complex, m, m>& U() const { return U_; }
  /// The leftmost of the leading eigenvalues, and the rightmost of the others.
  [[nodiscard]] Complex last_right() const { return last_right_; }
  [[nodiscard]] Complex first_left() const { return first_left_; }

 private:
  // T = Uᵀ H U with zeros below the subdiagonal.
  void reduce(const Matrix<Scalar, m, m>& H) {
    Matrix<Scalar, m, m> T = H, U = kernel::identity<Matrix<Scalar, m, m>>();
    for (int k = 0; k + 2 < m; ++k) {
      Vector<Scalar, m> v = kernel::column_of(T, k);
      for (int i = 0; i <= k; ++i) v(i) = 0;
      if (!(kernel::largest(v) > Scalar(0))) continue;
      v = kernel::normalised(v);
      v(k + 1) += v(k + 1) < Scalar(0) ? Scalar(-1) : Scalar(1);
      const Scalar factor = Scalar(2) / kernel::squared_norm(v);
      for (int j = k; j < m; ++j) {
        const Scalar along = factor * kernel::dot(v, kernel::column_of(T, j));
        for (int i = 0; i < m; ++i) T(i, j) -= v(i) * along;
      }
      const auto from_the_right = [&](Matrix<Scalar, m, m>& M) {
        Vector<Scalar, m> w = kernel::zeros<Vector<Scalar, m>>();
        for (int j = k + 1; j < m; ++j) {
          for (int i = 0; i < m; ++i) w(i) += M(i, j) * (factor * v(j));
        }
        for (int j = k + 1; j < m; ++j) {
          for (int i = 0; i < m; ++i) M(i, j) -= w(i) * v(j);
        }
      };
      from_the_right(T);
      from_the_right(U);
      for (int i = k + 2; i < m; ++i) T(i, k) = 0;
    }
    T_ = kernel::cast<Complex>(T);
    U_ = kernel::cast<Complex>(U);
  }

  bool iterate() {
    constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
    const auto size = [](Complex z) { return std::abs(z.real()) + std::abs(z.imag()); };
    const Scalar tiny = std::numeric_limits<Scalar>::min() / epsilon;
    int last = m - 1, tries = 0;
    for (int sweep = 0; sweep < 40 * m && last > 0; ++sweep) {
      int first = last;
      for (; first > 0; --first) {
        const Scalar neighbours = size(T_(first, first)) + size(T_(first - 1, first - 1));
        if (size(T_(first, first - 1)) > epsilon * neighbours + tiny) continue;
        T_(first, first - 1) = 0;
        break;
      }
      if (first == last) {
        --last;
        tries = 0;
        continue;
      }
      const Complex shift = ++tries % 10 == 0 ? T_(last, last) + size(T_(last, last - 1)) : wilkinson(last);
      Complex x = T_(first, first) - shift, y = T_(first + 1, first);
      for (int k = first; k < last; ++k) {
        rotate(k, x, y, k > first ? k - 1 : k, k + 2 < last ? k + 2 : last);
        if (k > first) T_(k + 1, k - 1) = 0;
        x = T_(k + 1, k);
        if (k + 2 < m) y = T_(k + 2, k);
      }
    }
    return last == 0;
  }

  // The eigenvalue of the last 2×2 block that is nearer to its last entry.
  Complex wilkinson(int k) const {
    const Complex half = (T_(k - 1, k - 1) - T_(k, k)) / Scalar(2);
    const Complex coupling = T_(k - 1, k) * T_(k, k - 1);
    const Complex root = std::sqrt(half * half + coupling);
    const Complex plus = half + root, minus = half - root;
    const Complex far = std::norm(plus) > std::norm(minus) ? plus : minus;
    return far == Complex(0) ? T_(k, k) : T_(k, k) - coupling / far;
  }

  void order(int leading) {
    bool right[m] = {};
    for (int count = 0; count < leading; ++count) {
      int best = -1;
      for (int i = 0; i < m; ++i) {
        if (!right[i] && (best < 0 || T_(i, i).real() > T_(best, best).real())) best = i;
      }
      right[best] = true;
    }
    int place = 0;
    for (int i = 0; i < m; ++i) {
      if (!right[i]) continue;
      for (int k = i; k > place; --k) {
        rotate(k - 1, T_(k - 1, k), T_(k, k) - T_(k - 1, k - 1), k - 1, k);
        T_(k, k - 1) = 0;
      }
      ++place;
    }
    last_right_ = T_(0, 0);
    first_left_ = T_(m - 1, m - 1);
    for (int i = 1; i < leading; ++i) {
      if (T_(i, i).real() < last_right_.real()) last_right_ = T_(i, i);
    }
    for (int i = leading; i < m; ++i) {
      if (T_(i, i).real() > first_left_.real()) first_left_ = T_(i, i);
    }
  }

  // The rotation that turns (x, y) into (r, 0): rows k and k+1 from column `first` on, columns k and k+1 down
  // to row `bottom`. In real numbers: a product of std::complex looks for infinities.
  void rotate(int k, Complex x, Complex y, int first, int bottom) {
    const Scalar size_x = std::abs(x), size_y = std::abs(y), r = std::hypot(size_x, size_y);
    if (!(size_y > Scalar(0)) || !std::isfinite(r)) return;
    const Scalar c = size_x / r;
    const Complex unit = size_x > Scalar(0) ? x / size_x : Complex(1);
    const Complex s = unit * (std::conj(y) / r);
    const auto turn = [c](Complex& a, Complex& b, Scalar s_real, Scalar s_imag) {
      const Scalar ar = a.real(), ai = a.imag(), br = b.real(), bi = b.imag();
      a = {c * ar + (s_real * br - s_imag * bi), c * ai + (s_real * bi + s_imag * br)};
      b = {c * br - (s_real * ar + s_imag * ai), c * bi - (s_real * ai - s_imag * ar)};
    };
    for (int j = first; j < m; ++j) turn(T_(k, j), T_(k + 1, j), s.real(), s.imag());
    for (int i = 0; i <= bottom; ++i) turn(T_(i, k), T_(i, k + 1), s.real(), -s.imag());
    for (int i = 0; i < m; ++i) turn(U_(i, k), U_(i, k + 1), s.real(), -s.imag());
  }

  Matrix<Complex, m, m> T_, U_;
  Complex last_right_, first_left_;
};

}  // namespace jml::kernel
#include <jml/warnings_end.hpp>
