// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An interval of a linear system within bounds as a dense quadratic programme in ξ = (x_0 - x̂_0, w_0, w_1,
/// …), solved by its dual in long double: min ½ λᵀMλ + sᵀλ over λ ≥ 0, by the active sets of Lawson and
/// Hanson.
#pragma once

#include <vector>

#include "interval/dense_solve.hpp"

namespace bounds_tests {

using Big = batch_tests::Dense<long double>;
using batch_tests::forward_solve, batch_tests::lower_root, batch_tests::times, batch_tests::transposed_times;

template <typename Derived>
Big big(const Eigen::MatrixBase<Derived>& a) {
  Big out(a.rows(), a.cols());
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    for (Eigen::Index i = 0; i < a.rows(); ++i) out(i, j) = static_cast<long double>(a(i, j));
  }
  return out;
}

/// X with Lᵀ X = b.
inline Big backward_solve(const Big& L, Big b) {
  for (Eigen::Index j = 0; j < b.cols(); ++j) {
    for (Eigen::Index i = L.rows() - 1; i >= 0; --i) {
      for (Eigen::Index k = i + 1; k < L.rows(); ++k) b(i, j) -= L(k, i) * b(k, j);
      b(i, j) /= L(i, i);
    }
  }
  return b;
}
inline Big inverse(const Big& a) {
  const Big L = lower_root(a);
  return backward_solve(L, forward_solve(L, Big(Big::Identity(a.rows(), a.rows()))));
}

/// λ ≥ 0 of least ½ λᵀMλ + sᵀλ.
inline std::vector<long double> non_negative(const Big& M, const Big& s) {
  const auto size = static_cast<std::size_t>(s.rows());
  std::vector<long double> lambda(size, 0);
  std::vector<Eigen::Index> active;
  const auto solve = [&] {
    const auto count = static_cast<Eigen::Index>(active.size());
    Big part(count, count), right(count, 1);
    for (Eigen::Index i = 0; i < count; ++i) {
      right(i, 0) = -s(active[static_cast<std::size_t>(i)], 0);
      for (Eigen::Index j = 0; j < count; ++j)
        part(i, j) = M(active[static_cast<std::size_t>(i)], active[static_cast<std::size_t>(j)]);
    }
    const Big L = lower_root(part);
    return backward_solve(L, forward_solve(L, right));
  };
  for (int changes = 0; changes < 1000; ++changes) {
    Eigen::Index enters = -1;
    long double steepest = -1e-15L;
    for (Eigen::Index i = 0; i < s.rows(); ++i) {
      long double slope = s(i, 0);
      for (const auto j : active) slope += M(i, j) * lambda[static_cast<std::size_t>(j)];
      bool in = false;
      for (const auto j : active) in = in || i == j;
      slope /= std::sqrt(M(i, i));
      if (!in && slope < steepest) {
        steepest = slope;
        enters = i;
      }
    }
    if (enters < 0) return lambda;
    active.push_back(enters);
    for (;;) {
      const Big z = solve();
      long double step = 1;
      for (std::size_t i = 0; i < active.size(); ++i) {
        const long double from = lambda[static_cast<std::size_t>(active[i])],
                          to = z(static_cast<Eigen::Index>(i), 0);
        if (to <= 0 && from / (from - to) < step) step = from / (from - to);
      }
      std::vector<Eigen::Index> stay;
      for (std::size_t i = 0; i < active.size(); ++i) {
        auto& value = lambda[static_cast<std::size_t>(active[i])];
        const long double to = z(static_cast<Eigen::Index>(i), 0);
        value += step * (to - value);
        if (step < 1 && to <= 0 && value < 1e-18L * (1 + std::abs(to))) value = 0;
        if (value > 0) stay.push_back(active[i]);
      }
      active = stay;
      if (step >= 1) break;
    }
  }
  return lambda;
}

/// x⁺ = F x + G w from x̂_0, P_0 (no rows: of x_0 nothing is known), with measurements; then bounds of any x_k
/// and w_k, and terms μᵀx_k, μᵀw_k.
class QuadraticProgramme {
 public:
  QuadraticProgramme(const Big& x0, const Big& P0, const Big& F, const Big& G, const Big& Q, int steps)
      : n_(x0.rows()), q_(Q.rows()), unknowns_(n_ + steps * q_), F_(F), G_(G), x0_(x0) {
    H_ = Big::Zero(unknowns_, unknowns_);
    g_ = Big::Zero(unknowns_, 1);
    if (P0.rows() > 0) H_.topLeftCorner(n_, n_) = inverse(P0);
    for (int k = 0; k < steps; ++k) H_.block(n_ + k * q_, n_ + k * q_, q_, q_) = inverse(Q);
    maps_.push_back(Big::Identity(n_, unknowns_));
    centres_.push_back(x0);
    for (int k = 0; k < steps; ++k) {
      Big map = times(F, maps_.back());
      map.middleCols(n_ + k * q_, q_) += G;
      maps_.push_back(map);
      centres_.push_back(times(F, centres_.back()));
    }
  }
  void measure(int node, const Big& M, const Big& R, const Big& y) {
    const Big map = times(M, x_map(node)), weight = inverse(R);
    const Big residual = y - times(M, centre(node));
    H_ += transposed_times(map, times(weight, map));
    g_ -= transposed_times(map, times(weight, residual));
    constant_ += transposed_times(residual, times(weight, residual))(0, 0) / 2;
  }
  void pull(int node, const Big& mu) { g_ += transposed_times(x_map(node), mu); }
  void pull_w(int step, const Big& mu) { g_ += transposed_times(w_map(step), mu); }

  void bound(int node, const Big& lower, const Big& upper) { add(x_map(node), centre(node), lower, upper); }
  void bound_w(int step, const Big& lower, const Big& upper) {
    add(w_map(step), Big::Zero(q_, 1), lower, upper);
  }
  /// Of the bound() or bound_w() number `which`: λ of component i, positive at an upper bound.
  [[nodiscard]] double multiplier(int which, int i) const {
    const auto at = static_cast<std::size_t>(first_[static_cast<std::size_t>(which)] + 2 * i);
    return static_cast<double>(lambda_[at + 1] - lambda_[at]);
  }
  void solve() {
    const Big L = lower_root(H_), free = forward_solve(L, Big(-g_)),
              half = forward_solve(L, Big(C_.transpose()));
    const Big M = transposed_times(half, half), s = d_ - transposed_times(half, free);
    lambda_ = non_negative(M, s);
    Big y = free;
    for (Eigen::Index i = 0; i < s.rows(); ++i) y -= half.col(i) * lambda_[static_cast<std::size_t>(i)];
    xi_ = backward_solve(L, y);
    cost_ = constant_ + transposed_times(xi_, Big(times(H_, xi_) / 2 + g_))(0, 0);
  }
  [[nodiscard]] double cost() const { return static_cast<double>(cost_); }
  [[nodiscard]] Eigen::VectorXd x(int k) const { return (centre(k) + times(x_map(k), xi_)).cast<double>(); }
  [[nodiscard]] Eigen::VectorXd w(int k) const { return times(w_map(k), xi_).cast<double>(); }

 private:
  [[nodiscard]] const Big& x_map(int k) const { return maps_[static_cast<std::size_t>(k)]; }
  [[nodiscard]] const Big& centre(int k) const { return centres_[static_cast<std::size_t>(k)]; }
  [[nodiscard]] Big w_map(int k) const {
    Big map = Big::Zero(q_, unknowns_);
    for (Eigen::Index i = 0; i < q_; ++i) map(i, n_ + k * q_ + i) = 1;
    return map;
  }
  /// C ξ ≤ d, two rows a component; an infinite bound becomes a distant one.
  void add(const Big& map, const Big& centre, const Big& lower, const Big& upper) {
    const Eigen::Index rows = C_.rows(), more = map.rows();
    first_.push_back(rows);
    C_.conservativeResize(rows + 2 * more, unknowns_);
    d_.conservativeResize(rows + 2 * more, 1);
    for (Eigen::Index i = 0; i < more; ++i) {
      C_.row(rows + 2 * i) = -map.row(i);
      C_.row(rows + 2 * i + 1) = map.row(i);
      d_(rows + 2 * i, 0) = centre(i, 0) - std::max(lower(i, 0), -1e6L);
      d_(rows + 2 * i + 1, 0) = std::min(upper(i, 0), 1e6L) - centre(i, 0);
    }
  }

  Eigen::Index n_, q_, unknowns_;
  Big F_, G_, x0_, H_, g_, C_{0, 0}, d_{0, 1}, xi_;
  std::vector<Big> maps_, centres_;
  std::vector<Eigen::Index> first_;
  std::vector<long double> lambda_;
  long double constant_ = 0, cost_ = 0;
};

}  // namespace bounds_tests
