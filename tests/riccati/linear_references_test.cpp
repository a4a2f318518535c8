// SPDX-License-Identifier: BSD-3-Clause
// On a linear system of 4 states neither the rule, nor the reference, nor the iteration changes anything.
#include "riccati/linear_run.hpp"

namespace {

TEST(LinearEquivalence, FourStatesEveryReference) {
  const linear_run::Run<4, 2> run(52);
  jml::Noise noise(55);
  const jml::AboutPoint point{jml::Vector<double, 4>(models::random_matrix<4, 1>(noise))};
  run.expect_kalman(jml::Kalman{}, "Kalman");
  run.expect_kalman(jml::Ekf<jml::EvaluatedAt::prediction>{}, "EKF, slots at the prediction");
  run.expect_kalman(jml::Sddre{}, "SDDRE");
  run.expect_kalman(jml::Sddre{point}, "SDDRE about a point");
  run.expect_kalman(jml::Sddre{jml::AboutEstimate{}}, "SDDRE about the estimate");
  run.expect_kalman(jml::Jml{}, "JML");
  run.expect_kalman(jml::Jml{point}, "JML about a point");
  run.expect_kalman(jml::Jml{jml::AboutEstimate{}}, "JML about the estimate");
}

TEST(LinearEquivalence, FourStatesEveryIteration) {
  const linear_run::Run<4, 2> run(56);
  run.expect_kalman(jml::Iekf{}, "IEKF");
  for (const auto method : {jml::Iteration::anderson, jml::Iteration::newton, jml::Iteration::none}) {
    run.expect_kalman(jml::IteratedJml{jml::IterationOptions{.method = method}}, "iterated JML");
  }
  run.expect_kalman(jml::IteratedJml{jml::AboutEstimate{}}, "iterated JML about the estimate");
}

}  // namespace
