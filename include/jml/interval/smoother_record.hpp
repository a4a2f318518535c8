// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the forward pass of a smoother leaves at each instant.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/linearised.hpp>

namespace jml::detail {

/// y - H x.
template <typename Scalar, int n, int p>
JML_NOINLINE void innovation_in_two(const Vector<Scalar, p>& y, const Matrix<Scalar, p, n>& H,
                                    const Vector<Scalar, n>& x, Vector<Scalar, p>& high,
                                    Vector<Scalar, p>& low) {
  for (int i = 0; i < p; ++i) {
    Extended<Scalar> sum(y(i));
    for (int j = 0; j < n; ++j) sum = sum - Extended<Scalar>(H(i, j)) * Extended<Scalar>(x(j));
    high(i) = in_two<Scalar>(sum).high;
    low(i) = in_two<Scalar>(sum).low;
  }
}

/// What one instant leaves for the way back: the step that led to it, and its own measurements as at most n
/// independent rows h (columns of H) of variance r, with residual e at the prediction. What later
/// measurements say is moved by differences of states, whose rounding their information magnifies: H and e
/// are kept in twice the digits, and so is what a step makes of a state.
template <typename Scalar_, typename D>
struct SmootherRecord {
  using Scalar = Scalar_;
  static constexpr int n = states_of<D>;
  static constexpr bool affine = DynamicsTraits<D>::linear;
  using Root = NoiseRoot<Scalar, D>;
  using T = Extended<Scalar>;

  Matrix<Scalar, n, n> transition = kernel::zeros<Matrix<Scalar, n, n>>();     // A
  Matrix<Scalar, n, Root::q> B = kernel::zeros<Matrix<Scalar, n, Root::q>>();  // B Bᵀ = G Q Gᵀ
  Vector<Scalar, n> constant = kernel::zeros<Vector<Scalar, n>>();  // f(0) of affine dynamics, else f(x̂)
  Vector<Scalar, n> prediction = constant;                          // to the digits of Scalar
  Matrix<Scalar, n, n> H = kernel::zeros<Matrix<Scalar, n, n>>(), H_low = H;
  Vector<Scalar, n> r = constant, e = constant, e_low = constant;
  int rows = 0;

  /// What the step makes of x + x_low, `constant` being known: f + A x_low, or f(0) + A (x + x_low).
  void predict(const Vector<Scalar, n>& x, const Vector<Scalar, n>& x_low, T* out) const {
    for (int i = 0; i < n; ++i) {
      T sum(constant(i));
      for (int k = 0; k < n; ++k)
        sum = sum + T(transition(i, k)) * (affine ? as_one(x(k), x_low(k)) : T(x_low(k)));
      out[i] = sum;
    }
  }

  /// A measurement whose innovation is at x, with what it has in twice the digits. False where R is not
  /// positive definite.
  template <int p>
  [[nodiscard]] bool add(const Vector<Scalar, n>& x, const Matrix<Scalar, p, n>& slot_d,
                         const Matrix<Scalar, p, p>& R, const Vector<Scalar, p>& innovation,
                         const Vector<Scalar, p>& low = kernel::zeros<Vector<Scalar, p>>()) {
    if (rows + p > n || x != prediction || !is_diagonal(R)) return add_in_two(x, slot_d, R, innovation, low);
    for (int i = 0; i < p; ++i) {
      if (!(R(i, i) > Scalar(0))) return false;
      for (int j = 0; j < n; ++j) {
        H(j, rows) = slot_d(i, j);
        H_low(j, rows) = Scalar(0);
      }
      r(rows) = R(i, i);
      e(rows) = innovation(i);
      e_low(rows++) = low(i);
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
  /// The same with the rows made independent and moved to the prediction; more of them than states become n.
  template <int p>
  JML_NOINLINE bool add_in_two(const Vector<Scalar, n>& x, const Matrix<Scalar, p, n>& slot_d,
                               const Matrix<Scalar, p, p>& R, const Vector<Scalar, p>& innovation,
                               const Vector<Scalar, p>& low) {
    T U[p * p], variance[p], h[n * p], own[p];
    for (int i = 0; i < p * p; ++i) U[i] = T(R.data()[i]);
    const ExtendedUd<Scalar> noise{p, U, variance};
    if (!noise.factor(std::numeric_limits<Scalar>::epsilon())) return false;
    for (int i = p - 1; i >= 0; --i) {  // the rows of U⁻¹ H are independent
      if (!(noise.upper(variance[i]) > Scalar(0))) return false;
      own[i] = as_one(innovation(i), low(i));
      for (int j = 0; j < n; ++j) {
        h[j + i * n] = T(slot_d(i, j));
        own[i] = own[i] + h[j + i * n] * (T(x(j)) - T(prediction(j)));
      }
      for (int k = i + 1; k < p; ++k) {
        own[i] = own[i] - noise.u(i, k) * own[k];
        for (int j = 0; j < n; ++j) h[j + i * n] = h[j + i * n] - noise.u(i, k) * h[j + k * n];
      }
    }
    Matrix<Scalar, n, p> high, rest;
    Vector<Scalar, p> variances, residual, residual_low;
    for (int i = 0; i < p; ++i) {
      for (int j = 0; j < n; ++j) {
        high(j, i) = in_two<Scalar>(h[j + i * n]).high;
        rest(j, i) = in_two<Scalar>(h[j + i * n]).low;
      }
      variances(i) = noise.upper(variance[i]);
      residual(i) = in_two<Scalar>(own[i]).high;
      residual_low(i) = in_two<Scalar>(own[i]).low;
    }
    if (rows + p <= n) {
      for (int i = 0; i < p; ++i) {
        for (int j = 0; j < n; ++j) {
          H(j, rows) = high(j, i);
          H_low(j, rows) = rest(j, i);
        }
        r(rows) = variances(i);
        e(rows) = residual(i);
        e_low(rows++) = residual_low(i);
      }
      return true;
    }
    InformationMemory<Scalar, n, 0, (p > n ? p : n)> memory;
    InformationInTwo<Scalar> information(memory);
    information.add_rows(rows, H.data(), r.data(), e.data(), nullptr, H_low.data(), e_low.data());
    information.add_rows(p, high.data(), variances.data(), residual.data(), nullptr, rest.data(),
                         residual_low.data());
    information.store(H.data());
    information.store_rest(H_low.data(), e.data(), e_low.data());
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
#include <jml/warnings_end.hpp>
