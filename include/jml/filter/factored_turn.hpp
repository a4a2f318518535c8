// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// P ← J P Jᵀ of a belief in factors: what filter/local_belief.hpp does where a state in a space has been
/// corrected.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored_in_two.hpp>
#include <jml/filter/local_belief.hpp>

namespace jml::detail {

template <typename Scalar, int n>
[[nodiscard]] bool turn(FactoredBelief<Scalar, n>& belief, const ChartSlope<Scalar, n>& slope) {
  const Matrix<Scalar, n, n>& J = slope.J;
  kernel::set_zero(belief.x);
  kernel::set_zero(belief.x_low);
  if (!belief.extended) {
    kernel::Padded<Scalar, n, n> W;
    FactoredBelief<Scalar, n> next;
    Vector<Scalar, n> sizes = kernel::zeros<Vector<Scalar, n>>();
    for (int k = 0; k < n; ++k) {
      for (int i = 0; i < kernel::Strip<Scalar, n>::padded; ++i) W(i, k) = Scalar(0);
      for (int i = 0; i < n; ++i) sizes(i) += J(i, k) * J(i, k) * belief.variances(k);
    }
    kernel::times_unit_upper<Scalar, n, n>(J, belief.U, W);  // J U
    kernel::orthogonalise<false, Scalar, n, n>(W, belief.D, next);
    if (settle(next, sizes)) {
      commit(belief, next);
      return true;
    }
  }
  ExtendedMemory<Scalar, n, 0, 0> memory;
  ExtendedStep<Scalar> two(memory);
  two.load(belief.U.data(), belief.D.data(), belief.extended ? belief.U_low.data() : nullptr,
           belief.extended ? belief.D_low.data() : nullptr);
  two.load_state(belief.x.data(), nullptr);
  return two.move(J.data(), nullptr, nullptr, nullptr) && store_extended(two, belief) == Status::ok;
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
