// SPDX-License-Identifier: BSD-3-Clause
// The Orocos Bayesian Filtering Library's ExtendedKalmanFilter on Boost's ublas, with analytic Jacobians.
#include <bfl/filter/extendedkalmanfilter.h>
#include <bfl/model/analyticmeasurementmodel_gaussianuncertainty.h>
#include <bfl/model/analyticsystemmodel_gaussianuncertainty.h>
#include <bfl/pdf/analyticconditionalgaussian_additivenoise.h>

#include "step_contest.hpp"

namespace {

using MatrixWrapper::ColumnVector, MatrixWrapper::Matrix, MatrixWrapper::SymmetricMatrix;
using peers::n, peers::p;

template <typename Vector>
ColumnVector vector(const Vector& from) {
  ColumnVector out(static_cast<unsigned>(from.size()));
  for (int i = 0; i < from.size(); ++i) out(i + 1) = from(i);
  return out;
}
template <typename From>
Matrix matrix(const From& from) {
  Matrix out(static_cast<unsigned>(from.rows()), static_cast<unsigned>(from.cols()));
  for (int i = 0; i < from.rows(); ++i) {
    for (int j = 0; j < from.cols(); ++j) out(i + 1, j + 1) = from(i, j);
  }
  return out;
}
template <typename From>
SymmetricMatrix symmetric(const From& from) {
  SymmetricMatrix out(static_cast<int>(from.rows()));
  for (int i = 0; i < from.rows(); ++i) {
    for (int j = 0; j < from.cols(); ++j) out(i + 1, j + 1) = from(i, j);
  }
  return out;
}

/// The state that a density is conditioned on.
peers::State given(const BFL::ConditionalPdf<ColumnVector, ColumnVector>& density) {
  const ColumnVector& x = density.ConditionalArgumentGet(0);
  peers::State out;
  for (int i = 0; i < n; ++i) out(i) = x(i + 1);
  return out;
}

class Transition : public BFL::AnalyticConditionalGaussianAdditiveNoise {
 public:
  explicit Transition(const peers::Contest& contest)
      : AnalyticConditionalGaussianAdditiveNoise(
            BFL::Gaussian(vector(peers::State(peers::State::Zero())), symmetric(contest.Q)), 1),
        contest_(contest) {}
  ColumnVector ExpectedValueGet() const override { return vector(contest_.dynamics.dynamics(given(*this))); }
  Matrix dfGet(unsigned) const override { return matrix(contest_.dynamics.dynamics_jacobian(given(*this))); }

 private:
  const peers::Contest& contest_;
};

class Observation : public BFL::AnalyticConditionalGaussianAdditiveNoise {
 public:
  explicit Observation(const peers::Contest& contest)
      : AnalyticConditionalGaussianAdditiveNoise(
            BFL::Gaussian(vector(peers::Measurement(peers::Measurement::Zero())), symmetric(contest.R)), 1),
        contest_(contest) {}
  ColumnVector ExpectedValueGet() const override { return vector(contest_.sensor.measurement(given(*this))); }
  Matrix dfGet(unsigned) const override { return matrix(contest_.sensor.measurement_jacobian(given(*this))); }

 private:
  const peers::Contest& contest_;
};

class Bfl {
 public:
  explicit Bfl(const peers::Contest& contest)
      : transition_(contest),
        observation_(contest),
        system_(&transition_),
        sensor_(&observation_),
        prior_(vector(contest.x0), symmetric(contest.P0)),
        filter_(&prior_),
        y_(p) {
    filter_.AllocateMeasModelExt(p);
  }
  bool step(const peers::Measurement& y) {
    for (int i = 0; i < p; ++i) y_(i + 1) = y(i);
    return filter_.Update(&system_, &sensor_, y_);
  }
  [[nodiscard]] double x(int i) const { return posterior().ExpectedValueGet()(i + 1); }
  [[nodiscard]] double variance(int i) const { return posterior().CovarianceGet()(i + 1, i + 1); }
  /// Filter and posterior without what they hold on the heap beside x and P.
  [[nodiscard]] static std::size_t state_bytes() {
    return sizeof(BFL::ExtendedKalmanFilter) + sizeof(BFL::Gaussian) + sizeof(double) * (n + n * n);
  }

 private:
  BFL::Gaussian& posterior() const { return *filter_.PostGet(); }

  Transition transition_;
  Observation observation_;
  BFL::AnalyticSystemModelGaussianUncertainty system_;
  BFL::AnalyticMeasurementModelGaussianUncertainty sensor_;
  BFL::Gaussian prior_;
  mutable BFL::ExtendedKalmanFilter filter_;
  ColumnVector y_;
};

}  // namespace

int main(int argc, char** argv) { return peers::run_steps<Bfl>(argc, argv, "bfl_ekf"); }
