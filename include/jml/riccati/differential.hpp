// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The one differential recursion behind the continuous EKF, SDDRE and RNLS filters (Rusnak 2018, eqs.
/// (17)-(19)), with the slots of Table 1:
///   ẋ = f(x) + G w̄ + K (y - m(x)),  K = P Dᵀ R⁻¹,
///   Ṗ = A P + P Bᵀ + G Q Gᵀ - P Dᵀ R⁻¹ E P,
/// where Q and R are spectral densities. In the row (F, f_x, m_x, M) of the RNLS filter P is not symmetric.
///
/// How long a step may be, and whether P escapes within it: step_bounds.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/factors.hpp>
#include <jml/riccati/gain_rule.hpp>
#include <jml/riccati/measurement_noise.hpp>
#include <jml/riccati/process_noise.hpp>
#include <jml/riccati/step_bounds.hpp>
#include <jml/status.hpp>

namespace jml {

/// What moving over an interval leaves beside (x, P).
template <typename Scalar, int n, int p>
struct FlowRecord {
  Vector<Scalar, p> innovation = kernel::zeros<Vector<Scalar, p>>();  ///< y - m(x̂) at the interval's start
  /// K = P Dᵀ R⁻¹ there, unit of x per y and s.
  Matrix<Scalar, n, p> gain = kernel::zeros<Matrix<Scalar, n, p>>();
  long steps = 0;        ///< of the integrator
  long evaluations = 0;  ///< of the differential equations
};

/// The coefficients of eq. (19) at one point; D, E, R are there with a measurement only.
template <typename Scalar, int n, int p>
struct RiccatiCoefficients {
  Matrix<Scalar, n, n> A;      ///< slot, n×n
  Matrix<Scalar, n, n> B;      ///< slot, n×n
  Matrix<Scalar, n, n> noise;  ///< G Q Gᵀ, n×n
  Matrix<Scalar, n, p> W;      ///< Dᵀ R⁻¹
  Matrix<Scalar, p, n> E;      ///< slot, p×n
};

/// The right-hand side of (17), (19) for one interval: rule, model, sensor, control and the measurement y(t),
/// which is any function of time that returns a Vector of p. It refers to its arguments.
template <typename Rule, typename D, typename S, typename Scalar_, typename Signal>
class Flow {
 public:
  using Scalar = Scalar_;                                  ///< of the states
  static constexpr int n = DynamicsTraits<D>::states;      ///< states
  static constexpr int p = SensorTraits<S>::measurements;  ///< entries of the measurement
  static constexpr bool measured = p > 0;                  ///< there is a sensor
  static constexpr bool symmetric = Rule::symmetric;       ///< P is a covariance
  /// D is in the chart at a state of a space (continuous/chart_dynamics.hpp).
  static constexpr bool in_chart = requires { requires D::in_chart; };
  using X = Vector<Scalar, n>;                             ///< n
  using Square = Matrix<Scalar, n, n>;                     ///< n×n
  using At = detail::Context<Scalar, D>;                   ///< time, and control
  using Report = FlowRecord<Scalar, n, p>;                 ///< what an interval leaves
  using Coefficients = RiccatiCoefficients<Scalar, n, p>;  ///< of (19)

  /// What the functions of the model are given beside x and the time.
  using Given = std::conditional_t<in_chart, At, Vector<Scalar, DynamicsTraits<D>::controls>>;
  /// Of a context.
  [[nodiscard]] static const Given& given(const At& at) {
    if constexpr (in_chart)
      return at;
    else
      return at.control;
  }

  /// Refers to its arguments.
  Flow(const Rule& rule, const D& dynamics, const ProcessNoise<Scalar, D>& process_noise, const S& sensor,
       const Signal& signal, const Given& given)
      : rule_(rule),
        dynamics_(dynamics),
        process_noise_(process_noise),
        sensor_(sensor),
        signal_(signal),
        given_(given) {}

  /// Asks the constants of the model once; to be called before anything else.
  [[nodiscard]] Status prepare(double time, const X& x) {
    if constexpr (measured) {
      if (!noise_.prepare(sensor_, x, at(time))) return Status::invalid_noise_covariance;
    }
    return process_noise_.valid() ? Status::ok : Status::invalid_disturbance_covariance;
  }

  /// ẋ and Ṗ at (t, x, P). Not asked to be finite: a NaN goes through, and is looked for once per interval.
  /// `gain` and `innovation` may be wanted too.
  JML_INLINE inline Status derivative(double time, const X& x, const Square& P, X& dx, Square& dP,
                                      Report* report = nullptr) {
    const At now = at(time);
    if constexpr (in_chart) {
      if (!dynamics_.reaches(x, now)) return Status::step_too_long;
    }
    Square A = dynamics_slot<Rule::A>(rule_, dynamics_, x, x, now);
    bounds_.at_slot(A);
    kernel::assign(dx, predicted_state(dynamics_, x, now));
    if constexpr (measured) {
      if (!noise_.at_point(sensor_, x, now)) return Status::invalid_noise_covariance;
      const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(rule_, sensor_, x, x, now);
      const Vector<Scalar, p> innovation =
          measurement_residual(sensor_, Vector<Scalar, p>(signal_(time)), measurement(sensor_, x, now));
      Matrix<Scalar, n, p> PD, gain;
      kernel::product_transposed(P, slot_d, PD);         // P Dᵀ
      kernel::product(PD, noise_.inverse, gain);         // K = P Dᵀ R⁻¹
      kernel::add_product<1>(dx, gain, innovation, dx);  // ẋ = f + G w̄ + K (y - m)
      if constexpr (in_chart) A = A + dynamics_.carried(x, X(gain * innovation), now);
      if (report != nullptr) {
        kernel::assign(report->gain, gain);
        kernel::assign(report->innovation, innovation);
      }
      const auto with_slot_e = [&](const Matrix<Scalar, p, n>& slot_e) JML_INLINE {
        if constexpr (p == 1)
          bounds_.rate = (slot_e * gain)(0, 0);  // E K
        else
          kernel::product(slot_e, PD, bounds_.feedback);  // E P Dᵀ
        if constexpr (symmetric) {                        // Ṗ = U + Uᵀ + G Q Gᵀ with U = (A - ½ K E) P
          Matrix<Scalar, n, p> half;
          kernel::scale(half, Scalar(0.5), gain);  // ½ K
          Square closed, U;
          kernel::add_product<-1>(A, half, slot_e, closed);  // A - ½ K E
          kernel::product(closed, P, U);                     // U = (A - ½ K E) P
          return add_noise(x, now, [&](const Square& noise) JML_INLINE {
            kernel::repeat<n>([&](int j) JML_INLINE {
              kernel::repeat<n>([&](int i) JML_INLINE {
                if (i >= j) dP(i, j) = dP(j, i) = (U(i, j) + U(j, i)) + noise(i, j);
              });
            });
          });
        } else {  // Ṗ = (A - K E) P + P Bᵀ + G Q Gᵀ
          Square closed;
          kernel::add_product<-1>(A, gain, slot_e, closed);  // A - K E
          return finish(x, now, closed, A, P, dP);
        }
      };
      if constexpr (Rule::D == Rule::E)
        return with_slot_e(slot_d);
      else
        return with_slot_e(sensor_slot<Rule::E>(rule_, sensor_, x, x, now));
    } else {
      return finish(x, now, A, A, P, dP);
    }
  }

  /// After derivative(): whether a fixed step of length h may be taken from that point (step_bounds.hpp).
  [[nodiscard]] JML_INLINE inline Status permits(Scalar h) const {
    if constexpr (measured)
      return bounds_.permits(h, noise_.R);
    else
      return bounds_.permits(h);
  }

  /// After derivative(): true if P may have a pole within time `ahead`.
  [[nodiscard]] bool pole_within(Scalar ahead) const {
    if constexpr (measured)
      return bounds_.pole_within(ahead, noise_.R);
    else
      return false;
  }

  /// The coefficients of (19) at (t, x), ẋ without measurement, y - m(x), for integrators that want them.
  [[nodiscard]] Status coefficients(double time, const X& x, Coefficients& out, X& drift,
                                    Vector<Scalar, p>& innovation) {
    const At now = at(time);
    if constexpr (in_chart) {
      if (!dynamics_.reaches(x, now)) return Status::step_too_long;
    }
    out.A = dynamics_slot<Rule::A>(rule_, dynamics_, x, x, now);
    if constexpr (Rule::A == Rule::B)
      out.B = out.A;
    else
      out.B = dynamics_slot<Rule::B>(rule_, dynamics_, x, x, now);
    drift = predicted_state(dynamics_, x, now);
    if constexpr (measured) {
      if (!noise_.at_point(sensor_, x, now)) return Status::invalid_noise_covariance;
      const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(rule_, sensor_, x, x, now);
      if constexpr (Rule::D == Rule::E)
        out.E = slot_d;
      else
        out.E = sensor_slot<Rule::E>(rule_, sensor_, x, x, now);
      kernel::product(kernel::transposed(slot_d), noise_.inverse, out.W);  // W = Dᵀ R⁻¹
      innovation =
          measurement_residual(sensor_, Vector<Scalar, p>(signal_(time)), measurement(sensor_, x, now));
    }
    return add_noise(x, now, [&](const Square& noise) { out.noise = noise; });
  }

  /// A prediction of x at time + ahead, right to first order and bounded for any gain: the measurement's part
  /// is a correction with R/ahead, x + ahead ẋ_free + P Dᵀ (R/ahead + E P Dᵀ)⁻¹ (y - m).
  [[nodiscard]] Status midpoint(double time, const X& x, const Square& P, Scalar ahead, X& out,
                                Report* report) {
    const At now = at(time);
    kernel::add_scaled(out, x, ahead, X(predicted_state(dynamics_, x, now)));
    if constexpr (measured) {
      if (!noise_.at_point(sensor_, x, now)) return Status::invalid_noise_covariance;
      const Matrix<Scalar, p, n> slot_d = sensor_slot<Rule::D>(rule_, sensor_, x, x, now);
      const Vector<Scalar, p> innovation =
          measurement_residual(sensor_, Vector<Scalar, p>(signal_(time)), measurement(sensor_, x, now));
      Matrix<Scalar, n, p> PD;
      kernel::product_transposed(P, slot_d, PD);  // P Dᵀ
      if (report != nullptr) {
        Matrix<Scalar, n, p> gain;
        kernel::product(PD, noise_.inverse, gain);  // K = P Dᵀ R⁻¹
        kernel::assign(report->gain, gain);
        kernel::assign(report->innovation, innovation);
      }
      Matrix<Scalar, p, p> feedback;
      if constexpr (Rule::D == Rule::E)
        kernel::product(slot_d, PD, feedback);  // E P Dᵀ
      else
        kernel::product(sensor_slot<Rule::E>(rule_, sensor_, x, x, now), PD, feedback);  // E P Dᵀ
      if constexpr (p == 1) {  // a negative E P Dᵀ would bring the denominator to zero
        const Scalar inverse =
            Scalar(1) / (noise_.R(0, 0) / ahead + (feedback(0, 0) > Scalar(0) ? feedback(0, 0) : Scalar(0)));
        kernel::add_scaled(out, out, inverse * innovation(0), PD);
      } else {
        const Matrix<Scalar, p, p> sum = noise_.R / ahead + kernel::symmetric_part(feedback);
        kernel::SymmetricFactor<Scalar, p> factor;
        const Vector<Scalar, p> weighted = factor.factor(sum)
                                               ? factor.solve(innovation)
                                               : Vector<Scalar, p>(ahead * (noise_.inverse * innovation));
        kernel::add_product<1>(out, PD, weighted, out);  // + P Dᵀ (R/ahead + E P Dᵀ)⁻¹ (y - m)
      }
    }
    return Status::ok;
  }

  [[nodiscard]] const Matrix<Scalar, p, p>& R() const { return noise_.R; }  ///< of the sensor, p×p
  [[nodiscard]] const Matrix<Scalar, p, p>& information() const { return noise_.inverse; }  ///< R⁻¹
  [[nodiscard]] const Rule& rule() const { return rule_; }                                  ///< as given
  [[nodiscard]] const D& dynamics() const { return dynamics_; }                             ///< as given
  [[nodiscard]] const S& sensor() const { return sensor_; }                                 ///< as given
  [[nodiscard]] Vector<Scalar, p> measured_at(double time) const { return signal_(time); }  ///< y, p
  /// The context at a time, s.
  [[nodiscard]] At at(double time) const {
    if constexpr (in_chart) {
      At now = given_;
      now.time = time;
      now.dt = Scalar(0);
      return now;
    } else {
      return {time, Scalar(0), given_};
    }
  }

 private:
  /// dP = left P + P Bᵀ + G Q Gᵀ, with `left` = A - K E.
  JML_INLINE inline Status finish(const X& x, const At& now, const Square& left, const Square& A,
                                  const Square& P, Square& dP) {
    return add_noise(x, now, [&](const Square& noise) JML_INLINE {
      Square sum;
      kernel::add_product<1>(noise, left, P, sum);  // left P + G Q Gᵀ
      if constexpr (Rule::A == Rule::B) {
        kernel::add_product_transposed<1>(sum, P, A, dP);  // Ṗ = left P + P Aᵀ + G Q Gᵀ
        if constexpr (symmetric) mirror(dP);
      } else {
        const Square B = dynamics_slot<Rule::B>(rule_, dynamics_, x, x, now);
        kernel::add_product_transposed<1>(sum, P, B, dP);  // Ṗ = left P + P Bᵀ + G Q Gᵀ
      }
    });
  }

  static void mirror(Square& a) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < j; ++i) a(i, j) = a(j, i) = (a(i, j) + a(j, i)) / Scalar(2);
    }
  }

  template <typename Use>
  JML_INLINE inline Status add_noise(const X& x, const At& now, const Use& use) {
    return process_noise_.with(dynamics_, x, now, use) ? Status::ok : Status::invalid_disturbance_covariance;
  }

  const Rule& rule_;
  const D& dynamics_;
  const ProcessNoise<Scalar, D>& process_noise_;
  const S& sensor_;
  const Signal& signal_;
  const Given& given_;
  struct Nothing {};
  [[no_unique_address]] std::conditional_t<measured, detail::MeasurementNoise<Scalar, n, S>, Nothing> noise_;
  StepBounds<Scalar, n, p, symmetric> bounds_;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
