// SPDX-License-Identifier: BSD-3-Clause
// On linear systems every rule is the Kalman filter: 6 states, and by night 2.
#include "riccati/linear_run.hpp"

namespace {

template <int n, int p>
void every_rule_is_kalman(unsigned seed) {
  const linear_run::Run<n, p> run(seed);
  run.expect_kalman(jml::Kalman{}, "Kalman");
  run.expect_kalman(jml::Ekf{}, "EKF");
  run.expect_kalman(jml::Sddre{}, "SDDRE");
  run.expect_kalman(jml::Jml{}, "JML");
  run.expect_kalman(jml::Jml{jml::AboutEstimate{}}, "JML about the estimate");
  run.expect_kalman(jml::Iekf{}, "IEKF");
  run.expect_kalman(jml::IteratedJml{}, "iterated JML");
}

TEST(LinearEquivalence, SixStates) { every_rule_is_kalman<6, 3>(53); }
#ifdef JML_BY_NIGHT
TEST(LinearEquivalence, TwoStates) { every_rule_is_kalman<2, 1>(51); }
#endif

}  // namespace
