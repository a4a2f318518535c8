// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// J of eq. (5) over a short interval as one function of all whitened unknowns z = (a, b_0, b_1, …), by
/// running the model from x_0 = x̂_0 + L a, L Lᵀ = P_0, along w_k = C b_k, C Cᵀ = Q. Its derivatives come from
/// dual numbers through the whole run: no recursion, no costate. For constant G, Q, R and one sensor type.
#pragma once

#include <array>
#include <jml/interval/batch.hpp>
#include <optional>

#include "interval/dense_solve.hpp"

namespace batch_tests {

using jml::Matrix, jml::Vector;

struct NoLoss {
  template <typename T>
  T operator()(const T& s) const {
    return s;
  }
};

/// y[k] is measured at node k, where there is one. Rho: of s = rᵀR⁻¹r, generic in its scalar.
template <typename D, typename S, int steps, typename Rho = NoLoss>
struct RollOut {
  static constexpr int n = D::states, q = D::disturbances, p = S::measurements, unknowns = n + steps * q;
  using Unknowns = Eigen::VectorXd;
  using Along = jml::Dual<double, unknowns>;
  using Map = Dense<double>;

  D dynamics;
  S sensor;
  jml::Estimate<double, n> prior;
  std::array<std::optional<Vector<double, p>>, steps + 1> y{};
  Rho rho{};

  /// use(node, x) along the run of z; T is double, or Along with one partial derivative per unknown.
  template <typename T, typename Use>
  void run(const Unknowns& z, const Use& use) const {
    Vector<T, n> x = prior.x.template cast<T>();
    add_product(lower_root<double>(prior.P), unknowns_at<T, n>(z, 0), x);
    use(0, x);
    const Map B =
        times<double>(dynamics.disturbance_input(), lower_root<double>(dynamics.disturbance_covariance()));
    for (int k = 0; k < steps; ++k) {
      x = dynamics.dynamics(Vector<T, n>(x));
      add_product(B, unknowns_at<T, q>(z, n + k * q), x);
      use(k + 1, x);
    }
  }

  /// Γ⁻¹ (y - m(x)) of a node, Γ Γᵀ = R.
  template <typename T>
  [[nodiscard]] Vector<T, p> whitened_residual(int node, const Vector<T, n>& x) const {
    const Vector<T, p> measured = y[static_cast<std::size_t>(node)]->template cast<T>();
    const Map whiten =
        forward_solve<double>(lower_root<double>(sensor.noise_covariance()), Map::Identity(p, p));
    Vector<T, p> out = Vector<T, p>::Zero();
    add_product(whiten, jml::measurement_residual(sensor, measured, Vector<T, p>(sensor.measurement(x))),
                out);
    return out;
  }

  [[nodiscard]] double cost(const Unknowns& z) const { return cost_as<double>(z); }
  [[nodiscard]] Unknowns gradient(const Unknowns& z) const {
    const Along J = cost_as<Along>(z);
    return Eigen::Map<const Unknowns>(J.partial, unknowns);
  }

  /// P of every node: the inverse of the Gauss-Newton Hessian I + Σ JᵀJ of the whitened residuals, carried to
  /// the states. Without a loss.
  [[nodiscard]] std::array<Map, steps + 1> covariances(const Unknowns& z) const {
    Map hessian = Map::Identity(unknowns, unknowns);
    std::array<Map, steps + 1> maps;
    run<Along>(z, [&](int node, const Vector<Along, n>& x) {
      maps[static_cast<std::size_t>(node)] = partials(x);
      if (!y[static_cast<std::size_t>(node)]) return;
      const Map J = partials(whitened_residual(node, x));
      hessian += transposed_times(J, J);
    });
    const Map L = lower_root(hessian);
    for (Map& map : maps) {
      const Map half = forward_solve<double>(L, map.transpose());
      map = transposed_times(half, half);
    }
    return maps;
  }

  /// z of a trajectory; state(k) for k = 0, …, steps, disturbance(k) for k < steps.
  template <typename State, typename Disturbance>
  [[nodiscard]] Unknowns unknowns_of(const State& state, const Disturbance& disturbance) const {
    Unknowns z(unknowns);
    z.head(n) = forward_solve<double>(lower_root<double>(prior.P), state(0) - prior.x);
    const Map C = lower_root<double>(dynamics.disturbance_covariance());
    for (int k = 0; k < steps; ++k) z.segment(n + k * q, q) = forward_solve<double>(C, disturbance(k));
    return z;
  }
  template <typename Batch>
  [[nodiscard]] Unknowns unknowns_of(const Batch& batch) const {
    return unknowns_of([&](int k) { return batch.x(k); }, [&](int k) { return batch.w(k); });
  }

  /// A batch with the prior and all measurements.
  [[nodiscard]] auto batch() const {
    jml::Batch out{dynamics, jml::sensors<S>, prior, {steps}};
    for (int k = 0; k <= steps; ++k) {
      if (k > 0 && out.predict() != jml::Status::ok) break;
      const auto& measured = y[static_cast<std::size_t>(k)];
      if (measured && out.update(sensor, *measured) != jml::Status::ok) break;
    }
    return out;
  }

 private:
  template <typename T>
  [[nodiscard]] T cost_as(const Unknowns& z) const {
    T sum(0.0);
    for (int i = 0; i < unknowns; ++i) {
      const T value = unknowns_at<T, 1>(z, i)(0);
      sum += value * value;
    }
    run<T>(z, [&](int node, const Vector<T, n>& x) {
      if (!y[static_cast<std::size_t>(node)]) return;
      T s(0.0);
      const Vector<T, p> r = whitened_residual(node, x);
      for (int i = 0; i < p; ++i) s += r(i) * r(i);
      sum += rho(s);
    });
    return 0.5 * sum;
  }
  template <typename T, int count>
  static Vector<T, count> unknowns_at(const Unknowns& z, int first) {
    Vector<T, count> out;
    for (int i = 0; i < count; ++i) {
      out(i) = T(z(first + i));
      if constexpr (std::is_same_v<T, Along>) out(i).partial[first + i] = 1;
    }
    return out;
  }
  /// to += a b.
  template <typename T, int rows, int cols>
  static void add_product(const Map& a, const Vector<T, cols>& b, Vector<T, rows>& to) {
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < cols; ++j) to(i) += a(i, j) * b(j);
    }
  }
  template <int rows>
  static Map partials(const Vector<Along, rows>& value) {
    Map out(rows, unknowns);
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < unknowns; ++j) out(i, j) = value(i).partial[j];
    }
    return out;
  }
};

}  // namespace batch_tests
