// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A method of one's own that borrows half of another: the Schmidt-Kalman or consider filter (S. F. Schmidt
/// 1966) in extended form.
///
/// The last k states are considered: biases and parameters whose uncertainty must be felt but which no
/// measurement is trusted to improve. Their rows of the gain are zero; the rows of the other states are those
/// of the EKF of all states. P⁺ = (I - K H) P (I - K H)ᵀ + K R Kᵀ holds for any gain, and keeps the
/// correlations of both.
#pragma once

#include <jml/jml.hpp>

namespace own {

/// jml::Filter filter{own::ConsiderEkf<2>{}, model, jml::Estimate{x0, P0}};   // the last two states
///
/// predict: as the EKF; the dynamics may move considered states too.
///
/// correct: leaves the estimate and the covariance block of the considered states as they are, bit by bit.
/// Refuses y, R, gate or a sensor model that is not valid, a prior that is not finite, a singular S, and a P
/// that is not finite or has lost a variance. That the prior P is a covariance is trusted, as in OnePass:
/// start() asks it once.
template <int k>
struct ConsiderEkf {
  static_assert(k >= 0, "ConsiderEkf: the number of considered states cannot be negative");
  static constexpr bool symmetric = true;
  static constexpr bool optimal_on_linear = k == 0;  // a consider filter gives up what it will not estimate

  template <typename Scalar, jml::Dynamics D>
  using Belief = jml::Estimate<Scalar, jml::states_of<D>>;

  template <typename D>
  static consteval bool accepts() {
    static_assert(jml::DiscreteDynamics<D>,
                  "ConsiderEkf: continuous dynamics must go through jml::discretize first");
    static_assert(k <= jml::states_of<D>,
                  "ConsiderEkf: the model has fewer states than are to be considered");
    return true;
  }

  template <typename Model, typename Scalar, int n>
  [[nodiscard]] jml::Status start(const Model& model, const jml::Estimate<Scalar, n>& given,
                                  jml::Estimate<Scalar, n>& belief) const {
    return ekf.start(model, given, belief);
  }

  template <typename Model, typename Scalar, int n, typename At>
  [[nodiscard]] jml::Status predict(const Model& model, const jml::Estimate<Scalar, n>& prior, const At& at,
                                    jml::Estimate<Scalar, n>& next) const {
    return ekf.predict(model, prior, at, next);
  }

  template <typename Model, typename Scalar, int n, typename Sample, typename Report>
  void correct(const Model&, const jml::Estimate<Scalar, n>& prior, const Sample& sample,
               jml::Estimate<Scalar, n>& next, Report& report) const {
    constexpr int p = Sample::measurements;
    const auto answer = [&report](jml::Status status) { report.status = status; };
    const auto& sensor = sample.sensor;

    if (!jml::all_finite(sample.y)) return answer(jml::Status::invalid_measurement);
    if (!sample.gate.valid()) return answer(jml::Status::invalid_option);
    if (!jml::all_finite(prior.x)) return answer(jml::Status::invalid_state);
    if (!jml::all_finite(prior.P)) return answer(jml::Status::invalid_covariance);
    const jml::Matrix<Scalar, p, p> R = jml::noise_covariance(sensor, prior.x, sample.at);
    if (!jml::is_noise_covariance(R)) return answer(jml::Status::invalid_noise_covariance);

    const jml::Matrix<Scalar, p, n> H = jml::measurement_jacobian(sensor, prior.x, sample.at);
    report.innovation =
        jml::measurement_residual(sensor, sample.y, jml::measurement(sensor, prior.x, sample.at));
    jml::Matrix<Scalar, p, n> HP;
    jml::kernel::product(H, prior.P, HP);
    jml::kernel::add_symmetric_product<1>(R, HP, H, report.innovation_matrix);  // S = H P Hᵀ + R
    if (!jml::all_finite(report.innovation) || !jml::all_finite(report.innovation_matrix))
      return answer(jml::Status::sensor_not_finite);

    jml::kernel::SymmetricFactor<Scalar, p> factor;
    if (!factor.factor(report.innovation_matrix)) return answer(jml::Status::singular_innovation);
    jml::Matrix<Scalar, n, p> half, scaled;
    factor.right_solve(jml::kernel::transposed(HP), half, scaled, report.gain);  // K = P Hᵀ S⁻¹ …
    report.gain.template bottomRows<k>().setZero();  // … but for the considered states

    if (!jml::judge(sample.gate, report)) return answer(jml::Status::innovation_indefinite);
    if (report.gate == jml::Verdict::rejected) {
      next = prior;
      return;
    }
    next.x = prior.x + report.gain * report.innovation;
    const jml::Matrix<Scalar, n, n> identity = jml::Matrix<Scalar, n, n>::Identity();
    jml::Matrix<Scalar, n, n> keep, kept, KRK = jml::Matrix<Scalar, n, n>::Zero();
    jml::Matrix<Scalar, n, p> KR;
    jml::kernel::product(report.gain, R, KR);
    jml::kernel::add_symmetric_product<1>(KRK, KR, report.gain, KRK);  // K R Kᵀ
    jml::kernel::add_product<-1>(identity, report.gain, H, keep);      // I - K H
    jml::kernel::product(keep, prior.P, kept);
    jml::kernel::add_symmetric_product<1>(KRK, kept, keep, next.P);  // (I - K H) P (I - K H)ᵀ + K R Kᵀ
    if (!jml::all_finite(next.x) || !jml::all_finite(next.P)) return answer(jml::Status::covariance_lost);
    for (int i = 0; i < n; ++i) {
      if (!(next.P(i, i) > Scalar(0)) && prior.P(i, i) != Scalar(0))
        return answer(jml::Status::covariance_lost);
    }
  }

 private:
  static constexpr jml::OnePass<jml::Ekf<>> ekf{};
};

}  // namespace own
