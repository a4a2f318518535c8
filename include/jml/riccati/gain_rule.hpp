// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Table 1 of the JML paper (Rusnak 2015) as types: which matrix stands in each slot of the one recursion
///   N = A P Bᵀ + G Q Gᵀ,   P⁺ = [N⁻¹ + Dᵀ R⁻¹ E]⁻¹,   gain P⁺ Dᵀ R⁻¹.
///
/// |        | A   | B   | D   | E   |                      |
/// |--------|-----|-----|-----|-----|----------------------|
/// | EKF    | f_x | f_x | m_x | m_x | eq. (16)             |
/// | SDDRE  | F   | F   | M   | M   | eq. (17)             |
/// | JML    | F   | f_x | m_x | M   | eq. (14), nonsymmetric |
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/image/parts.hpp>
#include <jml/model/concepts.hpp>

namespace jml {

/// What stands in a slot: a Jacobian or a SDC matrix, or a kind of one's own, a value of an empty struct with
///   matrix(derivative, x, r), the n×n or p×n matrix for f or m, where derivative(z) is its Jacobian at z,
///   x the estimate or the prediction, and r the reference point of the rule.
enum class Slot { jacobian, sdc };

/// The same kind of matrix stands in both slots.
template <auto a, auto b>
inline constexpr bool same_slot = false;
/// The same.
template <auto a>
inline constexpr bool same_slot<a, a> = true;

/// Where A and B are evaluated. Eq. (9) with x_{i/i+1} ≅ x̂_i gives the estimate, which is also the textbook
/// EKF; eqs. (14), (16), (17) print the prediction x̄_{i+1}.
enum class EvaluatedAt { estimate, prediction };

/// A row of the table, the reference point of its SDC matrices, and the point of A and B.
template <auto a, auto b, auto d, auto e, typename Reference_ = AboutOrigin,
          EvaluatedAt point = EvaluatedAt::estimate>
struct GainRule {
  using Reference = Reference_;  ///< of the SDC matrices
  static constexpr auto A = a;   ///< slot, see the table
  static constexpr auto B = b;   ///< slot
  static constexpr auto D = d;   ///< slot
  static constexpr auto E = e;   ///< slot
  /// P is symmetric, a covariance to first order.
  static constexpr bool symmetric = same_slot<a, b> && same_slot<d, e>;
  static constexpr EvaluatedAt evaluated_at = point;  ///< where A and B are evaluated
  static constexpr bool about_origin = std::is_same_v<Reference, AboutOrigin>;  ///< the reference is x = 0
  /// The reference is the estimate.
  static constexpr bool about_estimate = std::is_same_v<Reference, AboutEstimate>;
  static constexpr bool uses_sdc =  ///< false: the reference plays no part
      !(same_slot<a, Slot::jacobian> && same_slot<b, Slot::jacobian> && same_slot<d, Slot::jacobian> &&
        same_slot<e, Slot::jacobian>);

  [[no_unique_address]] Reference reference{};  ///< of a named point: that one

  /// The reference point r of F(x; r), given the estimate it would follow.
  template <typename Scalar, int n>
  constexpr Vector<Scalar, n> reference_point(const Vector<Scalar, n>& estimate) const {
    if constexpr (about_origin)
      return kernel::zeros<Vector<Scalar, n>>();
    else if constexpr (about_estimate)
      return estimate;
    else
      return kernel::cast<Scalar>(reference.point);
  }
};

/// The linear Kalman filter, eq. (7). Refuses at compile time a model that does not say it is linear.
struct Kalman : GainRule<Slot::jacobian, Slot::jacobian, Slot::jacobian, Slot::jacobian> {
  static constexpr bool linear_only = true;  ///< such a model alone
};

/// The extended Kalman filter, eq. (16).
template <EvaluatedAt point = EvaluatedAt::estimate>
struct Ekf : GainRule<Slot::jacobian, Slot::jacobian, Slot::jacobian, Slot::jacobian, AboutOrigin, point> {};

/// The state-dependent difference Riccati equation filter, eq. (17).
template <typename Reference = AboutOrigin, EvaluatedAt point = EvaluatedAt::estimate>
struct Sddre : GainRule<Slot::sdc, Slot::sdc, Slot::sdc, Slot::sdc, Reference, point> {
  constexpr Sddre()
    requires(std::is_empty_v<Reference>)  // a point must be given
  = default;
  constexpr explicit Sddre(const Reference& about) { this->reference = about; }  ///< about a reference point
};

/// The one-pass (non-iterative) joint maximum likelihood filter, eq. (14).
template <typename Reference = AboutOrigin, EvaluatedAt point = EvaluatedAt::estimate>
struct Jml : GainRule<Slot::sdc, Slot::jacobian, Slot::jacobian, Slot::sdc, Reference, point> {
  constexpr Jml()
    requires(std::is_empty_v<Reference>)  // a point must be given
  = default;
  constexpr explicit Jml(const Reference& about) { this->reference = about; }  ///< about a reference point
};

/// The recursive nonlinear least squares filter (Rusnak 2018, eq. (19)): the JML row in continuous time.
template <typename Reference = AboutOrigin>
struct Rnls : Jml<Reference> {
  constexpr Rnls()
    requires(std::is_empty_v<Reference>)
  = default;
  constexpr explicit Rnls(const Reference& about) : Jml<Reference>(about) {}  ///< about a reference point
};

template <typename Reference, EvaluatedAt point>
struct PartsOf<Sddre<Reference, point>> {
  static auto each(auto& rule, auto&& f) { return f(rule.reference); }
};
template <typename Reference, EvaluatedAt point>
struct PartsOf<Jml<Reference, point>> {
  static auto each(auto& rule, auto&& f) { return f(rule.reference); }
};
template <typename Reference>
struct PartsOf<Rnls<Reference>> : PartsOfBase<Rnls<Reference>, Jml<Reference>> {};

/// A rule of the one-pass recursion.
template <typename Rule>
concept OnePassRule = requires {
  { Rule::symmetric } -> std::convertible_to<bool>;
  Rule::A;
  Rule::E;
} && !requires { typename Rule::Inner; } && !requires {
  typename Rule::template Belief<double, OfStates<1>>;
};

/// F(x; r) or f_x(x), as the slot says.
template <auto slot, typename Rule, typename Scalar, int n, typename D, typename At>
JML_INLINE inline Matrix<Scalar, n, n> dynamics_slot(const Rule& rule, const D& d, const Vector<Scalar, n>& x,
                                                     const Vector<Scalar, n>& estimate, const At& at) {
  if constexpr (same_slot<slot, Slot::jacobian>) {
    return dynamics_jacobian(d, x, at);
  } else if constexpr (!same_slot<slot, Slot::sdc>) {
    return slot.matrix([&](const Vector<Scalar, n>& z) { return dynamics_jacobian(d, z, at); }, x,
                       rule.reference_point(estimate));
  } else {
    return dynamics_sdc<Rule::about_origin>(d, x, rule.reference_point(estimate), at);
  }
}

/// M(x; r) or m_x(x), as the slot says.
template <auto slot, typename Rule, typename Scalar, int n, typename S, typename At>
JML_INLINE inline Matrix<Scalar, measurements_of<S>, n> sensor_slot(const Rule& rule, const S& s,
                                                                    const Vector<Scalar, n>& x,
                                                                    const Vector<Scalar, n>& prediction,
                                                                    const At& at) {
  if constexpr (same_slot<slot, Slot::jacobian>) {
    return measurement_jacobian(s, x, at);
  } else if constexpr (!same_slot<slot, Slot::sdc>) {
    return slot.matrix([&](const Vector<Scalar, n>& z) { return measurement_jacobian(s, z, at); }, x,
                       rule.reference_point(prediction));
  } else {
    return measurement_sdc<Rule::about_origin>(s, x, rule.reference_point(prediction), at);
  }
}

}  // namespace jml
#include <jml/warnings_end.hpp>
