// SPDX-License-Identifier: BSD-3-Clause
// The data files of the interval contests, one a problem: prior and noise, each step's measurement and
// control, and where an EKF was at each node, which is the start of every engine; the signals of the
// continuous contests.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "problems.hpp"

void write_intervals(const std::filesystem::path& directory);

namespace {

template <typename Derived>
void row(std::FILE* file, const char* name, const Eigen::MatrixBase<Derived>& values) {
  std::fputs(name, file);
  for (int i = 0; i < values.rows(); ++i) {
    for (int j = 0; j < values.cols(); ++j) std::fprintf(file, ",%.17g", values(i, j));
  }
  std::fputc('\n', file);
}

template <typename Problem>
void write(const std::filesystem::path& directory, const std::string& name, int steps) {
  const Problem problem;
  const auto flight = peers::fly(problem, steps);
  std::FILE* file = std::fopen((directory / (name + ".csv")).c_str(), "w");
  if (file == nullptr) std::abort();
  row(file, "x0", problem.prior.x);
  row(file, "P0", problem.prior.P);
  row(file, "Q", problem.dynamics.disturbance_covariance());
  row(file, "R", problem.sensor.noise_covariance());
  for (const auto& x : flight.start) row(file, "start", x);
  for (const auto& x : flight.truth) row(file, "truth", x);
  if (Problem::u > 0) {
    for (const auto& u : flight.control) row(file, "control", u);
  }
  for (const auto& y : flight.y) row(file, "y", y);
  std::fclose(file);
}

void write_signal(const std::filesystem::path& directory, const std::string& name, int p) {
  std::FILE* file = std::fopen((directory / (name + ".csv")).c_str(), "w");
  if (file == nullptr) std::abort();
  for (int i = 0; i < 1024; ++i) {
    const double angle = 2 * 3.141592653589793 * i / 1024;
    std::fputc('y', file);
    for (int j = 0; j < p; ++j)
      std::fprintf(file, ",%.17g", 0.6 * std::sin(angle + j) + 0.1 * std::cos(3 * angle));
    std::fputc('\n', file);
  }
  std::fclose(file);
}

}  // namespace

void write_intervals(const std::filesystem::path& directory) {
  for (const int steps : {1000, 10000, 100000}) {
    const std::string of = "_" + std::to_string(steps);
    write<peers::VanDerPolProblem>(directory, "batch_van_der_pol" + of, steps);
    if (steps > 10000) continue;
    write<peers::RobotProblem>(directory, "batch_robot" + of, steps);
    write<peers::CartProblem>(directory, "batch_cart" + of, steps);
  }
  write<peers::VanDerPolProblem>(directory, "lag_van_der_pol", 1000);
  write<peers::RobotProblem>(directory, "lag_robot", 1000);
  write<peers::CartProblem>(directory, "lag_cart", 1000);
  write_signal(directory, "continuous_n2", 1);
  write_signal(directory, "continuous_n6", 3);
}
