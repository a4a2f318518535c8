// SPDX-License-Identifier: BSD-3-Clause
// The numbers that the demos wrote into their summary.csv, against the references and against theory.
#include <gtest/gtest.h>

#include "summary.hpp"

namespace {

using demo_results::Summary;

TEST(Demos, WriteTheSameBytesTwice) {
  for (const std::string demo : {"van_der_pol", "plaza1"})
    demo_results::expect_same_bytes_twice(demo);
}

// An independent implementation on these data: 0.89 m, 181 rejected, largest 2.70 m; dead reckoning 1.93
// m.
TEST(Plaza1, EkfWithBiasesIsAsGoodAsTheReference) {
  const Summary plaza("plaza1");
  EXPECT_LE(plaza["ekf_rmse"], 0.92);
  EXPECT_NEAR(plaza["ekf_rmse"], 0.887, 0.01);
  EXPECT_NEAR(plaza["ekf_rejected"], 181, 3);
  EXPECT_NEAR(plaza["ekf_largest_error"], 2.70, 0.05);
  EXPECT_NEAR(plaza["dead_reckoning_rmse"], 1.93, 0.05);
  EXPECT_EQ(plaza["ekf_refused"], 0);
}

TEST(Plaza1, WithoutBiasesTheEkfIsWorseThanDeadReckoning) {
  const Summary plaza("plaza1");
  EXPECT_GT(plaza["ekf_without_biases_rmse"], 2 * plaza["dead_reckoning_rmse"]);
}

TEST(Plaza1, WhiteNoiseIsTheWrongModelOfTheRadios) {
  const Summary plaza("plaza1");
  EXPECT_NEAR(plaza["ekf_nees"], 8, 1);  // 2 is expected
}

// Theory: about the current estimate the one-pass rules are the EKF, identically.
TEST(Plaza1, AboutTheEstimateTheOnePassRulesAreTheEkf) {
  const Summary plaza("plaza1");
  for (const std::string rule : {"sddre_estimate", "jml_estimate"}) {
    for (const std::string what : {"_rmse", "_largest_error", "_nees", "_cost"}) {
      EXPECT_NEAR(plaza[rule + what], plaza["ekf" + what], 1e-6 * plaza["ekf" + what]) << rule << what;
    }
    EXPECT_EQ(plaza[rule + "_rejected"], plaza["ekf_rejected"]) << rule;
    EXPECT_EQ(plaza[rule + "_refused"], 0) << rule;
  }
  EXPECT_NEAR(plaza["iterated_estimate_rmse"], plaza["ekf_rmse"], 0.01);
  EXPECT_EQ(plaza["iterated_estimate_refused"], 0);
}

// About the origin they lose the robot; the library must answer all the same.
TEST(Plaza1, AboutTheOriginTheAnswersAreFiniteAndPoor) {
  const Summary plaza("plaza1");
  for (const std::string rule :
       {"sddre_origin", "sddre_point", "jml_origin", "jml_point", "iterated_origin", "iterated_point"}) {
    EXPECT_TRUE(std::isfinite(plaza[rule + "_rmse"])) << rule;
    EXPECT_GT(plaza[rule + "_rmse"], 10) << rule;
  }
  EXPECT_NEAR(plaza["sddre_origin_rmse"], 37,
              1);  // symmetric: no question of what a gate does with an indefinite S
}

TEST(VanDerPol, NothingIsRefused) {
  const Summary paper("van_der_pol");
  for (const std::string key : {"quiet_", "noisy_"}) {
    for (const std::string rule : {"ekf", "sddre", "jml", "iterated"})
      EXPECT_EQ(paper[key + rule + "_refused"], 0) << rule;
  }
}

// "One can clearly see that the P matrix is non-symmetric. The difference in this example is small."
TEST(VanDerPol, OnlyTheJmlMatrixIsNonsymmetricAndSlightly) {
  const Summary paper("van_der_pol");
  EXPECT_EQ(paper["noisy_ekf_asymmetry"], 0);
  EXPECT_EQ(paper["noisy_sddre_asymmetry"], 0);
  for (const std::string rule : {"noisy_jml", "noisy_iterated", "quiet_jml", "quiet_iterated"}) {
    EXPECT_GT(paper[rule + "_asymmetry"], 1e-3) << rule;
    EXPECT_LT(paper[rule + "_asymmetry"], 0.1) << rule;
  }
}

TEST(VanDerPol, JmlIsOptimalInItsCriterionAndTheEkfInNoWayWorseInRmse) {
  const Summary paper("van_der_pol");
  for (const std::string rule : {"noisy_ekf", "noisy_sddre"})
    EXPECT_GT(paper[rule + "_excess_cost"], 0) << rule;
  EXPECT_NEAR(paper["noisy_iterated_excess_cost"], 0, 1e-9);
  EXPECT_LT(paper["noisy_iterated_cost"], paper["noisy_jml_cost"]);
  for (const std::string what : {"_position_rmse", "_velocity_rmse"}) {
    EXPECT_LT(paper["noisy_ekf" + what], 1.02 * paper["noisy_jml" + what]) << what;
    EXPECT_LT(paper["noisy_jml" + what], 1.2 * paper["noisy_ekf" + what]) << what;
    EXPECT_NEAR(paper["noisy_iterated" + what], paper["noisy_jml" + what], 0.01 * paper["noisy_jml" + what])
        << what;
  }
}

}  // namespace
