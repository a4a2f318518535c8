// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the whole-interval estimate costs when somebody writes it by hand for the Van der Pol oscillator
/// alone: n = 2, q = 2, p = 1, one measurement a step, constant noise, plain numbers, nothing checked. The
/// same two passes, the same damping-free Newton steps with the second derivatives worked out on paper.
#pragma once

#include <cmath>
#include <jml/estimate.hpp>
#include <models/van_der_pol.hpp>
#include <vector>

namespace limit {

struct BatchNode {
  double x[2][2], b[2][2];  // two trajectories: states and the whitened disturbances that lead to them
  double k[2], K[2][2];
  double y;
};

class Batch {
 public:
  Batch(const models::VanDerPolWhite& d, const models::SaturatingPosition& s,
        const jml::Estimate<double, 2>& prior)
      : d_(d), r_(1 / s.r) {
    const auto Q = d.disturbance_covariance();
    B_[0] = std::sqrt(Q(0, 0));
    B_[1] = Q(1, 0) / B_[0];
    B_[2] = std::sqrt(Q(1, 1) - B_[1] * B_[1]);
    L_[0] = std::sqrt(prior.P(0, 0));
    L_[1] = prior.P(1, 0) / L_[0];
    L_[2] = std::sqrt(prior.P(1, 1) - L_[1] * L_[1]);
    x0_[0] = prior.x(0);
    x0_[1] = prior.x(1);
  }
  std::vector<BatchNode> nodes;  // of the first, y is not used
  int iterations = 0;
  double cost = 0;

  /// From the states in nodes[j].x[0]; until the next step's root mean square is below `tolerance`.
  void solve(double tolerance, bool newton) {
    now_ = 0;
    iterations = 1;
    double decrease = backward<true, false>();
    cost = forward<true>();
    now_ = 1 - now_;
    const double unknowns = 2.0 * static_cast<double>(nodes.size());
    for (bool full = newton;;) {
      ++iterations;
      decrease = full ? backward<false, true>() : backward<false, false>();
      if (std::sqrt(2 * decrease / unknowns) <= tolerance) return;
      const double next = forward<false>();
      if (!(next <= cost * (1 + 1e-12))) return;  // a hand-made sweep gives up here
      cost = next;
      now_ = 1 - now_;
    }
  }
  const double* x(std::size_t j) const { return nodes[j].x[now_]; }

 private:
  /// C = I + MᵀΛM for lower triangular M; returns its inverse's three entries.
  template <bool loose, bool full>
  double backward() {
    double S00 = 0, S01 = 0, S11 = 0, s0 = 0, s1 = 0, decrease = 0;
    const double dt = d_.dt, B0 = B_[0], B1 = B_[1], B2 = B_[2];
    for (std::size_t j = nodes.size() - 1; j > 0; --j) {
      BatchNode& node = nodes[j];
      const BatchNode& last = nodes[j - 1];
      const double x0 = node.x[now_][0];
      {
        const double w = 1 + x0 * x0, root = std::sqrt(w), m = x0 / root, slope = 1 / (w * root);
        const double residual = node.y - m;
        s0 -= r_ * slope * residual;
        S00 += r_ * slope * slope;
        if (full) S00 += r_ * residual * 3 * x0 * slope / w;
      }
      const double p0 = last.x[now_][0], p1 = last.x[now_][1];
      const double A10 = -dt * (d_.k + 4 * d_.c * p0 * p1), A11 = 1 - dt * 2 * d_.c * (p0 * p0 - 1);
      const double H = full ? -s1 * dt * 4 * d_.c : 0;  // the costate times f'': H [p1 p0; p0 0]
      double t0 = s0, t1 = s1, b0 = 0, b1 = 0;
      if (loose) {
        const double e0 = p0 + dt * p1 - x0;
        const double e1 = p1 + dt * (-d_.k * p0 - 2 * d_.c * (p0 * p0 - 1) * p1) - node.x[now_][1];
        t0 += S00 * e0 + S01 * e1;
        t1 += S01 * e0 + S11 * e1;
      } else {
        b0 = node.b[now_][0];
        b1 = node.b[now_][1];
      }
      const double U00 = S00 * B0 + S01 * B1, U01 = S01 * B2, U10 = S01 * B0 + S11 * B1, U11 = S11 * B2;
      const double C00 = 1 + B0 * U00 + B1 * U10, C01 = B2 * U10, C11 = 1 + B2 * U11;
      const double inverse = 1 / (C00 * C11 - C01 * C01);
      const double I00 = C11 * inverse, I01 = -C01 * inverse, I11 = C00 * inverse;
      const double g0 = b0 + B0 * t0 + B1 * t1, g1 = b1 + B2 * t1;
      const double k0 = -(I00 * g0 + I01 * g1), k1 = -(I01 * g0 + I11 * g1);
      decrease -= (g0 * k0 + g1 * k1) / 2;
      const double V00 = U00 * I00 + U01 * I01, V01 = U00 * I01 + U01 * I11;
      const double V10 = U10 * I00 + U11 * I01, V11 = U10 * I01 + U11 * I11;
      const double T00 = S00 - V00 * U00 - V01 * U01, T01 = S01 - V00 * U10 - V01 * U11;
      const double T11 = S11 - V10 * U10 - V11 * U11;
      t0 += U00 * k0 + U01 * k1;
      t1 += U10 * k0 + U11 * k1;
      node.k[0] = k0;
      node.k[1] = k1;
      node.K[0][0] = -(V00 + V10 * A10);
      node.K[0][1] = -(V00 * dt + V10 * A11);
      node.K[1][0] = -(V01 + V11 * A10);
      node.K[1][1] = -(V01 * dt + V11 * A11);
      const double W00 = T00 + T01 * A10, W01 = T00 * dt + T01 * A11, W10 = T01 + T11 * A10,
                   W11 = T01 * dt + T11 * A11;
      S00 = W00 + A10 * W10;
      S01 = W01 + A10 * W11;
      S11 = dt * W01 + A11 * W11;
      if (full) {
        S00 += H * p1;
        S01 += H * p0;
      }
      s0 = t0 + A10 * t1;
      s1 = dt * t0 + A11 * t1;
    }
    const double L0 = L_[0], L1 = L_[1], L2 = L_[2];
    const BatchNode& first = nodes[0];
    const double a0 = loose ? 0 : a_[now_][0], a1 = loose ? 0 : a_[now_][1];
    const double e0 = x0_[0] + L0 * a0 - first.x[now_][0], e1 = x0_[1] + L1 * a0 + L2 * a1 - first.x[now_][1];
    s0 += S00 * e0 + S01 * e1;
    s1 += S01 * e0 + S11 * e1;
    const double U00 = S00 * L0 + S01 * L1, U10 = S01 * L0 + S11 * L1, U11 = S11 * L2;
    const double C00 = 1 + L0 * U00 + L1 * U10, C01 = L2 * U10, C11 = 1 + L2 * U11;
    const double inverse = 1 / (C00 * C11 - C01 * C01);
    const double g0 = a0 + L0 * s0 + L1 * s1, g1 = a1 + L2 * s1;
    step_[0] = -(C11 * g0 - C01 * g1) * inverse;
    step_[1] = -(C00 * g1 - C01 * g0) * inverse;
    return decrease - (g0 * step_[0] + g1 * step_[1]) / 2;
  }

  template <bool loose>
  double forward() {
    const int next = 1 - now_;
    const double dt = d_.dt;
    double a0 = step_[0], a1 = step_[1];
    if (!loose) {
      a0 += a_[now_][0];
      a1 += a_[now_][1];
    }
    a_[next][0] = a0;
    a_[next][1] = a1;
    double sum = a0 * a0 + a1 * a1;
    double x0 = x0_[0] + L_[0] * a0, x1 = x0_[1] + L_[1] * a0 + L_[2] * a1;
    nodes[0].x[next][0] = x0;
    nodes[0].x[next][1] = x1;
    for (std::size_t j = 1; j < nodes.size(); ++j) {
      BatchNode& node = nodes[j];
      const BatchNode& last = nodes[j - 1];
      const double o0 = x0 - last.x[now_][0], o1 = x1 - last.x[now_][1];
      double b0 = node.k[0] + node.K[0][0] * o0 + node.K[0][1] * o1;
      double b1 = node.k[1] + node.K[1][0] * o0 + node.K[1][1] * o1;
      if (!loose) {
        b0 += node.b[now_][0];
        b1 += node.b[now_][1];
      }
      node.b[next][0] = b0;
      node.b[next][1] = b1;
      const double f0 = x0 + dt * x1, f1 = x1 + dt * (-d_.k * x0 - 2 * d_.c * (x0 * x0 - 1) * x1);
      x0 = f0 + B_[0] * b0;
      x1 = f1 + B_[1] * b0 + B_[2] * b1;
      node.x[next][0] = x0;
      node.x[next][1] = x1;
      const double residual = node.y - x0 / std::sqrt(1 + x0 * x0);
      sum += b0 * b0 + b1 * b1 + r_ * residual * residual;
    }
    return sum / 2;
  }

  models::VanDerPolWhite d_;
  double r_, B_[3], L_[3], x0_[2], a_[2][2] = {}, step_[2] = {};
  int now_ = 0;
};

}  // namespace limit
