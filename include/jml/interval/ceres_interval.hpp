// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The recording of a Batch as a problem of Ceres, and the answer brought back (component jml::ceres); who
/// solves it is interval/ceres.hpp.
#include <jml/warnings_begin.hpp>
#pragma once

#include <ceres/loss_function.h>
#include <ceres/problem.h>

#include <algorithm>
#include <array>
#include <deque>
#include <jml/interval/ceres_terms.hpp>
#include <jml/interval/loss.hpp>
#include <jml/interval/recording.hpp>
#include <memory>
#include <vector>

namespace jml::detail {

/// The natural size of each state of a recording: its median standard deviation in a filter linearised along
/// the nominal. One that is certain throughout: its largest value.
template <typename Store, int n = states_of<typename Store::Dynamics>>
Vector<double, n> natural_size(Store& store) {
  using X = Vector<double, n>;
  using Square = Matrix<double, n, n>;
  const ProcessNoise<double, typename Store::Dynamics> noise(store.dynamics());
  std::array<std::vector<double>, n> variances;
  X largest = kernel::zeros<X>();
  Square P = store.estimate().P;
  for (int j = 0; j <= store.last(); ++j) {
    const auto& node = store.node(j);
    const X& x = node.x[store.now()];
    if (j > 0) {
      const X& previous = store.node(j - 1).x[store.now()];
      const Square A = dynamics_jacobian(store.dynamics(), previous, node.at());
      P = (A * P * A.transpose()).eval();
      (void)noise.with(store.dynamics(), previous, node.at(), [&P](const Square& C) { P += C; });
    }
    for (int i = 0; i < n; ++i) {
      if (P(i, i) > 0 && std::isfinite(P(i, i))) variances[static_cast<std::size_t>(i)].push_back(P(i, i));
      if (std::isfinite(x(i))) largest(i) = std::max(largest(i), std::abs(x(i)));
    }
    store.visit(j, [&](const auto& record) {
      constexpr int p = measurements_of<std::remove_cvref_t<decltype(record.sensor)>>;
      const auto at = end_of(node.at());
      const Matrix<double, p, n> M = measurement_jacobian(record.sensor, x, at);
      const Matrix<double, p, p> R = noise_covariance(record.sensor, x, at);
      const Eigen::LLT<Matrix<double, p, p>> root(M * P * M.transpose() + R);
      const Matrix<double, p, n> MP = root.matrixL().solve(M * P);
      if (all_finite(MP)) P -= MP.transpose() * MP;
    });
  }
  X size;
  for (int i = 0; i < n; ++i) {
    auto& of = variances[static_cast<std::size_t>(i)];
    const auto middle = of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2);
    std::nth_element(of.begin(), middle, of.end());
    size(i) = !of.empty() ? std::sqrt(*middle) : largest(i) > 0 ? largest(i) : 1;
  }
  return size;
}

template <typename D, typename List>
class CeresInterval;

/// The problem begins at the nominal of the store, and the answer becomes its nominal. State-dependent G, Q,
/// R are those of the last freeze().
template <typename D, typename... Sensor>
class CeresInterval<D, Sensors<Sensor...>> {
  using Store = Recording<D, Sensors<Sensor...>, double>;
  using Root = NoiseRoot<double, D>;
  static constexpr int n = states_of<D>;
  using X = Vector<double, n>;
  using Square = Matrix<double, n, n>;
  using At = StepContext<double, DynamicsTraits<D>::controls>;
  template <typename S>
  using Term = MeasurementTerm<S, n, At>;
  template <typename S>
  static constexpr auto type_of = static_cast<std::size_t>(Sensors<Sensor...>::template index_of<S>());

 public:
  static constexpr bool varies = !Root::constant || (Record<double, n, Sensor, At>::varies || ...);

  /// other: takes the place of `loss`; null for none.
  CeresInterval(Store& store, const Loss& loss, ::ceres::LossFunction* other)
      : store_(store), noise_(store.dynamics()), size_(natural_size(store)), loss_(other) {
    if (other == nullptr && loss.kind == Loss::Kind::huber)
      own_loss_ = std::make_unique<::ceres::HuberLoss>(loss.width);
    if (other == nullptr && loss.kind == Loss::Kind::cauchy)
      own_loss_ = std::make_unique<::ceres::CauchyLoss>(loss.width);
    if (own_loss_) loss_ = own_loss_.get();
    for (int i = 0; i < n; ++i) unit_(i) = std::exp2(std::round(std::log2(size_(i))));
    ::ceres::Problem::Options ownership;
    ownership.cost_function_ownership = ::ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.loss_function_ownership = ::ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.disable_all_safety_checks = true;
    problem_ = std::make_unique<::ceres::Problem>(ownership);
    build();
  }

  ::ceres::Problem& problem() { return *problem_; }

  /// G, Q, R and w̄ at the present states; softness: of singular terms, a part of the natural variance.
  /// `change`: the largest relative change of a covariance's root.
  Status freeze(double softness, double& change) {
    change = 0;
    Status status = Status::ok;
    const auto form = [&](Hold<n>& hold, const Square& C, Status refusal) {
      const Square before = hold.L;
      if (!hold.form(C, size_, softness)) status = refusal;
      change = std::max(change, (hold.L - before).norm() / hold.L.norm());
    };
    if (!known_start_) form(prior_.hold, store_.estimate().P, Status::invalid_covariance);
    std::array<std::size_t, sizeof...(Sensor)> next{};
    for (int j = 0; j <= store_.last(); ++j) {
      auto& node = store_.node(j);
      if (j > 0) {
        if constexpr (!Root::constant) {
          if (!node.noise.form(store_.dynamics(), x(j - 1), node.at()))
            status = Status::invalid_disturbance_covariance;
          step(j).mean_effect = node.noise.mean_effect;
        }
        if (!Root::constant || j == 1) {
          const bool valid = noise_.with(store_.dynamics(), x(j - 1), node.at(), [&](const Square& C) {
            form(hold(j), C, Status::invalid_disturbance_covariance);
          });
          if (!valid) status = Status::invalid_disturbance_covariance;
        }
      }
      store_.visit(j, [&](auto& record) {
        constexpr auto type = type_of<std::remove_cvref_t<decltype(record.sensor)>>;
        if (!std::get<type>(terms_)[next[type]++].freeze(x(j), change) ||
            !record.freeze(x(j), end_of(node.at())))
          status = Status::invalid_noise_covariance;
      });
    }
    return status;
  }

  /// The largest entry of the gradient at the start, with multipliers that ask nothing of its defects.
  double gradient_at_start() {
    for (int j = 1; j <= store_.last(); ++j)
      step(j).multiplier = -hold(j).multiplier(step(j).difference(x(j - 1), x(j)), kernel::zeros<X>());
    std::vector<double> gradient;
    const bool finite = problem_->Evaluate({}, nullptr, nullptr, &gradient, nullptr);
    for (auto& term : steps_) kernel::set_zero(term.multiplier);
    double largest = 0;
    for (const double g : gradient) largest = std::max(largest, std::abs(g));
    return finite ? largest : std::numeric_limits<double>::quiet_NaN();
  }

  /// What the rounding of the states makes of the gradient.
  double rounding_of_gradient() {
    double largest = 0;
    for (int j = 1; j <= store_.last(); ++j) {
      const X rounding = 4 * std::numeric_limits<double>::epsilon() * x(j).cwiseAbs();
      const X slope = hold(j).multiplier(rounding, kernel::zeros<X>()).cwiseProduct(unit_);
      largest = std::max(largest, slope.cwiseAbs().maxCoeff());
    }
    return largest;
  }

  /// What a minimisation left over.
  struct Left {
    double defect;  // largest |x⁺ - f(x) - G w̄ - B b| of a component over its largest value
    double cost;    // what softness and multipliers put on top of J
  };
  /// After a minimisation: its trajectory into the store, and the multipliers of the next.
  Left take() {
    const int now = store_.now();
    double cost = 0;
    X worst = kernel::zeros<X>(), largest = x(0).cwiseAbs();
    const auto from = [&](const Hold<n>& hold, const X& d, const auto& B, X& multiplier, auto& whitened) {
      multiplier = hold.multiplier(d, multiplier);
      whitened = B.transpose() * multiplier;
      cost += multiplier.dot(hold.slack.cwiseProduct(multiplier)) / 2;
      worst = worst.cwiseMax((d - B * whitened).cwiseAbs());
    };
    auto& prior = store_.prior();
    kernel::set_zero(prior.a[now]);
    if (!known_start_) from(prior_.hold, prior_.difference(x(0)), prior.L, prior_.multiplier, prior.a[now]);
    store_.node(0).x[now] = x(0);
    for (int j = 1; j <= store_.last(); ++j) {
      const X d = step(j).difference(x(j - 1), x(j));
      from(hold(j), d, store_.root(j).B, step(j).multiplier, store_.node(j).b[now]);
      store_.node(j).x[now] = x(j);
      largest = largest.cwiseMax(x(j).cwiseAbs());
    }
    double defect = 0;
    for (int i = 0; i < n; ++i) {
      if (!(worst(i) <= 0)) defect = std::max(defect, worst(i) / largest(i));
    }
    return {defect, cost};
  }

  /// |∇J| over (a, b), of which J is a function without constraints: an adjoint pass along the trajectory.
  double whitened_gradient() {
    const int now = store_.now();
    std::array<std::size_t, sizeof...(Sensor)> left{std::get<type_of<Sensor>>(terms_).size()...};
    X adjoint = kernel::zeros<X>();
    double sum = 0;
    for (int j = store_.last();; --j) {
      const auto& node = store_.node(j);
      store_.visit(j, [&](const auto& record) {
        using S = std::remove_cvref_t<decltype(record.sensor)>;
        Vector<double, measurements_of<S>> r;
        CeresJacobian<measurements_of<S>, n> slope;
        const double* u = state(j).data();
        double* jacobian = slope.data();
        (void)std::get<type_of<S>>(terms_)[--left[type_of<S>]].Evaluate(&u, r.data(), &jacobian);
        double rho[3] = {0, 1, 0};
        if (loss_ != nullptr) loss_->Evaluate(r.squaredNorm(), rho);
        adjoint += rho[1] * (slope.transpose() * r).cwiseQuotient(unit_);
      });
      if (j == 0) break;
      sum += (node.b[now] + store_.root(j).B.transpose() * adjoint).squaredNorm();
      adjoint = (dynamics_jacobian(store_.dynamics(), x(j - 1), node.at()).transpose() * adjoint).eval();
    }
    sum += (store_.prior().a[now] + store_.prior().L.transpose() * adjoint).squaredNorm();
    return std::sqrt(sum);
  }

 private:
  X& state(int j) { return states_[static_cast<std::size_t>(j)]; }
  [[nodiscard]] X x(int j) { return unit_.cwiseProduct(state(j)); }
  StepTerm<D>& step(int j) { return steps_[static_cast<std::size_t>(j - 1)]; }
  Hold<n>& hold(int j) { return holds_[Root::constant ? 0 : static_cast<std::size_t>(j - 1)]; }

  void build() {
    states_.resize(static_cast<std::size_t>(store_.last()) + 1);
    holds_.resize(Root::constant ? 1 : static_cast<std::size_t>(store_.last()));
    for (int j = 0; j <= store_.last(); ++j) {
      const auto& node = store_.node(j);
      state(j) = node.x[store_.now()].cwiseQuotient(unit_);
      problem_->AddParameterBlock(state(j).data(), n);
      if (j > 0) {
        steps_.emplace_back(store_.dynamics(), node.at(), unit_, hold(j));
        problem_->AddResidualBlock(&steps_.back(), nullptr, state(j - 1).data(), state(j).data());
      }
      store_.visit(j, [&](const auto& record) {
        auto& terms = std::get<type_of<std::remove_cvref_t<decltype(record.sensor)>>>(terms_);
        terms.emplace_back(record.sensor, record.y, end_of(node.at()), unit_);
        problem_->AddResidualBlock(&terms.back(), loss_, state(j).data());
      });
    }
    if (known_start_) {
      state(0) = store_.estimate().x.cwiseQuotient(unit_);
      problem_->SetParameterBlockConstant(state(0).data());
    } else {
      problem_->AddResidualBlock(&prior_, nullptr, state(0).data());
    }
  }

  Store& store_;
  ProcessNoise<double, D> noise_;
  X size_, unit_;
  ::ceres::LossFunction* loss_;
  std::unique_ptr<::ceres::LossFunction> own_loss_;
  bool known_start_ = store_.estimate().P.isZero(0);  // P_0 = 0: a constant to Ceres
  std::vector<X> states_;                             // in units
  std::vector<Hold<n>> holds_;
  PriorTerm<n> prior_{store_.prior().x, unit_};
  std::deque<StepTerm<D>> steps_;  // Ceres' cost functions cannot be moved
  std::tuple<std::deque<Term<Sensor>>...> terms_;
  std::unique_ptr<::ceres::Problem> problem_;
};

}  // namespace jml::detail
#include <jml/warnings_end.hpp>
