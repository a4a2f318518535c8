// SPDX-License-Identifier: BSD-3-Clause
// The interval contests by this library. CONTEST: batch_van_der_pol, batch_robot, batch_cart: the least J of
// a flight, from where an EKF was. lag_van_der_pol, lag_robot, lag_cart: a fixed lag of 20, step by step;
// lag_van_der_pol_converged: each window to the end. data_van_der_pol, data_robot, data_cart: the flight
// itself, into FILE.
#include "contender.hpp"
#include "problems.hpp"

namespace {

using namespace peers;

template <typename Problem>
Answer batch(const Problem& problem, int steps) {
  const auto flight = fly(problem, steps);
  jml::Batch batch{problem.dynamics, jml::sensors<decltype(problem.sensor)>, problem.prior, {steps}};
  batch.start = jml::Start::given;
  batch.guess(flight.start[0]);
  for (int k = 0; k < steps; ++k) {
    if (step(batch, problem, flight, k) != jml::Status::ok) refuse("not recorded");
    batch.guess(flight.start[static_cast<std::size_t>(k) + 1]);
  }
  jml::BatchReport<double> report;
  const auto restart = [&] {
    auto& store = batch.recording();
    for (int j = 0; j <= steps; ++j) store.node(j).x[store.now()] = flight.start[static_cast<std::size_t>(j)];
  };
  Answer answer;
  answer.seconds = least_time(restart, [&] { report = batch.solve(); }) / steps;
  if (!jml::usable(report.status)) refuse(jml::describe(report.status));
  answer.cost = report.cost;
  answer.iterations = report.iterations;
  for (int j = 0; j <= steps; ++j) answer.add(batch.x(j));
  return answer;
}

/// `converged`: each window to the end, else the two sweeps of a step.
template <typename Problem>
Answer lag(const Problem& problem, int steps, bool converged) {
  const auto flight = fly(problem, steps);
  jml::Filter filter{jml::FixedLag<20>{}, problem.dynamics, jml::sensors<decltype(problem.sensor)>,
                     problem.prior};
  filter.method().options.sweeps = converged ? 50 : 2;
  filter.method().options.tolerance = converged ? 1e-10 : 0;
  Answer answer;
  const auto restart = [&] {
    filter.reset(problem.prior, 0);
    answer.states.clear();
    answer.states.reserve(static_cast<std::size_t>(2 * problem.n * steps));
    answer.iterations = 0;
  };
  answer.seconds = least_time(restart,
                              [&] {
                                for (int k = 0; k < steps; ++k) {
                                  const auto report = step(filter, problem, flight, k);
                                  if (!jml::usable(report.status)) refuse(jml::describe(report.status));
                                  answer.iterations += report.sweeps;
                                  answer.add(filter.x());
                                  answer.add(filter.x(std::min(filter.depth(), 20)));
                                }
                              }) /
                   steps;
  return answer;
}

template <typename Problem>
bool run(const Task& task) {
  const Problem problem;
  const std::string_view name = Problem::name;
  const auto is = [&](std::string_view contest, std::string_view ending = {}) {
    return task.contest.size() == contest.size() + name.size() + ending.size() &&
           task.contest.starts_with(contest) && task.contest.ends_with(ending) &&
           task.contest.substr(contest.size(), name.size()) == name;
  };
  Answer answer;
  if (is("data_")) {
    fly(problem, task.steps).write(task.file);
    return true;
  }
  if (is("batch_"))
    answer = batch(problem, task.steps);
  else if (is("lag_"))
    answer = lag(problem, task.steps, false);
  else if (is("lag_", "_converged"))
    answer = lag(problem, task.steps, true);
  else
    return false;
  print(task.contest.data(), "jml", task.steps, answer, task.file);
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  const Task task(argc, argv);
  if (!run<VanDerPolProblem>(task) && !run<RobotProblem>(task) && !run<CartProblem>(task))
    refuse("no such contest");
}
