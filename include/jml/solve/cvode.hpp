// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ordinary differential equations ż = g(t, z) by SUNDIALS' CVODE (component jml::cvode), in Eigen's memory.
///
/// Adaptive in step and order: for stiff phases and long gaps. It allocates when it is created, and with
/// Adams never again. Nothing is printed; every return code of CVODE becomes a Status. SUNDIALS 6.4 to 7.x.
#pragma once

#include <cvode/cvode.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_version.h>
#include <sunlinsol/sunlinsol_dense.h>
#include <sunmatrix/sunmatrix_dense.h>
#include <sunnonlinsol/sunnonlinsol_fixedpoint.h>

#include <jml/linear_algebra.hpp>
#include <jml/status.hpp>
#include <memory>

namespace jml {

enum class CvodeMethod {
  adams,  ///< Adams-Moulton with fixed-point iteration: equations that are not stiff
  bdf,    ///< backward differentiation with Newton and a dense Jacobian: stiff equations
};

struct CvodeOptions {
  CvodeMethod method = CvodeMethod::adams;
  double relative_tolerance = 1e-6;
  double absolute_tolerance = 1e-8;   ///< of every component, in its unit
  int max_steps = 10000;              ///< over one interval
  double first_step = 0;              ///< s; 0: CVODE's choice
  double min_step = 0, max_step = 0;  ///< s; 0: no limit
};

[[nodiscard]] inline bool valid(const CvodeOptions& o) {
  return o.relative_tolerance >= 0 && o.absolute_tolerance >= 0 &&
         o.relative_tolerance + o.absolute_tolerance > 0 && std::isfinite(o.relative_tolerance) &&
         std::isfinite(o.absolute_tolerance) && o.max_steps > 0 && o.first_step >= 0 && o.min_step >= 0 &&
         o.max_step >= 0 && std::isfinite(o.first_step) && std::isfinite(o.min_step) &&
         std::isfinite(o.max_step) && (o.max_step == 0 || o.min_step <= o.max_step);
}

/// What one interval cost and how it ended.
struct CvodeReport {
  Status status = Status::ok;
  int code = CV_SUCCESS;  ///< CVODE's own return code
  long steps = 0, evaluations = 0;
  bool restarted = false;  ///< order and step were started afresh
};

/// A CVODE return code as a Status; `reason`: what the equations last refused with.
[[nodiscard]] constexpr Status cvode_status(int code, Status reason = Status::dynamics_not_finite) {
  switch (code) {
    case CV_SUCCESS:
    case CV_TSTOP_RETURN:
    case CV_ROOT_RETURN:
    case CV_WARNING:
      return Status::ok;
    case CV_TOO_MUCH_WORK:
      return Status::step_limit;
    case CV_TOO_MUCH_ACC:
    case CV_ERR_FAILURE:
    case CV_CONV_FAILURE:
      return reason == Status::ok ? Status::accuracy_not_met : reason;
    case CV_RHSFUNC_FAIL:
    case CV_FIRST_RHSFUNC_ERR:
    case CV_REPTD_RHSFUNC_ERR:
    case CV_UNREC_RHSFUNC_ERR:
      return reason == Status::ok ? Status::dynamics_not_finite : reason;
    case CV_ILL_INPUT:
      return Status::invalid_option;
    case CV_TOO_CLOSE:
    case CV_BAD_T:
      return Status::invalid_time_step;
    default:
      return Status::integrator_failed;
  }
}

/// Integrates systems of `size` equations; one SUNDIALS context and one memory of its own, so that objects
/// may work in different threads. A copy has the options and fresh memory, made at its first use.
template <int size>
class CvodeSolver {
 public:
  using State = Vector<double, size>;
  static constexpr int max_refusals = 200;  ///< of the equations in one interval; then it is refused

  explicit CvodeSolver(const CvodeOptions& options = {}) : options_(options) {}
  CvodeSolver(const CvodeSolver& other) : options_(other.options_) {}
  CvodeSolver& operator=(const CvodeSolver& other) {
    options_ = other.options_;
    memory_.reset();
    return *this;
  }
  CvodeSolver(CvodeSolver&&) noexcept = default;
  CvodeSolver& operator=(CvodeSolver&&) noexcept = default;
  ~CvodeSolver() = default;

  [[nodiscard]] const CvodeOptions& options() const { return options_; }

  /// Moves z from time `from` to `to`, stopping exactly there; no evaluation lies beyond `to`.
  ///
  /// `equations.derivative(t, z, dz)`: Status; z and dz are double[size]. A refusal makes CVODE try a smaller
  /// step; where none helps it is the answer. `equations.jacobian(t, z, J)`: bool, ∂g/∂z column by column;
  /// optional, else CVODE takes differences (BDF only).
  /// `continuous`: g is the same function as in the last call, up to kinks; then order and step are kept,
  /// provided that z and `from` are where that call ended. On refusal z is untouched.
  template <typename Equations>
  CvodeReport integrate(const Equations& equations, double from, double to, State& z,
                        bool continuous = false) {
    CvodeReport report;
    if (!valid(options_)) return {Status::invalid_option, CV_ILL_INPUT};
    if (!std::isfinite(from) || !std::isfinite(to) || to < from) {
      return {Status::invalid_time_step, CV_ILL_INPUT};
    }
    if (!all_finite(z)) return {Status::invalid_state, CV_ILL_INPUT};
    if (to == from) return report;
    try {
      if (!memory_) memory_ = std::make_unique<Memory>();
    } catch (...) {
      return {Status::integrator_failed, CV_MEM_FAIL};
    }
    Memory& m = *memory_;
    m.bind(equations);
    if (m.cvode == nullptr) {
      report.code = m.create(options_, from, z);
      report.restarted = true;
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
    if (m.cvode != nullptr) {
      CVodeGetNumSteps(m.cvode, &steps_after);
      CVodeGetNumRhsEvals(m.cvode, &evaluations_after);
    }
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
    SUNLinearSolver linear = nullptr;
    State z = kernel::zeros<State>();
    double reached = std::numeric_limits<double>::quiet_NaN();
    const void* equations = nullptr;
    Status (*derivative)(const void*, double, const double*, double*) = nullptr;
    bool (*jacobian)(const void*, double, const double*, double*) = nullptr;
    Status reason = Status::ok;  // of the last refusal in this interval
    long since_refusal = 0;      // evaluations
    int refusals = 0;            // in this interval

    Memory() = default;
    Memory(const Memory&) = delete;
    Memory& operator=(const Memory&) = delete;
    ~Memory() { destroy(); }

    template <typename Equations>
    void bind(const Equations& e) {
      equations = &e;
      reason = Status::ok;
      since_refusal = refusals = 0;
      derivative = [](const void* self, double t, const double* state, double* out) {
        return static_cast<const Equations*>(self)->derivative(t, state, out);
      };
      if constexpr (requires(double* J) { e.jacobian(0.0, z.data(), J); }) {
        jacobian = [](const void* self, double t, const double* state, double* out) {
          return static_cast<const Equations*>(self)->jacobian(t, state, out);
        };
      } else {
        jacobian = nullptr;
      }
    }

    /// All of it or nothing.
    int create(const CvodeOptions& options, double from, const State& start) {
      z = start;
      const int code = build(options, from);
      if (code != CV_SUCCESS) destroy();
      return code;
    }

    int build(const CvodeOptions& options, double from) {
#if SUNDIALS_VERSION_MAJOR >= 7
      if (SUNContext_Create(SUN_COMM_NULL, &context) != 0) return CV_MEM_FAIL;
      SUNContext_ClearErrHandlers(context);
#else
      if (SUNContext_Create(nullptr, &context) != 0) return CV_MEM_FAIL;
#endif
      const bool bdf = options.method == CvodeMethod::bdf;
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
        if (CVodeSetLinearSolver(cvode, linear, matrix) != 0) return CV_LINIT_FAIL;
      } else {
        fixed_point = SUNNonlinSol_FixedPoint(vector, 0, context);
        if (fixed_point == nullptr) return CV_MEM_FAIL;
        if (const int code = CVodeSetNonlinearSolver(cvode, fixed_point); code != CV_SUCCESS) return code;
      }
      for (const int code :
           {CVodeSStolerances(cvode, options.relative_tolerance, options.absolute_tolerance),
            CVodeSetMaxNumSteps(cvode, options.max_steps), CVodeSetMaxHnilWarns(cvode, -1),
            CVodeSetInitStep(cvode, options.first_step), CVodeSetMinStep(cvode, options.min_step),
            CVodeSetMaxStep(cvode, options.max_step)}) {
        if (code != CV_SUCCESS) return code;
      }
      return CV_SUCCESS;
    }

    void destroy() {
      if (cvode != nullptr) CVodeFree(&cvode);
      if (linear != nullptr) SUNLinSolFree(linear);
      if (matrix != nullptr) SUNMatDestroy(matrix);
      if (fixed_point != nullptr) SUNNonlinSolFree(fixed_point);
      if (vector != nullptr) N_VDestroy(vector);
      if (context != nullptr) SUNContext_Free(&context);
      cvode = nullptr;
      linear = nullptr;
      matrix = nullptr;
      fixed_point = nullptr;
      vector = nullptr;
      context = nullptr;
    }

    static int evaluate(sunrealtype t, N_Vector state, N_Vector out, void* data) {
      Memory& m = *static_cast<Memory*>(data);
      const Status status = m.derivative(m.equations, t, N_VGetArrayPointer(state), N_VGetArrayPointer(out));
      if (status == Status::ok) {
        ++m.since_refusal;
        return 0;
      }
      m.reason = status;
      m.since_refusal = 0;
      return ++m.refusals <= max_refusals ? 1 : -1;  // 1: try a smaller step
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
