// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A scenario whose errors are written in a table, and an estimator that makes them.
#pragma once

#include <atomic>
#include <jml/campaign/campaign.hpp>

namespace scripted {

using Number = jml::Vector<double, 1>;

struct Nothing {};

/// Truth 10; y[k] - 10 from the table, run after run: with one thread only.
struct Scenario {
  static constexpr int states = 1, measurements = 1;
  std::string name = "scripted";
  int steps = 2;
  double dt = 0.5;
  bool measured_at_start = false;
  double lost = 50;
  Nothing sensor{};
  std::vector<std::vector<double>> table;
  std::shared_ptr<std::atomic<std::size_t>> next = std::make_shared<std::atomic<std::size_t>>(0);

  void fly(jml::CounterNoise&, jml::Flight<1, 1>& flight) const {
    const auto& errors = table[(*next)++];
    for (std::size_t k = 0; k <= static_cast<std::size_t>(steps); ++k) {
      flight.truth[k](0) = 10;
      flight.y[k](0) = 10 + errors[k];
    }
  }
};

/// What an error in the table makes the echo do, beside being its error.
constexpr double refused = 4, rejected = 3, violated = -3, dead = 77;

struct Report {
  jml::Status status = jml::Status::ok;
  jml::Verdict gate = jml::Verdict::off;
  struct Violation {
    int row = -1;
  } violation;
  double y = 0;
  double nis() const { return 2 * y; }
};

struct Box {
  Number lower, upper;
};

/// x = y, P = 4, a box from x - 1.5 to x + 2.5.
class Echo {
 public:
  Report update(const Nothing&, const Number& y) { return step(Nothing{}, y, 0); }
  Report step(const Nothing&, const Number& y, double) {
    const double error = y(0) - 10;
    Report report;
    report.y = y(0);
    next_ = y;
    dead_ = error == dead;
    if (error == refused || dead_) {
      report.status = jml::Status::singular_innovation;
      return report;
    }
    if (error == rejected) report.gate = jml::Verdict::rejected;
    if (error == violated) report.violation.row = 0;
    x_ = y;
    return report;
  }
  jml::Status predict(double) {
    if (dead_) return jml::Status::dynamics_not_finite;
    x_ = next_;
    return jml::Status::ok;
  }
  const Number& x() const { return x_; }
  jml::Matrix<double, 1, 1> P() const { return jml::Matrix<double, 1, 1>(4.0); }
  Box box() const { return {Number(x_(0) - 1.5), Number(x_(0) + 2.5)}; }

 private:
  Number x_ = Number(10.0), next_ = x_;
  bool dead_ = false;
};

inline auto echo() {
  return jml::Estimator{"echo", [](const auto&) { return Echo{}; }};
}

}  // namespace scripted
