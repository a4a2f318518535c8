// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Noise as an argument: x⁺ = f(x, w) and y = m(x, v) (Rusnak 2015, eqs. (2), (3)), where it does not just
/// add.
///
/// What enters a recursion is then f_w Q f_wᵀ and m_v R m_vᵀ, derived here at the noise's mean (w̄, or zero).
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/call.hpp>
#include <jml/model/jacobian.hpp>

namespace jml::detail {

/// The model has it as (x, v, at), or as (x, v) where its second argument is no StepContext.
template <typename Hook, typename Model, typename X, typename V, typename At>
concept ReadsNoiseAt =
    requires(const Model& m, const X& x, const V& v, const At& at) { Hook::of(m, x, v, at); };
template <typename Hook, typename Model, typename X, typename V, typename At>
concept ReadsNoiseAlone = (!ReadsContext<Hook, Model, X, At>) && (V::RowsAtCompileTime > 0) &&
                          requires(const Model& m, const X& x, const V& v) { Hook::of(m, x, v); };
template <typename Hook, typename Model, typename X, typename V, typename At>
concept ReadsNoise = ReadsNoiseAt<Hook, Model, X, V, At> || ReadsNoiseAlone<Hook, Model, X, V, At>;

/// Its value there.
template <typename Hook, typename Model, typename X, typename V, typename At>
constexpr auto ask_noisy(const Model& model, const X& x, const V& v, const At& at) {
  if constexpr (ReadsNoiseAt<Hook, Model, X, V, At>)
    return Hook::of(model, x, v, at);
  else
    return Hook::of(model, x, v);
}

template <typename S>
constexpr int noises_of_sensor() {
  if constexpr (requires { SensorTraits<S>::noises; })
    return SensorTraits<S>::noises;
  else
    return SensorTraits<S>::measurements;
}

/// f(x, w) and m(x, v) in the scalar T.
template <typename D, typename T, int n, typename At>
concept NoisyDynamicsIn =
    ReadsNoise<hooks::Dynamics, D, Vector<T, n>, Vector<T, DynamicsTraits<D>::disturbances>, At>;
template <typename S, typename T, int n, typename At>
concept NoisySensorIn = ReadsNoise<hooks::Measurement, S, Vector<T, n>, Vector<T, noises_of_sensor<S>()>, At>;

/// Refuses, in words, m(x, v) where only m(x) + v would be right.
template <typename S, typename X, typename At>
consteval bool require_additive_noise() {
  constexpr bool additive = !NoisySensorIn<S, typename X::Scalar, int(X::RowsAtCompileTime), At>;
  static_assert(
      additive,
      "jml: this sensor takes its noise as an argument, m(x, v), and the method iterates: say `using Space = "
      "jml::Euclidean<n>;` in the dynamics, so that they are run in local coordinates");
  return additive;
}

/// w̄ in the scalar T, of which only the value is read.
template <typename T, typename D, int n, typename At>
Vector<T, DynamicsTraits<D>::disturbances> mean_disturbance(const D& d, const Vector<T, n>& x, const At& at) {
  constexpr int q = DynamicsTraits<D>::disturbances;
  using Plain = decltype(plain_value(T()));
  Vector<T, q> w = kernel::zeros<Vector<T, q>>();
  if constexpr (HasHook<hooks::DisturbanceMean, D, Vector<Plain, n>, At>) {
    Vector<Plain, n> here;
    for (int i = 0; i < n; ++i) here(i) = plain_value(x(i));
    const Vector<Plain, q> mean = evaluate<hooks::DisturbanceMean, q, 1>(d, here, at);
    for (int i = 0; i < q; ++i) w(i) = T(mean(i));
  }
  return w;
}

/// The derivative of a noisy function by its noise at v, rows×r.
template <typename Hook, int rows, typename Model, typename T, int n, int r, typename At>
Matrix<T, rows, r> noise_slope(const Model& model, const Vector<T, n>& x, const Vector<T, r>& v,
                               const At& at) {
  return derive_jacobian<rows>(
      [&](const auto& z) {
        using Z = typename std::remove_cvref_t<decltype(z)>::Scalar;
        Vector<Z, n> here;
        for (int i = 0; i < n; ++i) here(i) = Z(x(i));
        return ask_noisy<Hook>(model, here, z, at);
      },
      v);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
