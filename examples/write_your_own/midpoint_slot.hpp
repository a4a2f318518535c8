// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A kind of slot of one's own in the table of gain rules: a SDC matrix by one evaluation of the Jacobian.
///
/// F(x; r) with F (x - r) = f(x) - f(r) is ∫₀¹ f_x(r + s (x - r)) ds. By the midpoint rule that is f_x((x +
/// r)/2): exact where f is quadratic or linear; else off by |x - r|² f'''/24, where the library's derived SDC
/// matrices take eight evaluations and leave nothing.
#pragma once

#include <jml/jml.hpp>

namespace own {

/// The slot. x and r are n; derivative(z) is n×n or p×n, and so is the result.
// [slot]
struct Midpoint {
  template <typename Derivative, typename Scalar, int n>
  constexpr auto matrix(const Derivative& derivative, const jml::Vector<Scalar, n>& x,
                        const jml::Vector<Scalar, n>& r) const {
    const jml::Vector<Scalar, n> half_way = (x + r) / Scalar(2);
    return derivative(half_way);
  }
};
// [/slot]

/// The row of SDDRE with midpoint matrices, and symmetric as that. Reference: jml::AboutOrigin,
/// jml::AboutPoint, or jml::AboutEstimate, which makes it the EKF.
template <typename Reference = jml::AboutOrigin>
struct MidpointSddre : jml::GainRule<Midpoint{}, Midpoint{}, Midpoint{}, Midpoint{}, Reference> {
  constexpr MidpointSddre()
    requires(std::is_empty_v<Reference>)  // a point must be given
  = default;
  constexpr explicit MidpointSddre(const Reference& about) { this->reference = about; }
};

/// The row of JML likewise; nonsymmetric.
template <typename Reference = jml::AboutOrigin>
struct MidpointJml
    : jml::GainRule<Midpoint{}, jml::Slot::jacobian, jml::Slot::jacobian, Midpoint{}, Reference> {
  constexpr MidpointJml()
    requires(std::is_empty_v<Reference>)
  = default;
  constexpr explicit MidpointJml(const Reference& about) { this->reference = about; }
};

}  // namespace own
