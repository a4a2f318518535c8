// SPDX-License-Identifier: BSD-3-Clause
// The generator, at the suite's size, on the estimators of an interval: every node of a batch and of a smoother, and
// the window of a fixed lag. In double; the long run (covariance_generator.cpp) has float too.
#include <gtest/gtest.h>

#include "rounding/tally.hpp"

namespace {

using namespace rounding;

TEST(IntervalGenerator, RightWhereTheyAnswer) {
  Tally tally;
  for (std::uint64_t number = 0; number < 2000; ++number) {
    if (is_single(number)) continue;
    with_size(number, [&]<int n, int p>() {
      const Problem problem = make_problem(2, number, n, p, false);
      if (!problem.dense) return;
      const Flight flight(problem);
      tally.add(Form::fixed_lag, problem, fly_fixed_lag<double, n, p>(problem, flight), false);
      tally.add(Form::batch, problem, fly_batch<double, n, p>(problem, flight), false);
      tally.add(Form::smoother, problem, fly_smoother<double, n, p>(problem, flight), false);
    });
  }
  for (const Form form : {Form::fixed_lag, Form::batch, Form::smoother}) {
    tally.print(form, false);
    tally.print_wrong(form, false);
    const auto all = tally.total(form, false);
    EXPECT_GT(all.problems, 500) << name_of(form);
    EXPECT_EQ(all.wrong_P, 0) << name_of(form);
    EXPECT_EQ(all.wrong_x, 0) << name_of(form);
  }
}

}  // namespace
