// SPDX-License-Identifier: BSD-3-Clause
// Ceres: one block of parameters a node, analytic Jacobians, whitening formed once, one thread.
// JML_PEER_CERES_DEFAULT: the trust region begins at Ceres' own 1e4 and not wide open.
#include <ceres/problem.h>
#include <ceres/sized_cost_function.h>
#include <ceres/solver.h>

#include "contest.hpp"

namespace {

using namespace peers;
using Problem = JML_PEER_PROBLEM;
constexpr int n = Problem::n, p = Problem::p;
using X = jml::Vector<double, n>;
using Square = jml::Matrix<double, n, n>;
template <int rows>
using ByRows = Eigen::Matrix<double, rows, n, Eigen::RowMajor>;

/// √C⁻¹ of a covariance.
template <int size>
jml::Matrix<double, size, size> whitener(const jml::Matrix<double, size, size>& C) {
  return C.llt().matrixL().solve(jml::Matrix<double, size, size>::Identity());
}

struct Prior final : ceres::SizedCostFunction<n, n> {
  X mean;
  Square W;
  explicit Prior(const Problem& problem) : mean(problem.prior.x), W(whitener<n>(problem.prior.P)) {}
  bool Evaluate(const double* const* x, double* out, double** jacobians) const override {
    Eigen::Map<X>{out} = W * (Eigen::Map<const X>(x[0]) - mean);
    if (jacobians != nullptr && jacobians[0] != nullptr) Eigen::Map<ByRows<n>>{jacobians[0]} = W;
    return true;
  }
};

struct Step final : ceres::SizedCostFunction<n, n, n> {
  const Problem& problem;
  const Square& W;
  jml::Vector<double, (Problem::u > 0 ? Problem::u : 1)> control;
  Step(const Problem& of, const Square& whiten, const decltype(control)& u)
      : problem(of), W(whiten), control(u) {}
  template <typename Model, typename Use>
  void call(const Model& model, const Use& use) const {
    if constexpr (Problem::u > 0)
      use(model, jml::StepContext<double, Problem::u>{0, 1, control});
    else
      use(model);
  }
  bool Evaluate(const double* const* x, double* out, double** jacobians) const override {
    const X from = Eigen::Map<const X>(x[0]);
    const auto with = [&](const auto& model, const auto&... at) {
      Eigen::Map<X>{out} = W * (Eigen::Map<const X>(x[1]) - model.dynamics(from, at...));
      if (jacobians != nullptr && jacobians[0] != nullptr)
        Eigen::Map<ByRows<n>>{jacobians[0]} = -W * model.dynamics_jacobian(from, at...);
    };
    call(problem.dynamics, with);
    if (jacobians != nullptr && jacobians[1] != nullptr) Eigen::Map<ByRows<n>>{jacobians[1]} = W;
    return true;
  }
};

struct Measurement final : ceres::SizedCostFunction<p, n> {
  using Y = jml::Vector<double, p>;
  const Problem& problem;
  const jml::Matrix<double, p, p>& W;
  Y y;
  Measurement(const Problem& of, const jml::Matrix<double, p, p>& whiten, const Y& measured)
      : problem(of), W(whiten), y(measured) {}
  bool Evaluate(const double* const* x, double* out, double** jacobians) const override {
    const X at = Eigen::Map<const X>(x[0]);
    Eigen::Map<Y>{out} = W * (y - problem.sensor.measurement(at));
    if (jacobians != nullptr && jacobians[0] != nullptr)
      Eigen::Map<ByRows<p>>{jacobians[0]} = -W * problem.sensor.measurement_jacobian(at);
    return true;
  }
};

class Ceres : public Job {
 public:
  Ceres(const Data& data, long steps)
      : flight_(read_flight<Problem>(data, steps)),
        x_(flight_.start),
        noise_(whitener<n>(problem_.dynamics.disturbance_covariance())),
        weight_(whitener<p>(problem_.sensor.noise_covariance())) {
    ceres_.AddResidualBlock(new Prior(problem_), nullptr, x_[0].data());
    for (std::size_t k = 0; k < flight_.y.size(); ++k) {
      ceres_.AddResidualBlock(new Step(problem_, noise_, flight_.control[k]), nullptr, x_[k].data(),
                              x_[k + 1].data());
      ceres_.AddResidualBlock(new Measurement(problem_, weight_, flight_.y[k]), nullptr, x_[k + 1].data());
    }
    options_.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
    options_.logging_type = ceres::SILENT;
    options_.max_num_iterations = 200;
    options_.function_tolerance = options_.parameter_tolerance = 1e-16;  // the gradient decides
    options_.gradient_tolerance = least_gradient(problem_, flight_);
#ifndef JML_PEER_CERES_DEFAULT
    options_.initial_trust_region_radius = 1e16;
#endif
  }
  void run() override { ceres::Solve(options_, &ceres_, &summary_); }
  [[nodiscard]] Result result() const override {
    return result_of_batch(
        problem_, flight_, [this](std::size_t k) { return x_[k]; }, summary_.num_linear_solves);
  }

 private:
  Problem problem_;
  Flight<n, p, Problem::u> flight_;
  std::vector<X> x_;
  Square noise_;
  jml::Matrix<double, p, p> weight_;
  ceres::Problem ceres_;
  ceres::Solver::Options options_;
  ceres::Solver::Summary summary_;
};

}  // namespace

int main(int argc, char** argv) {
#ifdef JML_PEER_CERES_DEFAULT
  const char* name = "ceres_default";
#else
  const char* name = "ceres";
#endif
  return run(argc, argv, name, [](const Data& d, long n) -> Job* { return new Ceres(d, n); });
}
