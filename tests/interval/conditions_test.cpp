// SPDX-License-Identifier: BSD-3-Clause
// x and every P that FixedLag, Batch and Smoother hand out over conditions of the problem from 1 to 1e30 and
// more, against an information smoother in 113 bits that shares nothing with the library: all states of the
// interval stacked, (Σ hᵀh / r)⁻¹ by Cholesky. And starts of which nothing is known.
#include <gtest/gtest.h>

#include <cstdio>
#include <jml/interval/batch.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <jml/interval/smoother.hpp>
#include <vector>

#include "models/linear.hpp"

namespace {

using namespace jml::operators;

using Big = __float128;
using jml::Matrix, jml::Vector, jml::Status;
constexpr double infinite = std::numeric_limits<double>::infinity();

Big root(Big a) {
  Big x = static_cast<Big>(std::sqrt(static_cast<double>(a)));
  for (int i = 0; i < 3 && x > 0; ++i) x = (x + a / x) / 2;
  return x;
}

/// Regular normal equations in 113 bits: rows, of unit variance, of `size` unknowns.
class Normal {
 public:
  explicit Normal(int size) : n_(size), A_(static_cast<std::size_t>(size * size)), b_(static_cast<std::size_t>(size)) {}
  void add(const std::vector<Big>& row, Big y) {
    for (int i = 0; i < n_; ++i) {
      if (row[at(i)] == 0) continue;
      b_[at(i)] += row[at(i)] * y;
      for (int j = 0; j < n_; ++j) A_[at(i * n_ + j)] += row[at(i)] * row[at(j)];
    }
  }
  /// False where they are singular. Then x(), and P of a block.
  bool solve() {
    for (int j = 0; j < n_; ++j) {
      const Big whole = A_[at(j * n_ + j)];
      for (int i = j; i < n_; ++i) {
        Big sum = A_[at(i * n_ + j)];
        for (int k = 0; k < j; ++k) sum -= A_[at(i * n_ + k)] * A_[at(j * n_ + k)];
        if (i == j && !(sum > 1e-30 * whole)) return false;
        A_[at(i * n_ + j)] = i == j ? root(sum) : sum / A_[at(j * n_ + j)];
      }
    }
    x_ = back(forward(b_));
    return true;
  }
  [[nodiscard]] Big x(int i) const { return x_[at(i)]; }
  [[nodiscard]] std::vector<Big> column(int i) const {
    std::vector<Big> unit(at(n_));
    unit[at(i)] = 1;
    return back(forward(unit));
  }

 private:
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  [[nodiscard]] std::vector<Big> forward(std::vector<Big> z) const {
    for (int i = 0; i < n_; ++i) {
      for (int k = 0; k < i; ++k) z[at(i)] -= A_[at(i * n_ + k)] * z[at(k)];
      z[at(i)] /= A_[at(i * n_ + i)];
    }
    return z;
  }
  [[nodiscard]] std::vector<Big> back(std::vector<Big> z) const {
    for (int i = n_ - 1; i >= 0; --i) {
      for (int k = i + 1; k < n_; ++k) z[at(i)] -= A_[at(k * n_ + i)] * z[at(k)];
      z[at(i)] /= A_[at(i * n_ + i)];
    }
    return z;
  }

  int n_;
  std::vector<Big> A_, b_, x_;
};

/// F x + w, y = H x + v with diagonal P_0 (0 < ≤ ∞), Q (0 where q is) and R.
template <int n>
struct Problem {
  Matrix<double, n, n> F = Matrix<double, n, n>::Identity();
  Vector<double, n> P0, q, x0 = Vector<double, n>::Zero();
  Matrix<double, 1, n> H;
  double r = 1;
  std::vector<double> y;
};

/// What is right: x and P of node `node` of steps + 1, given y_0 … y_steps; a noise-free state is no unknown.
template <int n>
struct Truth {
  Vector<Big, n> x;
  Matrix<Big, n, n> P;
  bool found = false;
};
template <int n>
Truth<n> truth(const Problem<n>& problem, int steps, int node) {
  constexpr auto at = [](int i) { return static_cast<std::size_t>(i); };
  // Unknowns: x_0, then w_k / √q of the states that have noise.
  std::vector<int> noisy;
  for (int i = 0; i < n; ++i) {
    if (problem.q(i) > 0) noisy.push_back(i);
  }
  const int q = static_cast<int>(noisy.size()), size = n + steps * q;
  Normal normal(size);
  std::vector<std::vector<Big>> map(n, std::vector<Big>(at(size))), kept;
  for (int i = 0; i < n; ++i) {
    map[at(i)][at(i)] = 1;
    if (problem.P0(i) < infinite) {
      std::vector<Big> row(at(size));
      row[at(i)] = 1 / root(static_cast<Big>(problem.P0(i)));
      normal.add(row, row[at(i)] * static_cast<Big>(problem.x0(i)));
    }
  }
  for (int k = n; k < size; ++k) {
    std::vector<Big> row(at(size));
    row[at(k)] = 1;
    normal.add(row, 0);
  }
  for (int k = 0; k <= steps; ++k) {
    if (k > 0) {
      std::vector<std::vector<Big>> next(n, std::vector<Big>(at(size)));
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < n; ++j) {
          for (int u = 0; u < size; ++u) next[at(i)][at(u)] += static_cast<Big>(problem.F(i, j)) * map[at(j)][at(u)];
        }
      }
      map = next;
      for (int l = 0; l < q; ++l)
        map[at(noisy[at(l)])][at(n + (k - 1) * q + l)] += root(static_cast<Big>(problem.q(noisy[at(l)])));
    }
    if (k == node) kept = map;
    const Big weight = 1 / root(static_cast<Big>(problem.r));
    std::vector<Big> row(at(size));
    for (int i = 0; i < n; ++i) {
      for (int u = 0; u < size; ++u) row[at(u)] += weight * static_cast<Big>(problem.H(0, i)) * map[at(i)][at(u)];
    }
    normal.add(row, weight * static_cast<Big>(problem.y[at(k)]));
  }
  Truth<n> out;
  out.found = normal.solve();
  if (!out.found) return out;
  std::vector<std::vector<Big>> columns(at(size));
  for (int u = 0; u < size; ++u) columns[at(u)] = normal.column(u);
  for (int i = 0; i < n; ++i) {
    out.x(i) = 0;
    for (int u = 0; u < size; ++u) out.x(i) += kept[at(i)][at(u)] * normal.x(u);
    for (int j = 0; j < n; ++j) {
      out.P(i, j) = 0;
      for (int u = 0; u < size; ++u) {
        if (kept[at(i)][at(u)] == 0) continue;
        for (int v = 0; v < size; ++v)
          out.P(i, j) += kept[at(i)][at(u)] * columns[at(u)][at(v)] * kept[at(j)][at(v)];
      }
    }
  }
  return out;
}

/// The largest entry of L⁻¹ (P - P_ref) L⁻ᵀ, P_ref = L Lᵀ, times n: no eigenvalue is larger. And of x: (x -
/// x_ref) in standard deviations beyond 64 ε max |x|, by L⁻¹ too.
struct Errors {
  double x = 0, P = 0;
  void note(const Errors& other) {
    x = other.x > x || other.x != other.x ? other.x : x;
    P = other.P > P || other.P != other.P ? other.P : P;
  }
};
template <int n>
Matrix<Big, n, n> whiten(const Truth<n>& right) {
  Matrix<Big, n, n> L, inverse;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) L(i, j) = inverse(i, j) = 0;
  }
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i) {
      Big sum = right.P(i, j);
      for (int k = 0; k < j; ++k) sum -= L(i, k) * L(j, k);
      L(i, j) = i == j ? root(sum) : sum / L(j, j);
    }
  }
  for (int j = 0; j < n; ++j) {
    for (int i = j; i < n; ++i) {
      Big sum = i == j ? 1 : 0;
      for (int k = j; k < i; ++k) sum -= L(i, k) * inverse(k, j);
      inverse(i, j) = sum / L(i, i);
    }
  }
  return inverse;
}
template <int n, typename Number>
double error_of(const Truth<n>& right, const Matrix<Number, n, n>& P) {
  const auto W = whiten(right);
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      Big sum = 0;
      for (int k = 0; k < n; ++k) {
        for (int l = 0; l < n; ++l) sum += W(i, k) * (static_cast<Big>(P(k, l)) - right.P(k, l)) * W(j, l);
      }
      const double size = std::abs(static_cast<double>(sum)) * n;
      if (!(size <= worst)) worst = size;
    }
  }
  return worst;
}
template <int n>
double distance_of(const Truth<n>& right, const Vector<double, n>& x) {
  const auto W = whiten(right);
  Big largest = 0;
  for (int i = 0; i < n; ++i) largest = std::max(largest, right.x(i) < 0 ? -right.x(i) : right.x(i));
  double worst = 0;
  for (int i = 0; i < n; ++i) {
    Big sum = 0, slack = 0;
    for (int k = 0; k < n; ++k) {
      sum += W(i, k) * (static_cast<Big>(x(k)) - right.x(k));
      slack += (W(i, k) < 0 ? -W(i, k) : W(i, k)) * largest * Big(64 * std::numeric_limits<double>::epsilon());
    }
    const double size = static_cast<double>((sum < 0 ? -sum : sum) - slack);
    if (!(size <= worst)) worst = size;
  }
  return worst;
}

/// A dense P is right, or NaN where its correlations are beyond 1e10.
template <int n>
void expect_right(const char* who, const Truth<n>& right, const Vector<double, n>& x, const Matrix<double, n, n>& P,
                  Errors& worst, int& lost) {
  SCOPED_TRACE(who);
  const double x_error = distance_of(right, x);
  EXPECT_LE(x_error, 1e-6);
  worst.note({x_error, 0});
  if (!jml::all_finite(P)) {
    const auto W = whiten(right);
    double spread = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j)
        spread = std::max(spread, static_cast<double>(W(i, j) * W(i, j) * right.P(j, j)));
    }
    EXPECT_GT(spread, 1e10);
    ++lost;
    return;
  }
  const double P_error = error_of(right, P);
  EXPECT_LE(P_error, 1e-3);
  worst.note({0, P_error});
}

template <int n>
struct Row {
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  Matrix<double, 1, n> H;
  double r;
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, n>& x) const {
    T sum(0.0);
    for (int i = 0; i < n; ++i) sum += H(0, i) * x(i);
    return Vector<T, 1>(sum);
  }
  Matrix<double, 1, 1> noise_covariance() const { return Matrix<double, 1, 1>(r); }
};

template <int n>
models::LinearDynamics<n, n> model_of(const Problem<n>& problem) {
  models::LinearDynamics<n, n> d;
  d.F = problem.F;
  d.G = Matrix<double, n, n>::Identity();
  d.Q = problem.q.asDiagonal();
  return d;
}

/// All three, over the whole interval; the window full and sliding from `length` on.
template <int n>
void run(const Problem<n>& problem, Errors& worst, int& lost) {
  constexpr int length = 4;
  const int steps = static_cast<int>(problem.y.size()) - 1;
  const Row<n> sensor{problem.H, problem.r};
  const auto d = model_of(problem);
  Matrix<double, n, n> P0 = Matrix<double, n, n>::Zero();
  for (int i = 0; i < n; ++i) P0(i, i) = problem.P0(i);
  const jml::Estimate<double, n> start{problem.x0, P0};
  jml::Filter lag{jml::Factored{jml::FixedLag<length>{}}, d, jml::sensors<Row<n>>, start};
  jml::Batch batch{d, jml::sensors<Row<n>>, start, {steps}};
  jml::Smoother smoother{jml::Filter{jml::Factored{jml::Kalman{}}, d, start}, steps};
  for (int k = 0; k <= steps; ++k) {
    const double y = problem.y[static_cast<std::size_t>(k)];
    const Status status = k == 0 ? lag.update(sensor, y).status : lag.step(sensor, y).status;
    ASSERT_TRUE(jml::usable(status)) << k << " " << jml::describe(status);
    ASSERT_EQ(k == 0 ? batch.update(sensor, y).status : batch.step(sensor, y).status, Status::ok);
    const Status forward = k == 0 ? smoother.update(sensor, y).status : smoother.step(sensor, y).status;
    ASSERT_EQ(forward, Status::ok) << k << " " << jml::describe(forward);
    for (int age = 0; age <= lag.depth(); age += 2) {
      const Truth<n> right = truth(problem, k, k - age);
      if (right.found) {
        expect_right("lag", right, lag.x(age), lag.P(age), worst, lost);
      } else {  // some state is not determined yet
        EXPECT_TRUE(jml::all_finite(lag.x(age)));
        EXPECT_EQ(lag.P(age).diagonal().maxCoeff(), infinite);
      }
    }
  }
  const auto report = batch.solve();
  ASSERT_TRUE(jml::usable(report.status)) << jml::describe(report.status);
  static_cast<void>(smoother.smooth());
  for (int k = 0; k <= steps; k += 3) {
    const Truth<n> right = truth(problem, steps, k);
    ASSERT_TRUE(right.found);
    expect_right("batch", right, batch.x(k), batch.P(k), worst, lost);
    expect_right("smoother", right, smoother.x(k), smoother.P(k), worst, lost);
    const auto& factors = smoother.smoothed(k);
    Matrix<Big, n, n> P;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        P(i, j) = 0;
        for (int l = 0; l < n; ++l) {
          const auto u = [&](int row) {
            return static_cast<Big>(factors.U(row, l)) + (factors.extended && row != l ? static_cast<Big>(factors.U_low(row, l)) : 0);
          };
          P(i, j) += u(i) * u(j) * (static_cast<Big>(factors.D(l)) + (factors.extended ? static_cast<Big>(factors.D_low(l)) : 0));
        }
      }
    }
    EXPECT_LE(error_of(right, P), 1e-5) << "factors of node " << k;
  }
}

enum class Kind { still, velocity, slow_velocity, acceleration };

template <int n>
Problem<n> problem_of(Kind kind, double P0, double r, double q, int steps) {
  Problem<n> out;
  jml::Noise noise(static_cast<unsigned>(n) + 7);
  const double dt = kind == Kind::slow_velocity ? 1e-3 : 1;
  for (int i = 0; i < n; ++i) {
    for (int j = i + 1; j < n && kind != Kind::still; ++j) out.F(i, j) = j == i + 1 ? dt : dt * dt / 2;
    out.H(0, i) = kind == Kind::still || i == 0 ? 1 : 0;
    out.P0(i) = P0;
    out.q(i) = i == n - 1 ? q : 0;
  }
  if (kind == Kind::still) {  // states that are told apart by how they move alone
    for (int i = 0; i < n; ++i) out.F(i, i) = 1 - 0.25 * i;
  }
  Vector<double, n> x = 3 * noise.normal_vector<n>();
  out.y.push_back((out.H * x)(0) + std::sqrt(r) * noise.normal());
  for (int k = 0; k < steps; ++k) {
    x = (out.F * x).eval();
    x(n - 1) += std::sqrt(q) * noise.normal();
    out.y.push_back((out.H * x)(0) + std::sqrt(r) * noise.normal());
  }
  return out;
}

template <int n>
void family(const char* name, std::initializer_list<Kind> kinds, std::initializer_list<double> priors,
            std::initializer_list<double> rs, std::initializer_list<double> qs) {
  Errors worst;
  int lost = 0;
  for (const Kind kind : kinds) {
    for (const double P0 : priors) {
      for (const double r : rs) {
        for (const double q : qs) {
          SCOPED_TRACE(testing::Message() << name << " " << static_cast<int>(kind) << ", P_0 " << P0 << ", R " << r << ", Q " << q);
          run(problem_of<n>(kind, P0, r, q, 9), worst, lost);
          if (testing::Test::HasFatalFailure()) return;
        }
      }
    }
  }
  std::printf("%s: x %.1e, P %.1e, %d of P lost\n", name, worst.x, worst.P, lost);
}

// P_0 = 1e20 I, R = 1: FixedLag and Batch never began.
TEST(Conditions, WidePriors) {
  family<1>("one state", {Kind::still}, {1e6, 1e12, 1e20, 1e24}, {1e-6, 1, 1e6}, {1e-2, 0});
  family<2>("two states", {Kind::still, Kind::velocity}, {1e6, 1e12, 1e20, 1e24}, {1e-6, 1, 1e6}, {1e-2, 0});
  family<3>("three states", {Kind::still, Kind::acceleration}, {1e6, 1e12, 1e20, 1e24}, {1e-6, 1, 1e6}, {1e-2});
}

TEST(Conditions, SmallNoise) {
  family<2>("slow", {Kind::slow_velocity}, {1e-3, 1e3, 1e9}, {1e-14, 1e-6}, {1e-20, 1e-9, 1, 1e12});
  family<2>("fast", {Kind::velocity}, {1e-8, 1, 1e8}, {1e-20, 1e-10, 1},
            {1e-16, 1, 1e14});  // from 1e16 on y is finer than the digits of x
}

// The limit of P_0 → ∞ itself: until the data determine a state it stands at its prior mean, with an infinite
// variance.
TEST(Conditions, NothingKnown) {
  family<1>("one state unknown", {Kind::still}, {infinite}, {1e-6, 1, 1e6}, {1e-2, 0});
  family<2>("two states unknown", {Kind::still, Kind::velocity}, {infinite}, {1e-6, 1, 1e6}, {1e-2, 0});
  family<3>("three states unknown", {Kind::still, Kind::acceleration}, {infinite}, {1e-6, 1, 1e6}, {1e-2});
  Errors worst;
  int lost = 0;
  auto mixed = problem_of<3>(Kind::acceleration, 1, 1, 1e-2, 9);
  mixed.P0(2) = infinite;
  mixed.x0 << 1, 7, -1;
  run(mixed, worst, lost);
}

}  // namespace
