// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What jml::check_model has found: each entry of a model that is not what it should be, and a line of text
/// for it.
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>

namespace jml {

/// One thing that is wrong.
struct Finding {
  /// Of which function of the model.
  enum class Function : std::uint8_t {
    dynamics,
    jacobian,
    sdc,
    covariance,
    input,
    mean,
    measurement,
    linear
  } function{};  ///< which
  /// What is wrong with it.
  enum class Fault : std::uint8_t {
    not_finite,                  ///< a NaN or an infinity
    disagrees_with_duals,        ///< the Jacobian is not the derivative of the function's own code
    disagrees_with_differences,  ///< nor that of its central differences
    breaks_definition,           ///< F(x)(x - r) ≠ f(x) - f(r)
    not_a_covariance,            ///< not symmetric, or indefinite (R: not positive definite)
    not_linear,                  ///< says `linear`, but its Jacobian changes with x
  } fault{};                     ///< what
  int row = 0;                   ///< of the worst entry
  int column = 0;                ///< of the worst entry
  double given = 0;              ///< what the model says
  double expected = 0;           ///< what it should say
};

/// What check_model found: at most one finding for each function and fault.
struct ModelReport {
  std::array<Finding, 16> findings{};  ///< the first `count`
  int count = 0;                       ///< how many

  [[nodiscard]] bool ok() const { return count == 0; }  ///< nothing was found
  /// While there is room.
  void add(const Finding& finding) {
    if (count < static_cast<int>(findings.size())) findings[static_cast<std::size_t>(count++)] = finding;
  }
  /// One of this kind was found.
  [[nodiscard]] bool has(Finding::Function function, Finding::Fault fault) const {
    for (int i = 0; i < count; ++i) {
      const Finding& f = findings[static_cast<std::size_t>(i)];
      if (f.function == function && f.fault == fault) return true;
    }
    return false;
  }
  /// Calls line(const char*) once for each finding.
  template <typename Line>
  void print(const Line& line) const {
    constexpr const char* functions[] = {"dynamics",    "Jacobian",          "SDC matrix",
                                         "covariance",  "disturbance input", "disturbance mean",
                                         "measurement", "claim of linearity"};
    constexpr const char* faults[] = {"is not finite",
                                      "is not the derivative (dual numbers)",
                                      "is not the derivative (central differences)",
                                      "does not satisfy F(x) x = f(x) - f(0)",
                                      "is no covariance",
                                      "is wrong: the Jacobian changes with x"};
    for (int i = 0; i < count; ++i) {
      const Finding& f = findings[static_cast<std::size_t>(i)];
      char text[192];
      std::snprintf(text, sizeof text, "%s %s: entry (%d, %d) is %.9g, expected %.9g",
                    functions[static_cast<int>(f.function)], faults[static_cast<int>(f.fault)], f.row,
                    f.column, f.given, f.expected);
      line(static_cast<const char*>(text));
    }
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
