// SPDX-License-Identifier: BSD-3-Clause
// e^H, φ₁(H) c and φ₂(H) c against their Taylor series in long double, over all norms in reach and all
// scales.
#include <gtest/gtest.h>

#include <jml/campaign/noise.hpp>
#include <jml/solve/exponential.hpp>

namespace {

using namespace jml::operators;

using jml::Matrix;
using jml::Vector;

template <typename Scalar, int m>
Matrix<Scalar, m, m> random_of_norm(jml::Noise& noise, double norm) {
  Matrix<double, m, m> H;
  for (int i = 0; i < m * m; ++i) H.data()[i] = noise.uniform(-1, 1);
  H *= norm / H.cwiseAbs().colwise().sum().maxCoeff();
  return H.template cast<Scalar>();
}

template <typename Scalar, int m>
void series(const Matrix<Scalar, m, m>& H, const Vector<Scalar, m>& c, Matrix<long double, m, m>& E,
            Vector<long double, m>& v, Vector<long double, m>& w) {
  const Matrix<long double, m, m> A = H.template cast<long double>();
  Matrix<long double, m, m> term = Matrix<long double, m, m>::Identity();
  E = term;
  v = c.template cast<long double>();
  w = v / 2;
  for (int k = 1; k < 30; ++k) {
    term = (term * A / k).eval();
    E += term;
    v += term * c.template cast<long double>() / (k + 1);
    w += term * c.template cast<long double>() / ((k + 1) * (k + 2));
  }
}

/// Error of each entry, relative to the balanced matrix's scale there: unit(i)/unit(j).
template <typename Scalar, int m>
double error(const Matrix<Scalar, m, m>& H, const Vector<Scalar, m>& c, double norm,
             const Vector<double, m>& unit) {
  const jml::kernel::Exponential<Scalar, m> exponential(H, static_cast<Scalar>(norm));
  const Matrix<Scalar, m, m>& E = exponential.value();
  const Vector<Scalar, m> v = exponential.phi1(c), w = exponential.phi2(c);
  Matrix<long double, m, m> wanted_E;
  Vector<long double, m> wanted_v, wanted_w;
  series(H, c, wanted_E, wanted_v, wanted_w);
  double worst = 0;
  for (int i = 0; i < m; ++i) {
    worst = std::max(worst, static_cast<double>(std::abs(v(i) - wanted_v(i))) / unit(i));
    // φ₂ is right to two orders of H less: 6e-15 where the degree changes.
    worst = std::max(worst, static_cast<double>(std::abs(w(i) - wanted_w(i))) / unit(i) / 4);
    for (int j = 0; j < m; ++j)
      worst = std::max(worst, static_cast<double>(std::abs(E(i, j) - wanted_E(i, j))) * unit(j) / unit(i));
  }
  return worst;
}

template <typename Scalar, int m>
double worst_error(double spread) {
  jml::Noise noise(8);
  double worst = 0;
  for (const double norm : {1e-6, 1e-3, 0.0139, 0.0141, 0.1, 0.249, 0.251, 0.41, 0.43, 0.7, 0.95}) {
    for (int k = 0; k < 30; ++k) {
      Matrix<Scalar, m, m> H = random_of_norm<Scalar, m>(noise, norm);
      Vector<double, m> unit;
      for (int i = 0; i < m; ++i) unit(i) = std::exp2(std::round(noise.uniform(-spread, spread)));
      for (int i = 0; i < m; ++i) {
        for (int j = 0; j < m; ++j) H(i, j) *= static_cast<Scalar>(unit(i) / unit(j));
      }
      Vector<Scalar, m> c;
      for (int i = 0; i < m; ++i) c(i) = static_cast<Scalar>(unit(i) * noise.uniform(-1, 1));
      worst = std::max(worst, error(H, c, norm, unit));
    }
  }
  return worst;
}

// Measured: 9e-16 for both, whatever the scale; 6e-7 in float.
TEST(Exponential, RightToRounding) {
  EXPECT_LT((worst_error<double, 2>(0)), 2e-15);
  EXPECT_LT((worst_error<double, 4>(0)), 2e-15);
  EXPECT_LT((worst_error<double, 6>(0)), 2e-15);
  EXPECT_LT((worst_error<float, 4>(0)), 2e-6);
}
TEST(Exponential, EntryByEntryInAnyUnits) {  // 2^±27 is 10^±8
  EXPECT_LT((worst_error<double, 4>(27)), 2e-15);
  EXPECT_LT((worst_error<double, 6>(27)), 2e-15);
  EXPECT_LT((worst_error<float, 4>(13)), 2e-6);
}

// A rotation, and the sum of a geometric series: e^H = [cos, -sin; sin, cos], φ(H) c = ∫ rotations.
TEST(Exponential, Rotation) {
  for (const double a : {1e-4, 0.01, 0.2, 0.9}) {
    Matrix<double, 2, 2> H;
    H << 0, -a, a, 0;
    const jml::kernel::Exponential<double, 2> exponential(H, a);
    const Matrix<double, 2, 2>& E = exponential.value();
    const Vector<double, 2> v = exponential.phi1(Vector<double, 2>(1, 0));
    EXPECT_NEAR(E(0, 0), std::cos(a), 4e-16);
    EXPECT_NEAR(E(1, 0), std::sin(a), 4e-16);
    EXPECT_NEAR(E(0, 1), -std::sin(a), 4e-16);
    EXPECT_NEAR(v(0), std::sin(a) / a, 4e-16);
    EXPECT_NEAR(v(1), 2 * std::sin(a / 2) * std::sin(a / 2) / a, 4e-16);
  }
}

}  // namespace
