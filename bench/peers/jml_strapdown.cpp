// SPDX-License-Identifier: BSD-3-Clause
// jml's EKF on the model of examples/navigation, its Jacobians derived from it. JML_PEER_FLOAT: in single
// precision. JML_PEER_FACTORED: U D Uᵀ.
#include "strapdown_contest.hpp"

namespace {

#ifdef JML_PEER_FLOAT
using Scalar = float;
constexpr const char* name = "jml_ekf_float";
#else
using Scalar = double;
constexpr const char* name = "jml_ekf";
#endif

/// The model of the example, its covariances in the filter's own precision.
struct Unit : navigation::Strapdown {
  jml::Matrix<Scalar, 12, 12> disturbance_covariance(const auto& x, const auto& at) const {
    return navigation::Strapdown::disturbance_covariance(x, at).template cast<Scalar>();
  }
};
struct Fix : navigation::GnssFix {
  using navigation::GnssFix::GnssFix;
  jml::Matrix<Scalar, 6, 6> noise_covariance() const {
    return navigation::GnssFix::noise_covariance().template cast<Scalar>();
  }
};

class Library {
 public:
  explicit Library(const peers::Flight& flight)
      : fix_(flight.arm), filter_{jml::Ekf{}, Unit{}, start(flight)} {}
  bool predict(const jml::Vector<double, 6>& sample, double dt) {
    return jml::usable(filter_.predict(dt, jml::Vector<Scalar, 6>(sample.cast<Scalar>())));
  }
  bool correct(const jml::Vector<double, 6>& y) {
    return jml::usable(filter_.update(fix_, jml::Vector<Scalar, 6>(y.cast<Scalar>())).status);
  }
  [[nodiscard]] navigation::State<double> state() const { return filter_.x().template cast<double>(); }
  [[nodiscard]] double variance(int i) const { return static_cast<double>(filter_.P()(i, i)); }
  [[nodiscard]] static std::size_t bytes() { return sizeof(Filter); }

 private:
  static jml::Estimate<Scalar, 16, 15> start(const peers::Flight& flight) {
    return {jml::Vector<Scalar, 16>(flight.x0.cast<Scalar>()),
            jml::Matrix<Scalar, 15, 15>(flight.P0.cast<Scalar>())};
  }
  using Filter = decltype(jml::Filter{jml::Ekf{}, Unit{}, jml::Estimate<Scalar, 16, 15>{}});
  Fix fix_;
  Filter filter_;
};

}  // namespace

int main(int argc, char** argv) { return peers::run_strapdown<Library>(argc, argv, name); }
