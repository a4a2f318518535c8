// SPDX-License-Identifier: BSD-3-Clause
// The batch contests by Ceres, from the same start to the same gradient: a part of 1e-8 of that at the start.
// Analytic Jacobians, one block of parameters a node. --default in place of its best setting: the trust
// region begins at Ceres' own 1e4 and not wide open.
#include <jml/interval/ceres.hpp>

#include "contender.hpp"
#include "problems.hpp"

namespace {

using namespace peers;

template <typename Problem>
Answer solve(const Problem& problem, int steps, const jml::CeresOptions& options) {
  const auto flight = fly(problem, steps);
  jml::Batch batch{problem.dynamics, jml::sensors<decltype(problem.sensor)>, problem.prior, {steps}};
  batch.start = jml::Start::given;
  batch.guess(flight.start[0]);
  for (int k = 0; k < steps; ++k) {
    if (step(batch, problem, flight, k) != jml::Status::ok) refuse("not recorded");
    batch.guess(flight.start[static_cast<std::size_t>(k) + 1]);
  }
  const auto restart = [&] {
    auto& store = batch.recording();
    for (int j = 0; j <= steps; ++j) store.node(j).x[store.now()] = flight.start[static_cast<std::size_t>(j)];
  };
  Answer answer;
  jml::CeresReport report;
  double least = std::numeric_limits<double>::infinity();
  (void)least_time(restart, [&] {
    report = jml::solve_with_ceres(batch, options);
    least = std::min(least, report.last.total_time_in_seconds);  // inside ceres::Solve, its problem built
  });
  if (!jml::usable(report.status)) refuse(report.last.FullReport().c_str());
  answer.seconds = least / steps;
  answer.cost = report.cost;
  answer.iterations = report.iterations;
  for (int j = 0; j <= steps; ++j) answer.add(batch.x(j));
  return answer;
}

}  // namespace

int main(int argc, char** argv) {
  bool best = true;
  if (argc > 1 && std::strcmp(argv[1], "--default") == 0) {
    best = false;
    ++argv;
    --argc;
  }
  const Task task(argc, argv);
  jml::CeresOptions options;
  options.gradient_tolerance = 1e-8;
  if (!best)
    options.solver.initial_trust_region_radius = ceres::Solver::Options().initial_trust_region_radius;
  if (const char* e = std::getenv("J")) options.solver.jacobi_scaling = e[0] == '1';
  if (const char* e = std::getenv("E"))
    options.solver.sparse_linear_algebra_library_type = ceres::SparseLinearAlgebraLibraryType(std::atoi(e));
  if (const char* e = std::getenv("P")) options.solver.use_postordering = e[0] == '1';
  Answer answer;
  if (task.contest == "batch_van_der_pol")
    answer = solve(VanDerPolProblem{}, task.steps, options);
  else if (task.contest == "batch_robot")
    answer = solve(RobotProblem{}, task.steps, options);
  else if (task.contest == "batch_cart")
    answer = solve(CartProblem{}, task.steps, options);
  else
    refuse("no such contest");
  print(argv[1], best ? "ceres" : "ceres_default", task.steps, answer, task.file);
}
