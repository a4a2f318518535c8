// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The filter that is linearised about the nominal of an interval: what its arrival cost, its covariances and
/// where a minimisation starts are made of.
///
/// Forward in factors P = U D Uᵀ (Thornton, Bierman), in twice the digits where those of Scalar do not
/// suffice; the later data come as rows of their information, taken as measurements.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/interval/all_digits.hpp>
#include <jml/interval/belief_in_two.hpp>
#include <jml/interval/information_in_two.hpp>
#include <jml/interval/nodes.hpp>
#include <jml/interval/step_terms.hpp>

namespace jml::detail {

/// A belief from what the user gives to a filter; or why not. An infinite variance asks for zeros beside it.
struct AnyModel {
  static Status status() { return Status::ok; }
};
template <typename Given, typename Scalar, int n>
[[nodiscard]] Status start_factors(const Given& given, FactoredBelief<Scalar, n>& belief) {
  return Factored<Ekf<>>{}.start(AnyModel{}, given, belief);
}
template <typename Scalar, int n>
[[nodiscard]] Status start_factors(const Estimate<Scalar, n>& given, FactoredBelief<Scalar, n>& belief) {
  constexpr Scalar infinite = std::numeric_limits<Scalar>::infinity();
  Estimate<Scalar, n> known = given;
  bool valid = true, unknown[n] = {};
  for (int i = 0; i < n; ++i) {
    unknown[i] = given.P(i, i) == infinite;
    if (unknown[i]) known.P(i, i) = Scalar(1);
    for (int j = 0; unknown[i] && j < n; ++j)
      valid = valid && (i == j || (given.P(i, j) == Scalar(0) && given.P(j, i) == Scalar(0)));
  }
  if (!valid) return all_finite(given.x) ? Status::invalid_covariance : Status::invalid_state;
  const Status status = Factored<Ekf<>>{}.start(AnyModel{}, known, belief);
  for (int i = 0; i < n && status == Status::ok; ++i) {
    if (!unknown[i]) continue;
    belief.D(i) = belief.variances(i) = infinite;
    belief.D_low(i) = Scalar(0);
    belief.extended = true;
  }
  return status;
}

/// f_x of the step that leads to node j.
template <typename Store>
[[nodiscard]] auto step_jacobian(const Store& store, int j) {
  return dynamics_jacobian(store.dynamics(), store.node(j - 1).x[store.now()], store.node(j).at());
}

/// The step that leads to node j, x in the digits of Scalar. False where its covariance is lost: `belief` is
/// as it was.
template <typename Store, typename Scalar, int n>
[[nodiscard]] bool linearised_move(const Store& store, int j, FactoredBelief<Scalar, n>& belief) {
  constexpr int q = NoiseRoot<Scalar, typename Store::Dynamics>::q, m = n + q;
  const auto& nominal = store.node(j - 1).x[store.now()];
  const auto& root = store.root(j);
  const Matrix<Scalar, n, n> A = step_jacobian(store, j);
  const Vector<Scalar, n> off = belief.x - nominal;
  Vector<Scalar, n> x = dynamics(store.dynamics(), nominal, store.node(j).at()) + root.mean_effect;
  kernel::add_product<1>(x, A, off, x);  // f(x̃) + G w̄ + A (x - x̃)
  if (!belief.extended) {
    kernel::Padded<Scalar, n, m> W;
    Vector<Scalar, m> d;
    Vector<Scalar, n> sizes = kernel::zeros<Vector<Scalar, n>>();
    for (int k = 0; k < q; ++k) {
      for (int i = 0; i < kernel::Strip<Scalar, n>::padded; ++i) W(i, k) = i < n ? root.B(i, k) : Scalar(0);
      for (int i = 0; i < n; ++i) sizes(i) += root.B(i, k) * root.B(i, k);
      d(k) = Scalar(1);
    }
    for (int k = 0; k < n; ++k) {
      d(q + k) = belief.D(k);
      for (int i = 0; i < n; ++i) sizes(i) += A(i, k) * A(i, k) * belief.variances(k);
    }
    FactoredBelief<Scalar, n> next;
    kernel::assign(next.x, x);
    kernel::times_unit_upper<Scalar, n, m>(A, belief.U, W);  // [B, A U]
    kernel::orthogonalise<false, Scalar, n, m>(W, d, next);  // A P Aᵀ + B Bᵀ
    if (settle(next, sizes)) {
      commit(belief, next);
      return true;
    }
  }
  return move_in_two(A, root.B, x, belief);
}
/// The same, x in twice the digits.
template <typename Store, typename Scalar, int n>
JML_RARE bool linearised_step_in_two(const Store& store, int j, FactoredBelief<Scalar, n>& belief) {
  AllDigits<typename Store::Dynamics, Scalar> digits(belief);
  const Vector<Scalar, n> before = belief.x;
  if (!linearised_move(store, j, belief)) return false;
  constexpr int q = NoiseRoot<Scalar, typename Store::Dynamics>::q;
  digits.move(store, j, kernel::zeros<Vector<Scalar, q>>(), before, belief.x);
  belief.x_low = digits.low;
  return true;
}
template <typename Store, typename Scalar, int n>
[[nodiscard]] bool linearised_step(const Store& store, int j, FactoredBelief<Scalar, n>& belief) {
  using D = typename Store::Dynamics;
  if constexpr (DynamicsTraits<D>::linear) {
    if (AllDigits<D, Scalar>::known(belief)) return linearised_step_in_two(store, j, belief);
  }
  return linearised_move(store, j, belief);
}

/// Corrects `belief` with the measurements of node j; false where one would lose its covariance, and is left
/// out.
template <typename Store, typename Scalar, int n>
[[nodiscard]] bool linearised_correction(Store& store, int j, const Loss& loss,
                                         FactoredBelief<Scalar, n>& belief) {
  const auto& nominal = store.node(j).x[store.now()];
  const auto at = end_of(store.node(j).at());
  bool valid = true;
  store.visit(j, [&](const auto& record) {
    auto rows = rows_of(record, loss, true, nominal, at);
    constexpr int p = decltype(rows.r)::SizeAtCompileTime;
    if (!belief.extended) {
      FactoredBelief<Scalar, n> next;
      commit(next, belief);
      next.extended = false;
      if constexpr (!DynamicsTraits<typename Store::Dynamics>::linear) kernel::set_zero(next.x_low);
      Vector<Scalar, n> gain;
      for (int i = 0; i < p; ++i) {
        if (!(rows.r(i) <= std::numeric_limits<Scalar>::max())) continue;
        Scalar alpha, e = rows.e(i);
        for (int k = 0; k < n; ++k) e -= rows.H(k, i) * (next.x(k) - nominal(k));
        kernel::correct_row(next, &rows.H(0, i), rows.r(i), gain, alpha);
        const Scalar share = e / alpha;
        for (int k = 0; k < n; ++k) {
          const auto sum = as_one(next.x(k), next.x_low(k)) + Extended<Scalar>(gain(k) * share);
          next.x(k) = in_two<Scalar>(sum).high;
          next.x_low(k) = in_two<Scalar>(sum).low;
        }
      }
      if (rows.pulls) next.x += next.P() * rows.pull;
      if (settle(next, belief.variances)) {
        commit(belief, next);
        return;
      }
    }
    valid = valid && rows_in_two(rows, nominal, belief);
  });
  return valid && all_finite(belief.x);
}

/// The backward pass of Sweep in twice the digits, from the last node down to `until` (-1: through node 0).
/// on_node(j) where the information is of the nodes after j; on_law(j, law) where it has gone through the
/// step to node j.
template <typename Store, typename Scalar, typename OnNode, typename OnLaw>
void pass_in_two(Store& store, const Loss& loss, bool infeasible, bool bent, Scalar damping, int until,
                 InformationInTwo<Scalar>& information, PassSums<Scalar>& sums, const OnNode& on_node,
                 const OnLaw& on_law) {
  constexpr int n = states_of<typename Store::Dynamics>;
  constexpr int q = NoiseRoot<Scalar, typename Store::Dynamics>::q;
  const int now = store.now();
  for (int j = store.last();; --j) {
    on_node(j);
    if (j == until) return;
    const auto& node = store.node(j);
    store.visit(j, [&](const auto& record) {
      const auto rows = rows_of(record, loss, bent, node.x[now], end_of(node.at()));
      information.add_rows(static_cast<int>(rows.r.size()), rows.H.data(), rows.r.data(), rows.e.data(),
                           rows.pulls ? rows.pull.data() : nullptr);
      sums.cost += rows.rho / Scalar(2);
    });
    if (j == 0) return;
    const auto& root = store.root(j);
    Vector<Scalar, q> b = kernel::zeros<Vector<Scalar, q>>();
    if (infeasible) {
      const Vector<Scalar, n> defect =
          dynamics(store.dynamics(), store.node(j - 1).x[now], node.at()) + root.mean_effect - node.x[now];
      information.move_by(defect.data());  // λ + Λ (f + G w̄ - x)
    } else {
      b = node.b[now];
    }
    const Matrix<Scalar, n, n> A = step_jacobian(store, j);
    Feedback<Scalar, n, q> law;
    static_cast<void>(through_step(store, j, b, law, sums, [&](const auto& B, const auto& nominal) {
      information.pass(A.data(), B.data(), nominal.data(), damping, law.offset.data(), law.gain.data(), sums);
      return true;
    }));
    on_law(j, law);
  }
}

/// The most rows of one measurement in a list of sensors.
template <typename List>
inline constexpr int most_rows = 1;
template <typename... S>
inline constexpr int most_rows<Sensors<S...>> = [] {
  int most = 1;
  ((most = measurements_of<S> > most ? measurements_of<S> : most), ...);
  return most;
}();

/// P of nodes 0 … last in order, use(j, P): see linearised_covariance(). False where one is lost; that P is
/// NaN.
template <typename Store, typename Use>
[[nodiscard]] bool interval_covariances(Store& store, const Loss& loss, int last, const Use& use) {
  using D = typename Store::Dynamics;
  using Scalar = typename Store::Number;
  constexpr int n = states_of<D>;
  InformationMemory<Scalar, n, NoiseRoot<Scalar, D>::q, most_rows<typename Store::List>> memory;
  InformationInTwo<Scalar> information(memory);
  PassSums<Scalar> sums;
  if (const Terminal<Scalar, n>* end = store.terminal()) {
    const Vector<Scalar, n> none = kernel::zeros<Vector<Scalar, n>>();
    if (!information.begin(end->weight.data(), none.data())) return false;
  }
  pass_in_two(
      store, loss, false, true, Scalar(0), 0, information, sums,
      [&](int j) { information.store(store.later(j).data()); }, [](int, const auto&) {});
  FactoredBelief<Scalar, n> forward, belief;
  commit(forward, store.start());
  bool valid = true, all = true;
  for (int j = 0; j <= last; ++j) {
    if (j > 0) valid = valid && linearised_step(store, j, forward);
    valid = valid && linearised_correction(store, j, loss, forward);
    commit(belief, forward);
    const bool held = valid && condition_in_two(store.later(j), belief);
    const Matrix<Scalar, n, n> P =
        held ? dense_covariance(belief)
             : kernel::filled<Matrix<Scalar, n, n>>(std::numeric_limits<Scalar>::quiet_NaN());
    all = all && P(0, 0) == P(0, 0);
    use(j, P);
  }
  return all;
}

/// P of node j given all measurements of the interval, to first order about the nominal; NaN where it is
/// lost. `prior`: of node 0.
template <typename Store, typename Scalar, int n>
[[nodiscard]] JML_NOINLINE Matrix<Scalar, n, n> linearised_covariance(const Store& store,
                                                                      const FactoredBelief<Scalar, n>& prior,
                                                                      int j, const Loss& loss) {
  using D = typename Store::Dynamics;
  FactoredBelief<Scalar, n> belief;
  commit(belief, prior);
  bool valid = linearised_correction(store, 0, loss, belief);
  for (int i = 1; i <= j && valid; ++i)
    valid = linearised_step(store, i, belief) && linearised_correction(store, i, loss, belief);
  if (j < store.last() && valid) {
    InformationMemory<Scalar, n, NoiseRoot<Scalar, D>::q, most_rows<typename Store::List>> memory;
    InformationInTwo<Scalar> information(memory);
    PassSums<Scalar> sums;
    Matrix<Scalar, n, n> later;
    pass_in_two(
        store, loss, false, true, Scalar(0), j, information, sums, [](int) {}, [](int, const auto&) {});
    information.store(later.data());
    valid = condition_in_two(later, belief);
  }
  return valid ? dense_covariance(belief)
               : kernel::filled<Matrix<Scalar, n, n>>(std::numeric_limits<Scalar>::quiet_NaN());
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
