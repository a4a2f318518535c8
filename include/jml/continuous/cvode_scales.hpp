// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What an error of (x, P) is measured by while CVODE moves them (component jml::cvode): by nothing but the
/// estimate itself, so that the answer does not depend on the units of the states.
///
/// An error of P_ij is compared with √(P_ii P_jj), one of x_i with the larger of |x_i| and √P_ii. For where
/// these pass through zero, what flows in within a part of the next step is added: from the noise, and from
/// the other states by |A - P Dᵀ R⁻¹ E| off its diagonal.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <jml/riccati/differential.hpp>
#include <jml/solve/cvode.hpp>

namespace jml::detail {

/// (x, P) as one vector for CVODE; of a symmetric P the lower triangle alone, column by column.
template <int n, bool symmetric>
struct PackedEstimate {
  static constexpr int size = n + (symmetric ? n * (n + 1) / 2 : n * n);
  using State = Vector<double, size>;

  /// Where P_ij is.
  static constexpr int at(int i, int j) {
    if constexpr (symmetric) {
      const int row = i > j ? i : j, column = i > j ? j : i;
      return n + n * column - column * (column - 1) / 2 + row - column;
    } else {
      return n + n * j + i;
    }
  }
  static void pack(const Vector<double, n>& x, const Matrix<double, n, n>& P, double* z) {
    for (int j = 0; j < n; ++j) {
      z[j] = x(j);
      for (int i = symmetric ? j : 0; i < n; ++i) z[at(i, j)] = P(i, j);
    }
  }
  static void unpack(const double* z, Vector<double, n>& x, Matrix<double, n, n>& P) {
    for (int j = 0; j < n; ++j) {
      x(j) = z[j];
      for (int i = 0; i < n; ++i) P(i, j) = z[at(i, j)];
    }
  }

  /// ∂(ẋ, Ṗ)/∂(x, P) of a symmetric P, from that of n + n² free entries: P_ij and P_ji move together.
  template <typename Full>
  static void fold(const Full& all, double* out) {
    const auto rows = [&](int to, int from, int twin) {
      double* column = out + size * to;
      for (int j = 0; j < n; ++j) {
        column[j] = all(j, from) + (twin == from ? 0 : all(j, twin));
        for (int i = j; i < n; ++i) {
          const int row = n + n * j + i;
          column[at(i, j)] = all(row, from) + (twin == from ? 0 : all(row, twin));
        }
      }
    };
    for (int j = 0; j < n; ++j) {
      rows(j, j, j);
      for (int i = j; i < n; ++i) rows(at(i, j), n + n * j + i, n + n * i + j);
    }
  }
};

/// The scales along one interval, and a bound on what the errors of its steps grow to until its end.
template <typename Flow>
class CvodeScales {
 public:
  static constexpr int n = Flow::n;
  static constexpr bool symmetric = Flow::symmetric;
  using Packed = PackedEstimate<n, symmetric>;
  using V = Vector<double, n>;
  using Square = Matrix<double, n, n>;
  /// Squares of smaller deviations are lost in the range of double: such a variance is zero.
  static constexpr double least_deviation = 1e-140, least_state = 1e-280;

  /// `factor` times the tolerances of the options; the interval is `span` long, s.
  CvodeScales(Flow& flow, const CvodeOptions& options, double span, double factor = 1)
      : flow_(flow), options_(options), span_(span), factor_(factor) {}

  /// The scales at z, at `clock` of CVODE and `time` of the flow, s; `step`: the last one taken, 0 at a fresh
  /// start.
  void measure(double clock, double time, double step, const double* z) {
    Packed::unpack(z, x_, P_);
    if (steps_ > 0) {
      carry(reach_state_, clock - clock_);
      carry(reach_deviation_, clock - clock_);
    }
    clock_ = clock;
    step_ = step;
    if (!linearise(time)) {
      coupling_ = kernel::zeros<Square>();
      slope_ = damping_ = noise_ = kernel::zeros<V>();
    }
    if (steps_ == 0) look_ahead(time);
    double ahead = step == 0 ? span_ : clock < start_end_ ? std::max(step, start_length_) : step;
    for (int k = 0; k < 200 && !(contained(deviations(ahead), ahead) && contained(states(ahead), ahead)); ++k)
      ahead /= 8;
    if (step == 0) {
      start_end_ = clock + ahead;
      start_length_ = ahead;
    }
    deviation_ = filled(deviations(ahead / 10), ahead / 10);
    state_ = states(ahead);
    for (int i = 0; i < n; ++i) state_(i) = std::max(state_(i), deviation_(i));
    const V others = filled(state_, ahead / 10);
    for (int i = 0; i < n; ++i) {
      state_(i) = std::max({state_(i), 1e-3 * others(i), least_state});
      deviation_(i) = std::max(deviation_(i), least_deviation);
      const double relative = factor_ * options_.relative_tolerance;
      reach_state_(i) = std::max(reach_state_(i), state_(i) + absolute(i) / relative);
      reach_deviation_(i) =
          std::max(reach_deviation_(i), std::sqrt(deviation_(i) * deviation_(i) + absolute(i, i) / relative));
    }
    ++steps_;
  }

  /// After measure(): the error of each component that CVODE may make in a step.
  void tolerances(double* out) const {
    const double relative = factor_ * options_.relative_tolerance;
    for (int j = 0; j < n; ++j) {
      out[j] = relative * state_(j) + absolute(j);
      for (int i = symmetric ? j : 0; i < n; ++i)
        out[Packed::at(i, j)] = relative * scale(i, j) + absolute(i, j);
    }
  }

  /// What is below the range of double is zero: a state, or a variance with its covariances.
  static void clear_lost(V& x, Square& P) {
    for (int i = 0; i < n; ++i) {
      if (std::abs(x(i)) <= least_state) x(i) = 0;
      if (!symmetric || std::abs(P(i, i)) > least_deviation * least_deviation) continue;
      for (int j = 0; j < n; ++j) P(i, j) = P(j, i) = 0;
    }
  }

  /// The scales at the end of the interval, z there.
  void finish(double clock, double time, const double* z) { measure(clock, time, step_, z); }

  /// After finish(): true if the sum of the tolerances of all steps, each grown as the coefficients say at
  /// most, is a tenth of the error that is allowed.
  [[nodiscard]] bool certified() const {
    double worst = 0;
    for (int i = 0; i < n; ++i) {
      if (reach_state_(i) > least_state) worst = std::max(worst, reach_state_(i) / state_(i));
      const double growth = reach_deviation_(i) / final_deviation(i);
      if (reach_deviation_(i) > least_deviation) worst = std::max(worst, growth * growth);
      if (!std::isfinite(reach_state_(i)) || !std::isfinite(growth)) return false;
    }
    return factor_ * options_.relative_tolerance * static_cast<double>(steps_) * worst <= 0.1 * allowed();
  }

  /// After finish(): true if `other` is the same as z there, to this share of the error that is allowed.
  [[nodiscard]] bool agrees(const double* z, const double* other, double share) const {
    const auto near = [&](int k, double scale, double tolerance) {
      return std::abs(z[k] - other[k]) <= share * (allowed() * scale + 1e5 * tolerance);
    };
    for (int j = 0; j < n; ++j) {
      if (!near(j, state_(j), absolute(j))) return false;
      for (int i = symmetric ? j : 0; i < n; ++i) {
        const double scale_ij = symmetric ? final_deviation(i) * final_deviation(j) : scale(i, j);
        if (!near(Packed::at(i, j), scale_ij, absolute(i, j))) return false;
      }
    }
    return true;
  }

 private:
  /// Relative error of a result that is ok.
  [[nodiscard]] double allowed() const { return std::clamp(1e5 * options_.relative_tolerance, 1e-4, 0.1); }
  [[nodiscard]] double own(int i) const {
    return options_.absolute_tolerances.empty() ? 0
                                                : options_.absolute_tolerances[static_cast<std::size_t>(i)];
  }
  [[nodiscard]] double absolute(int i) const { return factor_ * (options_.absolute_tolerance + own(i)); }
  [[nodiscard]] double absolute(int i, int j) const {
    return factor_ * (options_.absolute_tolerance + own(i) * own(j));
  }
  /// Of P_ij; of a nonsymmetric P the entry itself may be larger than its variances say.
  [[nodiscard]] double scale(int i, int j) const {
    const double product = deviation_(i) * deviation_(j);
    return symmetric ? product : std::max(product, std::abs(P_(i, j)));
  }
  [[nodiscard]] double final_deviation(int i) const {
    return symmetric ? std::max(std::sqrt(std::abs(P_(i, i))), least_deviation) : deviation_(i);
  }

  /// The linear flow at (t, x_, P_): the size of its entries, the damping of each state, noise and ẋ. False
  /// where they are refused or not finite; that the derivative will answer.
  [[nodiscard]] bool linearise(double t) {
    RiccatiCoefficients<double, n, Flow::p> at;
    Vector<double, Flow::p> innovation;
    if (flow_.coefficients(t, x_, at, slope_, innovation) != Status::ok) return false;
    Square left = at.A, right = kernel::transposed(at.B);
    if constexpr (Flow::measured) {
      const Square WE = at.W * at.E;
      left = left - P_ * WE;
      right = right - WE * P_;
      slope_ = slope_ + P_ * (at.W * innovation);
    }
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) coupling_(i, j) = std::max(std::abs(left(i, j)), std::abs(right(j, i)));
      const double rate = std::max(left(i, i), right(i, i));
      coupling_(i, i) = std::max(0.0, rate);
      damping_(i) = std::max(0.0, -rate);
      noise_(i) = std::abs(at.noise(i, i));
    }
    return all_finite(slope_) && all_finite(left) && all_finite(right) && all_finite(noise_);
  }

  /// How much of `ahead` lasts what damping takes away, at `power` times its rate.
  [[nodiscard]] double lasting(int i, double power, double ahead) const {
    return ahead / (1 + power * ahead * damping_(i));
  }
  [[nodiscard]] V deviations(double ahead) const {
    V out;
    for (int i = 0; i < n; ++i) {
      const double variance = std::abs(P_(i, i)) + lasting(i, 2, ahead) * noise_(i);
      out(i) = std::max(std::sqrt(variance), later_deviation_(i));
    }
    return out;
  }
  [[nodiscard]] V states(double ahead) const {
    V out;
    for (int i = 0; i < n; ++i)
      out(i) = std::max(std::abs(x_(i)) + lasting(i, 1, ahead) * std::abs(slope_(i)), later_state_(i));
    return out;
  }
  /// What comes from other states within `ahead`, where they have the size s.
  [[nodiscard]] V inflow(const V& s, double ahead) const {
    V out = s;
    for (int i = 0; i < n; ++i) out(i) /= std::sqrt(1 + ahead * damping_(i));
    out = coupling_ * out;
    for (int i = 0; i < n; ++i) out(i) *= lasting(i, 1, ahead);
    return out;
  }
  /// `from` and all that comes by ways of up to n states.
  [[nodiscard]] V filled(const V& from, double ahead) const {
    V out = from;
    for (int k = 0; k < n; ++k) out = from + inflow(out, ahead);
    return out;
  }
  /// `ahead` is short enough for filled() to be no growing series.
  [[nodiscard]] bool contained(const V& from, double ahead) const {
    const V out = filled(from, ahead), more = inflow(out, ahead);
    for (int i = 0; i < n; ++i) {
      if (!(more(i) <= 1.1 * out(i)) || !std::isfinite(out(i))) return false;
    }
    return true;
  }
  /// e^{coupling h} reach; infinite where that takes more than 30 terms.
  void carry(V& reach, double h) const {
    V term = reach;
    for (int k = 1; k <= 30; ++k) {
      term = coupling_ * term * (h / k);
      reach = reach + term;
      bool small = true;
      for (int i = 0; i < n; ++i) small = small && term(i) <= 1e-3 * reach(i);
      if (small) return;
    }
    reach = kernel::filled<V>(std::numeric_limits<double>::infinity());
  }
  /// What is zero and does not move now may move later: a look at the end of the interval, where the rest,
  /// and what was found, have moved by a thousandth of it.
  void look_ahead(double time) {
    const auto still = [&](int i) { return x_(i) == 0 && slope_(i) == 0 && later_state_(i) == 0; };
    const auto certain = [&](int i) { return P_(i, i) == 0 && noise_(i) == 0 && later_deviation_(i) == 0; };
    for (int before = 2 * n + 1; before > 0;) {
      V there = x_, slope_x;
      Square P = P_, slope_P;
      int count = 0;
      for (int i = 0; i < n; ++i) {
        count += int(still(i)) + int(certain(i));
        there(i) += 1e-3 * (lasting(i, 1, span_) * slope_(i) + later_state_(i));
        P(i, i) += 1e-3 * later_deviation_(i) * later_deviation_(i);
      }
      if (count == before) return;
      before = count;
      if (count == 0 || flow_.derivative(time + span_, there, P, slope_x, slope_P) != Status::ok) return;
      if (!all_finite(slope_x) || !all_finite(slope_P)) return;
      for (int i = 0; i < n; ++i) {
        if (still(i)) later_state_(i) = lasting(i, 1, span_) * std::abs(slope_x(i));
        if (certain(i)) later_deviation_(i) = std::sqrt(lasting(i, 2, span_) * std::abs(slope_P(i, i)));
      }
    }
  }

  Flow& flow_;
  const CvodeOptions& options_;
  double span_, factor_, clock_ = 0, step_ = 0, start_end_ = 0, start_length_ = 0;
  long steps_ = 0;
  V x_, slope_, damping_, noise_, state_, deviation_;
  Square P_, coupling_;
  V later_state_ = kernel::zeros<V>(), later_deviation_ = later_state_;
  V reach_state_ = later_state_, reach_deviation_ = later_state_;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
