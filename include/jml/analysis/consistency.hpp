// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Does an estimator know how good it is? NEES, NIS, and confidence intervals of what a campaign counts.
/// Component jml::campaign (Boost.Math); nothing here throws or allocates.
///
/// A filter that is right has errors e ~ N(0, P), innovations ν ~ N(0, S), and innovations that are
/// independent from sample to sample (Bar-Shalom, Li, Kirubarajan 2001, section 5.4). Hence three tests:
///  - NEES eᵀ P⁻¹ e is χ² with n degrees (the states). It needs the truth. Along one run it is correlated:
///    average over independent runs at one time. For an average over time too, make one number of each run
///    and give those to mean_interval().
///  - NIS νᵀ S⁻¹ ν is χ² with p degrees (the measurements), independent in time: average over one run, or
///  all.
///  - L⁻¹ν with S = L Lᵀ is white (analysis/whiteness.hpp).
/// NEES and NIS see one number each, tr(P⁻¹ P_true) and tr(S⁻¹ S_true): too much here and too little there
/// may cancel, as Q too small and R too large do in S. Whiteness sees a gain that is not the best one,
/// whatever S says. With Q, R and P_0 wrong by one factor the gain is the best: only NEES and NIS see that. A
/// wrong P_0 is seen only while it is remembered, and what no measurement sees only by NEES.
///
/// One in twenty right filters fails at 95 %: where many averages are looked at, ask for more.
#include <jml/warnings_begin.hpp>
#pragma once

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <jml/analysis/nees.hpp>
#include <jml/filter/report.hpp>

namespace jml {

/// [low, high]; NaN where what was asked for is not defined.
struct ConfidenceInterval {
  double low = std::numeric_limits<double>::quiet_NaN();   ///< NaN where not defined
  double high = std::numeric_limits<double>::quiet_NaN();  ///< likewise

  [[nodiscard]] constexpr bool defined() const { return low <= high; }  ///< it is an interval: no NaN
  /// Both ends included.
  [[nodiscard]] constexpr bool contains(double value) const { return low <= value && value <= high; }
};

namespace detail {

namespace policies = boost::math::policies;
/// NaN or infinity for an answer where Boost would throw.
using Quiet = policies::policy<
    policies::domain_error<policies::ignore_error>, policies::pole_error<policies::ignore_error>,
    policies::overflow_error<policies::ignore_error>, policies::rounding_error<policies::ignore_error>,
    policies::evaluation_error<policies::ignore_error>, policies::promote_double<false>>;

constexpr bool is_probability(double probability) { return probability > 0 && probability < 1; }

/// χ² / count between equal tails. Not above 1e11 degrees, where Boost 1.74 is wrong in the first digits.
inline ConfidenceInterval chi_square_interval(double degrees, double count, double probability) {
  if (!(degrees > 0 && degrees <= 1e11) || !is_probability(probability)) return {};
  const boost::math::chi_squared_distribution<double, Quiet> law(degrees);
  const double tail = (1 - probability) / 2;
  return {quantile(law, tail) / count, quantile(complement(law, tail)) / count};
}

}  // namespace detail

/// Where the average of `samples` independent χ² values of `degrees` each lies with this probability, with
/// equal tails: the quantiles of χ² with degrees · samples degrees, over samples.
[[nodiscard]] inline ConfidenceInterval chi_square_average_interval(int degrees, long samples,
                                                                    double probability = 0.95) {
  if (degrees < 1 || samples < 1) return {};
  const auto count = static_cast<double>(samples);
  return detail::chi_square_interval(degrees * count, count, probability);
}

/// Of the true mean, from the mean of independent values and its standard error (sample deviation /
/// √samples): Student's t with samples - 1 degrees. Exact for normal values, good for others where there are
/// many.
[[nodiscard]] inline ConfidenceInterval mean_interval(double mean, double standard_error, long samples,
                                                      double probability = 0.95) {
  if (samples < 2 || !(standard_error >= 0) || !std::isfinite(standard_error) || !std::isfinite(mean) ||
      !detail::is_probability(probability))
    return {};
  const boost::math::students_t_distribution<double, detail::Quiet> law(static_cast<double>(samples - 1));
  const double reach = quantile(complement(law, (1 - probability) / 2)) * standard_error;
  return {mean - reach, mean + reach};
}

/// Of the true mean square error, from that of `samples` independent normal errors of equal variance and mean
/// zero: χ² with `samples` degrees. (The roots of its ends are the interval of the RMSE.)
///
/// Right for one component at one time of many runs. Longer than need be where the errors have a mean, and
/// for |e|² of a vector. Too short where the variance changes from sample to sample, for heavy tails, and for
/// correlated samples such as one run: give the squares (or the mean square of each run) to mean_interval(),
/// which asks nothing of their law but wants many: of 50 squares of normal errors it holds in 92 %, not 95.
[[nodiscard]] inline ConfidenceInterval mean_square_interval(double mean_square, long samples,
                                                             double probability = 0.95) {
  if (samples < 1 || !(mean_square >= 0) || !std::isfinite(mean_square)) return {};
  const auto count = static_cast<double>(samples);
  const ConfidenceInterval ratio = detail::chi_square_interval(count, count, probability);
  return {mean_square / ratio.high, mean_square / ratio.low};
}

/// Of the true probability of success, from independent trials (Clopper and Pearson 1934): holds with at
/// least this probability whatever the truth is, with 0 of `trials` too. Wilson's is shorter, but promises
/// less for rare events, which is what campaigns count.
[[nodiscard]] inline ConfidenceInterval proportion_interval(long successes, long trials,
                                                            double probability = 0.95) {
  if (trials < 1 || successes < 0 || successes > trials || !detail::is_probability(probability)) return {};
  using Law = boost::math::binomial_distribution<double, detail::Quiet>;
  const auto n = static_cast<double>(trials), k = static_cast<double>(successes);
  const double tail = (1 - probability) / 2;
  return {Law::find_lower_bound_on_p(n, k, tail), Law::find_upper_bound_on_p(n, k, tail)};
}

/// What an average of NEES or NIS says of the covariance.
enum class CovarianceVerdict : std::uint8_t {
  undefined,    ///< no sample, or no probability in (0, 1)
  consistent,   ///< the average is inside
  optimistic,   ///< above: the covariance is too small for the errors
  pessimistic,  ///< below: the covariance is too large
};

/// The test of an average of NEES or NIS, one value at a time.
///
///     jml::Consistency nis;
///     nis.add(filter.step(sensor, y));                          // p degrees, of the sensor
///     jml::Consistency nees;                                    // at one time of the flight, over runs
///     nees.add(jml::nees(truth - filter.x(), filter.P()), 4);   // n degrees
///
/// The values must be independent: NIS along one run, NEES over runs at one time (see above). Sensors of
/// different size may be mixed: the degrees add up. At 95 % a covariance wrong by the factor 1 + a is seen
/// in half of the cases with 8/a² degrees of freedom in all, in 97 of 100 with 31/a² (small a).
class Consistency {
 public:
  /// `probability`: of interval(), in (0, 1).
  explicit Consistency(double probability = 0.95) : probability_(probability) {}

  /// One NEES or NIS value. NaN, negative, or of less than 1 degree: left out and counted. A verdict with
  /// samples left out is about the others only.
  void add(double value, int degrees) {
    if (!(value >= 0) || degrees < 1) {
      ++left_out_;
      return;
    }
    sum_ += value;
    degrees_ += degrees;
    ++samples_;
  }
  /// NIS of a step; left out where the step was refused. What a gate rejected is counted: without its large
  /// values NIS is not χ².
  template <typename Scalar, int n, int p>
  void add(const StepReport<Scalar, n, p>& report) {
    add(usable(report.status) ? static_cast<double>(report.nis()) : std::numeric_limits<double>::quiet_NaN(),
        p);
  }

  [[nodiscard]] long samples() const { return samples_; }    ///< values added
  [[nodiscard]] long left_out() const { return left_out_; }  ///< values that were no sample
  /// Mean of the samples.
  [[nodiscard]] double average() const { return sum_ / static_cast<double>(samples_); }
  /// Mean degrees: what average() is near.
  [[nodiscard]] double expected() const { return degrees_ / static_cast<double>(samples_); }
  /// Where average() lies with the probability asked for, if the covariance is right.
  [[nodiscard]] ConfidenceInterval interval() const {
    return detail::chi_square_interval(degrees_, static_cast<double>(samples_), probability_);
  }
  /// What average() says of the covariance; undefined without samples.
  [[nodiscard]] CovarianceVerdict verdict() const {
    const ConfidenceInterval range = interval();
    if (!range.defined()) return CovarianceVerdict::undefined;
    if (average() > range.high) return CovarianceVerdict::optimistic;
    return average() < range.low ? CovarianceVerdict::pessimistic : CovarianceVerdict::consistent;
  }

 private:
  double probability_, sum_ = 0, degrees_ = 0;
  long samples_ = 0, left_out_ = 0;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
