// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The fixed-interval smoother behind Kalman, Ekf and Sddre and their factored forms: what all measurements
/// say of every past instant.
///
/// Two passes (Fraser and Potter 1969): with P and x̂ of the filter, and with the information Λ and slope λ of
/// all later measurements as a function of x at that instant, the smoothed pair is
///   P_s = (P⁻¹ + Λ)⁻¹ = L (I + LᵀΛL)⁻¹ Lᵀ,   x_s = x̂ - P_s λ,   P = L Lᵀ of any rank.
/// Nothing is subtracted, so that no digit of P_s is lost where the later measurements are much better than
/// P. The backward pass is that of Batch and FixedLag (interval/costate.hpp), about the points and with the
/// matrices that the forward pass used: the model is not asked again. Where the digits of Scalar do not
/// suffice, and for the factored forms always, it is made in twice as many and in factors, the later data
/// taken as measurements (interval/information_in_two.hpp). One record per instant, of a size that does not
/// depend on the sensors.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored.hpp>
#include <jml/filter/filter.hpp>
#include <jml/interval/fineness.hpp>
#include <jml/interval/local_smoother.hpp>
#include <jml/interval/room.hpp>
#include <jml/interval/smoother_memory.hpp>

namespace jml {

namespace detail {

template <typename M>
inline constexpr bool is_smoothable = false;
template <OnePassRule Rule>
inline constexpr bool is_smoothable<Rule> = Rule::symmetric;
template <typename Rule>
inline constexpr bool is_smoothable<Factored<Rule>> = true;

}  // namespace detail

/// The method of Smoother: a one-pass rule, or its factored form, that remembers what its steps use.
template <typename M>
struct Remembering {
  static_assert(
      detail::is_smoothable<M>,
      "jml: a smoother belongs to the symmetric one-pass rules Kalman, Ekf and Sddre: P of another rule "
      "is no covariance, or no step of it is one linearisation");
  /// What filter/method.hpp asks of a method.
  /// @{
  using Method = typename MethodOf<M>::type;
  using Rule = typename Method::Rule;
  static constexpr bool rolls_back = true, optimal_on_linear = true, symmetric = true;
  template <typename Scalar, int n>
  using RunsOn = Dual<Scalar, n>;
  template <typename Scalar, typename D>
  using Belief = detail::SmootherMemory<Scalar, D, Method>;
  template <typename Scalar, typename D, typename S>
  using Report = ReportOf<M, D, S, Scalar>;

  [[no_unique_address]] Method method;  ///< of the forward pass
  int capacity = 0;                     ///< steps that there is room for

  template <typename D>
  static consteval bool accepts() {
    return Method::template accepts<D>();
  }
  template <typename S>
  static consteval bool accepts_sensor() {
    return Method::template accepts_sensor<S>();
  }

  template <typename Belief, typename Given>
  [[nodiscard]] Status start(Belief& memory, const Given& given, double time) const {
    const std::size_t count = static_cast<std::size_t>(capacity < 0 ? 0 : capacity) + 1;
    const bool fits = count <= memory.nodes.capacity() ||
                      (capacity <= detail::most_nodes &&
                       detail::has_room(static_cast<double>(count) * sizeof(typename Belief::Node)));
    memory.nodes.resize(fits ? count : 1);
    typename Belief::Filtered begin{};
    Status status = Status::ok;
    if constexpr (requires { given.belief; }) {
      status = given.status;
      if (status == Status::ok) detail::commit(begin, given.belief);
    } else {
      status = method.start(memory.model, given, begin);
    }
    if (!fits && status == Status::ok) status = Status::invalid_option;
    memory.keep(0, {}, begin, time);
    if constexpr (Belief::Record::Root::constant)
      static_cast<void>(memory.root.form(memory.model.dynamics, begin.x, {}));
    return status;
  }

  template <typename Belief, typename At>
  [[nodiscard]] Status predict(Belief& memory, const At& at) const {
    if (memory.full()) return Status::memory_full;
    typename Belief::Record record;
    typename Belief::Filtered next{};
    Status status = Status::ok;
    bool moved = false, unused = false;
    if constexpr (Belief::factored)
      status = method.predict(memory.model, memory.filtered(), at, next);
    else
      status = detail::one_pass_predict(rule(), memory.model, memory.filtered(), at, next,
                                        detail::SmootherObserver<decltype(record)>{record, moved, unused});
    if (!usable(status)) return status;
    note_step(memory, record, moved, moved ? next.x : predicted_state(memory.dynamics(), memory.x(), at), at);
    if (!memory.form(record, at)) return Status::invalid_disturbance_covariance;
    record.prediction = next.x;
    memory.keep(memory.last + 1, record, next, end_of(at).time);
    return status;
  }
  template <typename Belief, typename Sample, typename Report>
  void correct(Belief& memory, const Sample& sample, Report& report) const {
    auto record = memory.node(memory.last).record;
    if (memory.last == 0) record.prediction = memory.x();
    typename Belief::Filtered next{};
    bool moved = false, noted = false;
    if constexpr (Belief::factored)
      method.correct(memory.model, memory.filtered(), sample, next, report);
    else
      detail::one_pass_correct(rule(), memory.filtered(), sample, next, report,
                               detail::SmootherObserver<decltype(record)>{record, moved, noted});
    if (!usable(report.status)) return;
    if (report.gate == Verdict::rejected || report.redone) {
      record = memory.node(memory.last).record;
      if (memory.last == 0) record.prediction = memory.x();
      noted = false;  // but by an attempt in the digits of Scalar
    }
    if (report.gate != Verdict::rejected) {
      if (!noted && !note(record, memory.x(), sample, sample.at, report)) return;
      note_fineness(memory, memory.x(), noted, sample, sample.at, next);
    }
    memory.keep(memory.last, record, next, memory.node(memory.last).time);
  }
  template <typename Belief, typename Sample, typename Report>
  void step(Belief& memory, const Sample& sample, Report& report) const {
    const auto at = end_of(sample.at);
    if constexpr (Belief::factored) {
      const int before = memory.last;
      report.status = predict(memory, sample.at);
      if (!usable(report.status)) return;
      correct(memory, jml::Sample{sample.sensor, sample.y, at, sample.gate}, report);
      if (!usable(report.status)) memory.last = before;
    } else {
      report.status = memory.full() ? Status::memory_full : Status::ok;
      if (report.status != Status::ok) return;
      typename Belief::Record record;
      typename Belief::Filtered next{};
      bool moved = false, noted = false;
      detail::one_pass_step(rule(), memory.model, memory.filtered(), sample, next, report,
                            detail::SmootherObserver<decltype(record)>{record, moved, noted, true});
      if (!usable(report.status)) return;
      note_step(memory, record, moved, predicted_state(memory.dynamics(), memory.x(), sample.at), sample.at);
      if (!memory.form(record, sample.at)) {
        report.status = Status::invalid_disturbance_covariance;
        return;
      }
      if (report.redone) noted = false;  // but by an attempt in the digits of Scalar
      if (report.gate == Verdict::rejected) {
        record.rows = 0;
        record.prediction = next.x;
      } else {
        if (!noted) {
          record.rows = 0;
          record.prediction = memory.predicted(record);
          if (!note(record, record.prediction, sample, at, report)) return;
        }
        note_fineness(memory, record.prediction, noted, sample, at, next);
      }
      memory.keep(memory.last + 1, record, next, at.time);
    }
  }
  /// @}

 private:
  /// What a step used, where it did not tell, and what the model makes of x̂ or of zero: f is `prediction`.
  template <typename Belief, typename Record, typename X, typename At>
  void note_step(const Belief& memory, Record& record, bool told, const X& prediction, const At& at) const {
    const auto& d = memory.dynamics();
    const X& x = Rule::evaluated_at == EvaluatedAt::estimate ? memory.x() : prediction;
    if (!told) record.transition = dynamics_slot<Rule::A>(rule(), d, x, memory.x(), at);
    if constexpr (Record::affine)
      record.constant = predicted_state(d, kernel::zeros<X>(), at);
    else
      record.constant = prediction;
  }
  /// y - m(x) can be had in more digits.
  template <typename Record, typename Sample>
  static constexpr bool in_all_digits =
      detail::exact_sensor<std::remove_cvref_t<decltype(std::declval<Sample>().sensor)>,
                           Vector<typename Record::Scalar, Sample::measurements>>();
  /// What a correction used that did not tell.
  template <typename Record, typename X, typename Sample, typename At, typename Report>
  [[nodiscard]] bool note(Record& record, const X& x, const Sample& sample, const At& at,
                          Report& report) const {
    const auto H = sensor_slot<Rule::D>(rule(), sample.sensor, x, x, at);
    auto innovation = report.innovation, low = innovation;
    kernel::set_zero(low);
    if constexpr (in_all_digits<Record, Sample>)
      detail::innovation_in_two(detail::from_origin<Record::n>(sample.sensor, sample.y, at), H, x, innovation,
                                low);
    if (record.add(x, H, noise_covariance(sample.sensor, x, at), innovation, low)) return true;
    report.status = Status::invalid_noise_covariance;
    return false;
  }
  /// The filter's x is in all digits where that of a linear system was never rounded; else a measurement may
  /// ask for more.
  template <typename Belief, typename X, typename Sample, typename At, typename Next>
  void note_fineness(Belief& memory, const X& x, bool noted, const Sample& sample, const At& at,
                     const Next& next) const {
    bool exact = false;
    if constexpr (Belief::Record::affine && in_all_digits<typename Belief::Record, Sample>) {
      if constexpr (Belief::factored)
        exact = true;
      else
        exact = detail::is_exact(next);
    }
    const auto& y = sample.y;
    memory.too_fine = memory.too_fine || (!exact && (detail::too_fine(sample.sensor, next.x, y, at) ||
                                                     (!noted && detail::too_fine(sample.sensor, x, y, at))));
  }
  [[nodiscard]] const Rule& rule() const {
    if constexpr (requires { method.rule; })
      return method.rule;
    else
      return method;
  }
};

/// A filter that can look back.
///
///     jml::Smoother smoother{jml::Filter{jml::Ekf{}, VanDerPol{}, jml::Estimate{x0, P0}}, 500};
///     const auto report = smoother.step(SaturatingPosition{}, y);  // as with the filter
///     const jml::Status status = smoother.smooth();                // then smoother.x(k), smoother.P(k)
///
/// Its verbs do, report and refuse what those of Filter do; step() and predict() add a node. The memory is
/// reserved at construction; where it is used up, they answer memory_full. Of a filter with
/// jml::Factored{jml::Ekf{}} the smoothed pair is kept in factors too, smoothed(k): for a P that no matrix of
/// Scalar can hold, and from a start of which nothing is known. A row with R = 0 it does not take.
template <typename M, typename D, typename Scalar = double>
class Smoother : public Filter<Remembering<M>, D, Scalar> {
  using Base = Filter<Remembering<M>, D, Scalar>;
  using Memory = typename Base::Belief;
  static constexpr bool in_charts = requires(const Memory& memory) { memory.chart(0); };

 public:
  using typename Base::Covariance;  ///< as of Filter
  using typename Base::State;       ///< as of Filter

  /// Starts, as node 0, where `filter` stands, with its gate; a sensor that reads the control sees none
  /// before the first step. `capacity`: steps and predictions to remember; none where negative.
  /// invalid_option: more than the heap would give.
  Smoother(const Filter<M, D, Scalar>& filter, int capacity)
      : Base({filter.method(), capacity}, filter.dynamics(),
             detail::SmootherStart<typename Filter<M, D, Scalar>::Belief>{filter.belief(), filter.status()},
             filter.time()) {
    this->gate = filter.gate;
  }

  /// Smooths all nodes with all measurements so far; more may follow, and another smooth(). covariance_lost:
  /// at some nodes P is NaN, as no matrix of Scalar holds it to 1e-3 in every direction; x is right there.
  /// accuracy_not_met: a measurement of a linear m was finer than the digits of an x that had been rounded;
  /// all nodes are the filter's. Where x is no answer either, node and P are the filter's.
  [[nodiscard]] Status smooth() {
    return this->status() == Status::ok ? this->mutable_belief().smooth() : this->status();
  }

  /// Number of nodes: the start, and one for each step() and predict().
  [[nodiscard]] int samples() const { return this->belief().last + 1; }
  /// Of node k, 0 ≤ k < samples(), as of the last smooth(); of newer ones the filter's.
  [[nodiscard]] decltype(auto) x(int k) const {
    if constexpr (in_charts)
      return this->belief().x(k);
    else
      return (this->belief().node(k).smoothed.x);
  }
  /// As x(k).
  [[nodiscard]] decltype(auto) P(int k) const {
    if constexpr (in_charts)
      return this->belief().P(k);
    else
      return (this->belief().node(k).smoothed.P);
  }
  /// x, U and D of a factored form.
  [[nodiscard]] const auto& smoothed(int k) const
    requires(Memory::factored && !in_charts)
  {
    return this->belief().node(k).factors;
  }
  [[nodiscard]] double time(int k) const { return this->belief().node(k).time; }  ///< s
  /// The filter's belief after the last correction there.
  [[nodiscard]] const typename Memory::Filtered& filtered(int k) const
    requires(!in_charts)
  {
    return this->belief().node(k).filtered;
  }
  using Base::P;                                              ///< of the last node, as the filter has it
  using Base::time;                                           ///< likewise, s
  using Base::x;                                              ///< likewise
  [[nodiscard]] const Base& filter() const { return *this; }  ///< of the forward pass
};

}  // namespace jml
#include <jml/warnings_end.hpp>
