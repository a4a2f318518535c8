// SPDX-License-Identifier: BSD-3-Clause
// One step of a linear tracker: the answer is known in closed form.
#include <cmath>
#include <cstdio>
#include <jml/jml.hpp>
#ifdef WITH_ceres
#include <jml/solve/ceres.hpp>
#endif
#ifdef WITH_mpi
#include <jml/campaign/campaign_mpi.hpp>
#endif
#ifdef WITH_campaign
#include <jml/analysis/consistency.hpp>
#include <jml/campaign/counter_noise.hpp>

bool component_works() {
  return jml::chi_square_average_interval(1, 50).contains(1) && jml::CounterNoise(1, 2).uniform() < 1;
}
#elif defined(WITH_cvode)
#include <jml/solve/cvode.hpp>

bool component_works() {  // compiled with its headers, linked and loaded with its libraries
  SUNContext context = nullptr;
#if SUNDIALS_VERSION_MAJOR >= 7
  SUNContext_Create(SUN_COMM_NULL, &context);
#else
  SUNContext_Create(nullptr, &context);
#endif
  void* memory = CVodeCreate(CV_ADAMS, context);
  const bool made = memory != nullptr;
  CVodeFree(&memory);
  SUNContext_Free(&context);
  const jml::CvodeOptions options;
  return made && jml::valid(options);
}
#else
bool component_works() { return true; }
#endif

struct Walk {  // x⁺ = x + w
  static constexpr int states = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> dynamics(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> disturbance_covariance() const { return jml::Matrix<double, 1, 1>(1); }
};
struct Scale {  // y = x + v
  static constexpr int measurements = 1;
  static constexpr bool linear = true;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 1>& x) const {
    return x;
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(2); }
};

int main() {
  const jml::Estimate<double, 1> start{jml::Vector<double, 1>(0), jml::Matrix<double, 1, 1>(1)};
  jml::Filter filter{jml::Kalman{}, Walk{}, start};
  const auto report = filter.step(Scale{}, 3.0);
  std::printf("%s, x = %g\n", jml::describe(report.status), filter.x()(0));
  const bool right = jml::usable(report.status) && std::abs(filter.x()(0) - 1.5) < 1e-12;  // gain 2/(2 + 2)
  return right && component_works() ? 0 : 1;
}
