// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The states of an interval in twice the digits, where its start is known better than Scalar can say: what
/// they lose to rounding no disturbance explains, and dynamics that expand make more of it.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored_belief.hpp>
#include <jml/filter/known_states.hpp>

namespace jml::detail {

/// The store of an interval is a window.
template <typename Store>
inline constexpr bool slides = requires { Store::longest; };

/// What Scalar does not hold of the state at a node of linear dynamics. Nothing where the start is known to
/// no more digits than Scalar has.
template <typename D, typename Scalar>
struct AllDigits {
  static constexpr int n = states_of<D>;
  using X = Vector<Scalar, n>;
  bool any = false;
  X low = kernel::zeros<X>();

  /// `slides`: of a window. What moves its start by an ulp between two of its minimisations tells in J,
  /// unless all of it is known exactly.
  AllDigits(const FactoredBelief<Scalar, n>& start, bool slides) {
    if constexpr (DynamicsTraits<D>::linear) {
      bool known = true;
      for (int i = 0; i < n; ++i) {
        any = any || low_digits_tell(std::numeric_limits<Scalar>::epsilon() * start.x(i), start.D(i));
        known = known && start.D(i) == Scalar(0);
      }
      any = any && (known || !slides);
      if (any) low = start.x_low;
    }
  }

  /// x_0 = x̂_0 + L a, into x.
  JML_RARE void begin(const X& start, const Matrix<Scalar, n, n>& L, const X& a, X& x) {
    for (int i = 0; i < n; ++i) {
      Extended<Scalar> sum = as_one(start(i), low(i));
      for (int k = 0; k < n; ++k) sum = sum + Extended<Scalar>(L(i, k)) * Extended<Scalar>(a(k));
      keep(i, sum, x);
    }
  }
  /// Over the step to node j, with its whitened disturbance b, from a state whose upper part is `before`;
  /// into x.
  template <typename Store, int q>
  JML_RARE void move(const Store& store, int j, const Vector<Scalar, q>& b, const X& before, X& x) {
    using T = Extended<Scalar>;
    const auto at = store.node(j).at();
    const auto& root = store.root(j);
    const Matrix<Scalar, n, n> A = dynamics_jacobian(store.dynamics(), before, at);
    const X constant = dynamics(store.dynamics(), kernel::zeros<X>(), at) + root.mean_effect, rest = low;
    for (int i = 0; i < n; ++i) {
      T sum(constant(i));
      for (int k = 0; k < n; ++k) sum = sum + T(A(i, k)) * as_one(before(k), rest(k));
      for (int k = 0; k < q; ++k) sum = sum + T(root.B(i, k)) * T(b(k));
      keep(i, sum, x);
    }
  }
  /// The state of the last node, from x_0 on: nodes hold upper parts alone.
  template <typename Store>
  [[nodiscard]] JML_RARE X follow(const Store& store, const X& start, const Matrix<Scalar, n, n>& L,
                                  const X& a) {
    X before, after;
    begin(start, L, a, before);
    for (int j = 1; j <= store.last(); ++j, before = after)
      move(store, j, store.node(j).b[store.now()], before, after);
    return before;
  }

 private:
  void keep(int i, const Extended<Scalar>& value, X& x) {
    const auto parts = in_two<Scalar>(value);
    x(i) = parts.high;
    low(i) = parts.low;
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
