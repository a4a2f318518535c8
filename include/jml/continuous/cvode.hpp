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
#pragma once

#include <algorithm>
#include <jml/continuous/continuous.hpp>
#include <jml/riccati/differential_jacobian.hpp>
#include <jml/solve/cvode.hpp>
#include <vector>

namespace jml {

/// Options of the integrator; see CvodeOptions. BDF gets the Jacobian of riccati/differential_jacobian.hpp.
struct Cvode : CvodeOptions {
  template <typename Scalar, int n>
  class Engine;
};

/// What Cvode keeps for one filter of n states: a solver of n + n² equations. Copies start afresh.
template <typename Scalar, int n>
class Cvode::Engine {
  static_assert(std::is_same_v<Scalar, double>, "jml: CVODE integrates in double");

 public:
  static constexpr int size = n + n * n;

  Engine(const Cvode& options) : solver_(options) {}  // NOLINT(google-explicit-constructor): the same thing

  template <typename Flow>
  Status move(Flow& flow, double time, double dt, Vector<double, n>& x, Matrix<double, n, n>& P,
              typename Flow::Report& report) {
    const double end = time + dt;
    {  // gain and innovation of the start, for the report
      typename Flow::X slope_x;
      typename Flow::Square slope_P;
      const Status status = flow.derivative(time, x, P, slope_x, slope_P, &report);
      if (status != Status::ok) return status;
    }
    Vector<double, size> z;
    z.template head<n>() = x;
    Eigen::Map<Matrix<double, n, n>>(z.data() + n) = P;
    const CvodeReport result =
        solver_.integrate(Equations<Flow>{flow, 1e-6 * dt}, time, end, z, follows(flow, time));
    report.steps = result.steps;
    report.evaluations = result.evaluations;
    if (result.status == Status::ok) {
      x = z.template head<n>();
      P = Eigen::Map<const Matrix<double, n, n>>(z.data() + n);
      if constexpr (Flow::symmetric) P = kernel::symmetric_part(P);
      remember(flow, end);
    } else {
      last_.clear();
    }
    return result.status;
  }

 private:
  template <typename Flow>
  struct Equations {
    Flow& flow;
    double ahead;  // a pole of P nearer than this is an escape

    Status derivative(double t, const double* z, double* out) const {
      typename Flow::X slope_x;
      typename Flow::Square slope_P;
      const typename Flow::X x = Eigen::Map<const typename Flow::X>(z);
      const typename Flow::Square P = Eigen::Map<const typename Flow::Square>(z + n);
      const Status status = flow.derivative(t, x, P, slope_x, slope_P);
      if (status != Status::ok) return status;
      if (!all_finite(slope_x) || !all_finite(slope_P)) return Status::dynamics_not_finite;
      if (flow.pole_within(ahead)) return Status::riccati_escape;
      Eigen::Map<typename Flow::X>{out} = slope_x;
      Eigen::Map<typename Flow::Square>{out + n} = slope_P;
      return Status::ok;
    }

    bool jacobian(double t, const double* z, double* out) const {
      const typename Flow::X x = Eigen::Map<const typename Flow::X>(z);
      const typename Flow::Square P = Eigen::Map<const typename Flow::Square>(z + n);
      Eigen::Map<Eigen::Matrix<double, size, size>> J(out);
      return flow_jacobian(flow, t, x, P, J);
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

  CvodeSolver<size> solver_;
  std::vector<double> last_;  // y and control at the end of the last interval
  const void* kind_ = nullptr;
};

/// Moves (x, P) over dt from `time`; the interface of every integrator.
template <typename Engine, typename Flow>
  requires requires { Engine::size; }
[[nodiscard]] Status advance(Engine& engine, Flow& flow, double time, double dt, typename Flow::X& x,
                             typename Flow::Square& P, typename Flow::Report& report) {
  return engine.move(flow, time, dt, x, P, report);
}

}  // namespace jml
