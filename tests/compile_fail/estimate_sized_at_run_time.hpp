// SPDX-License-Identifier: BSD-3-Clause
// must say: jml: how many states an estimate has must be known at compile time
#include "parts.hpp"

namespace estimate_sized_at_run_time {

#ifdef MISTAKE
inline auto start() { return jml::Estimate{Eigen::VectorXd(2), Eigen::MatrixXd(2, 2)}; }
#else
inline auto start() { return jml::Estimate<double, 2>{Eigen::VectorXd(2), Eigen::MatrixXd(2, 2)}; }
#endif

inline bool run() { return start().x(0) > 0; }

}  // namespace estimate_sized_at_run_time
