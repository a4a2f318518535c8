// SPDX-License-Identifier: BSD-3-Clause
// The same filter as a textbook's author writes it, Jacobians derived on paper, in fixed-size Eigen
// (tests/models).
#include <models/strapdown_by_hand.hpp>

#include "strapdown_contest.hpp"

namespace {

class ByHand {
 public:
  explicit ByHand(const peers::Flight& flight)
      : fix_(flight.arm), filter_{navigation::Strapdown{}, flight.x0, flight.P0} {}
  bool predict(const jml::Vector<double, 6>& sample, double dt) {
    filter_.predict(sample, dt);
    last_ = sample;
    dt_ = dt;
    return true;
  }
  bool correct(const jml::Vector<double, 6>& y) {
    const Eigen::Matrix3d R = filter_.R();
    jml::Matrix<double, 6, 15> m_x;
    m_x.topRows<3>() = models::by_hand::position_slope(R, fix_.place.arm);
    m_x.bottomRows<3>() = models::by_hand::velocity_slope(
        R, fix_.place.arm, filter_.rate - filter_.x.segment<3>(navigation::gyro_bias));
    const jml::StepContext<double, 6> at{0, dt_, last_};
    filter_.correct<6>(y, fix_.measurement(filter_.x, at), m_x, fix_.noise_covariance());
    return true;
  }
  [[nodiscard]] navigation::State<double> state() const { return filter_.x; }
  [[nodiscard]] double variance(int i) const { return filter_.P(i, i); }
  [[nodiscard]] static std::size_t bytes() { return sizeof(models::StrapdownByHand); }

 private:
  navigation::GnssFix fix_;
  models::StrapdownByHand filter_;
  jml::Vector<double, 6> last_ = jml::Vector<double, 6>::Zero();
  double dt_ = 0;
};

}  // namespace

int main(int argc, char** argv) { return peers::run_strapdown<ByHand>(argc, argv, "strapdown_by_hand"); }
