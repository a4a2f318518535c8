// SPDX-License-Identifier: BSD-3-Clause
// SUNDIALS' CVODE called by hand: x and the upper triangle of P, Adams with fixed-point iteration, begun
// afresh at each sample, as a held measurement jumps there. Relative tolerance 1e-9 as jml::Cvode's.
#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_version.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <Eigen/LU>
#include <jml/jml.hpp>

#include "continuous_contest.hpp"

namespace {

using namespace peers;
constexpr int size = n + n * (n + 1) / 2;

struct Slope {
  Oscillating dynamics;
  Signal sensor;
  Square noise = dynamics.disturbance_input() * dynamics.disturbance_spectral_density() *
                 dynamics.disturbance_input().transpose();
  jml::Matrix<double, p, p> weight = sensor.noise_spectral_density().inverse();
  Measurement y;

  static void unpack(const double* z, State& x, Square& P) {
    for (int i = 0; i < n; ++i) x(i) = *z++;
    for (int i = 0; i < n; ++i) {
      for (int j = i; j < n; ++j) P(i, j) = P(j, i) = *z++;
    }
  }
  void operator()(const double* z, double* out) const {
    State x;
    Square P;
    unpack(z, x, P);
    const jml::Matrix<double, p, n> H = sensor.measurement_jacobian(x);
    const jml::Matrix<double, n, p> K = P * H.transpose() * weight;
    const Square closed = dynamics.dynamics_jacobian(x) * P;
    const Square dP = closed + closed.transpose() + noise - K * H * P;
    const State dx = dynamics.dynamics(x) + K * (y - sensor.measurement(x));
    for (int i = 0; i < n; ++i) *out++ = dx(i);
    for (int i = 0; i < n; ++i) {
      for (int j = i; j < n; ++j) *out++ = dP(i, j);
    }
  }
};

int evaluate(sunrealtype, N_Vector z, N_Vector out, void* slope) {
  (*static_cast<const Slope*>(slope))(N_VGetArrayPointer(z), N_VGetArrayPointer(out));
  return 0;
}

void check(bool good) {
  if (!good) std::exit(2);
}

class ByHand : public Job {
 public:
  ByHand(const Data& data, long steps) : y_(read_signal(data, steps)) {
#if SUNDIALS_VERSION_MAJOR >= 7
    check(SUNContext_Create(SUN_COMM_NULL, &context_) == 0);
#else
    check(SUNContext_Create(nullptr, &context_) == 0);
#endif
    z_ = N_VNew_Serial(size, context_);
    double* z = N_VGetArrayPointer(z_);
    for (int i = 0; i < n; ++i) *z++ = 0;
    for (int i = 0; i < n; ++i) {
      for (int j = i; j < n; ++j) *z++ = i == j ? 1e-3 : 0;
    }
    memory_ = CVodeCreate(CV_ADAMS, context_);
    solver_ = SUNNonlinSol_FixedPoint(z_, 0, context_);
    check(CVodeInit(memory_, evaluate, 0, z_) == CV_SUCCESS);
    check(CVodeSetUserData(memory_, &slope_) == CV_SUCCESS);
    check(CVodeSStolerances(memory_, 1e-9, 1e-12) == CV_SUCCESS);
    check(CVodeSetNonlinearSolver(memory_, solver_) == CV_SUCCESS);
  }
  ~ByHand() override {
    CVodeFree(&memory_);
    SUNNonlinSolFree(solver_);
    N_VDestroy(z_);
    SUNContext_Free(&context_);
  }
  ByHand(const ByHand&) = delete;
  ByHand& operator=(const ByHand&) = delete;

  void run() override {
    for (const auto& y : y_) {
      slope_.y = y;
      sunrealtype reached = 0;
      check(CVodeReInit(memory_, 0, z_) == CV_SUCCESS);
      check(CVodeSetStopTime(memory_, sample) == CV_SUCCESS);
      check(CVode(memory_, sample, z_, &reached, CV_NORMAL) >= 0);
    }
  }
  [[nodiscard]] Result result() const override {
    State x;
    Square P;
    Slope::unpack(N_VGetArrayPointer(z_), x, P);
    return result_of_sample(x, P, true);
  }

 private:
  std::vector<Measurement> y_;
  Slope slope_;
  SUNContext context_ = nullptr;
  N_Vector z_ = nullptr;
  void* memory_ = nullptr;
  SUNNonlinearSolver solver_ = nullptr;
};

}  // namespace

int main(int argc, char** argv) {
  return run(argc, argv, "cvode_by_hand", [](const Data& d, long n) -> Job* { return new ByHand(d, n); });
}
