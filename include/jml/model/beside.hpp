// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A plant with more states beside its own, and its sensors there: what noise that is not white and
/// independent is turned into (model/coloured_noise.hpp, model/correlated_noise.hpp).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/local_context.hpp>

namespace jml {

namespace detail {

/// What a model made of a plant would leave out without a word.
template <typename Plant>
consteval bool require_no_mean() {
  constexpr bool none =
      !HasHook<hooks::DisturbanceMean, Plant, Vector<double, states_of<Plant>>, Context<double, Plant>>;
  static_assert(none,
                "jml: a plant with more states beside it has no disturbance_mean(): add what is known of its "
                "disturbance in dynamics(x)");
  return none;
}
template <typename D, int more>
using SpaceBeside = std::conditional_t<is_flat<D>, Euclidean<states_of<D> + more>,
                                       Product<typename SpaceOfModel<D>::type, Euclidean<more>>>;

/// y = m(x, v), or m(x) + v.
template <typename S, typename T, int numbers, int r, typename At>
[[nodiscard]] Vector<T, measurements_of<S>> observed(const S& s, const Vector<T, numbers>& x,
                                                     const Vector<T, r>& v, const At& at) {
  if constexpr (NoisySensorIn<S, T, numbers, At>) {
    return ask_noisy<hooks::Measurement>(s, x, v, at);
  } else {
    Vector<T, measurements_of<S>> y = jml::measurement(s, x, at);
    for (int i = 0; i < measurements_of<S>; ++i) y(i) += v(i);
    return y;
  }
}
/// R of v, r×r.
template <typename S, typename X, typename At>
[[nodiscard]] auto noise_of(const S& s, const X& x, const At& at) {
  constexpr int r = noises_of_sensor<S>();
  return evaluate<hooks::NoiseCovariance, r, r>(s, x, at);
}

/// A sensor of the first states of a larger model, with `more` states after them. Effect: what these add.
template <typename S, int own, int more, typename Effect>
struct SensorBeside {
  static constexpr int measurements = measurements_of<S>, noises = noises_of_sensor<S>();
  static constexpr bool timed = sensor_reads_context<S, Vector<double, own>, StepContext<double>>();
  S sensor;
  Effect effect;

  template <typename T>
  Vector<T, measurements> measurement(const Vector<T, own + more>& x, const Vector<T, noises>& v) const
    requires(!timed)
  {
    return read(x, v, StepContext<double>{});
  }
  template <typename T, typename At>
  Vector<T, measurements> measurement(const Vector<T, own + more>& x, const Vector<T, noises>& v,
                                      const At& at) const
    requires timed
  {
    return read(x, v, at);
  }
  template <typename Scalar>
  Matrix<Scalar, noises, noises> noise_covariance(const Vector<Scalar, own + more>& x) const
    requires(!timed)
  {
    return effect.covariance(noise_of(sensor, piece<own>(x, 0), StepContext<double>{}));
  }
  template <typename Scalar, typename At>
  Matrix<Scalar, noises, noises> noise_covariance(const Vector<Scalar, own + more>& x, const At& at) const
    requires timed
  {
    return effect.covariance(noise_of(sensor, piece<own>(x, 0), at));
  }
  template <typename Y>
  Y residual(const Y& y, const Y& predicted) const {
    return measurement_residual(sensor, y, predicted);
  }

 private:
  template <typename T, typename At>
  Vector<T, measurements> read(const Vector<T, own + more>& x, const Vector<T, noises>& v,
                               const At& at) const {
    const Vector<T, more> beside = piece<more>(x, own);
    Vector<T, measurements> y = observed(sensor, piece<own>(x, 0), effect.noise(v, beside), at);
    effect.add(y, beside);
    return y;
  }
};

struct NoEffect {
  template <typename V, typename X>
  static V noise(const V& v, const X&) {
    return v;
  }
  template <typename Y, typename X>
  static void add(Y&, const X&) {}
  template <typename R>
  static R covariance(const R& r) {
    return r;
  }
};
}  // namespace detail

/// A sensor of the plant on the states of a model made of it.
template <typename Whole, typename S>
[[nodiscard]] auto beside(const Whole&, const S& sensor) {
  constexpr int own = Whole::plant_states;
  return detail::SensorBeside<S, own, Whole::states - own, detail::NoEffect>{sensor, {}};
}

}  // namespace jml
#include <jml/warnings_end.hpp>
