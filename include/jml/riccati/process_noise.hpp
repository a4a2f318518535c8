// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// G Q Gᵀ of the dynamics, formed and checked once where it is a constant.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/kernels.hpp>
#include <jml/model/concepts.hpp>
#include <type_traits>

namespace jml {

/// G Q Gᵀ of the dynamics, n×n; Q is a covariance per step, or of continuous dynamics a spectral density.
/// Where G and Q are constants it is formed and checked once, here; a filter keeps this object beside its
/// dynamics. Otherwise it is formed at each step, frozen at the estimate.
template <typename Scalar, typename D>
class ProcessNoise {
  using Traits = DynamicsTraits<D>;
  static constexpr int n = Traits::states, q = Traits::disturbances;
  using X = Vector<Scalar, n>;
  using At = detail::Context<Scalar, D>;
  static constexpr bool identity_input = !has_disturbance_input<D, X, At>();
  static_assert(
      !requires { &D::disturbance_input; } || !identity_input,
      "jml: disturbance_input exists but does not accept (), (x) or (x, at): check its arguments and const");
  static_assert(!identity_input || q == 0 || q == n,
                "jml: the dynamics have fewer disturbances than states: give disturbance_input(), n×q");
  static constexpr bool continuous = ContinuousDynamics<D>;
  using Q = std::conditional_t<continuous, detail::hooks::DisturbanceSpectralDensity,
                               detail::hooks::DisturbanceCovariance>;

 public:
  /// G and Q are the same at every state and time.
  static constexpr bool constant =
      q == 0 || (detail::ConstantHook<Q, D, X, At> &&
                 (identity_input || detail::ConstantHook<detail::hooks::DisturbanceInput, D, X, At>));

  /// Asks a constant Q and G once.
  explicit ProcessNoise(const D& d) {
    if constexpr (constant) valid_ = form(d, kernel::zeros<X>(), At{}, noise_);
  }

  /// False where a constant Q is not finite, not symmetric or indefinite, or a constant G not finite.
  [[nodiscard]] bool valid() const { return valid_; }

  /// use(G Q Gᵀ) at x; false, and not called, where Q is not finite, not symmetric or indefinite, or G is not
  /// finite.
  template <typename Function>
  [[nodiscard]] JML_INLINE bool with(const D& d, const X& x, const At& at, const Function& use) const {
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
      Matrix<Scalar, q, q> covariance;
      if constexpr (continuous)
        covariance = disturbance_spectral_density(d, x, at);
      else
        covariance = disturbance_covariance(d, x, at);
      if (!is_covariance(covariance)) return false;
      if constexpr (identity_input && q == n) {
        out = covariance;
      } else {
        const Matrix<Scalar, n, q> G = disturbance_input(d, x, at);
        Matrix<Scalar, n, q> GQ;
        kernel::product(G, covariance, GQ);                 // G Q
        kernel::add_symmetric_product<1>(out, GQ, G, out);  // G Q Gᵀ
        return all_finite(out);
      }
    }
    return true;
  }

  struct Nothing {};
  [[no_unique_address]] std::conditional_t<constant, Matrix<Scalar, n, n>, Nothing> noise_{};
  bool valid_ = true;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
