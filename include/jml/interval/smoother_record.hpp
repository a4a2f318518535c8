// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the forward pass of a smoother leaves at each instant.
#pragma once

#include <jml/interval/linearised.hpp>

namespace jml::detail {

/// What one instant leaves for the way back: the step that led to it, and its own measurements as at most n
/// independent rows h (columns of H) of variance r, with residual e at the prediction.
template <typename Scalar, typename D>
struct SmootherRecord {
  static constexpr int n = states_of<D>;
  using Root = NoiseRoot<Scalar, D>;

  Matrix<Scalar, n, n> transition = kernel::zeros<Matrix<Scalar, n, n>>();     // A
  Matrix<Scalar, n, Root::q> B = kernel::zeros<Matrix<Scalar, n, Root::q>>();  // B Bᵀ = G Q Gᵀ
  Vector<Scalar, n> prediction = kernel::zeros<Vector<Scalar, n>>();
  Matrix<Scalar, n, n> H = kernel::zeros<Matrix<Scalar, n, n>>();
  Vector<Scalar, n> r = kernel::zeros<Vector<Scalar, n>>(), e = r;
  int rows = 0;

  /// A measurement whose innovation is at x. False where R is not positive definite.
  template <int p>
  [[nodiscard]] bool add(const Vector<Scalar, n>& x, const Matrix<Scalar, p, n>& slot_d,
                         const Matrix<Scalar, p, p>& R, const Vector<Scalar, p>& innovation) {
    kernel::SymmetricFactor<Scalar, p> factor;
    if (!factor_precisely(R, factor)) return false;
    const Vector<Scalar, n> off = x - prediction;
    RecordRows<Scalar, n, p> own;
    own.H = kernel::transposed(slot_d);
    kernel::add_product<1>(innovation, slot_d, off, own.e);  // y - m about the prediction
    independent_rows(factor, own);
    if (rows + p > n) return compress(own);
    for (int i = 0; i < p; ++i) {
      for (int j = 0; j < n; ++j) H(j, rows) = own.H(j, i);
      r(rows) = own.r(i);
      e(rows++) = own.e(i);
    }
    return true;
  }

  /// From the cost to go about the prediction here to that about the estimate of the instant before.
  /// `condition`: of C = I + Bᵀ Λ B, by its pivots, as many times as much rounding of Λ is left in what goes
  /// on.
  [[nodiscard]] bool pass(CostToGo<Scalar, n>& v, Scalar& condition) const {
    for (int i = 0; i < rows; ++i) {
      for (int k = 0; k < n; ++k) {
        const Scalar weighted = H(k, i) / r(i);
        for (int j = 0; j < n; ++j) v.information(j, k) += H(j, i) * weighted;
        v.slope(k) -= weighted * e(i);
      }
    }
    condition = 1;
    if constexpr (Root::q > 1) {
      Matrix<Scalar, n, Root::q> U;
      Matrix<Scalar, Root::q, Root::q> C = kernel::identity<Matrix<Scalar, Root::q, Root::q>>();
      kernel::product(v.information, B, U);
      kernel::add_symmetric_transposed_product<1>(C, B, U, C);
      kernel::SymmetricFactor<Scalar, Root::q> factor;
      if (!factor.factor(C)) return false;
      for (int i = 0; i < Root::q; ++i) condition = std::max(condition, C(i, i) * factor.inverse_diagonal(i));
    }
    Feedback<Scalar, n, Root::q> law;
    PassSums<Scalar> sums;
    return pass_dynamics(transition, B, kernel::zeros<Vector<Scalar, Root::q>>(), Scalar(0), v, law, sums);
  }

 private:
  /// More rows than states: n rows of the same information.
  template <int p>
  JML_NOINLINE bool compress(const RecordRows<Scalar, n, p>& own) {
    InformationMemory<Scalar, n, 0, (p > n ? p : n)> memory;
    InformationInTwo<Scalar> information(memory);
    information.add_rows(rows, H.data(), r.data(), e.data(), nullptr);
    information.add_rows(p, own.H.data(), own.r.data(), own.e.data(), nullptr);
    information.store(H.data());
    information.innovations(e.data());
    for (int k = 0; k < n; ++k) {
      r(k) = Scalar(1) / H(k, k);
      H(k, k) = Scalar(1);
    }
    rows = n;
    return true;
  }
};

/// What a step of the forward pass used, on its way into a record.
template <typename Record>
struct SmootherObserver {
  Record& record;
  bool &moved, &corrected;  // it was told
  bool joint = false;       // the prediction is not known before the correction

  template <typename A>
  void transition(const A& a) const {
    record.transition = a;
    moved = true;
  }
  template <typename X, typename H, typename R, typename Innovation>
  void correction(const X& x, const H& slot_d, const R& noise, const Innovation& innovation) const {
    if (joint) record.prediction = x;
    corrected = record.add(x, slot_d, noise, innovation);
  }
};

}  // namespace jml::detail
