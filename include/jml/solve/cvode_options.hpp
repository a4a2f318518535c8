// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What SUNDIALS' CVODE is asked for, and what it reports (component jml::cvode).
#include <jml/warnings_begin.hpp>
#pragma once

#include <cvode/cvode.h>

#include <cmath>
#include <jml/status.hpp>
#include <vector>

namespace jml {

/// How CVODE integrates.
enum class CvodeMethod {
  adams,  ///< Adams-Moulton with fixed-point iteration: equations that are not stiff
  bdf,    ///< backward differentiation with Newton and a dense Jacobian: stiff equations
};

/// What a step may be wrong by, in each component: relative_tolerance times its scale, plus the absolute
/// ones. The scale is what the equations say (see CvodeSolver::integrate), else the size of the component;
/// then one that becomes exactly zero needs an absolute tolerance, and is invalid_option without.
struct CvodeOptions {
  CvodeMethod method = CvodeMethod::adams;  ///< for equations that are not stiff
  double relative_tolerance = 1e-9;         ///< of each component's scale
  double absolute_tolerance = 0;            ///< of every component, in its unit
  int max_steps = 100000;                   ///< over one interval
  double first_step = 0;                    ///< s; 0: CVODE's choice
  double min_step = 0;                      ///< s; 0: no limit
  double max_step = 0;                      ///< s; 0: no limit
  /// Of each component by itself, in its unit; as many as there are components, or none.
  std::vector<double> absolute_tolerances = {};
};

/// Everything finite and in its range, and some tolerance above zero.
[[nodiscard]] inline bool valid(const CvodeOptions& o) {
  bool some = o.relative_tolerance > 0 || o.absolute_tolerance > 0;
  for (const double tolerance : o.absolute_tolerances) {
    if (!(tolerance >= 0 && std::isfinite(tolerance))) return false;
    some = some || tolerance > 0;
  }
  return some && o.relative_tolerance >= 0 && o.absolute_tolerance >= 0 &&
         std::isfinite(o.relative_tolerance) && std::isfinite(o.absolute_tolerance) && o.max_steps > 0 &&
         o.first_step >= 0 && o.min_step >= 0 && o.max_step >= 0 && std::isfinite(o.first_step) &&
         std::isfinite(o.min_step) && std::isfinite(o.max_step) &&
         (o.max_step == 0 || o.min_step <= o.max_step);
}

/// What one interval cost and how it ended.
struct CvodeReport {
  Status status = Status::ok;  ///< ok, or why it ended before
  int code = CV_SUCCESS;       ///< CVODE's own return code
  long steps = 0;              ///< of CVODE
  long evaluations = 0;        ///< of the equations
  bool restarted = false;      ///< order and step were started afresh
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

}  // namespace jml
#include <jml/warnings_end.hpp>
