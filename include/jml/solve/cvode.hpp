// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ordinary differential equations ż = g(t, z) by SUNDIALS' CVODE (component jml::cvode), in Eigen's memory.
///
/// Adaptive in step and order: for stiff phases and long gaps. It allocates when it is created, and with
/// Adams never again. Nothing is printed; every return code of CVODE becomes a Status. SUNDIALS 6.4 to 7.x.
#include <jml/warnings_begin.hpp>
#pragma once

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_version.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <algorithm>
#include <jml/linear_algebra.hpp>
#include <jml/solve/cvode_options.hpp>
#include <memory>

namespace jml {

/// Integrates systems of `size` equations; one SUNDIALS context and one memory of its own, so that objects
/// may work in different threads. A copy has the options and fresh memory, made at its first use.
template <int size>
class CvodeSolver {
 public:
  using State = Vector<double, size>;       ///< `size` numbers
  static constexpr int max_refusals = 200;  ///< of the equations in one interval; then it is refused

  /// Refused, where they are out of range, by integrate().
  explicit CvodeSolver(const CvodeOptions& options = {}) : options_(options) {}
  CvodeSolver(const CvodeSolver& other) : options_(other.options_) {}  ///< the options, and fresh memory
  /// Likewise.
  CvodeSolver& operator=(const CvodeSolver& other) {
    options_ = other.options_;
    memory_.reset();
    return *this;
  }
  CvodeSolver(CvodeSolver&&) noexcept = default;             ///< with its memory
  CvodeSolver& operator=(CvodeSolver&&) noexcept = default;  ///< likewise
  ~CvodeSolver() = default;

  [[nodiscard]] const CvodeOptions& options() const { return options_; }  ///< as given

  /// Moves z from time `from` to `to`, stopping exactly there; no evaluation lies beyond `to`.
  ///
  /// `equations.derivative(t, z, dz)`: Status; z and dz are double[size]. A refusal makes CVODE try a smaller
  /// step; where none helps it is the answer. `equations.jacobian(t, z, J)`: bool, ∂g/∂z column by column;
  /// optional, else CVODE takes differences (BDF only). `equations.tolerances(t, step, z, e)`: e,
  /// double[size] > 0, is what the next step may be wrong by, in place of the options' tolerances; optional,
  /// asked before every step, with the length of the last one, 0 at a fresh start. `continuous`: g is the
  /// same function as in the last call, up to kinks; then order and step are kept, provided that z and `from`
  /// are where that call ended. On refusal z is untouched.
  template <typename Equations>
  CvodeReport integrate(const Equations& equations, double from, double to, State& z,
                        bool continuous = false) {
    CvodeReport report;
    const std::size_t given = options_.absolute_tolerances.size();
    if (!valid(options_) || (!has_tolerances<Equations> && given != 0 && given != std::size_t(size)))
      return {Status::invalid_option, CV_ILL_INPUT};
    if (!std::isfinite(from) || !std::isfinite(to) || to < from)
      return {Status::invalid_time_step, CV_ILL_INPUT};
    if (!all_finite(z)) return {Status::invalid_state, CV_ILL_INPUT};
    if (to == from) return report;
    const bool fresh = !memory_;
    try {
      if (fresh) memory_ = std::make_unique<Memory>();
    } catch (...) {
      return {Status::integrator_failed, CV_MEM_FAIL};
    }
    Memory& m = *memory_;
    m.bind(equations, options_);
    if (fresh) {
      m.z = z;
      report.code = m.build(options_, from);
      report.restarted = true;
      if (report.code != CV_SUCCESS) {
        memory_.reset();
        report.status = cvode_status(report.code, Status::ok);
        return report;
      }
    } else if (!(continuous && same_time(m.reached, from) && m.z == z)) {
      m.z = z;
      report.code = CVodeReInit(m.cvode, from, m.vector);
      report.restarted = true;
    }
    if (report.code == CV_SUCCESS && m.linear != nullptr)
      report.code = CVodeSetJacFn(m.cvode, m.jacobian != nullptr ? Memory::differentiate : nullptr);
    long steps = 0, evaluations = 0, steps_after = 0, evaluations_after = 0;
    if (report.code == CV_SUCCESS && !report.restarted) {
      CVodeGetNumSteps(m.cvode, &steps);
      CVodeGetNumRhsEvals(m.cvode, &evaluations);
    }
    if (report.code == CV_SUCCESS) report.code = CVodeSetStopTime(m.cvode, to);
    double reached = from;
    if (report.code == CV_SUCCESS) report.code = CVode(m.cvode, to, m.vector, &reached, CV_NORMAL);
    CVodeGetNumSteps(m.cvode, &steps_after);
    CVodeGetNumRhsEvals(m.cvode, &evaluations_after);
    report.steps = steps_after - steps;
    report.evaluations = evaluations_after - evaluations;
    if (report.code == CV_TOO_CLOSE) {  // a few units in the last place of t: nothing can change
      report.status = Status::ok;
      m.reached = std::numeric_limits<double>::quiet_NaN();
      return report;
    }
    report.status = cvode_status(report.code, m.reason);
    // Steps that creep because the equations refuse what lies ahead are no lack of steps.
    if (report.code == CV_TOO_MUCH_WORK && m.reason != Status::ok && m.since_refusal < 50)
      report.status = m.reason;
    if (report.status == Status::ok && !all_finite(m.z)) report.status = Status::dynamics_not_finite;
    if (report.status == Status::ok) {
      z = m.z;
      m.reached = to;
    } else {
      m.reached = std::numeric_limits<double>::quiet_NaN();
    }
    return report;
  }

 private:
  template <typename Equations>
  static constexpr bool has_tolerances =
      requires(const Equations& e, double* out) { e.tolerances(0.0, 0.0, out, out); };

  /// To rounding: the caller's clock and CVODE's own sum a flight's steps each in its own way.
  [[nodiscard]] static bool same_time(double a, double b) {
    return std::abs(a - b) <= 8 * std::numeric_limits<double>::epsilon() * std::abs(a);
  }

  /// What CVODE keeps, at an address that does not move with the solver.
  struct Memory {
    SUNContext context = nullptr;
    void* cvode = nullptr;
    N_Vector vector = nullptr;
    SUNNonlinearSolver fixed_point = nullptr;
    SUNMatrix matrix = nullptr;
    SUNLinearSolver linear = nullptr, scaled = nullptr;
    State z = kernel::zeros<State>(), weights = z, row = z;
    double reached = std::numeric_limits<double>::quiet_NaN();
    const void* equations = nullptr;
    Status (*derivative)(const void*, double, const double*, double*) = nullptr;
    bool (*jacobian)(const void*, double, const double*, double*) = nullptr;
    void (*tolerances)(const void*, double, double, const double*, double*) = nullptr;
    const CvodeOptions* options = nullptr;
    Status reason = Status::ok;  // of the last refusal in this interval
    long since_refusal = 0;      // evaluations
    int refusals = 0;            // in this interval
    double stuck_at = 0;         // t that does not move but for rounding
    int stuck = 0;               // evaluations there

    Memory() = default;
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;
    ~Memory() {
      if (cvode != nullptr) CVodeFree(&cvode);
      if (scaled != nullptr) SUNLinSolFreeEmpty(scaled);
      if (linear != nullptr) SUNLinSolFree(linear);
      if (matrix != nullptr) SUNMatDestroy(matrix);
      if (fixed_point != nullptr) SUNNonlinSolFree(fixed_point);
      if (vector != nullptr) N_VDestroy(vector);
      if (context != nullptr) SUNContext_Free(&context);
    }

    template <typename Equations>
    void bind(const Equations& e, const CvodeOptions& o) {
      equations = &e;
      options = &o;
      reason = Status::ok;
      since_refusal = refusals = stuck = 0;
      derivative = [](const void* self, double t, const double* state, double* out) {
        return static_cast<const Equations*>(self)->derivative(t, state, out);
      };
      jacobian = nullptr;
      if constexpr (requires(double* J) { e.jacobian(0.0, z.data(), J); }) {
        jacobian = [](const void* self, double t, const double* state, double* out) {
          return static_cast<const Equations*>(self)->jacobian(t, state, out);
        };
      }
      tolerances = nullptr;
      if constexpr (has_tolerances<Equations>) {
        tolerances = [](const void* self, double t, double step, const double* state, double* out) {
          static_cast<const Equations*>(self)->tolerances(t, step, state, out);
        };
      }
    }

    int build(const CvodeOptions& o, double from) {
#if SUNDIALS_VERSION_MAJOR >= 7
      if (SUNContext_Create(SUN_COMM_NULL, &context) != 0) return CV_MEM_FAIL;
      SUNContext_ClearErrHandlers(context);
#else
      if (SUNContext_Create(nullptr, &context) != 0) return CV_MEM_FAIL;
#endif
      const bool bdf = o.method == CvodeMethod::bdf;
      vector = N_VMake_Serial(size, z.data(), context);
      cvode = CVodeCreate(bdf ? CV_BDF : CV_ADAMS, context);
      if (vector == nullptr || cvode == nullptr) return CV_MEM_FAIL;
#if SUNDIALS_VERSION_MAJOR < 7
      CVodeSetErrHandlerFn(cvode, [](int, const char*, const char*, char*, void*) {}, nullptr);
#endif
      if (const int code = CVodeInit(cvode, evaluate, from, vector); code != CV_SUCCESS) return code;
      CVodeSetUserData(cvode, this);
      if (bdf) {
        matrix = SUNDenseMatrix(size, size, context);
        if (matrix == nullptr) return CV_MEM_FAIL;
        linear = SUNLinSol_Dense(vector, matrix, context);
        if (linear == nullptr) return CV_MEM_FAIL;
        scaled = SUNLinSolNewEmpty(context);
        if (scaled == nullptr) return CV_MEM_FAIL;
        scaled->content = this;
        scaled->ops->gettype = [](SUNLinearSolver) { return SUNLINEARSOLVER_DIRECT; };
        scaled->ops->setup = factor;
        scaled->ops->solve = solve;
        if (CVodeSetLinearSolver(cvode, scaled, matrix) != 0) return CV_LINIT_FAIL;
      } else {
        fixed_point = SUNNonlinSol_FixedPoint(vector, 0, context);
        if (fixed_point == nullptr) return CV_MEM_FAIL;
        if (const int code = CVodeSetNonlinearSolver(cvode, fixed_point); code != CV_SUCCESS) return code;
      }
      for (const int code : {CVodeWFtolerances(cvode, weigh), CVodeSetMaxNumSteps(cvode, o.max_steps),
                             CVodeSetMaxHnilWarns(cvode, -1), CVodeSetMaxErrTestFails(cvode, 20),
                             CVodeSetInitStep(cvode, o.first_step), CVodeSetMinStep(cvode, o.min_step),
                             CVodeSetMaxStep(cvode, o.max_step)}) {
        if (code != CV_SUCCESS) return code;
      }
      return CV_SUCCESS;
    }

    static int evaluate(sunrealtype t, N_Vector state, N_Vector out, void* data) {
      Memory& m = *static_cast<Memory*>(data);
      if (!(std::abs(t - m.stuck_at) <= 16 * std::numeric_limits<double>::epsilon() * std::abs(t))) {
        m.stuck_at = t;
        m.stuck = 0;
      } else if (++m.stuck > 1000 + 10 * size) {
        if (m.reason == Status::ok) m.reason = Status::accuracy_not_met;
        return -1;
      }
      const Status status = m.derivative(m.equations, t, N_VGetArrayPointer(state), N_VGetArrayPointer(out));
      if (status == Status::ok) {
        ++m.since_refusal;
        return 0;
      }
      m.reason = status;
      m.since_refusal = 0;
      return ++m.refusals <= max_refusals ? 1 : -1;  // 1: try a smaller step
    }

    /// What an error counts by, 1 over its tolerance.
    static int weigh(N_Vector state, N_Vector out, void* data) {
      Memory& m = *static_cast<Memory*>(data);
      const CvodeOptions& o = *m.options;
      const double* at = N_VGetArrayPointer(state);
      double* weight = N_VGetArrayPointer(out);
      if (m.tolerances != nullptr) {
        double time = 0, step = 0;
        CVodeGetCurrentTime(m.cvode, &time);
        CVodeGetLastStep(m.cvode, &step);
        m.tolerances(m.equations, time, step, at, weight);
      } else {
        for (std::size_t k = 0; k < size; ++k)
          weight[k] = o.relative_tolerance * std::abs(at[k]) + o.absolute_tolerance +
                      (o.absolute_tolerances.empty() ? 0 : o.absolute_tolerances[k]);
      }
      for (int k = 0; k < size; ++k) {
        if (m.tolerances == nullptr && !(weight[k] > 0)) return -1;
        m.weights(k) = weight[k] = weight[k] > 1e-300 ? 1 / weight[k] : 1e300;
      }
      return 0;
    }

    /// Newton's matrix, each row over its tolerance: no pivot, nor a small part's digits, depend on units.
    static int factor(SUNLinearSolver self, SUNMatrix a) {
      Memory& m = *static_cast<Memory*>(self->content);
      for (int k = 0; k < size; ++k) m.row(k) = std::min(m.weights(k), 1e200);
      for (int j = 0; j < size; ++j) {
        for (int k = 0; k < size; ++k) SUNDenseMatrix_Column(a, j)[k] *= m.row(k);
      }
      return SUNLinSolSetup(m.linear, a);
    }
    static int solve(SUNLinearSolver self, SUNMatrix a, N_Vector x, N_Vector b, sunrealtype tolerance) {
      Memory& m = *static_cast<Memory*>(self->content);
      for (int k = 0; k < size; ++k) N_VGetArrayPointer(x)[k] = m.row(k) * N_VGetArrayPointer(b)[k];
      return SUNLinSolSolve(m.linear, a, x, x, tolerance);
    }

    static int differentiate(sunrealtype t, N_Vector state, N_Vector, SUNMatrix out, void* data, N_Vector,
                             N_Vector, N_Vector) {
      Memory& m = *static_cast<Memory*>(data);
      return m.jacobian(m.equations, t, N_VGetArrayPointer(state), SUNDenseMatrix_Data(out)) ? 0 : 1;
    }
  };

  CvodeOptions options_;
  std::unique_ptr<Memory> memory_;
};

}  // namespace jml
#include <jml/warnings_end.hpp>
