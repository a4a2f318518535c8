// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A union of boxes that holds the truth always: for sensors whose slope changes sign, and sets that one box
/// covers badly, as the arc that a range leaves or the two places that it cannot tell apart.
///
/// Set inversion by a subpaving of bounded size: boxes are contracted, what cannot be is dropped, the rest is
/// bisected and contracted again (SIVIA, Jaulin and Walter 1993), and the union is carried from sample to
/// sample (Kieffer, Jaulin and Walter 2002). Each box moves and is cut as a guaranteed one; beside them goes
/// one guaranteed box of all, with its zonotope, which cuts each of them.
/// Beyond the bounded-noise dissertation, whose set is one box.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/bounded/guaranteed_box.hpp>
#include <jml/bounded/paving.hpp>

namespace jml {

/// A rule for a union of at most `parts_` boxes: filter.parts(); filter.box() is the smallest box around them
/// and filter.x() its centre. `columns_per_state`: of the zonotope; 0: none. Paved<1> is Guaranteed.
///
/// The truth is in one of the parts, as long as the bounds hold; the model is to be as for Guaranteed, and a
/// bound that depends on the state holds for all of a box of whose centre it is asked. A measurement that no
/// part can have given is reported and not used: report.violation is that of the part that comes nearest.
/// Time of a step: at most 1 move of Guaranteed and parts_ of Guaranteed<0>; 1 cut of Guaranteed and 3 parts_
/// of Guaranteed<0>, and as many Jacobians of the sensor; parts_³/2 volumes.
template <int parts_ = 8, int columns_per_state = 6>
struct Paved {
  static_assert(parts_ >= 1, "jml: Paved<parts>: a union has one box or more");
  /// cut() works in place, and has to be taken back.
  static constexpr bool contradiction_changes_nothing = false;
  template <typename Scalar, int n>
  using RunsOn = Interval<Scalar>;  ///< a model runs on intervals too
  /// Insides of the rule.
  /// @{
  using Whole = Guaranteed<columns_per_state>;
  using Part = Guaranteed<0>;
  /// @}

  /// What is carried beside the box around all: the parts.
  template <typename Scalar, int n>
  struct Memory {
    /// Insides of the rule.
    /// @{
    typename Whole::template Memory<Scalar, n> whole;
    detail::Paving<Scalar, n, parts_, typename Part::template Memory<Scalar, n>> paving;

    auto each_part(auto&& f) { return f(whole, paving); }
    /// @}
    /// The parts of `box`, the belief's: itself, until there are more.
    [[nodiscard]] std::span<const Box<Scalar, n>> parts(const Box<Scalar, n>& box) const {
      return paving.count() > 0 ? paving.boxes() : std::span<const Box<Scalar, n>>(&box, 1);
    }
  };

  /// Moves all parts over at.dt. state_unbounded: a state has no bound yet; invalid_disturbance_bound;
  /// dynamics_not_finite. The box is then as it was, the memory is not.
  template <typename D, typename Scalar, int n, typename At>
  [[nodiscard]] static Status move(const D& d, Box<Scalar, n>& box, Memory<Scalar, n>& memory, const At& at) {
    Box<Scalar, n> next = box;
    const Status status = Whole::move(d, next, memory.whole, at);
    if (status != Status::ok) return status;
    if constexpr (parts_ > 1) {
      auto& paving = memory.paving;
      if (paving.count() == 0) paving.start(box);
      for (int k = paving.count() - 1; k >= 0; --k) {
        const Status moved = Part::move(d, paving.box(k), paving.memory(k), at);
        if (moved != Status::ok) return moved;
        if (detail::meet(paving.box(k), next) >= 0) paving.drop(k);
      }
      if (paving.count() == 0) paving.start(next);  // bounds were violated, unseen: as Guaranteed goes on
      next = paving.hull();
    }
    box = next;
    return Status::ok;
  }

  /// Cuts all parts by a measurement: report.status, report.violation.
  template <typename S, typename Scalar, int n, int p, typename At>
  static void cut(const S& s, Box<Scalar, n>& box, Memory<Scalar, n>& memory, const Vector<Scalar, p>& y,
                  const At& at, BoundedReport<Scalar, p>& report) {
    Whole::cut(s, box, memory.whole, y, at, report);
    if constexpr (parts_ > 1) {
      if (report.status != Status::ok || !box.bounded()) return;
      auto& paving = memory.paving;
      if (paving.count() == 0) paving.start(box);
      Violation<Scalar> nearest;
      for (int k = paving.count() - 1; k >= 0; --k) {
        const int apart = detail::meet(paving.box(k), box);
        if (!cut_part(s, paving, k, y, at, nearest)) {
          paving.drop(k);
        } else if (apart >= 0) {  // from the box around all, which the measurement has cut too
          nearer(nearest, {-1, apart, detail::gap(paving.box(k), box, apart)});
          paving.drop(k);
        }
      }
      paving.merge(parts_ > 2 ? parts_ / 2 : 1);
      divide(s, paving, strips(s, box, at), y, at, nearest);
      if (paving.count() == 0) {
        report.status = Status::accepted_without_measurement;
        report.violation = nearest;
        return;
      }
      box = paving.hull();
    }
  }

 private:
  /// Where to bisect a box, and how much there is in it.
  template <typename Scalar>
  struct Smear {
    Scalar size = 0;
    int state = 0;
  };

  /// Bisects the part of the largest smear and cuts both halves, while there is room.
  template <typename S, typename Paving, typename Scalar, int p, typename At>
  static void divide(const S& s, Paving& paving, const Vector<Scalar, p>& strip, const Vector<Scalar, p>& y,
                     const At& at, Violation<Scalar>& nearest) {
    Smear<Scalar> smears[parts_];
    for (int k = 0; k < paving.count(); ++k) smears[k] = smear(s, paving, k, strip, at);
    for (int tries = 0; tries < parts_ && paving.count() > 0 && paving.count() < parts_; ++tries) {
      int worst = 0;
      for (int k = 1; k < paving.count(); ++k) worst = smears[k].size > smears[worst].size ? k : worst;
      if (!(smears[worst].size > Scalar(0.1))) return;
      paving.bisect(worst, smears[worst].state);
      for (const int k : {paving.count() - 1, worst}) {
        if (cut_part(s, paving, k, y, at, nearest)) {
          smears[k] = smear(s, paving, k, strip, at);
        } else {
          paving.drop(k);
          smears[k] = smears[paving.count()];
        }
      }
    }
  }

  template <typename Scalar>
  static void nearer(Violation<Scalar>& nearest, const Violation<Scalar>& other) {
    const bool none = nearest.row < 0 && nearest.state < 0;
    if (none || other.excess < nearest.excess) nearest = other;
  }

  /// False where no state of part k can have given y; `nearest`: the least of what such parts miss by.
  template <typename S, typename Paving, typename Scalar, int p, typename At>
  static bool cut_part(const S& s, Paving& paving, int k, const Vector<Scalar, p>& y, const At& at,
                       Violation<Scalar>& nearest) {
    BoundedReport<Scalar, p> report;
    report.status = Status::ok;
    const auto before = paving.box(k);
    Part::cut(s, paving.box(k), paving.memory(k), y, at, report);
    if (report.status == Status::accepted_without_measurement) {
      nearer(nearest, report.violation);
      return false;
    }
    if (report.status != Status::ok) paving.box(k) = before;  // nothing is said of this part
    return true;
  }

  /// What a measurement leaves of each row, 2 b; where that is little, a thousandth of the row over `box`.
  template <typename S, typename Scalar, int n, typename At>
  static Vector<Scalar, measurements_of<S>> strips(const S& s, const Box<Scalar, n>& box, const At& at) {
    constexpr int p = measurements_of<S>;
    Vector<Scalar, p> out = Scalar(2) * noise_bound(s, detail::point_in(box), at);
    const Vector<Interval<Scalar>, p> all = measurement(s, detail::ranges(box), at);
    for (int row = 0; row < p; ++row) {
      const Scalar floor = (all(row).high - all(row).low) / Scalar(1024);
      if (floor > out(row) && std::isfinite(floor)) out(row) = floor;
    }
    return out;
  }

  /// The largest |slope| · width of a state, in strips of the sensor (maximal smear, Kearfott and Novoa
  /// 1990); or of the dynamics' last step, what the width of the slope adds, against the disturbance's push.
  template <typename S, typename Paving, typename Scalar, int p, typename At>
  static Smear<Scalar> smear(const S& s, Paving& paving, int k, const Vector<Scalar, p>& strip,
                             const At& at) {
    const auto& box = paving.box(k);
    const auto& memory = paving.memory(k);
    const auto width = box.width();
    constexpr int n = std::remove_cvref_t<decltype(width)>::RowsAtCompileTime;
    Matrix<Interval<Scalar>, p, n> M = measurement_jacobian(s, detail::ranges(box), at);
    Smear<Scalar> out;
    for (int j = 0; j < n; ++j) {
      const Scalar middle = detail::point_in(box.lower(j), box.upper(j));
      if (!(box.lower(j) < middle && middle < box.upper(j))) continue;  // too thin
      Scalar size = 0;
      for (int row = 0; row < p; ++row) {
        detail::known(M(row, j));
        size = std::max(size, mag(M(row, j)) * width(j) / strip(row));
      }
      for (int i = 0; i < n && memory.stepped; ++i) {
        const Scalar push = memory.rest(i).high - memory.rest(i).low + width(i) / Scalar(32);
        size = std::max(size, memory.J(i, j).radius() * width(j) / push);
      }
      if (size > out.size) out = {size, j};
    }
    return out;
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
