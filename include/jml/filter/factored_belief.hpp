// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a factored filter carries: x, and P = U D Uᵀ, in the digits of Scalar or, where these do not suffice,
/// in twice as many.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/argument.hpp>
#include <jml/estimate.hpp>
#include <jml/interval/noise_root.hpp>
#include <jml/twofold.hpp>
#include <jml/ud_factors.hpp>

namespace jml {

/// Where a factored filter starts, by factors: P_0 = U diag(D) Uᵀ, U n×n unit upper triangular (what is below
/// its diagonal is not read), D n, ≥ 0. An infinite D_j says that nothing is known along column j of U. This
/// is how to give a P_0 that no n×n matrix of doubles can hold (condition above 1e12); an Estimate will do
/// for the others, with an infinite variance on the diagonal of a state of which nothing is known.
template <typename Scalar_, int n>
struct FactoredEstimate {
  using Scalar = Scalar_;           ///< of x, U and D
  static constexpr int states = n;  ///< numbers of x, n
  Vector<Scalar, n> x;              ///< n
  Matrix<Scalar, n, n> U;           ///< n×n, unit upper triangular
  Vector<Scalar, n> D;              ///< variances, n, ≥ 0

  /// x, n; U, n×n; D, n. A factored filter refuses others (invalid_state, invalid_covariance) when it starts.
  FactoredEstimate(const Argument<Scalar, n>& state, const Argument<Scalar, n, n>& factor,
                   const Argument<Scalar, n>& variances)
      : x(state), U(factor), D(variances) {}
};
/// Types from the arguments.
template <typename X, typename F, typename V>
FactoredEstimate(const Eigen::MatrixBase<X>&, const Eigen::MatrixBase<F>&, const Eigen::MatrixBase<V>&)
    -> FactoredEstimate<typename X::Scalar, X::RowsAtCompileTime>;

/// x + x_low and P = (U + U_low) diag(D + D_low) (U + U_low)ᵀ. An infinite D_j: nothing is known along column
/// j.
template <typename Scalar_, int n>
struct FactoredBelief : UdFactors<Scalar_, n> {
  using Scalar = Scalar_;           ///< of x, U and D
  static constexpr int states = n;  ///< numbers of x, n

  Vector<Scalar, n> x = kernel::zeros<Vector<Scalar, n>>();  ///< n
  Vector<Scalar, n> variances = x;                           ///< P_ii; infinite where nothing is known of x_i
  bool extended = false;     ///< U_low and D_low hold digits; else they are not to be read
  Scalar magnification = 0;  ///< of the rounding of the steps in twice the digits that led here
  Vector<Scalar, n> x_low = kernel::zeros<Vector<Scalar, n>>();        ///< what x lacks, where `extended`
  Vector<Scalar, n> D_low = x_low;                                     ///< what D lacks
  Matrix<Scalar, n, n> U_low = kernel::zeros<Matrix<Scalar, n, n>>();  ///< what U lacks, where `extended`

  FactoredBelief() = default;
  /// What is to be written before it is read is not set.
  explicit FactoredBelief(Scratch) : x_low(), D_low(), U_low() {}

  /// *this = next.
  JML_INLINE void take(const FactoredBelief& next) {
    kernel::assign(x, next.x);
    kernel::assign(x_low, next.x_low);
    kernel::assign(this->U, next.U);
    kernel::assign(this->D, next.D);
    kernel::assign(variances, next.variances);
    extended = next.extended;
    magnification = next.magnification;
    if (next.extended) {
      D_low = next.D_low;
      U_low = next.U_low;
    }
  }

  /// U D Uᵀ, rounded to the digits of Scalar. Of a state of which nothing is known the variance is infinite,
  /// and its covariances are zero.
  [[nodiscard]] Matrix<Scalar, n, n> P() const {
    Matrix<Scalar, n, n> out;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i <= j; ++i) {
        Extended<Scalar> sum(0);
        bool infinite = false;
        for (int k = j; k < n; ++k) {
          if (std::isinf(this->D(k)))
            infinite = infinite || (this->U(i, k) != Scalar(0) && this->U(j, k) != Scalar(0));
          else
            sum = sum + factor(i, k) * variance(k) * factor(j, k);
        }
        const Scalar unknown = i == j ? std::numeric_limits<Scalar>::infinity() : Scalar(0);
        out(i, j) = out(j, i) = infinite ? unknown : in_two<Scalar>(sum).high;
      }
    }
    return out;
  }

 private:
  [[nodiscard]] Extended<Scalar> factor(int i, int k) const {
    return as_one(this->U(i, k), extended && i != k ? U_low(i, k) : Scalar(0));
  }
  [[nodiscard]] Extended<Scalar> variance(int k) const {
    return as_one(this->D(k), extended ? D_low(k) : Scalar(0));
  }
};

template <typename Scalar, int n>
struct PartsOf<FactoredBelief<Scalar, n>> {
  static auto each(auto& b, auto&& f) {
    return f(b.x, b.x_low, b.U, b.D, b.variances, b.magnification, b.extended, part_if(b.extended, b.U_low),
             part_if(b.extended, b.D_low));
  }
};

namespace detail {

/// G Q Gᵀ = B diag(d) Bᵀ. With as many disturbances as states or more, B is a unit upper triangle.
template <typename Scalar, typename D>
struct NoiseFactors {
  using Root = NoiseRoot<Scalar, D>;
  static constexpr int n = Root::n, q = Root::q;
  static constexpr bool triangular = q >= n;
  static constexpr bool constant = ProcessNoise<Scalar, D>::constant;
  static constexpr int columns = triangular ? n : q;

  Matrix<Scalar, n, columns> B = kernel::zeros<Matrix<Scalar, n, columns>>();
  Vector<Scalar, columns> d = kernel::zeros<Vector<Scalar, columns>>();
  Vector<Scalar, n> sizes = kernel::zeros<Vector<Scalar, n>>();  // Σ B² d, of B before it was made a triangle

  /// At x. False where Q is no covariance or G is not finite.
  bool form(const D& model, const Vector<Scalar, n>& x, const Context<Scalar, D>& at) {
    if constexpr (q > 0) {
      Matrix<Scalar, q, q> L;
      if (!Root::root_of_covariance(model, x, at, L)) return false;
      Matrix<Scalar, n, q> GL;
      kernel::product(disturbance_input(model, x, at), L, GL);  // G L, L Lᵀ = Q
      const Vector<Scalar, q> ones = kernel::filled<Vector<Scalar, q>>(Scalar(1));
      for (int i = 0; i < n; ++i) {
        sizes(i) = Scalar(0);
        for (int k = 0; k < q; ++k) sizes(i) += GL(i, k) * GL(i, k);
      }
      if constexpr (triangular) {
        UdFactors<Scalar, n> out;
        kernel::Padded<Scalar, n, q> W = kernel::zeros<kernel::Padded<Scalar, n, q>>();
        for (int k = 0; k < q; ++k) {
          for (int i = 0; i < n; ++i) W(i, k) = GL(i, k);
        }
        kernel::orthogonalise<false, Scalar, n, q>(W, ones, out);
        B = out.U;
        d = out.D;
      } else {
        B = GL;
        d = ones;
      }
    }
    return all_finite(B) && all_finite(d);
  }
};

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
