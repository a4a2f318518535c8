// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The sweeps of a window, also of one that begins with states which are known better than Scalar can say.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/all_digits.hpp>
#include <jml/interval/minimise.hpp>

namespace jml::detail {

/// minimise() from the nominal of `window`, a trajectory of the model. Of a linear model whose start is known
/// better than Scalar can say the nodes, in its digits, are none, and their J is nothing to compare with:
/// they are a guess, and the answer is swept until the next step is 1e-7 of a deviation (float: 1e-4), else
/// it is accuracy_not_met.
template <typename Window>
[[nodiscard]] BatchReport<typename Window::Number> minimise_window(Window& window, BatchOptions how,
                                                                   bool once) {
  using Scalar = typename Window::Number;
  bool known = false;
  if constexpr (all_linear<typename Window::Dynamics, typename Window::List>)
    known = how.loss.kind == Loss::Kind::none &&
            AllDigits<typename Window::Dynamics, Scalar>::known(window.start());
  if (known) {
    how.max_iterations = std::min(how.max_iterations, std::numeric_limits<int>::max() - 30) + 6;
    how.tolerance = std::min(how.tolerance, static_cast<double>(plain_error<Scalar>));
  }
  auto report = minimise(window, how, !known, once);
  if (known && usable(report.status) && !(report.step <= plain_error<Scalar>))
    report.status = Status::accuracy_not_met;
  return report;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
