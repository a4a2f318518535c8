// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A model in local coordinates: what every recursion in ℝⁿ needs to run on a state in a space.
///
/// x = from ⊞ z before a step, x = to ⊞ z after it, and the recursion sees z alone (n = degrees of freedom):
///   φ(z) = f(from ⊞ z, w) ⊟ to,   μ(z) = m(to ⊞ z, v).
/// Additive disturbances of a model in a space act on the right, f(x, w) = f(x) ⊞ G w. The points, and the w
/// about which φ is linearised in w, travel in the context of a step, so that the nodes of an interval each
/// have their own. Then x⁺ = φ(z) + φ_w (ω - w): exact in z, and exact in ω where it equals w, which an
/// estimator that iterates sees to (theory: the stationarity conditions of J with f(x, w) are those of this
/// form there).
#include <jml/warnings_begin.hpp>
#pragma once

#include <cstdint>
#include <jml/model/concepts.hpp>
#include <jml/model/part.hpp>

namespace jml::detail {

/// Where an exact step looks for its root. `everywhere`: from its prediction, and for lower minima too;
/// `prediction`: from there alone; `slope`: near a root that is known, from x_s = slope_at.
enum class Search : std::uint8_t { everywhere, prediction, slope };

/// A step between two charts.
template <typename Scalar, typename D>
struct LocalContext : StepContext<Scalar, DynamicsTraits<D>::controls> {
  using Plain = StepContext<Scalar, DynamicsTraits<D>::controls>;
  using Point = Vector<Scalar, states_of<D>>;
  using Noise = Vector<Scalar, DynamicsTraits<D>::disturbances>;

  Point from = SpaceOf<D>::template origin<Scalar>(), to = from;
  Noise w = kernel::zeros<Noise>();
  /// Where `frozen`, φ_w is that at this z: of an exact step, which forms it once.
  Vector<Scalar, SpaceOf<D>::tangent> slope_at = kernel::zeros<Vector<Scalar, SpaceOf<D>::tangent>>();
  bool frozen = false;
  Search search = Search::everywhere;

  LocalContext() = default;
  explicit LocalContext(const Plain& at) : Plain(at) {}

  auto each_part(auto&& f) { return f(static_cast<Plain&>(*this), from, to, w, slope_at, frozen); }
};
template <typename Scalar, typename D>
[[nodiscard]] LocalContext<Scalar, D> end_of(const LocalContext<Scalar, D>& at) {
  LocalContext<Scalar, D> out = at;
  static_cast<typename LocalContext<Scalar, D>::Plain&>(out) =
      end_of(static_cast<const typename LocalContext<Scalar, D>::Plain&>(at));
  out.from = at.to;
  return out;
}

template <typename T, typename Scalar, int n>
[[nodiscard]] Vector<T, n> cast_to(const Vector<Scalar, n>& x) {
  Vector<T, n> out;
  for (int i = 0; i < n; ++i) out(i) = T(x(i));
  return out;
}
template <typename T, int n>
[[nodiscard]] auto plain_values(const Vector<T, n>& x) {
  Vector<decltype(plain_value(T())), n> out;
  for (int i = 0; i < n; ++i) out(i) = plain_value(x(i));
  return out;
}
template <typename V>
[[nodiscard]] bool all_zero(const V& v) {
  bool zero = true;
  for (int i = 0; i < int(V::RowsAtCompileTime); ++i) zero = zero && plain_value(v(i)) == 0;
  return zero;
}

/// f(x, w) of the model in the scalar T of w, or f(x) ⊞ G w with G at the value of x.
template <typename T, typename D, int numbers, int q, typename At>
[[nodiscard]] Vector<T, numbers> moved(const D& d, const Vector<T, numbers>& x, const Vector<T, q>& w,
                                       const At& at) {
  if constexpr (NoisyDynamicsIn<D, T, numbers, At>) {
    return ask_noisy<hooks::Dynamics>(d, x, w, at);
  } else {
    constexpr int n = degrees_of<D>;
    const Vector<T, numbers> f = dynamics(d, x, at);
    if constexpr (q == 0) {
      return f;
    } else {
      if constexpr (std::is_floating_point_v<T>) {
        if (all_zero(w)) return f;
      }
      const auto G = input_in<n>(d, plain_values(x), at);
      Vector<T, n> push = kernel::zeros<Vector<T, n>>();
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < q; ++j) push(i) += G(i, j) * w(j);
      }
      return SpaceOf<D>::plus(f, push);
    }
  }
}
/// So many derivatives are taken at once: dual numbers with many partials are large, and slow on a small
/// processor (Cortex-M7, strapdown: f_x by five 18 000 instructions, by fifteen three times as many).
constexpr int derivatives_at_once(int n) { return n <= 6 ? n : 5; }
/// x with ε_j of m in its entry first + j.
template <int m, typename Scalar, int n>
[[nodiscard]] Vector<Dual<Scalar, m>, n> seed_from(const Vector<Scalar, n>& x, int first) {
  Vector<Dual<Scalar, m>, n> out;
  for (int i = 0; i < n; ++i) {
    out(i) = x(i);
    if (i >= first && i < first + m) out(i).partial[i - first] = Scalar(1);
  }
  return out;
}
/// Columns from `first` on, as many as there are.
template <typename Scalar, int rows, int cols, int m>
void set_columns(Matrix<Scalar, rows, cols>& out, int first, const Matrix<Scalar, rows, m>& columns) {
  for (int j = 0; j < m && first + j < cols; ++j) {
    for (int i = 0; i < rows; ++i) out(i, first + j) = columns(i, j);
  }
}

/// The model runs in the scalar T.
template <typename D, typename T, typename At>
concept MovesIn = Generic<HookOf<hooks::Dynamics, D>, Vector<T, states_of<D>>, At> ||
                  NoisyDynamicsIn<D, T, states_of<D>, At>;
template <typename S, typename T, int numbers, typename At>
concept MeasuresIn =
    Generic<HookOf<hooks::Measurement, S>, Vector<T, numbers>, At> || NoisySensorIn<S, T, numbers, At>;

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
