// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Are the innovations of a filter white? The portmanteau test over lags (component jml::campaign).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/analysis/consistency.hpp>

namespace jml {

namespace detail {

/// D^-½ L⁻¹ b with S = L D Lᵀ as factored.
template <int p, int cols>
Matrix<double, p, cols> whitened(const kernel::SymmetricFactor<double, p>& factor,
                                 Matrix<double, p, cols> b) {
  for (int i = 0; i < p; ++i) {
    for (int k = 0; k < i; ++k) b.row(i) -= factor.lower(i, k) * b.row(k);
  }
  for (int i = 0; i < p; ++i) b.row(i) *= std::sqrt(factor.inverse_diagonal(i));
  return b;
}

}  // namespace detail

/// What the autocorrelation of the innovations says of the gain.
enum class WhitenessVerdict : std::uint8_t {
  undefined,  ///< no more samples than lags or measurements, or no probability in (0, 1)
  white,      ///< the statistic is below its bound
  coloured,   ///< the past innovations predict the next one: the gain is not the best, or the model is wrong
};

/// Whiteness of the innovations of p measurements at lags 1 … `lags`: all p×p entries of the autocovariance
/// of z = L⁻¹ν, S = L Lᵀ, are tested together (Hosking 1980). With C_k = Σ z_t z_{t-k}ᵀ over N samples,
///
///     statistic = w Σ_k tr(C_kᵀ C_0⁻¹ C_k C_0⁻¹) / (number of pairs at lag k)
///
/// is about χ² with p² · lags degrees, whatever the scale of S. w → N²; since Z (ZᵀZ)^-½ of N normal rows is
/// uniform on the Stiefel manifold, w = p N(N+2)(N-1) / (p(N+1) - 2) makes the mean exact: with p = 1 it is
/// N(N+2) of Ljung and Box (1978). No mean is subtracted: a bias shows as correlation at all lags.
///
/// Lags beyond the memory of the filter dilute the test. At 95 % and N = 10 · p · lags up to 6 of 100 white
/// sequences fail, not 5. A correlation r at one lag is seen where N r² is well above √(2 p² lags).
template <int p, int lags = 10>
class Whiteness {
  static_assert(p >= 1 && lags >= 1, "jml: Whiteness<p, lags> wants a measurement and a lag");

 public:
  /// `probability`: that white innovations pass, in (0, 1).
  explicit Whiteness(double probability = 0.95) : probability_(probability) {
    for (auto& sum : sum_) kernel::set_zero(sum);
  }

  /// Left out and counted where sym(S) is not positive definite or the innovation not finite: the samples
  /// before and after it are then one lag apart.
  void add(const Vector<double, p>& innovation, const Matrix<double, p, p>& S) {
    kernel::SymmetricFactor<double, p> factor;
    const Matrix<double, p, p> symmetric_part = kernel::symmetric_part(S);
    const bool positive = factor.factor(symmetric_part);
    const Vector<double, p> z = detail::whitened<p, 1>(factor, innovation);
    if (!positive || !all_finite(z)) {
      ++left_out_;
      return;
    }
    sum_[0] += z * z.transpose();
    ++pairs_[0];
    for (int k = 1; k <= held_; ++k) {
      sum_[k] += z * recent_[(next_ + lags - k) % lags].transpose();
      ++pairs_[k];
    }
    recent_[next_] = z;
    next_ = (next_ + 1) % lags;
    held_ = held_ < lags ? held_ + 1 : lags;
  }
  /// Of a step, also one that a gate rejected; left out where the step was refused.
  template <typename Scalar, int n>
  void add(const StepReport<Scalar, n, p>& report) {
    if (usable(report.status))
      add(kernel::cast<double>(report.innovation), kernel::cast<double>(report.innovation_matrix));
    else
      ++left_out_;
  }
  /// The next innovation belongs to another run: no pair is made across.
  void start_run() { held_ = 0; }

  [[nodiscard]] long samples() const { return pairs_[0]; }   ///< innovations added
  [[nodiscard]] long left_out() const { return left_out_; }  ///< innovations that were no sample
  /// Mean of z zᵀ: the identity where S is right; its trace is the average NIS.
  [[nodiscard]] Matrix<double, p, p> covariance() const { return sum_[0] / static_cast<double>(samples()); }
  /// Entry (i, j): correlation of z_i with z_j `lag` samples before. NaN beyond the lags kept.
  [[nodiscard]] Matrix<double, p, p> autocorrelation(int lag) const {
    if (lag < 0 || lag > lags)
      return kernel::filled<Matrix<double, p, p>>(std::numeric_limits<double>::quiet_NaN());
    const Vector<double, p> unit = sum_[0].diagonal().cwiseSqrt().cwiseInverse();
    return unit.asDiagonal() * sum_[lag] * unit.asDiagonal();
  }
  /// White innovations: a single entry of autocorrelation() is within ± this with the probability asked for.
  [[nodiscard]] double bound() const {
    if (!detail::is_probability(probability_)) return std::numeric_limits<double>::quiet_NaN();
    const boost::math::normal_distribution<double, detail::Quiet> law;
    return quantile(complement(law, (1 - probability_) / 2)) / std::sqrt(static_cast<double>(samples()));
  }

  [[nodiscard]] static constexpr int degrees() { return p * p * lags; }  ///< of the statistic: p² · lags
  /// Hosking's, above. NaN with too few samples.
  [[nodiscard]] double statistic() const {
    kernel::SymmetricFactor<double, p> factor;
    if (pairs_[lags] < 1 || samples() <= p || !factor.factor(sum_[0]))
      return std::numeric_limits<double>::quiet_NaN();
    double sum = 0;
    for (int k = 1; k <= lags; ++k) {
      const Matrix<double, p, p> half = detail::whitened<p, p>(factor, sum_[k]).transpose();
      sum += detail::whitened<p, p>(factor, half).squaredNorm() / static_cast<double>(pairs_[k]);
    }
    const auto N = static_cast<double>(samples());
    return p * N * (N + 2) * (N - 1) / (p * (N + 1) - 2) * sum;
  }
  /// White innovations stay below this with the probability asked for.
  [[nodiscard]] double statistic_bound() const {
    if (!detail::is_probability(probability_)) return std::numeric_limits<double>::quiet_NaN();
    const boost::math::chi_squared_distribution<double, detail::Quiet> law(degrees());
    return quantile(complement(law, 1 - probability_));
  }
  /// Undefined without a statistic.
  [[nodiscard]] WhitenessVerdict verdict() const {
    const double value = statistic(), limit = statistic_bound();
    if (std::isnan(value) || std::isnan(limit)) return WhitenessVerdict::undefined;
    return value > limit ? WhitenessVerdict::coloured : WhitenessVerdict::white;
  }

 private:
  double probability_;
  Matrix<double, p, p> sum_[lags + 1];  // Σ z_t z_{t-k}ᵀ
  long pairs_[lags + 1] = {};           // its terms
  Vector<double, p> recent_[lags];      // a ring, the newest before next_
  int next_ = 0, held_ = 0;
  long left_out_ = 0;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
