// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A plant with more states beside its own, and its sensors there: what noise that is not white and
/// independent is turned into (model/coloured_noise.hpp, model/correlated_noise.hpp).
#pragma once

#include <jml/model/concepts.hpp>

namespace jml {

namespace detail {

/// f(x, w) of any discrete dynamics, additive or not.
template <typename D, typename T, int numbers, int q, typename At>
[[nodiscard]] Vector<T, numbers> driven(const D& d, const Vector<T, numbers>& x, const Vector<T, q>& w,
                                        const At& at) {
  if constexpr (q > 0 && NoisyDynamicsIn<D, T, numbers, At>) {
    return ask_noisy<hooks::Dynamics>(d, x, w, at);
  } else {
    constexpr int n = degrees_of<D>;
    Vector<T, n> push = kernel::zeros<Vector<T, n>>();
    if constexpr (q > 0) {
      Vector<decltype(plain_value(T())), numbers> here;
      for (int i = 0; i < numbers; ++i) here(i) = plain_value(x(i));
      const auto G = input_in<n>(d, here, at);
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < q; ++j) push(i) += G(i, j) * w(j);
      }
    }
    return SpaceOf<D>::plus(jml::dynamics(d, x, at), push);
  }
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
