// SPDX-License-Identifier: BSD-3-Clause
// SymmetricFactor and GeneralFactor against complete-pivoting LU in long double, and what they call singular.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <jml/kernels.hpp>

#include "models/linear.hpp"

namespace {

using namespace jml::operators;

using Big = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

template <typename Derived>
Big big(const Eigen::MatrixBase<Derived>& a) {
  Big out(a.rows(), a.cols());  // no expression: each would be a type of its own to compile
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    for (Eigen::Index i = 0; i < a.rows(); ++i) out(i, j) = static_cast<long double>(a(i, j));
  }
  return out;
}

Big inverse_times(const Big& s, const Big& b) { return s.fullPivLu().solve(b); }

/// Largest singular value over the smallest, from the eigenvalues of sᵀ s by way of norms: an upper bound is
/// enough.
double condition(const Big& s) {
  return static_cast<double>(s.norm() * inverse_times(s, Big::Identity(s.rows(), s.cols())).norm());
}

void expect_near(const Big& got, const Big& wanted, double condition_number, const char* what) {
  const double bound = 20 * 2.3e-16 * condition_number;
  EXPECT_LE(static_cast<double>((got - wanted).norm() / wanted.norm()), bound) << what;
}

template <int p>
void symmetric_solves() {
  constexpr int n = 5;
  for (int run = 0; run < 20; ++run) {
    jml::Noise noise(static_cast<unsigned>(1000 * p + run));
    const auto s = models::random_covariance<p>(noise, 0.01);
    const auto w = models::random_matrix<n, p>(noise);
    const auto b = models::random_matrix<p, 1>(noise);
    jml::kernel::SymmetricFactor<double, p> factor;
    ASSERT_TRUE(factor.factor(s));
    jml::Matrix<double, n, p> v, scaled, gain;
    factor.right_solve(w, v, scaled, gain);
    const double k = condition(big(s));
    expect_near(big(factor.solve(b)), inverse_times(big(s), big(b)), k, "solve");
    expect_near(big(gain), inverse_times(big(s).transpose(), big(w).transpose()).transpose(), k,
                "right_solve");
    const Big product = inverse_times(big(s), big(w).transpose());
    expect_near(big(scaled) * big(v).transpose(), big(w) * product, k, "scaled vT");
    const Big quadratic = big(b).transpose() * inverse_times(big(s), big(b));
    EXPECT_NEAR(factor.squared_norm(b), static_cast<double>(quadratic(0, 0)),
                20 * 2.3e-16 * k * static_cast<double>(quadratic(0, 0)));
  }
}

template <int p>
void general_solves() {
  constexpr int n = 5;
  for (int run = 0; run < 20; ++run) {
    jml::Noise noise(static_cast<unsigned>(2000 * p + run));
    jml::Matrix<double, p, p> s = models::random_matrix<p, p>(noise);
    if (p > 1) s(0, 0) = 0;  // only an exchange of columns can go on
    const auto w = models::random_matrix<n, p>(noise);
    const auto b = models::random_matrix<p, 1>(noise);
    const double k = condition(big(s));
    jml::kernel::GeneralFactor<double, p> factor;
    ASSERT_TRUE(factor.factor(s, jml::Vector<double, p>::Ones()));
    jml::Matrix<double, n, p> gain;
    factor.right_solve(w, gain);
    expect_near(big(factor.solve(b)), inverse_times(big(s), big(b)), k, "solve");
    expect_near(big(gain), inverse_times(big(s).transpose(), big(w).transpose()).transpose(), k,
                "right_solve");
  }
}

TEST(SymmetricFactor, SolvesOneToSeven) {
  symmetric_solves<1>();
  symmetric_solves<2>();
  symmetric_solves<3>();
  symmetric_solves<4>();
  symmetric_solves<5>();
  symmetric_solves<6>();
  symmetric_solves<7>();
}

TEST(GeneralFactor, SolvesOneToSeven) {
  general_solves<1>();
  general_solves<2>();
  general_solves<3>();
  general_solves<4>();
  general_solves<5>();
  general_solves<6>();
  general_solves<7>();
}

using Matrix3 = jml::Matrix<double, 3, 3>;
using Vector3 = jml::Vector<double, 3>;
const Vector3 unit_choices[] = {
    {1, 1, 1}, {1e8, 1, 1e-8}, {1e-8, 1e8, 1}, {1, 1e-8, 1e8}, {1e-6, 1e-6, 1e-6}};

Matrix3 in_units(const Matrix3& a, const Vector3& d) { return d.asDiagonal() * a * d.asDiagonal(); }

bool symmetric_factors(const Matrix3& s) {
  jml::kernel::SymmetricFactor<double, 3> factor;
  return factor.factor(s);
}
bool general_factors(const Matrix3& s, const Vector3& scale) {
  jml::kernel::GeneralFactor<double, 3> factor;
  return factor.factor(s, scale);
}

TEST(SymmetricFactor, SingularAndIndefiniteAreNamedInAnyUnits) {
  Matrix3 rank_two, indefinite, good;
  rank_two << 5, 4, 9, 4, 5, 9, 9, 9, 18;    // u uᵀ + v vᵀ, u = (2,1,3), v = (1,2,3)
  indefinite << 1, 2, 0, 2, 1, 0, 0, 0, 1;   // eigenvalues 3, -1, 1
  good << 5, 4, 9, 4, 5, 9, 9, 9, 18.00001;  // the same plane and a little more: regular
  for (const auto& units : unit_choices) {
    SCOPED_TRACE(units.transpose());
    EXPECT_FALSE(symmetric_factors(in_units(rank_two, units)));
    EXPECT_FALSE(symmetric_factors(in_units(indefinite, units)));
    EXPECT_TRUE(symmetric_factors(in_units(good, units)));
  }
  EXPECT_FALSE(symmetric_factors(Matrix3::Zero()));
  EXPECT_FALSE(symmetric_factors(-good));
}

TEST(GeneralFactor, SingularIsNamedInAnyUnits) {
  Matrix3 singular, good;
  singular << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  good << 1, 2, 3, 4, 5, 6, 7, 8, 9.00001;
  for (const auto& units : unit_choices) {
    SCOPED_TRACE(units.transpose());
    EXPECT_FALSE(general_factors(in_units(singular, units), units));
    EXPECT_TRUE(general_factors(in_units(good, units), units));
  }
  EXPECT_FALSE(general_factors(Matrix3::Zero(), Vector3::Ones()));
}

TEST(GeneralFactor, NegativeAndZeroPivotsAreRegular) {
  Matrix3 a;
  a << 0, 0, -2, 3, 0, 0, 0, -5, 0;  // a signed permutation
  jml::kernel::GeneralFactor<double, 3> factor;
  ASSERT_TRUE(factor.factor(a, Vector3::Ones()));
  const Vector3 x = factor.solve(Vector3(-2, 3, -5));
  EXPECT_EQ(x, Vector3(1, 1, 1));
}

TEST(Factors, NotANumberIsNotRegular) {
  for (int j = 0; j < 3; ++j) {
    for (int i = j; i < 3; ++i) {
      Matrix3 a = 2 * Matrix3::Identity();
      a(i, j) = a(j, i) = std::numeric_limits<double>::quiet_NaN();
      EXPECT_FALSE(symmetric_factors(a)) << i << j;
      EXPECT_FALSE(general_factors(a, Vector3::Ones())) << i << j;
    }
  }
}

/// Of rank one but for the rounding of its entries, which leaves a pivot above zero as often as not.
template <int p>
jml::Matrix<double, p, p> rounded_rank_one(jml::Noise& noise) {
  const auto u = noise.normal_vector<p>();
  jml::Matrix<double, p, p> s;
  for (int i = 0; i < p; ++i) {
    for (int j = 0; j < p; ++j) s(i, j) = u(i) * u(j);
  }
  return s;
}

TEST(SymmetricFactor, OfOneAndTwoRowsSingularAndOverflowingAreNamed) {
  jml::kernel::SymmetricFactor<double, 1> one;
  EXPECT_FALSE(one.factor(jml::Matrix<double, 1, 1>(std::numeric_limits<double>::infinity())));
  EXPECT_TRUE(one.factor(jml::Matrix<double, 1, 1>(1e-300)));
  jml::kernel::SymmetricFactor<double, 2> two;
  EXPECT_FALSE(two.factor(1e200 * jml::Matrix<double, 2, 2>::Identity())) << "1/D would be zero";
  jml::Noise noise(71);
  int positive = 0;
  for (int run = 0; run < 100; ++run) {
    const auto s = rounded_rank_one<2>(noise);
    positive += s(0, 0) * s(1, 1) - s(1, 0) * s(1, 0) > 0;
    EXPECT_FALSE(two.factor(s)) << s;
  }
  EXPECT_GT(positive, 5);
}

// A pivot is judged by the unit of its component, and by the entry that it is left of.
TEST(GeneralFactor, PivotsThatAreNoneByTheUnitOrByTheEntry) {
  jml::kernel::GeneralFactor<double, 1> one;
  using Number = jml::Vector<double, 1>;
  EXPECT_FALSE(one.factor(jml::Matrix<double, 1, 1>(-1e-16), Number(1)));
  EXPECT_TRUE(one.factor(jml::Matrix<double, 1, 1>(-1e-16), Number(1e-16)));
  Matrix3 small = Matrix3::Identity();
  small(2, 2) = 1e-16;
  EXPECT_FALSE(general_factors(small, Vector3::Ones()));
  EXPECT_TRUE(general_factors(small, Vector3(1, 1, 1e-8)));
  Matrix3 singular;
  singular << 1, 2, 3, 4, 5, 6, 7, 8, 9;
  for (const double size : {1e10, 1e10 / 3, 1e10 / 7, 1e10 / 11}) {
    EXPECT_FALSE(general_factors(size * singular, Vector3::Ones())) << size;
  }
}

TEST(SemidefiniteFactor, RankOfWhatIsRounded) {
  jml::Noise noise(72);
  for (int run = 0; run < 100; ++run) {
    const auto u = noise.normal_vector<3>(), v = noise.normal_vector<3>();
    const Matrix3 P = u * u.transpose() + v * v.transpose();
    const jml::kernel::SemidefiniteFactor<double, 3> factor(P);
    EXPECT_EQ(factor.rank, 2) << P;
    EXPECT_LT((factor.L * factor.L.transpose() - P).norm(), 1e-14 * P.norm());
    // bᵀ P⁺ b = 5 of b = u + 2 v, and nothing of what is off their plane.
    double squared = 0;
    const Vector3 slack = Vector3::Constant(1e-9), b = u + 2 * v, off = u.cross(v);
    EXPECT_TRUE(factor.squared_norm(b, slack, squared));
    EXPECT_NEAR(squared, 5, 1e-9);
    EXPECT_FALSE(factor.squared_norm(b + off, slack, squared));
  }
}

}  // namespace
