// SPDX-License-Identifier: BSD-3-Clause
// The judge of the covariance generator is judged: against the whole flight as one Gaussian vector (the prior's and
// all disturbances' whitened unknowns), conditioned on one row of measurements after another, in the same 113 bits
// but with no recursion in time. And against numbers that can be had by hand.
#include <gtest/gtest.h>

#include "rounding/flight.hpp"
#include "rounding/problems.hpp"

namespace {

using namespace rounding;

/// x of every move is centre + A u, u ~ (0, I) before any measurement, (mean, S Sᵀ) after.
class WholeFlight {
 public:
  explicit WholeFlight(const Problem& problem) : problem_(problem), n_(problem.n), B_(problem.noise_root()) {
    const QuadMatrix root = problem.prior_root();
    std::size_t moves = 0;
    for (const Event& event : problem.events) moves += event.moves;
    size_ = static_cast<std::size_t>(n_) * (moves + 1);
    mean_.assign(size_, 0);
    S_.assign(size_ * size_, 0);
    for (std::size_t i = 0; i < size_; ++i) S_[i * size_ + i] = 1;
    Node start{{}, std::vector<Quad>(static_cast<std::size_t>(n_) * size_, 0)};
    for (int i = 0; i < n_; ++i) {
      start.centre[i] = problem.x0[static_cast<std::size_t>(i)];
      for (int j = 0; j < n_; ++j) at(start, i, static_cast<std::size_t>(j)) = root[i][j];
    }
    nodes_.push_back(start);
    for (const Event& event : problem.events) {
      if (event.moves) move();
      if (event.rows == Rows::none) continue;
      const auto& sensor = problem.sensors[static_cast<std::size_t>(event.sensor)];
      Square R = sensor.R;
      for (int i = 0; i < problem.p; ++i) {
        for (int j = 0; j < problem.p; ++j) {
          if (event.rows == Rows::apart && i != j) R[static_cast<std::size_t>(i * problem.p + j)] = 0;
        }
      }
      for (const ExactRow& row : independent_rows(sensor.H.data(), R.data(), event.y.data(), problem.p, n_)) measure(row);
    }
  }

  [[nodiscard]] std::size_t nodes() const { return nodes_.size(); }
  /// Of a node, given all measurements.
  [[nodiscard]] Shown shown(std::size_t node) const {
    const Node& of = nodes_[node];
    std::vector<Quad> root(static_cast<std::size_t>(n_) * size_, 0);
    Shown out;
    for (int i = 0; i < n_; ++i) {
      out.x[i] = of.centre[i];
      for (std::size_t k = 0; k < size_; ++k) {
        out.x[i] += at(of, i, k) * mean_[k];
        for (std::size_t j = 0; j <= k; ++j) root[static_cast<std::size_t>(i) * size_ + j] += at(of, i, k) * S_[k * size_ + j];
      }
    }
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j < n_; ++j) {
        for (std::size_t k = 0; k < size_; ++k)  // the same sum for (i, j) and (j, i)
          out.P[i][j] += root[static_cast<std::size_t>(i) * size_ + k] * root[static_cast<std::size_t>(j) * size_ + k];
      }
    }
    return out;
  }

 private:
  struct Node {
    QuadVector centre{};
    std::vector<Quad> A;  // n×size
  };
  Quad& at(Node& node, int i, std::size_t k) const { return node.A[static_cast<std::size_t>(i) * size_ + k]; }
  const Quad& at(const Node& node, int i, std::size_t k) const { return node.A[static_cast<std::size_t>(i) * size_ + k]; }

  void move() {
    const Node before = nodes_.back();
    Node next{{}, std::vector<Quad>(before.A.size(), 0)};
    const std::size_t place = static_cast<std::size_t>(n_) * nodes_.size();
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j < n_; ++j) {
        const Quad f = problem_.F[static_cast<std::size_t>(i * n_ + j)];
        next.centre[i] += f * before.centre[j];
        for (std::size_t k = 0; k < place; ++k) at(next, i, k) += f * at(before, j, k);
        at(next, i, place + static_cast<std::size_t>(j)) = B_[i][j];
      }
    }
    nodes_.push_back(next);
  }
  void measure(const ExactRow& row) {
    const Node& node = nodes_.back();
    std::vector<Quad> h(size_, 0), f(size_, 0), gain(size_, 0);
    Quad innovation = row.y;
    for (int i = 0; i < n_; ++i) {
      innovation -= row.h[i] * node.centre[i];
      for (std::size_t k = 0; k < size_; ++k) h[k] += row.h[i] * at(node, i, k);
    }
    for (std::size_t i = 0; i < size_; ++i) {
      innovation -= h[i] * mean_[i];
      for (std::size_t j = 0; j <= i; ++j) f[j] += h[i] * S_[i * size_ + j];
    }
    Quad head = sqrtq(row.r);
    for (std::size_t j = size_; j-- > 0;) {
      if (f[j] == 0) continue;
      const Quad length = sqrtq(head * head + f[j] * f[j]), c = head / length, s = f[j] / length;
      head = length;
      for (std::size_t i = j; i < size_; ++i) {
        const Quad g = gain[i], column = S_[i * size_ + j];
        gain[i] = c * g + s * column;
        S_[i * size_ + j] = c * column - s * g;
      }
    }
    for (std::size_t i = 0; i < size_; ++i) mean_[i] += gain[i] / head * innovation;
  }

  const Problem& problem_;
  int n_;
  QuadMatrix B_;
  std::size_t size_ = 0;
  std::vector<Quad> mean_, S_;
  std::vector<Node> nodes_;
};

struct Worst {
  double regular = 0, singular = 0, x = 0;
  int of_regular = 0, of_singular = 0;
};
/// Both references of all nodes of a problem.
void compare(const Problem& problem, Worst& worst) {
  const Flight flight(problem);
  const WholeFlight whole(problem);
  std::vector<int> nodes{Flight::prior()};
  for (int k = 0; k < flight.events(); ++k) {
    if (problem.events[static_cast<std::size_t>(k)].moves) nodes.push_back(0);
    nodes.back() = flight.end(k);
  }
  ASSERT_EQ(nodes.size(), whole.nodes());
  const bool singular = flight.last().singular || flight.last().inner > singular_from;
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const Errors errors = flight.smoothed_errors(whole.shown(k), nodes[k], nodes.back(), factored_bounds);
    worst.x = std::max(worst.x, errors.x);
    (singular ? worst.singular : worst.regular) = std::max(singular ? worst.singular : worst.regular, errors.P);
    ++(singular ? worst.of_singular : worst.of_regular);
  }
}

// Filter (the last node) and smoother (the others) agree with the whole flight at once, from condition 1 to singular.
TEST(Judge, AgreesWithTheWholeFlightAtOnce) {
  constexpr int sizes[5][2] = {{1, 1}, {2, 1}, {3, 2}, {6, 3}, {8, 4}};
  Worst worst;
  for (std::uint64_t number = 0; number < 300; ++number) {
    const auto [n, p] = sizes[number % 5];
    Problem problem = make_problem(5, number, n, p, false);
    problem.events.resize(std::min<std::size_t>(problem.events.size(), n > 3 ? 7 : 14));
    compare(problem, worst);
  }
  std::printf("P of %d regular nodes to %.1e, of %d singular ones to %.1e; x to %.1e\n", worst.of_regular, worst.regular,
              worst.of_singular, worst.singular, worst.x);
  EXPECT_GT(worst.of_regular, 1000);
  EXPECT_GT(worst.of_singular, 300);
  EXPECT_LT(worst.regular, 1e-9);
  EXPECT_LT(worst.singular, 1e-7);
  EXPECT_LT(worst.x, 1e-9);
}

/// A judge that finds nothing wrong is none: errors of a known size, and where they lie.
TEST(Judge, MeasuresAnErrorInEveryDirection) {
  Moments exact;
  exact.n = 3;
  exact.S[0][0] = 1;
  exact.S[1][0] = 1;
  exact.S[1][1] = 1e-9;
  exact.S[2][0] = -1;
  exact.S[2][1] = 1e-9;
  exact.S[2][2] = 1e-10;
  exact.set_sizes();
  const QuadMatrix P = exact.P();
  EXPECT_EQ(covariance_error(P, P, exact), 0);
  EXPECT_NEAR(condition_of(exact).of_P, 4e20, 1e19);
  for (const double e : {1e-9, 1e-5, 0.5}) {
    QuadMatrix all = P, least = P;
    for (auto& row : all) {
      for (auto& entry : row) entry *= 1 + Quad(e);
    }
    QuadMatrix skew = P;
    skew[0][2] *= 1 + Quad(e);
    EXPECT_EQ(covariance_error(skew, P, exact), infinite);
    least[2][2] += e * Quad(1e-10) * Quad(1e-10);  // nothing beside P_22, but all that is left given the others
    EXPECT_NEAR(covariance_error(all, P, exact) / e, 1, 1e-4);
    EXPECT_NEAR(covariance_error(least, P, exact) / e, 1, 1e-4);
  }
  QuadVector x{};
  EXPECT_EQ(state_error(x, exact, 0, 1e-6), 0);
  x[2] = 1e-13;
  EXPECT_NEAR(state_error(x, exact, 0, 1e-6), 1e-3, 1e-9);
  EXPECT_LE(state_error(x, exact, 1e-12, 1e-6), 1e-6);  // within the slack of every component
  exact.S[2] = {};
  EXPECT_EQ(covariance_error(P, exact.P(), exact), infinite);  // a known state with a variance
}

}  // namespace
