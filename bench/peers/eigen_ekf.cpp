// SPDX-License-Identifier: BSD-3-Clause
// The EKF step as one writes it in fixed-size Eigen, nothing checked and nothing reported.
#include <Eigen/Cholesky>

#include "step_contest.hpp"

namespace {

using peers::n, peers::p;

class Textbook {
 public:
  explicit Textbook(const peers::Contest& contest) : contest_(contest), x_(contest.x0), P_(contest.P0) {}
  bool step(const peers::Measurement& y) {
    const peers::Square A = contest_.dynamics.dynamics_jacobian(x_);
    const peers::State x = contest_.dynamics.dynamics(x_);
    const peers::Square N = A * P_ * A.transpose() + contest_.Q;
    const jml::Matrix<double, p, n> H = contest_.sensor.measurement_jacobian(x);
    const jml::Matrix<double, n, p> NH = N * H.transpose();
    const peers::MeasurementSquare S = H * NH + contest_.R;
    const jml::Matrix<double, n, p> K = S.llt().solve(NH.transpose()).transpose();
    x_ = x + K * contest_.residual(y, contest_.sensor.measurement(x));
    const peers::Square P = N - K * NH.transpose();
    P_ = (P + P.transpose()) / 2;
    return true;
  }
  [[nodiscard]] double x(int i) const { return x_(i); }
  [[nodiscard]] double variance(int i) const { return P_(i, i); }
  [[nodiscard]] static std::size_t state_bytes() { return sizeof(x_) + sizeof(P_); }

 private:
  const peers::Contest& contest_;
  peers::State x_;
  peers::Square P_;
};

}  // namespace

int main(int argc, char** argv) { return peers::run_steps<Textbook>(argc, argv, "eigen_ekf"); }
