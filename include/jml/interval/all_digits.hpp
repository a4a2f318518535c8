// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The states of an interval in twice the digits, where its start, or a state given later measurements, is
/// known better than Scalar can say: what they lose to rounding no disturbance explains, and dynamics that
/// expand make more of it.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/factored_belief.hpp>
#include <jml/filter/known_states.hpp>

namespace jml::detail {

/// What Scalar does not hold of the state at a node of linear dynamics. Nothing where the start is known to
/// no more digits than Scalar has.
template <typename D, typename Scalar>
struct AllDigits {
  static constexpr int n = states_of<D>;
  using X = Vector<Scalar, n>;
  X low = kernel::zeros<X>();

  explicit AllDigits(const FactoredBelief<Scalar, n>& start) {
    if (known(start)) low = start.x_low;
  }
  /// An ε of some state of the start is no small part of its deviation.
  [[nodiscard]] static bool known(const FactoredBelief<Scalar, n>& start) {
    bool tell = false;
    if constexpr (DynamicsTraits<D>::linear) {
      for (int i = 0; i < n; ++i)
        tell = tell || low_digits_tell(std::numeric_limits<Scalar>::epsilon() * start.x(i), start.D(i));
    }
    return tell;
  }

  /// The same of node j on the nominal, given the measurements after it, which `information` is of: dynamics
  /// that expand make more of what rounding left, and no disturbance explains it.
  template <typename Store, typename Information>
  [[nodiscard]] static JML_RARE bool told_later(Store& store, int j, Information& information) {
    if constexpr (!DynamicsTraits<D>::linear) return false;
    const int now = store.now();
    const auto& prior = store.prior();
    const X from = j > 0 ? X(store.node(j - 1).x[now]) : X(prior.a[now]);
    const Matrix<Scalar, n, n> A =
        j > 0 ? dynamics_jacobian(store.dynamics(), from, store.node(j).at()) : prior.L;
    X sizes;
    for (int i = 0; i < n; ++i) {
      sizes(i) = std::abs(store.node(j).x[now](i));
      for (int k = 0; k < n; ++k) sizes(i) += std::abs(A(i, k) * from(k));
    }
    const Scalar deviations =
        std::numeric_limits<Scalar>::epsilon() * information.deviations_in(sizes.data());
    return !(deviations <= plain_error<Scalar> / 10);
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
  /// The state of the last node, from x_0 on: nodes hold upper parts alone. `rest`: what it lacks.
  template <typename Store, typename Prior>
  [[nodiscard]] static JML_RARE X last(const Store& store, const Prior& prior, X* rest = nullptr) {
    AllDigits digits(store.start());
    X before, x;
    digits.begin(prior.x, prior.L, prior.a[static_cast<std::size_t>(store.now())], x);
    for (int j = 1; j <= store.last(); ++j) {
      before = x;
      digits.move(store, j, store.node(j).b[store.now()], before, x);
    }
    if (rest != nullptr) *rest = digits.low;
    return x;
  }
  /// a of node 0, as Prior::coordinates() has it, of a window with `L` that has slid: it was node 1 of the
  /// one that began at `start` with `prior`.
  template <typename Store, typename Prior>
  [[nodiscard]] static JML_RARE X arrived(const Store& store, const FactoredBelief<Scalar, n>& start,
                                          const Prior& prior, const Matrix<Scalar, n, n>& L) {
    using T = Extended<Scalar>;
    const AllDigits mean(store.start());
    AllDigits digits(start);
    X before, x, a;
    digits.begin(prior.x, prior.L, prior.a[static_cast<std::size_t>(store.now())], before);
    digits.move(store, 0, store.node(0).b[store.now()], before, x);
    T rest[n];
    for (int i = 0; i < n; ++i) rest[i] = digits.left(x, store.start().x, mean, i);
    for (int j = n - 1; j >= 0; --j) {
      a(j) = L(j, j) > Scalar(0) ? in_two<Scalar>(rest[j]).high / L(j, j) : Scalar(0);
      for (int i = 0; i < j; ++i) rest[i] = rest[i] - T(L(i, j)) * T(a(j));
    }
    return a;
  }
  /// x - `other`, whose lower part is that of `digits`.
  [[nodiscard]] JML_RARE X off(const X& x, const X& other, const AllDigits& digits) const {
    X out;
    for (int i = 0; i < n; ++i) out(i) = in_two<Scalar>(left(x, other, digits, i)).high;
    return out;
  }

 private:
  Extended<Scalar> left(const X& x, const X& other, const AllDigits& digits, int i) const {
    return as_one(x(i), low(i)) - as_one(other(i), digits.low(i));
  }
  void keep(int i, const Extended<Scalar>& value, X& x) {
    const auto parts = in_two<Scalar>(value);
    x(i) = parts.high;
    low(i) = parts.low;
  }
};

/// In place of BothInDigits.
struct NotInDigits {
  explicit NotInDigits(const auto&) {}
};
/// A trajectory and the nominal that it is led along, side by side.
template <typename D, typename Scalar>
struct BothInDigits {
  static constexpr int n = states_of<D>;
  using X = Vector<Scalar, n>;
  AllDigits<D, Scalar> digits, nominal;
  X beside = kernel::zeros<X>();
  bool follows = false;  // the nominal is a trajectory too, and no guess

  explicit BothInDigits(const auto& store) : digits(store.start()), nominal(digits) {}
  template <typename Prior>
  void begin(const Prior& prior, int now, int next, bool infeasible, X& x) {
    follows = !infeasible;
    digits.begin(prior.x, prior.L, prior.a[static_cast<std::size_t>(next)], x);
    if (follows) nominal.begin(prior.x, prior.L, prior.a[static_cast<std::size_t>(now)], beside);
  }
  /// x - x̃.
  void off(const X& x, X& out) const {
    if (follows) out = digits.off(x, beside, nominal);
  }
  template <typename Store, int q>
  void move(const Store& store, int j, const Vector<Scalar, q>& b, const Vector<Scalar, q>& nominal_b,
            const X& before, X& x) {
    digits.move(store, j, b, before, x);
    if (follows) nominal.move(store, j, nominal_b, X(beside), beside);
  }
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
