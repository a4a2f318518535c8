// SPDX-License-Identifier: BSD-3-Clause
// What came of many problems, by form and by condition.
#pragma once

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "figure.hpp"
#include "rounding/contestants.hpp"

namespace rounding {

enum class Form { plain, factored, fixed_lag, batch, smoother };
inline constexpr int forms = 5;
inline const char* name_of(Form form) {
  constexpr const char* names[forms] = {"plain", "factored", "fixed lag", "batch", "smoother"};
  return names[static_cast<int>(form)];
}

class Tally {
 public:
  static constexpr int bins = 8;  ///< of four decades each; the last is from 1e28 on, and singular
  static int bin_of(double condition) {
    return condition >= 1e28 ? bins - 1 : std::clamp(static_cast<int>(std::log10(condition) / 4), 0, bins - 2);
  }

  struct Counts {
    long problems = 0, refused = 0, redone = 0, wrong_P = 0, wrong_x = 0;
    long textbook = 0, lost = 0;  ///< right by the textbook's recursion; refused or redone although
    long turned_away = 0;                         ///< of these refused
    double worst_P = 0, worst_x = 0;
    std::map<jml::Status, long> statuses;

    [[nodiscard]] long wrong() const { return wrong_P + wrong_x; }
    void add(const Counts& other) {
      problems += other.problems;
      refused += other.refused;
      redone += other.redone;
      wrong_P += other.wrong_P;
      wrong_x += other.wrong_x;
      textbook += other.textbook;
      lost += other.lost;
      turned_away += other.turned_away;
      worst_P = std::max(worst_P, other.worst_P);
      worst_x = std::max(worst_x, other.worst_x);
      for (const auto& [status, count] : other.statuses) statuses[status] += count;
    }
  };
  struct Wrong {
    double label;
    std::string text;
  };

  /// `textbook`: its recursion is right throughout; of the plain form alone.
  void add(Form form, const Problem& problem, const Outcome& outcome, bool textbook) {
    if (!outcome.flown) return;
    Counts counts;
    counts.problems = 1;
    counts.refused = outcome.refused;
    counts.redone = outcome.redone;
    counts.wrong_P = outcome.wrong_P;
    counts.wrong_x = outcome.wrong_x && !outcome.wrong_P;
    counts.textbook = textbook;
    counts.lost = textbook && (outcome.refused || outcome.redone);
    counts.turned_away = textbook && outcome.refused;
    counts.worst_P = outcome.worst.P;
    counts.worst_x = outcome.worst.x;
    if (outcome.refused) counts.statuses[outcome.status] = 1;
    auto& of = tables_[index(form, problem.single)];
    of.by_condition[static_cast<std::size_t>(bin_of(outcome.label))].add(counts);
    of.by_loss[static_cast<std::size_t>(bin_of(outcome.loss))].add(counts);
    if (!counts.wrong()) return;
    char text[512];
    std::snprintf(text, sizeof text,
                  "n = %d, p = %d, problem %llu of seed %llu, event %d: condition %.1e (within %.1e, of a step %.1e), "
                  "P %.1e, x %.1e; %s",
                  problem.n, problem.p, static_cast<unsigned long long>(problem.number),
                  static_cast<unsigned long long>(problem.seed), outcome.event, outcome.label, outcome.inner,
                  outcome.loss, outcome.worst.P, outcome.worst.x, problem.family.c_str());
    keep(of.wrong, {outcome.label, text});
  }

  void add(const Tally& other) {
    for (std::size_t t = 0; t < tables_.size(); ++t) {
      for (std::size_t b = 0; b < bins; ++b) {
        tables_[t].by_condition[b].add(other.tables_[t].by_condition[b]);
        tables_[t].by_loss[b].add(other.tables_[t].by_loss[b]);
      }
      for (const auto& wrong : other.tables_[t].wrong) keep(tables_[t].wrong, wrong);
    }
  }

  /// Of the problems whose steps have conditions below `limit` (a bin's edge).
  [[nodiscard]] Counts total(Form form, bool single, double limit = infinite) const {
    Counts sum;
    for (int b = 0; b < bins; ++b) {
      if (limit == infinite || b < bin_of(limit)) sum.add(tables_[index(form, single)].by_loss[static_cast<std::size_t>(b)]);
    }
    return sum;
  }

  void print(Form form, bool single, bool by_loss = false) const {
    const auto& table = tables_[index(form, single)];
    const Counts all = total(form, single);
    if (all.problems == 0) return;
    std::printf("\n%s, %s: by the largest condition of %s\n", name_of(form), single ? "float" : "double",
                by_loss ? "a step, with what cancelled in it" : "P");
    std::printf("%-13s %9s %8s %8s %8s %8s %9s %9s", "condition", "problems", "refused", "redone", "wrong P", "wrong x",
                "worst P", "worst x");
    if (form == Form::plain) std::printf(" %10s %s", "textbook", "of these refused, or redone");
    std::printf("\n");
    for (int b = 0; b <= bins; ++b) {
      const auto& of = by_loss ? table.by_loss : table.by_condition;
      const Counts& c = b == bins ? all : of[static_cast<std::size_t>(b)];
      if (c.problems == 0) continue;
      char range[32];
      std::snprintf(range, sizeof range, b == bins ? "all" : b == bins - 1 ? "1e28, singular" : "1e%d to 1e%d", 4 * b, 4 * b + 4);
      const auto share = [&](long count) { return 100.0 * static_cast<double>(count) / static_cast<double>(c.problems); };
      std::printf("%-14s %8ld %7.2f%% %7.2f%% %8ld %8ld %9.1e %9.1e", range, c.problems, share(c.refused), share(c.redone),
                  c.wrong_P, c.wrong_x, c.worst_P, c.worst_x);
      if (form == Form::plain)
        std::printf(" %10ld %6.2f%% %6.2f%%", c.textbook, 100.0 * static_cast<double>(c.turned_away) / static_cast<double>(std::max(1L, c.textbook)), 100.0 * static_cast<double>(c.lost - c.turned_away) / static_cast<double>(std::max(1L, c.textbook)));
      std::printf("\n");
    }
    for (const auto& [status, count] : all.statuses) std::printf("  %8ld %s\n", count, jml::describe(status));
  }
  /// Of all its problems: as figures, for the guide.
  void print_figures(Form form, bool single) const {
    std::string key = std::string(name_of(form)) + (single ? "_float/" : "/");
    std::replace(key.begin(), key.end(), ' ', '_');
    const Counts all = total(form, single);
    const std::pair<const char*, long> figures[] = {
        {"problems", all.problems}, {"refused", all.refused}, {"redone", all.redone}, {"wrong", all.wrong()}};
    for (const auto& [name, count] : figures) figure::print(key + name, static_cast<double>(count));
    figure::print(key + "worst_P", all.worst_P);
  }
  void print_wrong(Form form, bool single) const {
    for (const auto& wrong : tables_[index(form, single)].wrong)
      std::printf("  wrong: %s, %s, %s\n", name_of(form), single ? "float" : "double", wrong.text.c_str());
  }

 private:
  struct Table {
    std::array<Counts, bins> by_condition{}, by_loss{};
    std::vector<Wrong> wrong;  ///< those of the lowest conditions
  };
  static std::size_t index(Form form, bool single) { return static_cast<std::size_t>(2 * static_cast<int>(form) + (single ? 1 : 0)); }
  static void keep(std::vector<Wrong>& list, const Wrong& wrong) {
    list.push_back(wrong);
    std::sort(list.begin(), list.end(), [](const Wrong& a, const Wrong& b) { return a.label < b.label || (a.label == b.label && a.text < b.text); });
    if (list.size() > 10) list.pop_back();
  }
  std::array<Table, 2 * forms> tables_{};
};

/// Which forms fly a problem.
struct Which {
  bool plain = true, factored = true, interval = false;
};

template <typename Scalar, int n, int p, bool with_interval>
void fly_all(const Problem& problem, const Which& which, Tally& tally) {
  const Flight flight(problem);
  if (which.plain) {
    const Outcome outcome = fly_plain<Scalar, n, p>(problem, flight);
    const bool as_ever = outcome.right() && !outcome.redone;
    tally.add(Form::plain, problem, outcome,
              as_ever || (outcome.flown && (outcome.refused || outcome.redone) && textbook_is_right<Scalar, n, p>(problem, flight)));
  }
  if (which.factored) tally.add(Form::factored, problem, fly_factored<Scalar, n, p>(problem, flight), false);
  if constexpr (with_interval) {
    if (!which.interval || problem.number / 64 % 4 != 0) return;
    tally.add(Form::fixed_lag, problem, fly_fixed_lag<Scalar, n, p>(problem, flight), false);
    tally.add(Form::batch, problem, fly_batch<Scalar, n, p>(problem, flight), false);
    tally.add(Form::smoother, problem, fly_smoother<Scalar, n, p>(problem, flight), false);
  }
}

/// use.operator()<n, p>() of the size of problem `number`: the large ones, which take longer, are fewer.
template <typename Use>
void with_size(std::uint64_t number, const Use& use) {
  switch (number % 16) {
    case 0:
      return use.template operator()<1, 1>();
    case 1: case 2: case 3: case 4:
      return use.template operator()<2, 1>();
    case 5: case 6: case 7: case 8: case 9:
      return use.template operator()<3, 2>();
    case 10: case 11: case 12: case 13:
      return use.template operator()<6, 3>();
    default:
      return use.template operator()<8, 4>();
  }
}
inline bool is_single(std::uint64_t number) { return number / 16 % 4 == 3; }

/// Problem `number` of a seed, whose size and scalar follow from the number. One in four is float, and one in four is
/// for the estimators of an interval too.
template <bool with_interval>
void fly_problem(std::uint64_t seed, std::uint64_t number, const Which& which, Tally& tally) {
  with_size(number, [&]<int n, int p>() {
    const Problem problem = make_problem(seed, number, n, p, is_single(number));
    if (problem.single)
      fly_all<float, n, p, with_interval>(problem, which, tally);
    else
      fly_all<double, n, p, with_interval>(problem, which, tally);
  });
}

}  // namespace rounding
