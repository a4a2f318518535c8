// SPDX-License-Identifier: BSD-3-Clause
// MRPT's CKalmanFilterCapable, method kfEKFNaive, its virtual functions given by the models with analytic
// Jacobians.
#include <mrpt/bayes/CKalmanFilterCapable.h>

#include "step_contest.hpp"

// The library as Debian builds it holds no 1×1 matrix: what the base class asks of one, which is never called
// here.
#if JML_PEER_N == 2
namespace mrpt::math {
template <>
void MatrixVectorBase<double, CMatrixFixed<double, 1, 1>>::impl_op_selfsubs(
    const CMatrixFixed<double, 1, 1>& m) {
  mvbDerived()(0, 0) -= m(0, 0);
}
}  // namespace mrpt::math
#endif

namespace {

using peers::n, peers::p;

class Mrpt : public mrpt::bayes::CKalmanFilterCapable<n, p, 0, 0, double> {
 public:
  explicit Mrpt(const peers::Contest& contest) : contest_(contest) {
    setMinLoggingLevel(mrpt::system::LVL_ERROR);
    m_xkk.resize(n);
    m_pkk.setSize(n, n);
    for (int i = 0; i < n; ++i) {
      m_xkk[i] = contest.x0(i);
      for (int j = 0; j < n; ++j) m_pkk(i, j) = contest.P0(i, j);
    }
    KF_options.method = mrpt::bayes::kfEKFNaive;
  }
  bool step(const peers::Measurement& y) {
    y_ = &y;
    runOneKalmanIteration();
    return true;
  }
  [[nodiscard]] double x(int i) const { return m_xkk[i]; }
  [[nodiscard]] double variance(int i) const { return m_pkk(i, i); }
  [[nodiscard]] static std::size_t state_bytes() { return sizeof(Mrpt) + sizeof(double) * (n + n * n); }

 protected:
  [[nodiscard]] peers::State now() const { return Eigen::Map<const peers::State>(&m_xkk[0]); }

  void OnGetAction(KFArray_ACT&) const override {}
  void OnTransitionModel(const KFArray_ACT&, KFArray_VEH& x, bool&) const override {
    x.asEigen() = contest_.dynamics.dynamics(peers::State(x.asEigen()));
  }
  void OnTransitionJacobian(KFMatrix_VxV& F) const override {
    F.asEigen() = contest_.dynamics.dynamics_jacobian(now());
  }
  void OnTransitionNoise(KFMatrix_VxV& Q) const override { Q.asEigen() = contest_.Q; }
  void OnGetObservationNoise(KFMatrix_OxO& R) const override { R.asEigen() = contest_.R; }
  void OnGetObservationsAndDataAssociation(vector_KFArray_OBS& out, std::vector<int>& association,
                                           const vector_KFArray_OBS&, const KFMatrix&,
                                           const std::vector<size_t>&, const KFMatrix_OxO&) override {
    out.resize(1);
    out[0].asEigen() = *y_;
    association.clear();
  }
  void OnObservationModel(const std::vector<size_t>&, vector_KFArray_OBS& out) const override {
    out.resize(1);
    out[0].asEigen() = contest_.sensor.measurement(now());
  }
  void OnObservationJacobians(size_t, KFMatrix_OxV& H, KFMatrix_OxF&) const override {
    H.asEigen() = contest_.sensor.measurement_jacobian(now());
  }
  void OnSubstractObservationVectors(KFArray_OBS& a, const KFArray_OBS& b) const override {
    a.asEigen() = contest_.residual(peers::Measurement(a.asEigen()), peers::Measurement(b.asEigen()));
  }

 private:
  const peers::Contest& contest_;
  const peers::Measurement* y_ = nullptr;
};

}  // namespace

int main(int argc, char** argv) { return peers::run_steps<Mrpt>(argc, argv, "mrpt_ekf"); }
