// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The criterion (11) of a step in charts with the disturbance where it enters, in f(x, w) itself, and its
/// minima.
///
/// With x_s = x̂ ⊞ L a and w = w̄ + W b it is ½|a|² + ½|b|² + ½|R^{-½} (y - m(f(x_s, w)))|². A step that is
/// linearised about a w and done again about the w that it found comes to a root of it slowly, or not at all
/// where f bends much in w. Here a minimum is gone down to by the fallback solver, and then by Newton's
/// method with a Hessian by differences of the gradient, which also says that it is one. The noise of the
/// sensor stays linearised where it is.
#include <jml/warnings_begin.hpp>
#pragma once

#include <algorithm>
#include <array>
#include <jml/iterated/rules.hpp>
#include <jml/model/local_context.hpp>
#include <jml/solve/negative_direction.hpp>

namespace jml::detail {

/// `At`: the context of the step, with the w that it is linearised about, and where its slope is taken.
template <typename D, typename S, typename At, typename Scalar, int n>
struct WholeStep {
  static constexpr bool whitened = true;
  static constexpr int p = measurements_of<S>, q = D::disturbances, parameters = n + q, residuals = n + q + p;
  using U = Vector<Scalar, parameters>;
  using Hessian = Matrix<Scalar, parameters, parameters>;

  const D& dynamics_model;
  const S& sensor;
  const Vector<Scalar, p>& y;
  At at;
  Matrix<Scalar, n, n> L = kernel::zeros<Matrix<Scalar, n, n>>();
  Matrix<Scalar, q, q> W = kernel::zeros<Matrix<Scalar, q, q>>();
  Vector<Scalar, q> mean = kernel::zeros<Vector<Scalar, q>>();
  kernel::SymmetricFactor<Scalar, p> R{kernel::zeros<Matrix<Scalar, p, p>>(),
                                       kernel::zeros<Vector<Scalar, p>>()};
  Scalar share = 1;  ///< of the measurement's weight R⁻¹: its root
  bool valid = false;

  JML_RARE WholeStep(const D& d, const Matrix<Scalar, n, n>& P, const S& s, const Vector<Scalar, p>& given,
                     const At& step)
      : dynamics_model(d), sensor(s), y(given), at(step) {
    const Vector<Scalar, n> here = kernel::zeros<Vector<Scalar, n>>();
    const Matrix<Scalar, q, q> Q = disturbance_covariance(d, here, at);
    if (!is_covariance(Q) || !all_finite(P)) return;
    L = kernel::SemidefiniteFactor<Scalar, n>(kernel::symmetric_part(P)).L;
    W = kernel::SemidefiniteFactor<Scalar, q>(Q).L;
    mean = mean_disturbance(d, here, at) + at.w;  // of which the first is what is left beside the second
    const Vector<Scalar, n> prediction = predicted_state(d, here, at);
    valid = R.factor(noise_covariance(s, prediction, end_of(at)));
    at.frozen = false;
  }

  [[nodiscard]] Vector<Scalar, n> smoothed(const U& u) const { return L * kernel::block<n, 1>(u, 0, 0); }
  [[nodiscard]] At at_noise(const U& u) const {
    At out = at;
    out.w = mean + W * kernel::block<q, 1>(u, n, 0);
    return out;
  }

  /// u of a root where the context has it: a = Lᵀ f_xᵀ e, b = Wᵀ f_wᵀ e.
  [[nodiscard]] JML_RARE U coordinates(const Vector<Scalar, n>& x_s) const {
    const Vector<Scalar, n> x_1 = dynamics(dynamics_model, x_s, at);
    const auto end = end_of(at);
    const Vector<Scalar, p> nu = R.solve(measurement_residual(sensor, y, measurement(sensor, x_1, end)));
    const Vector<Scalar, n> e = kernel::transposed(measurement_jacobian(sensor, x_1, end)) * nu;
    const Matrix<Scalar, n, n> f_x = dynamics_jacobian(dynamics_model, x_s, at);
    const Matrix<Scalar, n, q> f_w = disturbance_input(dynamics_model, x_s, at);
    U u;
    kernel::set_block(
        u, 0, 0, Vector<Scalar, n>(kernel::transposed(L) * Vector<Scalar, n>(kernel::transposed(f_x) * e)));
    kernel::set_block(
        u, n, 0, Vector<Scalar, q>(kernel::transposed(W) * Vector<Scalar, q>(kernel::transposed(f_w) * e)));
    return u;
  }

  JML_RARE bool evaluate(const U& u, Vector<Scalar, residuals>& r,
                         Matrix<Scalar, residuals, parameters>* J) const {
    const Vector<Scalar, n> x_s = smoothed(u);
    const At here = at_noise(u);
    const auto end = end_of(here);
    const Vector<Scalar, n> x_1 = dynamics(dynamics_model, x_s, here);
    Vector<Scalar, p> innovation = measurement_residual(sensor, y, measurement(sensor, x_1, end));
    whiten(innovation);
    kernel::set_block(r, 0, 0, u);
    kernel::set_block(r, parameters, 0, innovation);
    if (J != nullptr) {
      const Matrix<Scalar, p, n> m_x = measurement_jacobian(sensor, x_1, end);
      const Matrix<Scalar, p, n> by_a =
          m_x * Matrix<Scalar, n, n>(dynamics_jacobian(dynamics_model, x_s, here) * L);
      const Matrix<Scalar, p, q> by_b =
          m_x * Matrix<Scalar, n, q>(disturbance_input(dynamics_model, x_s, here) * W);
      kernel::set_zero(*J);
      for (int j = 0; j < parameters; ++j) {
        (*J)(j, j) = Scalar(1);
        Vector<Scalar, p> column = j < n ? -kernel::column_of(by_a, j) : -kernel::column_of(by_b, j - n);
        whiten(column);
        kernel::set_block(*J, parameters, j, column);
      }
      if (!all_finite(*J)) return false;
    }
    return all_finite(r);
  }
  [[nodiscard]] JML_RARE Scalar cost(const U& u) const {
    Vector<Scalar, residuals> r;
    return evaluate(u, r, nullptr) ? kernel::squared_norm(r) / Scalar(2)
                                   : std::numeric_limits<Scalar>::infinity();
  }
  [[nodiscard]] JML_RARE bool gradient(const U& u, U& g) const {
    Vector<Scalar, residuals> r;
    Matrix<Scalar, residuals, parameters> J;
    if (!evaluate(u, r, &J)) return false;
    g = kernel::transposed(J) * r;
    return true;
  }
  /// By central differences.
  [[nodiscard]] JML_RARE bool hessian(const U& u, Hessian& H) const {
    const Scalar h = std::cbrt(std::numeric_limits<Scalar>::epsilon());
    U at_j = u, above, below;
    for (int j = 0; j < parameters; ++j) {
      at_j(j) = u(j) + h;
      bool defined = gradient(at_j, above);
      at_j(j) = u(j) - h;
      defined = defined && gradient(at_j, below);
      at_j(j) = u(j);
      if (!defined) return false;
      kernel::set_column(H, j, U((above - below) / (Scalar(2) * h)));
    }
    H = kernel::symmetric_part(H);
    return true;
  }
  /// f and m bend too little at x̂ for more minima than one: Σ |(∇²J - Jᵀ J)_ij| < 1.
  [[nodiscard]] JML_RARE bool bends_slightly() const {
    const U zero = kernel::zeros<U>();
    Vector<Scalar, residuals> r;
    Matrix<Scalar, residuals, parameters> J;
    Hessian H;
    if (!evaluate(zero, r, &J) || !hessian(zero, H)) return false;
    H = H - kernel::transposed(J) * J;
    Scalar sum = 0;
    for (int i = 0; i < parameters * parameters; ++i) sum += std::abs(H.data()[i]);
    return sum < Scalar(1);
  }

 private:
  /// v ← share D^{-½} L⁻¹ v of R = L D Lᵀ.
  void whiten(Vector<Scalar, p>& v) const {
    for (int i = 0; i < p; ++i) {
      for (int k = 0; k < i; ++k) v(i) -= R.lower(i, k) * v(k);
    }
    for (int i = 0; i < p; ++i) v(i) *= share * std::sqrt(R.inverse_diagonal(i));
  }
};

/// A minimum of a whole step.
template <typename Whole, typename Scalar>
struct WholeMinimum {
  typename Whole::U u = kernel::zeros<typename Whole::U>();
  Scalar cost = std::numeric_limits<Scalar>::infinity();
  bool found = false;
};

/// Newton's method from u; u moves where it gets nearer. 1: at a minimum; -1: where the Hessian is
/// indefinite, with a direction down; 0: neither.
template <typename Whole, typename U>
[[nodiscard]] JML_RARE int polish_whole(const Whole& whole, U& u, U& down, int& iterations) {
  using Scalar = typename U::Scalar;
  constexpr Scalar close = std::is_same_v<Scalar, float> ? Scalar(1e-5) : Scalar(1e-12);
  typename Whole::Hessian H;
  kernel::SymmetricFactor<Scalar, Whole::parameters> factor;
  for (int again = 0; again < 4; ++again) {
    if (!whole.hessian(u, H)) return 0;
    if (!factor.factor(H)) {
      const U rounding = std::sqrt(std::numeric_limits<Scalar>::epsilon()) * kernel::diagonal(H).cwiseAbs();
      return negative_direction(H, rounding, down) ? -1 : 0;
    }
    Scalar before = std::numeric_limits<Scalar>::infinity();
    for (int k = 0; k < 8; ++k) {
      U g;
      if (!whole.gradient(u, g)) return 0;
      ++iterations;
      const U step = factor.solve(g);
      const Scalar length = kernel::norm(step);
      if (length <= close || (length > before / Scalar(2) && length <= Scalar(1e3) * close)) return 1;
      if (!(length < before / Scalar(4))) break;  // H is that of another place
      u = u - step;
      before = length;
    }
  }
  return 0;
}

/// Down from u, also from a saddle that this ends at.
template <typename Rule, typename Whole, typename U>
[[nodiscard]] JML_RARE auto descend_whole(const Rule& rule, const Whole& whole, U u, int& iterations) {
  using Scalar = typename U::Scalar;
  WholeMinimum<Whole, Scalar> out;
  for (int saddles = 0; saddles < 4; ++saddles) {
    for (int again = 0; again < 2; ++again) {
      const SolverReport report = rule.fallback.minimize(whole, u);
      iterations += report.iterations;
      if (report.converged) break;
    }
    U down;
    const int end = all_finite(u) ? polish_whole(whole, u, down, iterations) : 0;
    if (end == 0) return out;
    if (end == 1) {
      out.u = u;
      out.cost = whole.cost(u);
      out.found = std::isfinite(out.cost);
      return out;
    }
    const Scalar length = Scalar(0.1);
    u = u + (whole.cost(U(u + length * down)) < whole.cost(U(u - length * down)) ? length : -length) * down;
  }
  return out;
}

/// The lowest minimum that is found, from `begin` where it is given, and where `widely` is asked for from the
/// prediction, by degrees, and from rule.options.starts points about x̂, where the step bends most.
template <typename Rule, typename Whole>
[[nodiscard]] JML_RARE auto seek_whole(const Rule& rule, Whole& whole, const typename Whole::U* begin,
                                       bool widely, int& iterations) {
  using U = typename Whole::U;
  using Scalar = typename U::Scalar;
  constexpr int size = Whole::parameters;
  WholeMinimum<Whole, Scalar> best;
  const auto compare = [&](const U& from) {
    const auto other = descend_whole(rule, whole, from, iterations);
    if (other.found && other.cost < best.cost) best = other;
  };
  if (begin != nullptr) compare(*begin);
  if (best.found && (!widely || whole.bends_slightly())) return best;
  const U zero = kernel::zeros<U>();
  compare(zero);
  const Scalar cost = whole.cost(zero);
  U u = zero;
  for (Scalar weight = Scalar(0.5) / cost; weight < Scalar(1) && weight > Scalar(1e-12);
       weight *= Scalar(10)) {
    whole.share = std::sqrt(weight);
    iterations += rule.fallback.minimize(whole, u).iterations;
  }
  whole.share = Scalar(1);
  compare(u);
  // How much the residuals bend along each axis.
  std::array<Scalar, size> bends{};
  std::array<int, size> axes{};
  Vector<Scalar, Whole::residuals> r, above, below;
  if (!whole.evaluate(zero, r, nullptr)) return best;
  for (int i = 0; i < size; ++i) {
    Scalar bend = std::numeric_limits<Scalar>::infinity();
    u = zero;
    u(i) = Scalar(1);
    bool defined = whole.evaluate(u, above, nullptr);
    u(i) = Scalar(-1);
    defined = defined && whole.evaluate(u, below, nullptr);
    if (defined) bend = kernel::squared_norm(Vector<Scalar, Whole::residuals>(above + below - r - r));
    int place = i;
    for (; place > 0 && bends[static_cast<std::size_t>(place - 1)] < bend; --place) {
      bends[static_cast<std::size_t>(place)] = bends[static_cast<std::size_t>(place - 1)];
      axes[static_cast<std::size_t>(place)] = axes[static_cast<std::size_t>(place - 1)];
    }
    bends[static_cast<std::size_t>(place)] = bend;
    axes[static_cast<std::size_t>(place)] = i;
  }
  for (int k = 0; k < std::min(rule.options.starts, 2 * size); ++k) {
    const auto axis = static_cast<std::size_t>(k / 2);
    if (bends[axis] == Scalar(0)) break;
    u = zero;
    u(axes[axis]) = k % 2 == 0 ? Scalar(1.5) : Scalar(-1.5);
    compare(u);
  }
  return best;
}

/// The w, and where its slope is taken, of the step in charts `at` become those of the lowest minimum found.
/// `begun`: they are near one. False where none was found, or the rule does not look for minima.
template <typename Rule, typename D, typename Scalar, int n, typename Sample, typename At>
[[nodiscard]] JML_RARE bool seek_minimum_of_whole(const Rule& rule, const D& d, const Matrix<Scalar, n, n>& P,
                                                  const Sample& sample, At& at, bool begun, bool widely,
                                                  int& iterations) {
  using S = std::remove_cvref_t<decltype(sample.sensor)>;
  if (!rule.options.use_fallback || rule.options.accept_at_limit || !is_symmetric(P)) return false;
  const Vector<Scalar, measurements_of<S>> y = sample.y;
  WholeStep<D, S, At, Scalar, n> whole(d, P, sample.sensor, y, at);
  if (!whole.valid) return false;
  typename WholeStep<D, S, At, Scalar, n>::U u;
  if (begun) u = whole.coordinates(at.slope_at);
  const auto best = seek_whole(rule, whole, begun && all_finite(u) ? &u : nullptr, widely, iterations);
  if (!best.found) return false;
  at.w = whole.at_noise(best.u).w;
  at.slope_at = whole.smoothed(best.u);
  at.frozen = true;
  at.search = Search::slope;
  return true;
}
}  // namespace jml::detail
#include <jml/warnings_end.hpp>
