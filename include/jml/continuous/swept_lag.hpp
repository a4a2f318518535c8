// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The swept filter of continuous/swept.hpp at each step over the last `lag` intervals: bounded time and
/// memory.
///
/// What is older is kept as x̂ and P of (19) where the window begins, x = x̂ + P λ, P nonsymmetric as it is.
/// With a lag that the gain has forgotten the newest estimate is the exact one of (8); with lag 1 and one
/// sweep it is the filter (17)-(19), its coefficients along a prediction.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/continuous/swept.hpp>

namespace jml {

/// The window of a SweptLag. invalid_option: a sweep count below 1.
struct SweptLagOptions {
  int lag = 20;    ///< intervals of the window
  int sweeps = 2;  ///< at each step
};

/// What a step of a SweptLag reports.
template <typename Scalar>
struct SweptLagReport {
  /// ok, or why the step is refused: riccati_escape, dynamics_not_finite, … The filter is then as it was.
  Status status = Status::ok;
  /// The largest change of a state in the last sweep, relative to its largest value in the window.
  Scalar step = std::numeric_limits<Scalar>::quiet_NaN();
};

///     jml::SweptLag filter{jml::Rnls{}, Oscillator{}, sensor, jml::Estimate{x0, P0}, {.lag = 20, .sweeps =
///     2}}; const auto report = filter.step(jml::Line{y, y_next}, dt);  // filter.x(), filter.P(),
///     filter.x(steps ago)
///
/// Rule: Rnls or Ekf. What is refused of a model is as of TwoPoint. The heap is used by the constructor only.
template <typename Rule, typename D, typename S, typename Scalar_ = double>
class SweptLag {
  using Smoother = TwoPoint<D, S, Scalar_>;
  static_assert(same_slot<Rule::B, Slot::jacobian> && same_slot<Rule::D, Slot::jacobian>,
                "jml: only with Jacobians in the slots B and D do the sweeps end at a solution of (12): take "
                "Rnls or Ekf");

 public:
  /// As of TwoPoint.
  /// @{
  using Scalar = Scalar_;
  using State = typename Smoother::State;
  using Covariance = typename Smoother::Covariance;
  using Control = typename Smoother::Control;
  /// @}

  /// As of TwoPoint. A bad argument does not throw: status() names it, and every verb answers it.
  SweptLag(Rule rule, D dynamics, S sensor, const Estimate<Scalar, Smoother::states>& prior,
           SweptLagOptions options = {}, double time = 0)
      : rule_(std::move(rule)),
        options_(options),
        window_(dynamics, sensor, prior, room(options), time),
        kept_(std::move(dynamics), std::move(sensor), prior, room(options), time) {
    if (window_.status() != Status::ok) return;
    auto& first = window_.recording().node(0);
    first.P = window_.recording().start().P();
    first.filtered = window_.recording().start().x;
  }

  /// y over the next dt, s, as of TwoPoint.
  template <typename Y>
  SweptLagReport<Scalar> step(
      const Y& y, Scalar dt, const Argument<Scalar, Smoother::controls>& control = kernel::zeros<Control>()) {
    return advance([&] { return window_.step(y, dt, control); });
  }
  /// Nothing is measured over the next dt.
  SweptLagReport<Scalar> predict(
      Scalar dt, const Argument<Scalar, Smoother::controls>& control = kernel::zeros<Control>()) {
    return advance([&] { return window_.predict(dt, control); });
  }

  /// Ok, or what is wrong with the arguments of the constructor.
  [[nodiscard]] Status status() const {
    return options_.sweeps > 0 ? window_.status() : Status::invalid_option;
  }
  [[nodiscard]] int steps() const { return window_.steps(); }   ///< intervals in the window
  [[nodiscard]] double time() const { return window_.time(); }  ///< s, of x()
  [[nodiscard]] const State& x() const { return window_.x(); }  ///< of the present
  /// Smoothed, so many steps ago: 0 … steps().
  [[nodiscard]] const State& x(int ago) const { return window_.x(steps() - ago); }
  /// P of (19) at x(): of a nonsymmetric rule not symmetric, no covariance.
  [[nodiscard]] const Covariance& P() const { return window_.recording().node(steps()).P; }

 private:
  static Capacity room(const SweptLagOptions& options) {
    return {.steps = options.lag > 0 && options.lag < detail::most_nodes ? options.lag + 1 : -1};
  }
  template <typename Append>
  SweptLagReport<Scalar> advance(const Append& append) {
    SweptLagReport<Scalar> out;
    out.status = status();
    if (out.status != Status::ok) return out;
    auto& record = window_.recording();
    kept_.recording().copy_nodes(record);
    out.status = append();
    if (out.status != Status::ok) return out;
    if (window_.steps() > options_.lag) record.slide();
    const auto now = std::size_t(record.now());
    auto& node = record.node(record.last());
    const State& x = record.node(record.last() - 1).x[now];
    node.stages[now] = {x, x, x};
    State end;  // without disturbance, where that is a number
    const auto still = kernel::zeros<Vector<Scalar, Smoother::Record::m>>();
    if (record.step().solve(x, still, node.at, node.stages[now], end)) {
      node.x[now] = end;
    } else {
      node.stages[now] = {x, x, x};
    }
    detail::RiccatiSweep<Rule, typename Smoother::Record> one(record, rule_);
    SweptReport<Scalar, Smoother::states> report;
    for (int i = 0; i < options_.sweeps && report.status == Status::ok; ++i)
      report.status = one.sweep(report);
    out.status = report.status;
    out.step = report.step;
    if (out.status != Status::ok) record.copy_nodes(kept_.recording());
    return out;
  }

  [[no_unique_address]] Rule rule_;
  SweptLagOptions options_;
  Smoother window_, kept_;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
