// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// CVODE as the integrator of a continuous filter (component jml::cvode): adaptive, for stiff Riccati phases
/// and long gaps, and the reference for the fixed-time ones. Not for the control loop.
///
///     jml::Filter filter{jml::Continuous{jml::Rnls{}, jml::Cvode{{.relative_tolerance = 1e-10}}}, dynamics,
///                        estimate};
///
/// A held measurement jumps at each sample, and CVODE starts afresh there. A jml::Line, a function of time or
/// a held value that did not change only continues what was: order and step are kept.
///
/// `ok` is the answer where (x, P) is right to 1e-4 in each component and in any units: x_i relative to the
/// larger of |x_i| and √P_ii, P_ij to √(P_ii P_jj); or to 1e5 times the tolerances, if that is more. Where
/// the errors that the steps may make, each grown by the coefficients, might sum up to a tenth of it, the
/// interval is integrated a second time with ten times the tolerances, and if the two differ with a hundredth
/// of them; where that differs too, it is accuracy_not_met. The first interval always goes this way.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/continuous.hpp>
#include <jml/continuous/cvode_scales.hpp>
#include <jml/riccati/differential_jacobian.hpp>

namespace jml {

/// Options of the integrator; see CvodeOptions. The relative tolerance, of a step, is that of x_i and of P_ij
/// with the scales above. The absolute tolerances are 0 unless given, and then are a floor for what counts:
/// absolute_tolerance of x_i and P_ij alike, absolute_tolerances one for each state, in its unit, and for
/// P_ij the product of two. Any other number of them is invalid_option. BDF gets the Jacobian of
/// riccati/differential_jacobian.hpp. Over states in a space each chart is an interval of its own: CVODE
/// starts afresh there, max_steps are those of one, and BDF gets its Jacobian by differences.
struct Cvode : CvodeOptions {
  static constexpr bool adaptive = true;  ///< over states in a space it goes on from chart to chart
  template <typename Scalar, int n>
  class Engine;
};

/// What Cvode keeps for one filter of n states: two solvers of n + n² equations, or n + n (n + 1)/2 of a
/// symmetric rule. Copies start afresh.
template <typename Scalar, int n>
class Cvode::Engine {
  static_assert(std::is_same_v<Scalar, double>, "jml: CVODE integrates in double");

 public:
  static constexpr int size = n + n * n;  ///< equations at most

  /// The options are copied.
  Engine(const Cvode& options)  // NOLINT(google-explicit-constructor): the same thing
      : options_(options), symmetric_(options), full_(options) {}

  /// Moves x and P over dt, s, from `time`. On refusal both are untouched.
  template <typename Flow>
  Status move(Flow& flow, double time, double dt, Vector<double, n>& x, Matrix<double, n, n>& P,
              typename Flow::Report& report) {
    const std::size_t given = options_.absolute_tolerances.size();
    if (given != 0 && given != std::size_t(n)) return Status::invalid_option;
    {  // gain and innovation of the start, for the report
      typename Flow::X slope_x;
      typename Flow::Square slope_P;
      const Status status = flow.derivative(time, x, P, slope_x, slope_P, &report);
      if (status != Status::ok) return status;
    }
    try {
      last_.reserve(static_cast<std::size_t>(flow.measured_at(time).size() + flow.at(time).control.size()));
      if (Flow::symmetric && options_.method == CvodeMethod::bdf) jacobian_.resize(std::size_t(size) * size);
    } catch (...) {
      return Status::integrator_failed;
    }
    Packed<Flow> z;
    PackedEstimate<Flow>::pack(x, P, z.data());
    const Status status = integrate(flow, time, dt, z, solvers<Flow>(), report);
    if (status == Status::ok) {
      PackedEstimate<Flow>::unpack(z.data(), x, P);
      detail::CvodeScales<Flow>::clear_lost(x, P);
      remember(flow, time + dt);
    } else {
      kind_ = nullptr;
    }
    return status;
  }

  /// The next interval starts afresh.
  void restart() { kind_ = nullptr; }

 private:
  template <typename Flow>
  using PackedEstimate = detail::PackedEstimate<n, Flow::symmetric>;
  template <typename Flow>
  using Packed = typename PackedEstimate<Flow>::State;

  /// One of the two forms of P; no memory but the options' before its first interval.
  template <bool symmetric>
  struct Solvers {
    explicit Solvers(const CvodeOptions& o) : first(o), second(o) {}
    CvodeSolver<detail::PackedEstimate<n, symmetric>::size> first, second;
    typename detail::PackedEstimate<n, symmetric>::State second_end;
    bool compared = false;  // second_end belongs to the end of the last interval
    double clock = 0;       // s since `first` was started afresh: finer than the time of day
  };
  template <typename Flow>
  auto& solvers() {
    if constexpr (Flow::symmetric)
      return symmetric_;
    else
      return full_;
  }

  /// z over dt, checked as said above.
  template <typename Flow, typename Both>
  Status integrate(Flow& flow, double time, double dt, Packed<Flow>& z, Both& by,
                   typename Flow::Report& report) {
    if (!(dt > 1e-100)) return dt >= 0 ? Status::ok : Status::invalid_time_step;
    const bool first = kind_ == nullptr, goes_on = !Flow::in_chart && follows(flow, time),
               compared = goes_on && by.compared;
    const Packed<Flow> start = z;
    by.compared = false;
    if (!goes_on) by.clock = 0;
    report.steps = report.evaluations = 0;
    const auto run = [&](auto& solver, auto& scales, Packed<Flow>& state, double clock, bool continuous) {
      const Equations<Flow> equations{flow, scales, jacobian_, time - clock, time + dt, 1e-6 * dt};
      const CvodeReport result = solver.integrate(equations, clock, clock + dt, state, continuous);
      report.steps += result.steps;
      report.evaluations += result.evaluations;
      return result.status;
    };
    detail::CvodeScales<Flow> scales(flow, options_, dt);
    Status status = run(by.first, scales, z, by.clock, goes_on);
    if (status != Status::ok) return status;
    const double clock = by.clock;
    by.clock += dt;
    scales.finish(by.clock, time + dt, z.data());
    if (!first && scales.certified()) return status;
    for (const double factor : {10.0, 1e-2, 1e-4}) {
      const bool looser = factor > 1;
      if (!looser && factor * options_.relative_tolerance < 1e-14) break;
      Packed<Flow> other = looser && compared ? by.second_end : start;
      detail::CvodeScales<Flow> others(flow, options_, dt, factor);
      status = run(by.second, others, other, clock, looser && compared);
      if (status != Status::ok) return status;
      const bool agree = scales.agrees(z.data(), other.data(), looser ? 0.1 : 0.3);
      by.compared = looser && agree;
      by.second_end = other;
      if (!looser) z = other;
      if (agree) return status;
      scales.finish(by.clock, time + dt, z.data());
    }
    return Status::accuracy_not_met;
  }

  template <typename Flow>
  struct Equations {
    Flow& flow;
    detail::CvodeScales<Flow>& scales;
    std::vector<double>& all;  // the Jacobian of n + n² equations
    double origin, end;        // the flow's time at CVODE's zero, and its last
    double ahead;              // a pole of P nearer than this is an escape

    double at(double clock) const { return std::min(origin + clock, end); }
    Status derivative(double clock, const double* z, double* out) const {
      typename Flow::X x, slope_x;
      typename Flow::Square P, slope_P;
      PackedEstimate<Flow>::unpack(z, x, P);
      const Status status = flow.derivative(at(clock), x, P, slope_x, slope_P);
      if (status != Status::ok) return status;
      if (!all_finite(slope_x) || !all_finite(slope_P)) return Status::dynamics_not_finite;
      if (flow.pole_within(ahead)) return Status::riccati_escape;
      PackedEstimate<Flow>::pack(slope_x, slope_P, out);
      return Status::ok;
    }
    bool jacobian(double clock, const double* z, double* out) const {
      typename Flow::X x;
      typename Flow::Square P;
      PackedEstimate<Flow>::unpack(z, x, P);
      Eigen::Map<Eigen::Matrix<double, size, size>> J(Flow::symmetric ? all.data() : out);
      if (!flow_jacobian(flow, at(clock), x, P, J)) return false;
      if constexpr (Flow::symmetric) PackedEstimate<Flow>::fold(J, out);
      return true;
    }
    void tolerances(double clock, double step, const double* z, double* out) const {
      scales.measure(clock, at(clock), step, z);
      scales.tolerances(out);
    }
  };

  /// An address that tells one type of flow from another.
  template <typename Flow>
  static const void* kind() {
    static const char tag = 0;
    return &tag;
  }

  template <typename Flow>
  void remember(const Flow& flow, double time) {
    const auto y = flow.measured_at(time);
    const auto u = flow.at(time).control;
    last_.assign(y.data(), y.data() + y.size());
    last_.insert(last_.end(), u.data(), u.data() + u.size());
    kind_ = kind<Flow>();
  }

  /// True where measurement and control begin as they ended, to rounding.
  template <typename Flow>
  [[nodiscard]] bool follows(const Flow& flow, double time) const {
    const auto y = flow.measured_at(time);
    const auto u = flow.at(time).control;
    const auto same = [](double a, double b) {
      return std::abs(a - b) <= 1e-13 * (std::abs(a) + std::abs(b));
    };
    return kind_ == kind<Flow>() && last_.size() == static_cast<std::size_t>(y.size() + u.size()) &&
           std::equal(y.data(), y.data() + y.size(), last_.begin(), same) &&
           std::equal(u.data(), u.data() + u.size(), last_.begin() + y.size(), same);
  }

  CvodeOptions options_;
  Solvers<true> symmetric_;
  Solvers<false> full_;
  std::vector<double> last_;      // y and control at the end of the last interval
  std::vector<double> jacobian_;  // of all n + n² equations, before P_ij and P_ji are made one
  const void* kind_ = nullptr;    // of the last flow; none at first and after a refusal
};

/// Moves (x, P) over dt from `time`; the interface of every integrator.
template <typename Engine, typename Flow>
  requires requires { Engine::size; }
[[nodiscard]] Status advance(Engine& engine, Flow& flow, double time, double dt, typename Flow::X& x,
                             typename Flow::Square& P, typename Flow::Report& report) {
  return engine.move(flow, time, dt, x, P, report);
}

}  // namespace jml
#include <jml/warnings_end.hpp>
