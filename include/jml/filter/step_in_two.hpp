// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A step of a symmetric one-pass rule in twice the digits: the model's side of filter/extended_step.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/filter/extended_step.hpp>
#include <jml/filter/method.hpp>
#include <jml/riccati/difference.hpp>

namespace jml::detail {

template <bool moves, typename Model>
consteval int disturbances_in() {
  if constexpr (moves)
    return DynamicsTraits<std::remove_cvref_t<decltype(Model::dynamics)>>::disturbances;
  else
    return 0;
}
template <typename Sample>
consteval int measurements_in() {
  if constexpr (requires { Sample::measurements; })
    return Sample::measurements;
  else
    return 0;
}

/// y - m(x) = (y - m(0)) - H x of an affine m that is not wrapped can be had in more digits.
template <typename S, typename Y>
consteval bool exact_sensor() {
  return SensorTraits<S>::linear && !requires(const S& s, const Y& y) { SensorTraits<S>::residual(s, y, y); };
}
/// y - m(0).
template <int n, typename S, typename Scalar, int p, typename At>
[[nodiscard]] Vector<Scalar, p> from_origin(const S& s, const Vector<Scalar, p>& y, const At& at) {
  return y - measurement(s, kernel::zeros<Vector<Scalar, n>>(), at);
}

/// What the rows of a measurement came to, as they were taken: made independent, one after the other. The
/// variance is infinite where a row resolved a direction or said nothing new.
template <typename Scalar, int p>
struct RowsFound {
  int redundant = 0, resolved = 0;
  Vector<Scalar, p> innovation = kernel::zeros<Vector<Scalar, p>>();
  Vector<Scalar, p> variance = kernel::zeros<Vector<Scalar, p>>();

  [[nodiscard]] Scalar nis() const {
    Scalar sum = 0;
    for (int i = 0; i < p; ++i) sum += innovation(i) * innovation(i) / variance(i);
    return sum;
  }
  /// The gate's verdict, and how many rows it was asked of. False where NIS is no number.
  [[nodiscard]] bool judge(const Gate& gate, Report<Scalar, p>& report) {
    report.degrees = static_cast<std::int16_t>(report.degrees - redundant - resolved);
    if (gate.off()) return true;
    const Scalar found = nis();
    if (!(found >= Scalar(0))) return false;
    const bool pass = report.degrees <= 0 || gate.passes(found, report.degrees);
    report.gate = pass ? Verdict::accepted : Verdict::rejected;
    return true;
  }
};

/// P ← A P Aᵀ + G Q Gᵀ and x ← f(x) over `at`, of what `two` has been loaded with; x: its high part.
template <typename Rule, typename Model, typename Scalar, int n, typename At>
[[nodiscard]] JML_RARE Status predict_in_two(const Rule& rule, const Model& model, const Vector<Scalar, n>& x,
                                             const At& at, ExtendedStep<Scalar>& two) {
  const auto& d = model.dynamics;
  constexpr int q = disturbances_in<true, Model>();
  const Vector<Scalar, n> f = predicted_state(d, x, at);
  const Vector<Scalar, n>& point = Rule::evaluated_at == EvaluatedAt::estimate ? x : f;
  const Matrix<Scalar, n, n> A = dynamics_slot<Rule::A>(rule, d, point, x, at);
  Matrix<Scalar, q, q> Q = kernel::zeros<Matrix<Scalar, q, q>>();
  Matrix<Scalar, n, q> G = kernel::zeros<Matrix<Scalar, n, q>>();
  if constexpr (q > 0) {
    Q = disturbance_covariance(d, x, at);
    G = disturbance_input(d, x, at);
  }
  if (!all_finite(x)) return Status::invalid_state;
  if (!all_finite(f) || !all_finite(A)) return Status::dynamics_not_finite;
  // f(x) = A x + f(0) of linear dynamics can be had in all digits.
  constexpr bool affine = DynamicsTraits<std::remove_cvref_t<decltype(d)>>::linear;
  const Vector<Scalar, n> constant = affine ? predicted_state(d, kernel::zeros<Vector<Scalar, n>>(), at) : f;
  const bool valid = is_covariance(Q) && all_finite(G);
  return valid && two.move(A.data(), G.data(), Q.data(), constant.data(), affine)
             ? Status::ok
             : Status::invalid_disturbance_covariance;
}

/// The correction of what `two` holds; of the report status, innovation, S, K and the gate. Where that
/// rejects, `two` is no longer the prediction. `perfect`: R may be singular.
template <bool perfect = true, typename Rule, typename Scalar, int n, int p, typename Sample, typename At>
JML_RARE void correct_in_two(const Rule& rule, const Sample& sample, const At& at, ExtendedStep<Scalar>& two,
                             StepReport<Scalar, n, p>& report, RowsFound<Scalar, p>& found) {
  const auto answer = [&report](Status status) { report.status = status; };
  const auto& s = sample.sensor;
  Vector<Scalar, n> x;
  for (int i = 0; i < n; ++i) x(i) = in_two<Scalar>(two.x(i)).high;
  const Matrix<Scalar, p, p> R = noise_covariance(s, x, at);
  const Vector<Scalar, p> predicted = measurement(s, x, at);
  report.innovation = measurement_residual(s, sample.y, predicted);
  const Matrix<Scalar, p, n> H = sensor_slot<Rule::D>(rule, s, x, x, at);
  if (!all_finite(x)) return answer(Status::invalid_state);
  const bool valid = perfect ? is_covariance(R) : is_noise_covariance(R);
  if (!valid) return answer(Status::invalid_noise_covariance);
  if (!all_finite(sample.y)) return answer(Status::invalid_measurement);
  if (!all_finite(report.innovation) || !all_finite(H)) return answer(Status::sensor_not_finite);
  if (!sample.gate.valid()) return answer(Status::invalid_option);
  constexpr bool exact = exact_sensor<std::remove_cvref_t<decltype(s)>, Vector<Scalar, p>>();
  Vector<Scalar, p> sizes, given = report.innovation;
  if constexpr (exact) given = from_origin<n>(s, sample.y, at);
  for (int i = 0; i < p; ++i) {
    sizes(i) = std::abs(sample.y(i)) + std::abs(predicted(i));
    for (int j = 0; j < n; ++j) sizes(i) += std::abs(H(i, j) * x(j));
  }
  const RowsReport rows =
      two.correct(H.data(), R.data(), given.data(), exact, sizes.data(), report.innovation_matrix.data());
  if (rows.status != Status::ok) return answer(rows.status);
  found.redundant = rows.redundant;
  found.resolved = rows.resolved;
  for (int i = 0; i < p; ++i) {
    found.innovation(i) = two.row_innovation(i);
    found.variance(i) = two.row_variance(i);
  }
  if (diagonal_is<Definite::positive>(R)) two.gain(report.gain.data());
  if (!found.judge(sample.gate, report)) answer(Status::innovation_indefinite);
}

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
