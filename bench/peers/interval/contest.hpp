// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The interval contests in C++: the flight as the data file has it, and the judge of an answer.
#pragma once

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "../harness.hpp"
#include "problems.hpp"

namespace peers {

/// The first `steps` steps of the file.
template <typename Problem>
Flight<Problem::n, Problem::p, Problem::u> read_flight(const Data& data, long steps) {
  Flight<Problem::n, Problem::p, Problem::u> flight;
  const auto take = [&](const char* name, auto& to, long count) {
    using Row = typename std::remove_reference_t<decltype(to)>::value_type;
    const auto& rows = data.rows(name);
    if (static_cast<long>(rows.size()) < count) std::exit(2);
    for (long k = 0; k < count; ++k)
      to.push_back(Eigen::Map<const Row>(rows[static_cast<std::size_t>(k)].data()));
  };
  take("y", flight.y, steps);
  take("start", flight.start, steps + 1);
  if constexpr (Problem::u > 0)
    take("control", flight.control, steps);
  else
    flight.control.resize(flight.y.size());
  return flight;
}

/// J of eq. (5) at a sequence of states, and the largest entry of its gradient there. Written here once more:
/// no contender judges itself.
struct Judgement {
  double cost = 0, gradient = 0;
};

template <typename Problem, typename States>
Judgement judge(const Problem& problem, const Flight<Problem::n, Problem::p, Problem::u>& flight,
                const States& x) {
  constexpr int n = Problem::n;
  using X = jml::Vector<double, n>;
  const auto& d = problem.dynamics;
  const auto& s = problem.sensor;
  const Eigen::LLT<jml::Matrix<double, n, n>> Q(d.disturbance_covariance()), P0(problem.prior.P);
  const Eigen::LLT<jml::Matrix<double, Problem::p, Problem::p>> R(s.noise_covariance());
  const auto model = [&](const X& at, std::size_t k, jml::Matrix<double, n, n>& A) -> X {
    if constexpr (Problem::u > 0) {
      const jml::StepContext<double, Problem::u> with{0, 1, flight.control[k]};
      A = d.dynamics_jacobian(at, with);
      return d.dynamics(at, with);
    } else {
      A = d.dynamics_jacobian(at);
      return d.dynamics(at);
    }
  };
  Judgement out;
  std::vector<X> gradient(flight.start.size(), X::Zero());
  const X first = x(0) - problem.prior.x;
  gradient[0] = P0.solve(first);
  out.cost = first.dot(gradient[0]);
  for (std::size_t k = 0; k < flight.y.size(); ++k) {
    jml::Matrix<double, n, n> A;
    const X w = x(k + 1) - model(x(k), k, A), pull = Q.solve(w);
    const auto v = (flight.y[k] - s.measurement(x(k + 1))).eval();
    out.cost += w.dot(pull) + v.dot(R.solve(v));
    gradient[k + 1] += pull - s.measurement_jacobian(x(k + 1)).transpose() * R.solve(v);
    gradient[k] -= A.transpose() * pull;
  }
  out.cost /= 2;
  for (const X& g : gradient) out.gradient = std::max(out.gradient, g.cwiseAbs().maxCoeff());

  return out;
}

/// The gradient that all have to reach.
template <typename Problem>
double least_gradient(const Problem& problem, const Flight<Problem::n, Problem::p, Problem::u>& flight) {
  return Problem::gradient * judge(problem, flight, [&](std::size_t k) { return flight.start[k]; }).gradient;
}

/// Of a whole flight: 17 of its states, equally spaced, with J and gradient of all. `x(k)`: state k.
template <typename Problem, typename States>
Result result_of_batch(const Problem& problem, const Flight<Problem::n, Problem::p, Problem::u>& flight,
                       const States& x, int iterations) {
  Result out;
  for (std::size_t i = 0; i <= 16; ++i) {
    const auto at = x(i * flight.y.size() / 16);
    for (int j = 0; j < Problem::n; ++j) out.x.push_back(at(j));
  }
  const Judgement found = judge(problem, flight, x);
  const double part = found.gradient / least_gradient(problem, flight);
  out.more = {{"cost", found.cost}, {"gradient", Problem::gradient * part}, {"iterations", iterations}};
  out.usable = part <= 1;
  return out;
}

}  // namespace peers
