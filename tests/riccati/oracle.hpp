// SPDX-License-Identifier: BSD-3-Clause
// The recursion written a second time, in long double and with explicit inverses, sharing nothing with the
// library.
#pragma once

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace oracle {

using Big = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

template <typename Derived>
Big big(const Eigen::MatrixBase<Derived>& a) {
  Big out(a.rows(), a.cols());  // no expression: each would be a type of its own to compile
  for (Eigen::Index j = 0; j < a.cols(); ++j) {
    for (Eigen::Index i = 0; i < a.rows(); ++i) out(i, j) = static_cast<long double>(a(i, j));
  }
  return out;
}

/// Table 1's slots and what goes with them, at one step.
struct Slots {
  Big A, B, D, E, noise, R;  // noise = G Q Gᵀ
};

struct Posterior {
  Big x, P, gain;
};

inline Big inverse(const Big& a) { return a.fullPivLu().inverse(); }

/// N = A P Bᵀ + G Q Gᵀ.
inline Big predicted(const Slots& s, const Big& P) { return Big(Big(s.A * P) * s.B.transpose()) + s.noise; }

/// P⁺ = [N⁻¹ + Dᵀ R⁻¹ E]⁻¹, gain P⁺ Dᵀ R⁻¹, as Table 1 prints it. N must be regular.
inline Posterior brute_force(const Slots& s, const Big& prediction, const Big& P, const Big& innovation) {
  const Big weight = s.D.transpose() * inverse(s.R);
  const Big information = inverse(predicted(s, P)) + weight * s.E;
  Posterior out;
  out.P = inverse(information);
  out.gain = out.P * weight;
  out.x = prediction + out.gain * innovation;
  return out;
}

/// The same for any N: [N⁻¹ + W]⁻¹ = (I + N W)⁻¹ N.
inline Posterior push_through(const Slots& s, const Big& prediction, const Big& P, const Big& innovation) {
  const Big weight = s.D.transpose() * inverse(s.R);
  const Big N = predicted(s, P);
  Posterior out;
  out.P = inverse(Big::Identity(N.rows(), N.cols()) + N * weight * s.E) * N;
  out.gain = out.P * weight;
  out.x = prediction + out.gain * innovation;
  return out;
}

/// Joseph's form of the symmetric case (A = B, D = E): (I - K D) N (I - K D)ᵀ + K R Kᵀ.
inline Posterior joseph(const Slots& s, const Big& prediction, const Big& P, const Big& innovation) {
  const Big N = predicted(s, P);
  Posterior out;
  out.gain = N * s.D.transpose() * inverse(s.R + s.D * N * s.D.transpose());
  const Big keep = Big::Identity(N.rows(), N.cols()) - out.gain * s.D;
  out.P = keep * N * keep.transpose() + out.gain * s.R * out.gain.transpose();
  out.x = prediction + out.gain * innovation;
  return out;
}

/// The largest difference of an entry, relative to the largest entry of `wanted`.
template <typename Derived>
double distance(const Eigen::MatrixBase<Derived>& got, const Big& wanted) {
  const long double scale = wanted.cwiseAbs().maxCoeff();
  const long double off = (big(got) - wanted).cwiseAbs().maxCoeff();
  if (!std::isfinite(off)) return 1e300;
  return static_cast<double>(scale > 0 ? off / scale : off);
}

}  // namespace oracle
