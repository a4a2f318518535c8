// SPDX-License-Identifier: BSD-3-Clause
// batch_van_der_pol in loops written for this one model (bench/batch_limit.hpp).
#include "../../batch_limit.hpp"
#include "contender.hpp"
#include "problems.hpp"

int main(int argc, char** argv) {
  using namespace peers;
  const Task task(argc, argv);
  if (task.contest != "batch_van_der_pol") refuse("no such contest");
  const VanDerPolProblem problem;
  const auto flight = fly(problem, task.steps);
  limit::Batch batch(problem.dynamics, problem.sensor, problem.prior);
  batch.nodes.resize(flight.start.size());
  for (std::size_t k = 0; k < flight.y.size(); ++k) batch.nodes[k + 1].y = flight.y[k](0);
  const auto restart = [&] {
    for (std::size_t k = 0; k < flight.start.size(); ++k) {
      batch.nodes[k].x[0][0] = flight.start[k](0);
      batch.nodes[k].x[0][1] = flight.start[k](1);
    }
  };
  Answer answer;
  answer.seconds = least_time(restart, [&] { batch.solve(1e-10, true); }) / task.steps;
  answer.cost = batch.cost;
  answer.iterations = batch.iterations;
  for (std::size_t k = 0; k < flight.start.size(); ++k)
    answer.add(jml::Vector<double, 2>(batch.x(k)[0], batch.x(k)[1]));
  print("batch_van_der_pol", "by_hand", task.steps, answer, task.file);
}
