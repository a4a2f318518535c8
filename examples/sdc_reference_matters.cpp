// SPDX-License-Identifier: BSD-3-Clause
// F(x; r)(x - r) = f(x) - f(r): the JML gain depends on the reference r, the root of the exact step does not.
#include <cmath>
#include <cstdio>
#include <jml/jml.hpp>

#include "models/van_der_pol.hpp"

int main() {
  const models::VanDerPol dynamics;
  const models::SaturatingPosition sensor;
  const jml::Vector<double, 2> x0(1.5, 0.5), elsewhere(1, 1);
  const jml::Estimate prior{x0, jml::Matrix<double, 2, 2>(0.3 * jml::Matrix<double, 2, 2>::Identity())};
  const jml::Vector<double, 1> y(0.5);

  double spread = 0;
  const auto show = [&](const char* reference, const auto& one_pass, const auto& exact) {
    const auto a = jml::step(one_pass, dynamics, sensor, prior, y).estimate;
    const auto b = jml::step(exact, dynamics, sensor, prior, y).estimate;
    static const jml::Vector<double, 2> root = b.x;
    spread = std::max(spread, (b.x - root).norm());
    std::printf("%-16s one pass x = (%.4f, %.4f)   exact x = (%.10f, %.10f), P12 - P21 = %+.5f\n", reference,
                a.x(0), a.x(1), b.x(0), b.x(1), b.P(0, 1) - b.P(1, 0));
  };
  // [references]
  show("origin", jml::Jml{}, jml::IteratedJml{});
  show("a fixed point", jml::Jml{jml::AboutPoint{elsewhere}}, jml::IteratedJml{jml::AboutPoint{elsewhere}});
  show("the estimate", jml::Jml{jml::AboutEstimate{}}, jml::IteratedJml{jml::AboutEstimate{}});
  // [/references]
  return spread < 1e-10 ? 0 : 1;
}
