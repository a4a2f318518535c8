// SPDX-License-Identifier: BSD-3-Clause
// The whole flight of coming_from.md by Ceres itself.
#include <ceres/autodiff_cost_function.h>
#include <ceres/problem.h>
#include <ceres/solver.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>

namespace {

constexpr double dt = 1, q = 0.16;
constexpr double ys[8][2] = {{107.64, 0.5243}, {103.65, 0.5701}, {102.81, 0.6276}, {100.98, 0.6927},
                             {98.04, 0.7793},  {98.27, 0.8544},  {94.97, 0.9369},  {96.2, 1.0203}};

// [residuals]
struct Motion {  // L⁻¹ (x_k - F x_{k-1}), Q = L Lᵀ
  Eigen::Matrix4d whitener;
  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    const Eigen::Vector4<T> w(b[0] - a[0] - dt * a[2], b[1] - a[1] - dt * a[3], b[2] - a[2], b[3] - a[3]);
    Eigen::Map<Eigen::Vector4<T>> out(residual);
    out = whitener.cast<T>() * w;
    return true;
  }
};
struct Radar {
  double range, bearing;
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    using std::atan2, std::sqrt;
    residual[0] = (sqrt(x[0] * x[0] + x[1] * x[1]) - range) / 2.0;
    residual[1] = (atan2(x[1], x[0]) - bearing) / 0.01;
    return true;
  }
};
struct Prior {
  template <typename T>
  bool operator()(const T* x, T* residual) const {
    constexpr double mean[] = {100, 50, -6, 4}, deviation[] = {5, 5, 2, 2};
    for (int i = 0; i < 4; ++i) residual[i] = (x[i] - mean[i]) / deviation[i];
    return true;
  }
};
// [/residuals]

}  // namespace

int main() {
  const Eigen::Matrix2d one = Eigen::Matrix2d::Identity();
  Eigen::Matrix4d Q;
  Q << q * dt * dt * dt / 3 * one, q * dt * dt / 2 * one, q * dt * dt / 2 * one, q * dt * one;
  const Eigen::Matrix4d L = Q.llt().matrixL(), whitener = L.inverse();

  // [solve]
  std::array<double, 4> x[9] = {{100, 50, -6, 4}};
  ceres::Problem problem;
  problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Prior, 4, 4>(new Prior), nullptr, x[0].data());
  for (int k = 1; k <= 8; ++k) {
    const auto& before = x[k - 1];
    x[k] = {before[0] + dt * before[2], before[1] + dt * before[3], before[2], before[3]};
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Motion, 4, 4, 4>(new Motion{whitener}), nullptr,
                             x[k - 1].data(), x[k].data());
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<Radar, 2, 4>(new Radar{ys[k - 1][0], ys[k - 1][1]}), nullptr,
        x[k].data());
  }
  ceres::Solver::Options options;
  options.function_tolerance = options.parameter_tolerance = 1e-15;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  // [/solve]

  std::printf("J %.12f\n", summary.final_cost);
  for (const int k : {0, 8})
    std::printf("x_%d %.12f %.12f %.12f %.12f\n", k, x[k][0], x[k][1], x[k][2], x[k][3]);
  // As with_gtsam.py prints them.
  constexpr double there[] = {50.418897681432, 81.653647617811, -6.614469779692, 4.338931388637};
  bool same = summary.IsSolutionUsable() && std::abs(summary.final_cost - 2.890137594137) < 1e-9;
  for (std::size_t i = 0; i < 4; ++i) same = same && std::abs(x[8][i] - there[i]) < 1e-6;
  return same ? 0 : 1;
}
