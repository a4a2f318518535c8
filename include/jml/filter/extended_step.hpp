// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One step of a symmetric rule in twice the digits: what the plain and the factored form do over again where
/// their own digits do not suffice.
///
/// P = U D Uᵀ by ud_extended.hpp; x with its own low part. The sizes are run-time numbers, so that a program
/// has one copy of this rare code for each scalar type; a Memory of the right size is the caller's.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>
#include <jml/rounding.hpp>
#include <jml/status.hpp>
#include <jml/ud_extended.hpp>

namespace jml::detail {
/// Room for n states, q disturbances and p measurements.
template <typename Scalar, int n, int q, int p>
struct ExtendedMemory {
  using T = Extended<Scalar>;
  static constexpr int most = q > 1 ? q : 1, columns = n + most > p ? n + most : p, rows = p > 0 ? p : 1;
  T U[n * n], D[n], W[n * columns], d[columns], B[n * (q > 0 ? q : 1)], Q[q * q + 1], d_B[q + 1];
  T x[n], moved[n], f[n], gain[n], h[rows * n], e[rows], R[rows * rows], r[rows], alpha[rows];
  Scalar size[n], row_size[n], bulk[n * columns];
};

/// What the rows of a measurement came to.
struct RowsReport {
  Status status = Status::ok;
  int redundant = 0;  ///< perfect rows that said nothing new
  int resolved = 0;   ///< rows that gave a variance to a direction that had none
};

template <typename Scalar>
class ExtendedStep {
 public:
  using T = Extended<Scalar>;

  template <int n, int q, int p>
  explicit ExtendedStep(ExtendedMemory<Scalar, n, q, p>& m)
      : n_(n),
        q_(q),
        p_(p),
        ud_{n, m.U, m.D},
        W_(m.W),
        d_(m.d),
        B_(m.B),
        Q_(m.Q),
        d_B_(m.d_B),
        x_(m.x),
        moved_(m.moved),
        f_(m.f),
        gain_(m.gain),
        h_(m.h),
        e_(m.e),
        R_(m.R),
        r_(m.r),
        alpha_(m.alpha),
        size_(m.size),
        row_size_(m.row_size),
        bulk_(m.bulk) {}

  /// P as a dense matrix, column by column, its low part or null; an infinite variance asks for zeros beside
  /// it. False where it is indefinite.
  [[nodiscard]] JML_RARE bool load(const Scalar* P, const Scalar* low = nullptr) {
    for (int i = 0; i < n_ * n_; ++i) ud_.U[i] = low != nullptr ? as_one(P[i], low[i]) : T(P[i]);
    constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
    const bool valid = ud_.factor(low != nullptr ? extended_epsilon<Scalar> : epsilon);
    ud_.deviations(size_);
    ud_.noise = low != nullptr ? ud_.magnification(size_, size_, f_) : Scalar(1);
    return valid;
  }
  /// P by its factors; the low parts may be null.
  JML_RARE void load(const Scalar* U, const Scalar* D, const Scalar* U_low, const Scalar* D_low) {
    for (int i = 0; i < n_ * n_; ++i) ud_.U[i] = as_one(U[i], U_low != nullptr ? U_low[i] : Scalar(0));
    for (int i = 0; i < n_; ++i)
      ud_.D[i] = std::isinf(D[i]) ? T(D[i]) : as_one(D[i], D_low != nullptr ? D_low[i] : Scalar(0));
    ud_.noise = 1;
    ud_.deviations(size_);
  }
  void load_state(const Scalar* x, const Scalar* low) {
    for (int i = 0; i < n_; ++i) x_[i] = as_one(x[i], low != nullptr ? low[i] : Scalar(0));
  }

  /// P ← F P Fᵀ + G Q Gᵀ and x ← f + F x_low; `affine`: f + F x. F n×n (null: I), G n×q, Q q×q, f n (null: x
  /// stays). False where Q is indefinite.
  [[nodiscard]] JML_RARE bool move(const Scalar* F, const Scalar* G, const Scalar* Q, const Scalar* f,
                                   bool affine = false) {
    for (int i = 0; i < q_ * q_; ++i) Q_[i] = T(Q[i]);
    const ExtendedUd<Scalar> noise{q_, Q_, d_B_};
    if (!noise.factor(std::numeric_limits<Scalar>::epsilon())) return false;
    for (int j = 0; j < q_; ++j) {
      for (int i = 0; i < n_; ++i) {
        T sum(0);
        for (int k = 0; k <= j; ++k) sum = sum + T(G[i + k * n_]) * noise.u(k, j);
        B_[i + j * n_] = sum;
      }
    }
    ud_.propagate(F, q_, B_, d_B_, W_, d_, size_, bulk_);
    if (f == nullptr) return true;
    for (int i = 0; i < n_; ++i) {
      T sum(f[i]);
      for (int k = 0; F != nullptr && k < n_; ++k)
        sum = sum + T(F[i + k * n_]) * (affine ? x_[k] : T(in_two<Scalar>(x_[k]).low));
      moved_[i] = sum;
    }
    for (int i = 0; i < n_; ++i) x_[i] = moved_[i];
    return true;
  }

  /// P_ij of now.
  [[nodiscard]] JML_RARE T P(int i, int j) const {
    T sum(0);
    for (int k = i > j ? i : j; k < n_; ++k) {
      if (ExtendedUd<Scalar>::upper(ud_.D[k]) > Scalar(0)) sum = sum + ud_.u(i, k) * ud_.D[k] * ud_.u(j, k);
    }
    return sum;
  }

  /// The rows H (p×n) with noise R (p×p, positive semidefinite) and innovation e at the high part of x;
  /// exact: e is y, and H x is subtracted here. Rows are made independent first, then taken one after the
  /// other. `sizes`: of the terms of each innovation, for what its rounding may be. S: p×p or null.
  [[nodiscard]] JML_RARE RowsReport correct(const Scalar* H, const Scalar* R, const Scalar* e, bool exact,
                                            const Scalar* sizes, Scalar* S) {
    RowsReport report;
    for (int i = 0; i < p_ * p_; ++i) R_[i] = T(R[i]);
    const ExtendedUd<Scalar> noise{p_, R_, r_};
    if (!noise.factor(std::numeric_limits<Scalar>::epsilon())) {
      report.status = Status::invalid_noise_covariance;
      return report;
    }
    for (int i = 0; i < p_; ++i) {
      e_[i] = T(e[i]);
      for (int j = 0; j < n_; ++j) {
        h_[j + i * n_] = T(H[i + j * p_]);
        e_[i] = e_[i] - h_[j + i * n_] * (exact ? x_[j] : T(in_two<Scalar>(x_[j]).low));
      }
    }
    if (S != nullptr) innovation_matrix(R, S);
    // R = U D Uᵀ: the rows of U⁻¹ H are independent.
    for (int i = p_ - 1; i >= 0; --i) {
      for (int k = i + 1; k < p_; ++k) {
        const T factor = noise.u(i, k);
        if (factor == T(0)) continue;
        e_[i] = e_[i] - factor * e_[k];
        for (int j = 0; j < n_; ++j) h_[j + i * n_] = h_[j + i * n_] - factor * h_[j + k * n_];
      }
    }
    for (int j = 0; j < n_; ++j) moved_[j] = T(0);
    for (int i = 0; i < p_; ++i) {
      const RowUse use = take_row(h_ + i * n_, r_[i], e_[i], alpha_[i]);
      if (use == RowUse::resolved) ++report.resolved;
      if (use != RowUse::redundant) continue;
      ++report.redundant;
      alpha_[i] = T(std::numeric_limits<Scalar>::infinity());
      const Scalar slack = Scalar(64) * std::numeric_limits<Scalar>::epsilon() * sizes[i];
      if (!(ExtendedUd<Scalar>::size_of(e_[i]) <= slack)) report.status = Status::contradiction;
    }
    for (int j = 0; j < n_; ++j) x_[j] = x_[j] + moved_[j];
    return report;
  }

  /// n independent rows, the columns of the unit upper triangle V, of information E (zero: none) and with
  /// innovations e at x.
  JML_RARE void correct_by_rows(const T* V, const T* E, const T* e) {
    for (int j = 0; j < n_; ++j) moved_[j] = T(0);
    for (int k = 0; k < n_; ++k) {
      if (!(ExtendedUd<Scalar>::upper(E[k]) > Scalar(0))) continue;
      T innovation = e[k];
      for (int j = 0; j < n_; ++j) h_[j] = j < k ? V[j + k * n_] : T(j == k ? 1 : 0);
      static_cast<void>(take_row(h_, T(1) / E[k], innovation, alpha_[0]));
    }
    for (int j = 0; j < n_; ++j) x_[j] = x_[j] + moved_[j];
  }

  /// Innovation and variance of row i as it was taken; infinite where it resolved a direction or said
  /// nothing.
  [[nodiscard]] Scalar row_innovation(int i) const { return ExtendedUd<Scalar>::upper(e_[i]); }
  [[nodiscard]] Scalar row_variance(int i) const { return ExtendedUd<Scalar>::upper(alpha_[i]); }

  /// K (n×p) = P⁺ Hᵀ R⁻¹ of the correction just made, with R = U_R D_R U_Rᵀ.
  JML_RARE void gain(Scalar* K) {
    for (int i = 0; i < p_; ++i) {
      for (int j = 0; j < n_; ++j) {
        T sum(0);
        for (int k = 0; k < n_; ++k) sum = sum + P(j, k) * h_[k + i * n_];
        W_[j + i * n_] = sum / r_[i];
      }
    }
    for (int i = 0; i < p_; ++i) {  // K = [P⁺ h_i / r_i] U_R⁻¹
      for (int k = 0; k < i; ++k) {
        const T factor = R_[k + i * p_];
        for (int j = 0; j < n_; ++j) W_[j + i * n_] = W_[j + i * n_] - W_[j + k * n_] * factor;
      }
      for (int j = 0; j < n_; ++j) K[j + i * n_] = ExtendedUd<Scalar>::upper(W_[j + i * n_]);
    }
  }

  /// See ExtendedUd::magnification(): of what happened since load(); of that to P alone, where the variance
  /// of a state is right however much of it went; and of P as it is.
  [[nodiscard]] Scalar magnification() const { return ud_.magnification(size_, size_, f_); }
  [[nodiscard]] Scalar magnification_of_P() const {
    ud_.deviations(row_size_);
    return ud_.magnification(size_, row_size_, f_);
  }
  [[nodiscard]] Scalar magnification_of_now() const {
    ud_.deviations(row_size_);
    return ud_.magnification(row_size_, row_size_, f_);
  }
  /// What rounding may have made of x, in deviations and units of that of T, `before` being what it had made
  /// of P: the gain is as wrong as P is, and a row that is far off shows it.
  [[nodiscard]] JML_RARE Scalar magnification_of_x(Scalar before) const {
    Scalar nis = 0;
    for (int i = 0; i < p_; ++i) nis += row_innovation(i) / row_variance(i) * row_innovation(i);
    return magnification() * std::sqrt(Scalar(1) + nis) + before * std::sqrt(nis);
  }

  /// P_ii to a few digits.
  void variances(Scalar* out) const {
    ud_.deviations(out);
    for (int i = 0; i < n_; ++i) out[i] *= out[i];
  }

  /// A variance is too small for the digits of Scalar, or may have been when it was taken for zero.
  [[nodiscard]] JML_RARE bool underflows() const {
    for (int i = 0; i < n_; ++i) {
      const Scalar d = ExtendedUd<Scalar>::upper(ud_.D[i]);
      if (d < least_variance<Scalar> &&
          (d > Scalar(0) || (size_[i] > Scalar(0) && size_[i] * size_[i] < least_variance<Scalar>)))
        return true;
    }
    return false;
  }
  /// Some state is a combination of others exactly.
  [[nodiscard]] JML_RARE bool combines() const {
    for (int i = 0; i < n_; ++i) {
      if (ExtendedUd<Scalar>::upper(ud_.D[i]) != Scalar(0)) continue;
      for (int k = i + 1; k < n_; ++k) {
        if (ExtendedUd<Scalar>::size_of(ud_.u(i, k)) != Scalar(0) &&
            ExtendedUd<Scalar>::upper(ud_.D[k]) != Scalar(0))
          return true;
      }
    }
    return false;
  }

  [[nodiscard]] const T& x(int i) const { return x_[i]; }
  [[nodiscard]] const T& U(int i, int j) const { return ud_.u(i, j); }
  [[nodiscard]] const T& D(int i) const { return ud_.D[i]; }
  [[nodiscard]] JML_RARE bool finite() const {
    Scalar sum = 0;
    for (int i = 0; i < n_; ++i) {
      sum += Scalar(0) * ExtendedUd<Scalar>::upper(x_[i]);
      if (!ExtendedUd<Scalar>::infinite(ud_.D[i])) sum += Scalar(0) * ExtendedUd<Scalar>::upper(ud_.D[i]);
      for (int j = 0; j < i; ++j) sum += Scalar(0) * ExtendedUd<Scalar>::upper(ud_.u(j, i));
    }
    return sum == Scalar(0);
  }

 private:
  /// One row of variance r, whose innovation e is at x; on return at x + moved_, which it moves on.
  JML_RARE RowUse take_row(const T* h, const T& r, T& e, T& alpha) {
    for (int j = 0; j < n_; ++j) e = e - h[j] * moved_[j];
    const RowUse use = ud_.correct(h, r, gain_, alpha, f_, W_, d_, row_size_, bulk_);
    for (int j = 0; j < n_ && use != RowUse::redundant; ++j) {
      if (use == RowUse::resolved) size_[j] = row_size_[j] > size_[j] ? row_size_[j] : size_[j];
      moved_[j] = moved_[j] + gain_[j] * e;
    }
    return use;
  }
  /// S = R + H P Hᵀ.
  JML_RARE void innovation_matrix(const Scalar* R, Scalar* S) {
    for (int i = 0; i < p_; ++i) {
      for (int j = 0; j <= i; ++j) {
        T sum(R[i + j * p_]);
        bool infinite = false;
        for (int k = 0; k < n_; ++k) {
          T a(0), b(0);
          for (int l = 0; l <= k; ++l) {
            a = a + ud_.u(l, k) * h_[l + i * n_];
            b = b + ud_.u(l, k) * h_[l + j * n_];
          }
          if (ExtendedUd<Scalar>::infinite(ud_.D[k]))
            infinite = infinite || (ExtendedUd<Scalar>::size_of(a) > 0 && ExtendedUd<Scalar>::size_of(b) > 0);
          else
            sum = sum + a * ud_.D[k] * b;
        }
        S[i + j * p_] = S[j + i * p_] =
            infinite ? std::numeric_limits<Scalar>::infinity() : ExtendedUd<Scalar>::upper(sum);
      }
    }
  }

  int n_, q_, p_;
  ExtendedUd<Scalar> ud_;
  T *W_, *d_, *B_, *Q_, *d_B_, *x_, *moved_, *f_, *gain_, *h_, *e_, *R_, *r_, *alpha_;
  Scalar *size_, *row_size_, *bulk_;
};
}  // namespace jml::detail
#include <jml/warnings_end.hpp>
