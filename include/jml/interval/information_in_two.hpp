// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The backward recursion of interval/costate.hpp in twice the digits and in factors, Λ = V E Vᵀ: what the
/// passes are made of where Λ is so large against what is left of it that the digits of Scalar do not
/// suffice.
///
/// V E Vᵀ is moved as a covariance is (ud_extended.hpp), with the parts exchanged: a measurement adds its
/// rows as process noise does, a column b of B takes Λ b (1 + bᵀ Λ b)⁻¹ bᵀ Λ away as a measurement of
/// variance 1 does, and A acts from the other side. Sizes are run-time numbers: one copy of this rare code
/// for a program.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/extended_step.hpp>
#include <jml/interval/costate.hpp>

namespace jml::detail {

/// Room for n states, q disturbances and p rows of one measurement.
template <typename Scalar, int n, int q, int p>
struct InformationMemory {
  using T = Extended<Scalar>;
  static constexpr int rows = p > 1 ? p : 1, inputs = q > 1 ? q : 1, columns = n + rows + 1;
  T V[n * n], E[n], W[n * columns], d[columns], h[n * rows], weight[rows];
  T slope[n], moved[n], f[n], gain[n * inputs], alpha[inputs], g[inputs], offset[inputs], law[n * inputs];
  T U[n * n], D[n], mean[n];
  Scalar size[n], bulk[n * columns], transposed[n * n], terms[n];
};

template <typename Scalar>
class InformationInTwo {
 public:
  using T = Extended<Scalar>;
  using Ud = ExtendedUd<Scalar>;

  template <int n, int q, int p>
  explicit InformationInTwo(InformationMemory<Scalar, n, q, p>& m)
      : n_(n),
        q_(q),
        ud_{n, m.V, m.E},
        prior_{n, m.U, m.D},
        W_(m.W),
        d_(m.d),
        h_(m.h),
        weight_(m.weight),
        slope_(m.slope),
        moved_(m.moved),
        f_(m.f),
        gain_(m.gain),
        alpha_(m.alpha),
        g_(m.g),
        offset_(m.offset),
        law_(m.law),
        mean_(m.mean),
        size_(m.size),
        bulk_(m.bulk),
        transposed_(m.transposed),
        terms_(m.terms) {
    begin(nullptr, nullptr);
  }

  /// Λ (n×n; null: zero) and λ (null: zero). False where Λ is indefinite.
  bool begin(const Scalar* information, const Scalar* slope) {
    for (int i = 0; i < n_; ++i) {
      slope_[i] = T(slope != nullptr ? slope[i] : Scalar(0));
      terms_[i] = Ud::size_of(slope_[i]);
    }
    rounding_ = 0;
    for (int i = 0; i < n_ * n_; ++i) ud_.U[i] = T(information != nullptr ? information[i] : Scalar(0));
    return ud_.factor(std::numeric_limits<Scalar>::epsilon());
  }

  /// Λ + Σ h hᵀ / r, λ - Σ h e / r - pull: `count` rows h (columns of H, n×count). pull: n or null; H_low and
  /// e_low, what H and e have in twice the digits, or null.
  void add_rows(int count, const Scalar* H, const Scalar* r, const Scalar* e, const Scalar* pull,
                const Scalar* H_low = nullptr, const Scalar* e_low = nullptr) {
    for (int i = 0; i < count; ++i) {
      weight_[i] = std::isinf(r[i]) ? T(0) : T(1) / T(r[i]);
      const T innovation = as_one(e[i], e_low != nullptr ? e_low[i] : Scalar(0));
      for (int j = 0; j < n_; ++j) {
        h_[j + i * n_] = as_one(H[j + i * n_], H_low != nullptr ? H_low[j + i * n_] : Scalar(0));
        const T part = h_[j + i * n_] * (weight_[i] * innovation);
        slope_[j] = slope_[j] - part;
        terms_[j] += Ud::size_of(part);
      }
    }
    for (int j = 0; pull != nullptr && j < n_; ++j) slope_[j] = slope_[j] - T(pull[j]);
    ud_.propagate(nullptr, count, h_, weight_, W_, d_, size_, bulk_);
  }

  /// λ + Λ δ.
  template <typename Number>
  void move_by(const Number* delta) {
    times_information(delta);
    for (int i = 0; i < n_; ++i) slope_[i] = slope_[i] + moved_[i];
    for (int k = 0; k < n_; ++k) {
      Scalar sizes = 0;
      for (int i = 0; i <= k; ++i) sizes += Ud::size_of(ud_.u(i, k)) * Ud::size_of(T(delta[i]));
      sizes *= Ud::upper(ud_.D[k]);
      for (int i = 0; i <= k; ++i) terms_[i] += Ud::size_of(ud_.u(i, k)) * sizes;
    }
  }

  /// Through a step: pass_dynamics(). A n×n, B n×q, b q; offset q and gain q×n of the law, or null.
  void pass(const Scalar* A, const Scalar* B, const Scalar* b, Scalar damping, Scalar* offset, Scalar* gain,
            PassSums<Scalar>& sums) {
    for (int c = 0; c < q_; ++c) {  // column by column: g = b̃ + bᵀλ, Λ ← Λ - α k kᵀ, λ ← λ - k g
      T* k = gain_ + c * n_;
      T g(b[c]);
      for (int i = 0; i < n_; ++i) {
        h_[i] = T(B[i + c * n_]);
        g = g + h_[i] * slope_[i];
      }
      static_cast<void>(
          ud_.correct(h_, T(1) + T(damping), k, alpha_[c], f_, W_, d_, size_, bulk_));  // k = Λ b / α
      for (int i = 0; i < n_; ++i) {
        slope_[i] = slope_[i] - k[i] * g;
        terms_[i] += Ud::size_of(k[i]) * Ud::size_of(g);
      }
      sums.decrease += Ud::upper(g * g / alpha_[c]) / Scalar(2);
      sums.cost += b[c] * b[c] / Scalar(2);
      g_[c] = g;
    }
    if (offset != nullptr) find_law(A, B, offset, gain);
    for (int i = 0; i < n_; ++i) {
      T sum(0), sizes(0);
      for (int k = 0; k < n_; ++k) {
        sum = sum + T(A[k + i * n_]) * slope_[k];
        sizes = sizes + T(std::abs(A[k + i * n_]) * terms_[k]);
        transposed_[i + k * n_] = A[k + i * n_];
      }
      moved_[i] = sum;
      law_[i] = sizes;
    }
    ud_.propagate(transposed_, 0, nullptr, nullptr, W_, d_, size_, bulk_);  // Aᵀ Λ A
    for (int i = 0; i < n_; ++i) size_[i] = Ud::upper(law_[i]);
    rounding_ += extended_epsilon<Scalar> * ud_.magnification(size_, size_, f_);
    for (int i = 0; i < n_; ++i) {
      slope_[i] = moved_[i];  // Aᵀ λ
      terms_[i] = Ud::size_of(moved_[i]);
    }
  }
  /// What rounding may have made of the innovations of Λ's rows since begin(), in their deviations.
  [[nodiscard]] Scalar rounding() const { return rounding_; }
  /// At most how many deviations a state moves by these sizes, n, of its change.
  [[nodiscard]] Scalar deviations_in(const Scalar* sizes) {
    Scalar sum = 0;
    ud_.deviations(size_);  // √Λ_ii
    for (int i = 0; i < n_; ++i) sum += size_[i] * sizes[i];
    return sum;
  }

  /// At node 0, x = x̂ + L a with a term ½ Σ weight a² in J, `off` = x̂ - x̃: the change `law` of the nominal a.
  /// Rows of Λ are taken as measurements of a, so that a weight of 0 and an L of any rank are ordinary; what
  /// nothing determines goes to a = 0. False where a number is not finite.
  [[nodiscard]] bool at_prior(const Scalar* L, const Scalar* weight, const Scalar* a, const Scalar* off,
                              Scalar damping, Scalar* law, PassSums<Scalar>& sums) {
    for (int i = 0; i < n_; ++i) {
      const Scalar total = weight[i] + damping;
      prior_.D[i] = total > Scalar(0) ? T(1) / T(total) : T(std::numeric_limits<Scalar>::infinity());
      mean_[i] = total > Scalar(0) ? T(damping) * T(a[i]) / T(total) : T(0);
      for (int j = 0; j < n_; ++j) prior_.U[j + i * n_] = T(i == j ? 1 : 0);
    }
    whiten_slope();
    for (int k = 0; k < n_; ++k) {
      if (!informed(k)) continue;
      T e = -(moved_[k] / ud_.D[k]);
      for (int i = 0; i <= k; ++i) e = e - ud_.u(i, k) * T(off[i]);
      for (int j = 0; j < n_; ++j) {  // row k of Vᵀ L
        T sum(0);
        for (int i = 0; i <= k; ++i) sum = sum + ud_.u(i, k) * T(L[i + j * n_]);
        h_[j] = sum;
        e = e - sum * mean_[j];
      }
      static_cast<void>(prior_.correct(h_, T(1) / ud_.D[k], gain_, alpha_[0], f_, W_, d_, size_, bulk_));
      for (int j = 0; j < n_; ++j) mean_[j] = mean_[j] + gain_[j] * e;
    }
    for (int j = 0; j < n_; ++j) law[j] = Ud::upper(mean_[j] - T(a[j]));
    // g = a + Lᵀ (λ + Λ (off + L a)), and J can fall by -½ gᵀ δa.
    for (int i = 0; i < n_; ++i) {
      T sum(off[i]);
      for (int j = 0; j < n_; ++j) sum = sum + T(L[i + j * n_]) * T(a[j]);
      f_[i] = sum;
    }
    times_information(f_);
    for (int i = 0; i < n_; ++i)  // the cost is that of a trajectory from x̂_0 + L a, see Sweep
      sums.cost += Ud::upper(f_[i] * (slope_[i] + T(Scalar(0.5)) * moved_[i]));
    for (int j = 0; j < n_; ++j) {
      T g = T(weight[j]) * T(a[j]);
      for (int i = 0; i < n_; ++i) g = g + T(L[i + j * n_]) * (slope_[i] + moved_[i]);
      sums.decrease -= Ud::upper(g * T(law[j])) / Scalar(2);
      sums.cost += weight[j] * a[j] * a[j] / Scalar(2);
    }
    Scalar zero = Scalar(0) * sums.decrease;
    for (int j = 0; j < n_; ++j) zero += Scalar(0) * law[j];
    return zero == Scalar(0);
  }

  /// Λ as rows: column k of V (unit upper triangle) of variance 1 / E_k, with E on its diagonal: n×n.
  void store(Scalar* rows) const {
    for (int k = 0; k < n_; ++k) {
      for (int i = 0; i < n_; ++i) rows[i + k * n_] = i < k ? Ud::upper(ud_.u(i, k)) : Scalar(0);
      rows[k + k * n_] = Ud::upper(ud_.D[k]);
    }
  }
  /// Of each such row what store() leaves out, and its innovation at the nominal, ½ E_k (v_kᵀ δ - e_k)², zero
  /// where E_k is: as add_rows() takes them.
  void store_rest(Scalar* rows_low, Scalar* e, Scalar* e_low) {
    whiten_slope();
    for (int k = 0; k < n_; ++k) {
      const T innovation = informed(k) ? -(moved_[k] / ud_.D[k]) : T(0);
      e[k] = in_two<Scalar>(innovation).high;
      e_low[k] = in_two<Scalar>(innovation).low;
      for (int i = 0; i < n_; ++i) rows_low[i + k * n_] = i < k ? in_two<Scalar>(ud_.u(i, k)).low : Scalar(0);
    }
  }
  /// `belief`, a state of the same n, given what Λ and λ say of it about its x.
  void correct(ExtendedStep<Scalar>& belief) {
    whiten_slope();
    for (int k = 0; k < n_; ++k) {
      if (informed(k)) moved_[k] = -(moved_[k] / ud_.D[k]);
    }
    belief.correct_by_rows(ud_.U, ud_.D, moved_);
  }

 private:
  [[nodiscard]] bool informed(int k) const { return Ud::upper(ud_.D[k]) > Scalar(0); }

  /// V⁻¹ λ into moved_.
  void whiten_slope() {
    for (int j = n_ - 1; j >= 0; --j) {
      moved_[j] = slope_[j];
      for (int k = j + 1; k < n_; ++k) moved_[j] = moved_[j] - ud_.u(j, k) * moved_[k];
    }
  }
  /// Λ δ into moved_.
  template <typename Number>
  void times_information(const Number* delta) {
    for (int i = 0; i < n_; ++i) moved_[i] = T(0);
    for (int k = 0; k < n_; ++k) {
      T sum(0);
      for (int i = 0; i <= k; ++i) sum = sum + ud_.u(i, k) * T(delta[i]);
      sum = sum * ud_.D[k];
      for (int i = 0; i <= k; ++i) moved_[i] = moved_[i] + ud_.u(i, k) * sum;
    }
  }
  /// Column c was eliminated with those after it still in x: δb_c = -g_c/α_c - k_cᵀ (A δ + Σ_{i>c} b_i δb_i).
  void find_law(const Scalar* A, const Scalar* B, Scalar* offset, Scalar* gain) {
    for (int c = q_ - 1; c >= 0; --c) {
      const T* k = gain_ + c * n_;
      T* row = law_ + c * n_;
      offset_[c] = -(g_[c] / alpha_[c]);
      for (int j = 0; j < n_; ++j) {
        row[j] = T(0);
        for (int i = 0; i < n_; ++i) row[j] = row[j] - k[i] * T(A[i + j * n_]);
      }
      for (int l = c + 1; l < q_; ++l) {
        T across(0);
        for (int i = 0; i < n_; ++i) across = across + k[i] * T(B[i + l * n_]);
        offset_[c] = offset_[c] - across * offset_[l];
        for (int j = 0; j < n_; ++j) row[j] = row[j] - across * law_[j + l * n_];
      }
      offset[c] = Ud::upper(offset_[c]);
      for (int j = 0; j < n_; ++j) gain[c + j * q_] = Ud::upper(row[j]);
    }
  }

  int n_, q_;
  Ud ud_, prior_;
  T *W_, *d_, *h_, *weight_, *slope_, *moved_, *f_, *gain_, *alpha_, *g_, *offset_, *law_, *mean_;
  Scalar *size_, *bulk_, *transposed_, *terms_;
  Scalar rounding_ = 0;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
