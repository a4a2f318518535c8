// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The smoother over states in a space: each instant in the chart at its prediction
/// (model/local_context.hpp).
///
/// The filter's estimate stays where it is in that chart, so that the records of the way back, transitions
/// from chart to chart, are those of ℝⁿ; only what is shown is moved into the tangent at the state.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/local_method.hpp>
#include <jml/interval/smoother_memory.hpp>

namespace jml::detail {

template <typename Inner, typename D>
struct LocalSmoother : Inner {
  using Local = LocalDynamics<D>;
  using Space = SpaceOf<D>;

  template <typename Scalar, typename>
  class BeliefType : public SmootherMemory<Scalar, Local, typename Inner::Method> {
   public:
    using Inside = SmootherMemory<Scalar, Local, typename Inner::Method>;
    using Point = Vector<Scalar, states_of<D>>;
    using Covariance = Matrix<Scalar, Local::states, Local::states>;
    /// What a filter on D carries.
    using Given = LocalBelief<Scalar, D, typename Inside::Filtered>;

    explicit BeliefType(const D& of) : Inside(Local{of}) {}

    std::vector<Point> charts;

    [[nodiscard]] Inside& inside() { return *this; }
    [[nodiscard]] const Inside& inside() const { return *this; }
    [[nodiscard]] const D& dynamics() const { return inside().dynamics().model; }
    [[nodiscard]] const Point& chart(int k) const { return charts[static_cast<std::size_t>(k)]; }
    [[nodiscard]] Point x() const { return Space::plus(chart(this->last), inside().x()); }
    [[nodiscard]] Covariance P() const { return in_tangent(this->last, inside().x(), inside().P()); }
    // As smoothed.
    [[nodiscard]] Point x(int k) const { return Space::plus(chart(k), this->node(k).smoothed.x); }
    [[nodiscard]] Covariance P(int k) const {
      return in_tangent(k, this->node(k).smoothed.x, this->node(k).smoothed.P);
    }

   private:
    [[nodiscard]] Covariance in_tangent(int k, const Vector<Scalar, Local::states>& z,
                                        const Covariance& P) const {
      const Covariance J = Space::chart_slope(chart(k), z);
      return kernel::symmetric_part(Covariance(J * P * kernel::transposed(J)));
    }
  };
  template <typename Scalar, typename Of>
  using Belief = BeliefType<Scalar, Of>;
  template <typename Scalar, typename, typename S>
  using Report = typename ReportOf<typename Inner::Method, Scalar, Local, S>::type;

  LocalSmoother(const Inner& of) : Inner(of) {}  // NOLINT(google-explicit-constructor): the same thing

  /// Where a filter stands.
  template <typename Belief, typename Given>
  [[nodiscard]] Status start(Belief& memory, const Given& given, double time) const {
    using Filtered = typename Belief::Inside::Filtered;
    Status status = Status::invalid_state;
    if constexpr (requires { given.belief.local; }) {
      status =
          inner().start(memory.inside(), SmootherStart<Filtered>{given.belief.local, given.status}, time);
      memory.charts.assign(memory.nodes.size(), given.belief.x);
    } else {
      const auto zero = kernel::zeros<Vector<typename Belief::Inside::Scalar, Local::states>>();
      status = inner().start(memory.inside(),
                             Estimate<typename Belief::Inside::Scalar, Local::states>(zero, given.P), time);
      memory.charts.assign(memory.nodes.size(), given.x);
      if (!all_finite(given.x) || !Space::contains(given.x)) status = Status::invalid_state;
    }
    return status;
  }
  template <typename Belief, typename At>
  [[nodiscard]] Status predict(Belief& memory, const At& at) const {
    auto there = step_from(memory, at);
    if (const Status status = check_step<Space>(there); status != Status::ok) return status;
    const Status status = inner().predict(memory.inside(), there);
    if (usable(status)) memory.charts[static_cast<std::size_t>(memory.last)] = there.to;
    return status;
  }
  template <typename Belief, typename Sample, typename Report>
  void correct(Belief& memory, const Sample& sample, Report& report) const {
    using Scalar = typename Belief::Inside::Scalar;
    LocalContext<Scalar, D> here(sample.at);
    here.from = here.to = memory.chart(memory.last);
    inner().correct(memory.inside(),
                    jml::Sample{local_sensor<D, Scalar>(sample.sensor), sample.y, here, sample.gate}, report);
  }
  template <typename Belief, typename Sample, typename Report>
  void step(Belief& memory, const Sample& sample, Report& report) const {
    using Scalar = typename Belief::Inside::Scalar;
    auto there = step_from(memory, sample.at);
    report.status = check_step<Space>(there);
    if (report.status != Status::ok) return;
    inner().step(memory.inside(),
                 jml::Sample{local_sensor<D, Scalar>(sample.sensor), sample.y, there, sample.gate}, report);
    if (usable(report.status)) memory.charts[static_cast<std::size_t>(memory.last)] = there.to;
  }

 private:
  [[nodiscard]] const Inner& inner() const { return *this; }
  template <typename Belief, typename At>
  [[nodiscard]] static auto step_from(const Belief& memory, const At& at) {
    auto there = local_step<typename Belief::Inside::Scalar>(memory.dynamics(), memory.x(), at);
    there.from = memory.chart(memory.last);
    return there;
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
