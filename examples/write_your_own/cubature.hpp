// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A method of one's own: the third-degree cubature Kalman filter (I. Arasaratnam, S. Haykin, Cubature Kalman
/// Filters, IEEE Transactions on Automatic Control 54(6), 2009), for additive noise, after its CKF algorithm.
///
/// Of N(x, P) with P = L Lᵀ it takes 2n points of equal weight, x ± √n L_j with L_j the columns of L, and
/// reads mean and covariance off what a function makes of them: exact for polynomials of up to the third
/// degree, and no Jacobian is asked of the model. All is computed from differences to the image of x itself:
/// where P is zero they are zero. L is a Cholesky root whose columns are pivoted, so that it exists for a P
/// of any rank; another root of the same P gives other points, and in what is beyond the third degree another
/// answer.
#pragma once

#include <jml/jml.hpp>

namespace own {

/// jml::Filter filter{own::Cubature{}, model, jml::Estimate{x0, P0}};
///
/// predict: the mean of f + G w̄ over the points; their covariance, and G Q Gᵀ. Refuses a model that is not
/// finite, a varying Q that is no covariance, and a P that overflows.
///
/// correct: S and K from the points of the prediction. Refuses y, R, gate or a sensor model that is not
/// valid, a singular S, and a P that is not finite or lost a variance to rounding.
///
/// Both refuse a prior that is not finite, or whose P is not positive semidefinite (covariance_lost).
struct Cubature {
  static constexpr bool symmetric = true;
  static constexpr bool optimal_on_linear = true;  // the Kalman filter there: check_method() asks

  template <typename Scalar, jml::Dynamics D>
  using Belief = jml::Estimate<Scalar, jml::states_of<D>>;

  template <typename D>
  static consteval bool accepts() {
    static_assert(jml::DiscreteDynamics<D>,
                  "Cubature: continuous dynamics must go through jml::discretize first");
    return true;
  }

  /// P: symmetric positive semidefinite; zero means x is known exactly.
  template <typename Model, typename Scalar, int n>
  [[nodiscard]] jml::Status start(const Model& model, const jml::Estimate<Scalar, n>& given,
                                  jml::Estimate<Scalar, n>& belief) const {
    belief = given;
    const jml::Status status = jml::check_estimate(*this, given);
    return status == jml::Status::ok ? model.status() : status;
  }

  template <typename Model, typename Scalar, int n, typename At>
  [[nodiscard]] jml::Status predict(const Model& model, const jml::Estimate<Scalar, n>& prior, const At& at,
                                    jml::Estimate<Scalar, n>& next) const {
    jml::Matrix<Scalar, n, 2 * n> X;
    const jml::Status status = points_of(prior, X);
    if (status != jml::Status::ok) return status;

    const jml::Vector<Scalar, n> centre = jml::predicted_state(model.dynamics, prior.x, at);
    const auto image = image_of<n>(prior.x, X, [&](const jml::Vector<Scalar, n>& point) {
      return jml::Vector<Scalar, n>(jml::predicted_state(model.dynamics, point, at) - centre);
    });
    next.x = centre + image.mean;
    if (!jml::all_finite(next.x) || !jml::all_finite(image.deviations))
      return jml::Status::dynamics_not_finite;

    const bool valid =
        model.noise.with(model.dynamics, prior.x, at, [&](const jml::Matrix<Scalar, n, n>& noise) {
          // P = X Xᵀ + G Q Gᵀ, with X the deviations
          jml::kernel::add_symmetric_product<1>(noise, image.deviations, image.deviations, next.P);
        });
    if (!valid) return jml::Status::invalid_disturbance_covariance;
    return jml::all_finite(next.P) ? jml::Status::ok : jml::Status::covariance_lost;
  }

  template <typename Model, typename Scalar, int n, typename Sample, typename Report>
  void correct(const Model&, const jml::Estimate<Scalar, n>& prior, const Sample& sample,
               jml::Estimate<Scalar, n>& next, Report& report) const {
    constexpr int p = Sample::measurements;
    const auto answer = [&report](jml::Status status) { report.status = status; };
    const auto& sensor = sample.sensor;

    if (!jml::all_finite(sample.y)) return answer(jml::Status::invalid_measurement);
    if (!sample.gate.valid()) return answer(jml::Status::invalid_option);
    jml::Matrix<Scalar, n, 2 * n> X;
    const jml::Status status = points_of(prior, X);
    if (status != jml::Status::ok) return answer(status);
    const jml::Matrix<Scalar, p, p> R = jml::noise_covariance(sensor, prior.x, sample.at);
    if (!jml::is_noise_covariance(R)) return answer(jml::Status::invalid_noise_covariance);

    // The mean of angles is formed as a mean of differences, which the sensor's residual() knows how to take.
    const jml::Vector<Scalar, p> centre = jml::measurement(sensor, prior.x, sample.at);
    const auto image = image_of<p>(prior.x, X, [&](const jml::Vector<Scalar, n>& point) {
      return jml::measurement_residual(sensor, jml::measurement(sensor, point, sample.at), centre);
    });
    const jml::Matrix<Scalar, p, 2 * n>& Y = image.deviations;
    const jml::Vector<Scalar, p> predicted = centre + image.mean;
    report.innovation = jml::measurement_residual(sensor, sample.y, predicted);
    jml::kernel::add_symmetric_product<1>(R, Y, Y, report.innovation_matrix);  // S = Y Yᵀ + R
    if (!jml::all_finite(report.innovation) || !jml::all_finite(report.innovation_matrix))
      return answer(jml::Status::sensor_not_finite);

    jml::Matrix<Scalar, n, p> cross, half, scaled;
    jml::kernel::product_transposed(X, Y, cross);  // X Yᵀ
    jml::kernel::SymmetricFactor<Scalar, p> factor;
    if (!factor.factor(report.innovation_matrix)) return answer(jml::Status::singular_innovation);
    factor.right_solve(cross, half, scaled, report.gain);  // K = X Yᵀ S⁻¹

    if (!jml::judge(sample.gate, report)) return answer(jml::Status::innovation_indefinite);
    if (report.gate == jml::Verdict::rejected) {
      next = prior;
      return;
    }
    next.x = prior.x + report.gain * report.innovation;
    // P⁺ = (X - K Y)(X - K Y)ᵀ + K R Kᵀ, which is P - K S Kᵀ, and positive semidefinite as it is formed.
    jml::Matrix<Scalar, n, p> KR;
    jml::Matrix<Scalar, n, 2 * n> left;
    jml::kernel::product(report.gain, R, KR);
    jml::kernel::add_product<-1>(X, report.gain, Y, left);
    next.P.setZero();
    jml::kernel::add_symmetric_product<1>(next.P, left, left, next.P);
    jml::kernel::add_symmetric_product<1>(next.P, KR, report.gain, next.P);
    if (!jml::all_finite(next.x) || !jml::all_finite(next.P)) return answer(jml::Status::covariance_lost);
    for (int i = 0; i < n; ++i) {  // R > 0: something is left of every variance
      if (next.P(i, i) == Scalar(0) && prior.P(i, i) != Scalar(0))
        return answer(jml::Status::covariance_lost);
    }
  }

 private:
  /// X with X Xᵀ = P: the points less x, each times 1/√(2n). covariance_lost where P is indefinite by more
  /// than half of the digits, which rounding does not do.
  template <typename Scalar, int n>
  static jml::Status points_of(const jml::Estimate<Scalar, n>& prior, jml::Matrix<Scalar, n, 2 * n>& X) {
    if (!jml::all_finite(prior.x)) return jml::Status::invalid_state;
    if (!jml::all_finite(prior.P)) return jml::Status::invalid_covariance;
    const jml::kernel::SemidefiniteFactor<Scalar, n> root(prior.P);  // of any rank; cuts what is negative
    X << root.L, -root.L;
    X *= std::sqrt(Scalar(0.5));
    jml::Matrix<Scalar, n, n> cut;
    jml::kernel::add_product_transposed<-1>(prior.P, root.L, root.L, cut);  // P - L Lᵀ
    const Scalar slack = std::sqrt(Scalar(8 * n) * std::numeric_limits<Scalar>::epsilon());
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j <= i; ++j) {
        const Scalar scale = std::sqrt(std::abs(prior.P(i, i))) * std::sqrt(std::abs(prior.P(j, j)));
        if (!(std::abs(cut(i, j)) <= slack * scale)) return jml::Status::covariance_lost;
      }
    }
    return jml::Status::ok;
  }

  /// What a function makes of the points, less its value at x: the mean, m, and the deviations from that,
  /// each times 1/√(2n), so that their covariance is deviations · deviationsᵀ.
  template <typename Scalar, int m, int points>
  struct Image {
    jml::Vector<Scalar, m> mean = jml::Vector<Scalar, m>::Zero();
    jml::Matrix<Scalar, m, points> deviations;
  };

  /// change(point): of the function, from x to the point, m.
  template <int m, typename Scalar, int n, typename Change>
  static Image<Scalar, m, 2 * n> image_of(const jml::Vector<Scalar, n>& x,
                                          const jml::Matrix<Scalar, n, 2 * n>& X, const Change& change) {
    const Scalar root = std::sqrt(Scalar(2 * n));
    Image<Scalar, m, 2 * n> out;
    for (int j = 0; j < 2 * n; ++j) {
      const jml::Vector<Scalar, m> changed = change(jml::Vector<Scalar, n>(x + root * X.col(j)));
      out.mean += changed / Scalar(2 * n);
      out.deviations.col(j) = changed;
    }
    for (int j = 0; j < 2 * n; ++j) out.deviations.col(j) = (out.deviations.col(j) - out.mean) / root;
    return out;
  }
};

}  // namespace own
