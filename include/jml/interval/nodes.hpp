// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What an interval of the criterion J (Rusnak 2015, eq. (5)) consists of: a prior, nodes, and the
/// measurements of each node. Batch keeps it in reserved memory, FixedLag in static memory;
/// interval/sweep.hpp works on either.
#include <jml/warnings_begin.hpp>
#pragma once

#include <array>
#include <jml/filter/factored_belief.hpp>
#include <jml/interval/costate.hpp>
#include <jml/interval/noise_root.hpp>
#include <jml/model/sensors.hpp>
#include <jml/riccati/difference.hpp>
#include <tuple>

namespace jml::detail {

/// Takes no room where a model does not need it.
struct Nothing {};

/// Zeros.
template <int copies, typename V>
std::array<V, copies> copies_of() {
  std::array<V, copies> out;
  out.fill(kernel::zeros<V>());
  return out;
}

/// A state and the step that leads to it. Two of each, so that a trial never touches the nominal; or three,
/// so that a whole minimisation can be taken back.
template <typename Scalar, typename D, bool keeps_context, int copies = 2>
struct IntervalNode {
  using Root = NoiseRoot<Scalar, D>;
  static constexpr int n = Root::n, q = Root::q;
  using At = typename Root::At;

  std::array<Vector<Scalar, n>, copies> x = copies_of<copies, Vector<Scalar, n>>();
  std::array<Vector<Scalar, q>, copies> b = copies_of<copies, Vector<Scalar, q>>();  // whitened disturbance
  Feedback<Scalar, n, q> law{};
  [[no_unique_address]] std::conditional_t<Root::constant, Nothing, Root> noise{};
  [[no_unique_address]] std::conditional_t<keeps_context, At, Nothing> context{};

  /// The StepContext of the step that leads here.
  [[nodiscard]] JML_INLINE At at() const {
    if constexpr (keeps_context)
      return context;
    else
      return {};
  }
};

template <typename Scalar, int p>
JML_NOINLINE bool factor_in_two(const Matrix<Scalar, p, p>& R, kernel::SymmetricFactor<Scalar, p>& out) {
  using T = Extended<Scalar>;
  T L[p * p];
  for (int j = 0; j < p; ++j) {
    T pivot(R(j, j));
    for (int k = 0; k < j; ++k) pivot = pivot - L[j + k * p] * L[j + k * p] * L[k + k * p];
    if (!(in_two<Scalar>(pivot).high > Scalar(0))) return false;
    L[j + j * p] = pivot;
    out.inverse_diagonal(j) = in_two<Scalar>(T(1) / pivot).high;
    for (int i = j + 1; i < p; ++i) {
      T sum(R(i, j));
      for (int k = 0; k < j; ++k) sum = sum - L[i + k * p] * L[j + k * p] * L[k + k * p];
      L[i + j * p] = sum / pivot;
      out.lower(i, j) = in_two<Scalar>(L[i + j * p]).high;
    }
  }
  return true;
}
/// L D Lᵀ of R, by twice the digits where correlations leave a pivot few of those of Scalar.
template <typename Scalar, int p>
bool factor_precisely(const Matrix<Scalar, p, p>& R, kernel::SymmetricFactor<Scalar, p>& out) {
  if (!out.factor(R)) return false;
  if constexpr (p > 1) {
    bool near = true;
    for (int i = 0; i < p; ++i) near = near && R(i, i) * out.inverse_diagonal(i) < Scalar(1e4);
    if (!near) return factor_in_two(R, out);
  }
  return true;
}

/// One measurement, with R factored once; a state-dependent R is frozen at the nominal.
template <typename Scalar, int n, typename S, typename At>
struct Record {
  static constexpr int p = measurements_of<S>;
  static_assert(require_additive_noise<S, Vector<Scalar, n>, At>());
  static constexpr bool varies = !ConstantHook<hooks::NoiseCovariance, S, Vector<Scalar, n>, At>;

  [[no_unique_address]] S sensor;
  Vector<Scalar, p> y = kernel::zeros<Vector<Scalar, p>>();
  kernel::SymmetricFactor<Scalar, p> R{kernel::zeros<Matrix<Scalar, p, p>>(),
                                       kernel::zeros<Vector<Scalar, p>>()};

  /// False where R is no covariance. `moved`: by how many deviations the v moved that m(x, v) is taken at.
  bool freeze(const Vector<Scalar, n>& x, const At& at, Scalar* moved = nullptr) {
    if constexpr (requires { whole_of(sensor).point.v; }) {
      const Vector<Scalar, p> nu = R.solve(measurement_residual(sensor, y, measurement(sensor, x, at)));
      const Scalar by = whole_of(sensor).refreeze(x, nu, at);
      if (moved != nullptr) *moved = by;
    } else if (moved != nullptr) {
      *moved = Scalar(0);
    }
    const Matrix<Scalar, p, p> value = noise_covariance(sensor, x, at);
    return is_noise_covariance(value) && factor_precisely(value, R);
  }
};

/// True where the dynamics or any sensor read time, dt or control, so that nodes must keep them.
template <typename Scalar, typename D, typename List>
constexpr bool keeps_context = true;
template <typename Scalar, typename D, typename... S>
constexpr bool keeps_context<Scalar, D, Sensors<S...>> =
    reads_context<Scalar, D>() ||
    (sensor_reads_context<S, Vector<Scalar, states_of<D>>, Context<Scalar, D>>() || ...);

/// x̂_0, P_0 = L diag(1 / weight) Lᵀ, and the whitened offset a of the nominal x_0 = x̂_0 + L a, with a term
/// ½ Σ weight a² in J. weight is 1, or 0 along a direction of which nothing is known.
template <typename Scalar, int n, int copies = 2>
struct Prior {
  Vector<Scalar, n> x = kernel::zeros<Vector<Scalar, n>>();
  Matrix<Scalar, n, n> L = kernel::zeros<Matrix<Scalar, n, n>>();
  Vector<Scalar, n> weight = kernel::filled<Vector<Scalar, n>>(Scalar(1));
  bool diffuse = false;  // some weight is 0
  std::array<Vector<Scalar, n>, copies> a = copies_of<copies, Vector<Scalar, n>>();
  Vector<Scalar, n> law = kernel::zeros<Vector<Scalar, n>>();  // δa of the last backward pass

  /// x̂_0 and L = U √D.
  void set(const FactoredBelief<Scalar, n>& belief) {
    kernel::assign(x, belief.x);
    diffuse = false;
    for (int j = 0; j < n; ++j) {
      const bool unknown = std::isinf(belief.D(j));
      const Scalar root = unknown ? Scalar(1) : std::sqrt(belief.D(j));
      for (int i = 0; i < n; ++i) L(i, j) = i <= j ? belief.U(i, j) * root : Scalar(0);
      weight(j) = unknown ? Scalar(0) : Scalar(1);
      diffuse = diffuse || unknown;
    }
  }
  /// a of x̂_0 + `off`; zero along what is known exactly.
  [[nodiscard]] Vector<Scalar, n> coordinates(const Vector<Scalar, n>& off) const {
    Vector<Scalar, n> left = off, out;
    for (int j = n - 1; j >= 0; --j) {
      out(j) = L(j, j) > Scalar(0) ? left(j) / L(j, j) : Scalar(0);
      for (int i = 0; i < j; ++i) left(i) -= L(i, j) * out(j);
    }
    return out;
  }
  [[nodiscard]] Vector<Scalar, n> weighted(int which) const {
    Vector<Scalar, n> out = a[static_cast<std::size_t>(which)];
    for (int i = 0; i < n; ++i) out(i) *= weight(i);
    return out;
  }
  /// Σ weight a².
  [[nodiscard]] Scalar squared_norm(int which) const {
    const auto& of = a[static_cast<std::size_t>(which)];
    Scalar sum = 0;
    kernel::repeat<n>([&](int i) JML_INLINE { sum += weight(i) * of(i) * of(i); });
    return sum;
  }
};

/// `noise` and what count_rounding() has left at node 0, against I + Lᵀ Λ L; `lost` where that is singular.
template <typename Scalar, int n, int copies>
[[nodiscard]] JML_NOINLINE Scalar prior_noise(const Prior<Scalar, n, copies>& prior,
                                              const CostToGo<Scalar, n>& v, Scalar noise, Scalar lost) {
  Matrix<Scalar, n, n> C = kernel::transposed(prior.L) * v.information * prior.L, N = v.rounding;
  for (int i = 0; i < n; ++i) N(i, i) += v.information(i, i);
  const Matrix<Scalar, n, n> error = kernel::transposed(prior.L) * N * prior.L;
  C = kernel::symmetric_part(C);
  kernel::add_to_diagonal(C, Scalar(1));
  kernel::SymmetricFactor<Scalar, n> factor;
  if (!factor.factor(C)) return lost;
  for (int c = 0; c < n; ++c) noise += factor.solve(kernel::column_of(error, c))(c);
  return Scalar(4) * noise;
}

/// ½ (x_N - target)ᵀ weight (x_N - target), a term that J does not have; see interval/excess_cost.hpp.
template <typename Scalar, int n>
struct Terminal {
  Vector<Scalar, n> target = kernel::zeros<Vector<Scalar, n>>();
  Matrix<Scalar, n, n> weight = kernel::zeros<Matrix<Scalar, n, n>>();
};

/// What the two passes of interval/sweep.hpp and the minimisation ask of an interval's memory: its nodes, the
/// measurements of each (visit(j, use), use(record)), the root of the noise of the step to node j ≥ 1, the
/// prior, a terminal or null, and which of the copies of each node is the nominal, and which the trial.
template <typename Store>
concept IntervalStore = requires(Store& store, int j) {
  typename Store::Dynamics;
  typename Store::Number;
  store.dynamics();
  store.last();
  store.node(j).law;
  store.root(j).B;
  store.prior().law;
  store.terminal();
  store.now();
  store.next();
  store.flip();
  store.flip_back();
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
