// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What an interval of the criterion J (Rusnak 2015, eq. (5)) consists of: a prior, nodes, and the
/// measurements of each node. Batch keeps it in reserved memory, FixedLag in static memory;
/// interval/sweep.hpp works on either.
#pragma once

#include <array>
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

/// One measurement, with R factored once; a state-dependent R is frozen at the nominal.
template <typename Scalar, int n, typename S, typename At>
struct Record {
  static constexpr int p = measurements_of<S>;
  static constexpr bool varies = !ConstantHook<hooks::NoiseCovariance, S, Vector<Scalar, n>, At>;

  [[no_unique_address]] S sensor;
  Vector<Scalar, p> y = kernel::zeros<Vector<Scalar, p>>();
  kernel::SymmetricFactor<Scalar, p> R{kernel::zeros<Matrix<Scalar, p, p>>(),
                                       kernel::zeros<Vector<Scalar, p>>()};

  /// False where R is no covariance.
  bool freeze(const Vector<Scalar, n>& x, const At& at) {
    const Matrix<Scalar, p, p> value = noise_covariance(sensor, x, at);
    return is_noise_covariance(value) && R.factor(value);
  }
};

/// True where the dynamics or any sensor read time, dt or control, so that nodes must keep them.
template <typename Scalar, typename D, typename List>
constexpr bool keeps_context = true;
template <typename Scalar, typename D, typename... S>
constexpr bool keeps_context<Scalar, D, Sensors<S...>> =
    reads_context<Scalar, D>() || (sensor_reads_context<S, Vector<Scalar, states_of<D>>,
                                                        StepContext<Scalar, DynamicsTraits<D>::controls>>() ||
                                   ...);

/// x̂_0, P_0 = L Lᵀ, and the whitened offset a of the nominal x_0 = x̂_0 + L a.
template <typename Scalar, int n, int copies = 2>
struct Prior {
  Vector<Scalar, n> x = kernel::zeros<Vector<Scalar, n>>();
  Matrix<Scalar, n, n> L = kernel::zeros<Matrix<Scalar, n, n>>();
  std::array<Vector<Scalar, n>, copies> a = copies_of<copies, Vector<Scalar, n>>();
  Vector<Scalar, n> law = kernel::zeros<Vector<Scalar, n>>();  // δa of the last backward pass

  void set(const Estimate<Scalar, n>& estimate) {
    x = estimate.x;
    L = kernel::SemidefiniteFactor<Scalar, n>(estimate.P).L;
    a = copies_of<copies, Vector<Scalar, n>>();
  }
};

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
