// SPDX-License-Identifier: BSD-3-Clause
// The univariate nonstationary growth model of the EKF/UKF toolbox manual (Hartikainen, Solin and Särkkä
// 2011): EKF mean square error 125.9 with 100 runs; 118.7 ± 2.4 recomputed with 1000 runs of an independent
// implementation.
//
// A limit, not a success: x has a standard deviation near 10, so an answer of zero would have an error of
// about 100. The measurement does not see the sign of x, and every filter here follows one peak of two.
#include "by_night.hpp"
#include "published/growth_track.hpp"

namespace {

using growth::score, growth::steps, growth::Track;

TEST(Growth, EkfHasThePublishedError) {
  campaign::Score ekf{"EKF"};
  for (unsigned run = 0; run < 1000; ++run) score(jml::Ekf{}, Track(run), ekf);
  ekf.print("", "ekf");
  EXPECT_EQ(ekf.refused, 0);
  EXPECT_EQ(ekf.lost, 0);
  campaign::expect_agreement(ekf, {118.7, 2.4});
}

TEST(Growth, NoRuleIsGoodAtIt) {
  campaign::Score zero{"answer zero always"}, ekf{"EKF"}, iekf{"IEKF"}, sddre{"SDDRE about the origin"},
      jml_rule{"JML about the origin"}, iterated{"iterated JML, estimate"};
  const unsigned runs = by_night() ? 300 : 50;  // printed for a reader, who has them all by night
  for (unsigned run = 0; run < runs; ++run) {
    const Track track(run);
    double squares = 0;
    for (const double x : track.truth) squares += x * x;
    zero.finish(squares / steps, 1e9);
    score(jml::Ekf{}, track, ekf);
    score(jml::Iekf{}, track, iekf);
    score(jml::Sddre{}, track, sddre);
    score(jml::Jml{}, track, jml_rule);
    score(jml::IteratedJml{jml::AboutEstimate{}}, track, iterated);
  }
  for (const auto* s : {&zero, &ekf, &iekf, &sddre, &jml_rule, &iterated}) s->print("");
}

}  // namespace
