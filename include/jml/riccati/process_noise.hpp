// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// G Q Gᵀ of the dynamics, formed and checked once where it is a constant.
#pragma once

#include <jml/kernels.hpp>
#include <jml/model/concepts.hpp>
#include <type_traits>

namespace jml::detail {

/// G Q Gᵀ of the dynamics, n×n; Q is a covariance per step, or of continuous dynamics a spectral density.
/// Where G and Q are constants it is formed and checked once, here; a filter keeps this object beside its
/// dynamics. Otherwise it is formed at each step, frozen at the estimate.
template <typename Scalar, typename D>
class ProcessNoise {
  using Traits = DynamicsTraits<D>;
  static constexpr int n = Traits::states, q = Traits::disturbances;
  using X = Vector<Scalar, n>;
  using At = StepContext<Scalar, Traits::controls>;
  static constexpr bool identity_input = !has_disturbance_input<D, X, At>();
  static_assert(
      !requires { &D::disturbance_input; } || !identity_input,
      "jml: disturbance_input exists but does not accept (), (x) or (x, at): check its arguments and const");
  static_assert(!identity_input || q == 0 || q == n,
                "jml: the dynamics have fewer disturbances than states: give disturbance_input(), n×q");
  static constexpr bool continuous = ContinuousDynamics<D>;
  // Whether Q may be asked with these arguments.
  template <typename... A>
  static constexpr bool gives_Q() {
    if constexpr (continuous)
      return requires(const D& d, const A&... a) { Traits::disturbance_spectral_density(d, a...); };
    else
      return requires(const D& d, const A&... a) { Traits::disturbance_covariance(d, a...); };
  }

 public:
  /// G and Q are the same at every state and time.
  static constexpr bool constant =
      q == 0 || (gives_Q<>() && !gives_Q<X>() && !gives_Q<X, At>() &&
                 (identity_input || requires(const D& d) { Traits::disturbance_input(d); }));

  explicit ProcessNoise(const D& d) {
    if constexpr (constant) valid_ = form(d, kernel::zeros<X>(), At{}, noise_);
  }

  /// False where a constant Q is no covariance.
  [[nodiscard]] bool valid() const { return valid_; }

  /// False where Q is not finite, not symmetric or indefinite, or G is not finite.
  template <typename Function>
  [[nodiscard]] JML_INLINE bool with(const D& d, const X& x, const At& at,
                                              const Function& use) const {
    if constexpr (constant) {
      if (valid_) use(noise_);
      return valid_;
    } else {
      Matrix<Scalar, n, n> noise;
      const bool valid = form(d, x, at, noise);
      if (valid) use(noise);
      return valid;
    }
  }

 private:
  static bool form(const D& d, const X& x, const At& at, Matrix<Scalar, n, n>& out) {
    kernel::set_zero(out);
    if constexpr (q > 0) {
      Matrix<Scalar, q, q> Q;
      if constexpr (continuous)
        Q = disturbance_spectral_density(d, x, at);
      else
        Q = disturbance_covariance(d, x, at);
      if (!is_covariance(Q)) return false;
      if constexpr (identity_input && q == n) {
        out = Q;
      } else {
        const Matrix<Scalar, n, q> G = disturbance_input(d, x, at);
        Matrix<Scalar, n, q> GQ;
        kernel::product(G, Q, GQ);
        kernel::add_symmetric_product<1>(out, GQ, G, out);
        return all_finite(out);
      }
    }
    return true;
  }

  struct Nothing {};
  [[no_unique_address]] std::conditional_t<constant, Matrix<Scalar, n, n>, Nothing> noise_{};
  bool valid_ = true;
};

}  // namespace jml::detail
