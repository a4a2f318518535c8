// SPDX-License-Identifier: BSD-3-Clause
// The numbers that the demos of the continuous filters wrote, against theory and against runs made elsewhere.
#include <algorithm>

#include "summary.hpp"

namespace {

using demo_results::Summary, demo_results::expect_same_bytes_twice;

TEST(ContinuousDemos, WriteTheSameBytesTwice) {
  expect_same_bytes_twice("van_der_pol_continuous");
#ifdef JML_DEMO_CVODE
  expect_same_bytes_twice("stiff");
  expect_same_bytes_twice("stability_region");
#endif
}

TEST(VanDerPolContinuous, TheDiscreteFiltersBecomeTheContinuousOnes) {
  const Summary paper("van_der_pol_continuous");
  for (const std::string key : {"quiet_", "noisy_"}) {
    for (const std::string rule : {"ekf", "sddre", "rnls"}) {
      EXPECT_NEAR(paper[key + rule + "_x_order"], 1, 0.02) << key << rule;
      EXPECT_NEAR(paper[key + rule + "_P_order"], 1, 0.02) << key << rule;
      EXPECT_EQ(paper[key + rule + "_refused"], 0) << key << rule;
      EXPECT_EQ(paper[key + rule + "_discrete_refused"], 0) << key << rule;
      for (const std::string what : {"_position_rmse", "_velocity_rmse"}) {
        const double continuous = paper[key + rule + what];
        EXPECT_NEAR(paper[key + rule + "_discrete" + what], continuous, 0.01 * continuous) << key << rule;
      }
    }
  }
}

// The same truth, seeds and discrete filters as in van_der_pol, written twice.
TEST(VanDerPolContinuous, ItsDiscreteFiltersAreThoseOfTheOtherDemo) {
  const Summary here("van_der_pol_continuous"), there("van_der_pol");
  for (const std::string key : {"quiet_", "noisy_"}) {
    for (const std::string what : {"_position_rmse", "_velocity_rmse", "_asymmetry"}) {
      EXPECT_NEAR(here[key + "ekf_discrete" + what], there[key + "ekf" + what], 1e-8) << key << what;
      EXPECT_NEAR(here[key + "sddre_discrete" + what], there[key + "sddre" + what], 1e-8) << key << what;
      EXPECT_NEAR(here[key + "rnls_discrete" + what], there[key + "jml" + what], 1e-8) << key << what;
    }
  }
}

// "One can clearly see that the P matrix is non-symmetric. The difference in this example is small."
TEST(VanDerPolContinuous, OnlyTheMatrixOfRnlsIsNonsymmetricAndSlightly) {
  const Summary paper("van_der_pol_continuous");
  for (const std::string key : {"quiet_", "noisy_"}) {
    EXPECT_EQ(paper[key + "ekf_asymmetry"], 0);
    EXPECT_EQ(paper[key + "sddre_asymmetry"], 0);
    EXPECT_GT(paper[key + "rnls_asymmetry"], 1e-3);
    EXPECT_LT(paper[key + "rnls_asymmetry"], 0.1);
  }
}

#ifdef JML_DEMO_CVODE
// Two integrators that share no line.
TEST(StiffDemo, TheReferenceIsConfirmed) {
  const Summary stiff("stiff");
  EXPECT_LT(stiff["reference_position"], 1e-11);
  EXPECT_LT(stiff["reference_velocity"], 1e-8);
  EXPECT_LT(stiff["reference_P22"], 1e-10);
  EXPECT_LT(stiff["reference_first_P22"], 1e-10);
}

TEST(StiffDemo, FixedExplicitStepsAreRefusedByName) {
  const Summary stiff("stiff");
  EXPECT_EQ(stiff["function_rk4_1_step_too_long"], 1);
  EXPECT_EQ(stiff["function_rk4_1e6_step_too_long"], 1);
  // The first rate is P0/R, and a step of 1.39 over it is the longest.
  for (const std::string R : {"1e-4", "1e-6"}) {
    EXPECT_EQ(stiff["substeps_" + R + "_enough"], 1) << R;
    EXPECT_EQ(stiff["substeps_" + R + "_one_less_refused"], 1) << R;
  }
}

TEST(StiffDemo, EveryOtherIntegratorEndsWhereItShould) {
  const Summary stiff("stiff");
  // Errors of the velocity from 1 s on. The bounds are some ten times what was measured: they are to tell an
  // integrator that works from one that does not, and to order the tolerances.
  for (const auto& [key, velocity] : {std::pair<std::string, double>{"cut", 1e-5},
                                      {"cut_4", 1e-7},
                                      {"adams", 2e-4},
                                      {"bdf_4", 5e-3},
                                      {"bdf_6", 1e-4},
                                      {"bdf_9", 1e-6}}) {
    EXPECT_EQ(stiff["function_" + key + "_ok"], 1) << key;
    EXPECT_LT(stiff["function_" + key + "_velocity"], velocity) << key;
  }
  EXPECT_NEAR(
      std::log2(stiff["function_davison_maki_256_velocity"] / stiff["function_davison_maki_4096_velocity"]) /
          4,
      2, 0.05);
  for (const std::string key : {"davison_maki_1", "davison_maki_16"})
    EXPECT_LT(stiff["function_" + key + "_P22"], 0.1) << key;
}

// What the demo says of BDF: its work hardly grows, that of the explicit methods with the settled rate, which
// is R^(-1/4).
TEST(StiffDemo, BdfGoesInStepsOfTheMotion) {
  const Summary stiff("stiff");
  const auto grows = [&](const std::string& key) {
    return stiff["over_R_1e-14_" + key + "_evaluations"] / stiff["over_R_1e-10_" + key + "_evaluations"];
  };
  EXPECT_LT(grows("bdf"), 4);
  EXPECT_GT(grows("cut"), 8);
  EXPECT_GT(grows("adams"), 8);
  EXPECT_LT(10 * stiff["over_R_1e-14_bdf_evaluations"], stiff["over_R_1e-14_cut_evaluations"]);
  EXPECT_GT(stiff["held_1e-12_bdf_6_evaluations_later"], stiff["held_1e-12_cut_evaluations_later"]);
}

// n = 1 is certified exactly on (-1, 1), and there the printed condition is as good as the full one. The last
// point is short of 1, where 1/V vanishes: what is missing of the level is of second order.
TEST(StabilityRegionDemo, OneStateIsCertifiedAsByHand) {
  const Summary region("stability_region");
  for (const std::string key : {"one_state_1", "one_state_2"}) {
    const double exact = region[key + "_by_hand"];
    EXPECT_NEAR(region[key + "_level"], exact, 2e-6 * exact) << key;
    EXPECT_NEAR(region[key + "_printed_level"], exact, 2e-6 * exact) << key;
  }
}

// With one measurement of two states the printed condition fails beside h = 0 however near the origin.
TEST(StabilityRegionDemo, TheFullConditionCertifiesWhatThePrintedOneCannot) {
  const Summary region("stability_region");
  for (const std::string key : {"chapter", "paper", "coarse", "coarser"}) {
    EXPECT_GT(region[key + "_level"], 1) << key;
    EXPECT_EQ(region[key + "_printed_level"], 0) << key;
    EXPECT_GT(region[key + "_printed_failures"], 0) << key;
    EXPECT_LT(region[key + "_hamiltonian"], 1e-4) << key;
    EXPECT_GT(region[key + "_starts"], 100) << key;
    EXPECT_EQ(region[key + "_converging"], region[key + "_starts"]) << key;
    EXPECT_GT(region[key + "_farther"], 1) << key;
    EXPECT_NEAR(region[key + "_covariance_order"], 1, 0.02) << key;  // V(x) is even in x here
  }
  EXPECT_EQ(region["chapter_limited_by_box"], 1);
  EXPECT_EQ(region["paper_limited_by_box"], 1);
  EXPECT_EQ(region["coarse_limited_by_condition"], 1);
  // SciPy: 6.849152, by another integration and a scan over directions.
  EXPECT_NEAR(region["coarser_level"], 6.849152, 3e-4);
}
#endif

}  // namespace
