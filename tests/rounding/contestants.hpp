// SPDX-License-Identifier: BSD-3-Clause
// How each form of the library flies a problem, and what came of it.
#pragma once

#include <jml/filter/one_pass.hpp>
#include <jml/interval/batch.hpp>
#include <jml/interval/fixed_lag.hpp>
#include <jml/interval/smoother.hpp>
#if __has_include(<jml/filter/factored.hpp>)
#include <jml/filter/factored.hpp>
#define JML_TEST_FACTORED 1
#else
#define JML_TEST_FACTORED 0
#endif

#include "rounding/flight.hpp"
#include "rounding/problems.hpp"

namespace rounding {

/// What a form made of a problem, up to its first refusal or its first wrong answer.
struct Outcome {
  bool flown = false;  ///< false: this form is not given such problems
  bool refused = false, wrong_P = false, wrong_x = false, redone = false;
  jml::Status status = jml::Status::ok;
  int event = 0;  ///< of that refusal or answer
  Errors worst;
  double label = 1, inner = 1, loss = 1;  ///< of the flight up to there
  [[nodiscard]] bool right() const { return flown && !refused && !wrong_P && !wrong_x; }
};

template <typename Scalar, int n>
struct Dynamics {
  static constexpr int states = n, disturbances = n;
  static constexpr bool linear = true;
  jml::Matrix<Scalar, n, n> F, G, Q;
  template <typename T>
  jml::Vector<T, n> dynamics(const jml::Vector<T, n>& x) const {
    jml::Vector<T, n> out;
    for (int i = 0; i < n; ++i) {
      T sum(0);
      for (int j = 0; j < n; ++j) sum += F(i, j) * x(j);
      out(i) = sum;
    }
    return out;
  }
  jml::Matrix<Scalar, n, n> dynamics_jacobian(const jml::Vector<Scalar, n>&) const { return F; }
  jml::Matrix<Scalar, n, n> disturbance_input() const { return G; }
  jml::Matrix<Scalar, n, n> disturbance_covariance() const { return Q; }
};

template <typename Scalar, int n, int p>
struct Sensor {
  static constexpr int measurements = p;
  static constexpr bool linear = true;
  jml::Matrix<Scalar, p, n> H;
  jml::Matrix<Scalar, p, p> R;
  template <typename T>
  jml::Vector<T, p> measurement(const jml::Vector<T, n>& x) const {
    jml::Vector<T, p> out;
    for (int i = 0; i < p; ++i) {
      T sum(0);
      for (int j = 0; j < n; ++j) sum += H(i, j) * x(j);
      out(i) = sum;
    }
    return out;
  }
  jml::Matrix<Scalar, p, n> measurement_jacobian(const jml::Vector<Scalar, n>&) const { return H; }
  jml::Matrix<Scalar, p, p> noise_covariance() const { return R; }
};

/// The model of a problem in the library's types.
template <typename Scalar, int n, int p>
struct Model {
  using Joint = Sensor<Scalar, n, p>;
  using Single = Sensor<Scalar, n, 1>;
  Dynamics<Scalar, n> dynamics;
  std::array<Joint, 2> joint;
  std::array<std::array<Single, p>, 2> single;
  jml::Vector<Scalar, n> x0, D;
  jml::Matrix<Scalar, n, n> P0, U;

  explicit Model(const Problem& problem) {
    fill(dynamics.F, problem.F);
    fill(dynamics.G, problem.G);
    fill(dynamics.Q, problem.Q);
    fill(P0, problem.P0);
    fill(U, problem.U);
    fill(x0, problem.x0);
    fill(D, problem.D);
    for (std::size_t s = 0; s < 2; ++s) {
      fill(joint[s].H, problem.sensors[s].H);
      fill(joint[s].R, problem.sensors[s].R);
      for (int i = 0; i < p; ++i) {
        auto& row = single[s][static_cast<std::size_t>(i)];
        for (int j = 0; j < n; ++j) row.H(0, j) = joint[s].H(i, j);
        row.R(0, 0) = joint[s].R(i, i);
      }
    }
  }
  [[nodiscard]] jml::Estimate<Scalar, n> start() const { return {x0, P0}; }
  [[nodiscard]] static jml::Vector<Scalar, p> y(const Event& event) {
    jml::Vector<Scalar, p> out;
    for (int i = 0; i < p; ++i) out(i) = static_cast<Scalar>(event.y[static_cast<std::size_t>(i)]);
    return out;
  }

 private:
  template <typename M, typename Numbers>
  static void fill(M& to, const Numbers& from) {
    for (int i = 0; i < to.rows(); ++i) {
      for (int j = 0; j < to.cols(); ++j) to(i, j) = static_cast<Scalar>(from[static_cast<std::size_t>(i * to.cols() + j)]);
    }
  }
};

template <typename Scalar, int n>
Shown shown(const jml::Vector<Scalar, n>& x, const jml::Matrix<Scalar, n, n>& P) {
  Shown out;
  for (int i = 0; i < n; ++i) {
    out.x[i] = x(i);
    for (int j = 0; j < n; ++j) out.P[i][j] = P(i, j);
  }
  return out;
}
template <typename Scalar, int n>
Shown shown(const jml::Estimate<Scalar, n>& belief) {
  return shown(belief.x, belief.P);
}
/// By factors: U D Uᵀ of all the digits that the belief holds.
template <typename Belief>
  requires requires(const Belief& b) { b.U_low; }
Shown shown(const Belief& belief) {
  constexpr int n = Belief::states;
  const bool low = belief.extended;
  const auto sum_of = [&](auto high, auto rest) { return low ? Quad(high) + Quad(rest) : Quad(high); };
  Shown out;
  QuadMatrix U{};
  QuadVector D{};
  for (int j = 0; j < n; ++j) {
    out.x[j] = Quad(belief.x(j)) + Quad(belief.x_low(j));
    D[j] = sum_of(belief.D(j), belief.D_low(j));
    for (int i = 0; i < j; ++i) U[i][j] = sum_of(belief.U(i, j), belief.U_low(i, j));
    U[j][j] = 1;
  }
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j <= i; ++j) {
      Quad sum = 0;
      for (int k = i; k < n; ++k) sum += U[i][k] * D[k] * U[j][k];
      out.P[i][j] = out.P[j][i] = sum;
    }
  }
  return out;
}

/// Keeps an Outcome up to date; each verb returns false where the flight is over.
class Judge {
 public:
  Judge(const Flight& flight, const Bounds& bounds) : flight_(flight), bounds_(bounds) { out_.flown = true; }

  bool answered(jml::Status status, int event, int stage) {
    out_.event = event;
    const auto& exact = flight_.stage(stage);
    out_.label = exact.label;
    out_.inner = exact.inner;
    out_.loss = exact.loss;
    if (jml::usable(status)) return true;
    out_.refused = true;
    out_.status = status;
    return false;
  }
  bool showed(const Errors& errors) {
    out_.worst.P = std::max(out_.worst.P, errors.P);
    out_.worst.x = std::max(out_.worst.x, errors.x);
    out_.wrong_P = !(errors.P <= bounds_.P);
    out_.wrong_x = !(errors.x <= bounds_.x);
    return !out_.wrong_P && !out_.wrong_x;
  }
  bool showed(const Shown& what, int stage) { return showed(flight_.errors(what, stage, bounds_)); }
  bool showed_smoothed(const Shown& what, int stage, int until) {
    return showed(flight_.smoothed_errors(what, stage, until, bounds_));
  }
  /// The same of a trajectory of doubles, of whose states, `nodes`, each follows from the one before: x is as right
  /// as the largest of them is.
  bool showed(const Shown& what, int stage, const std::vector<int>& nodes) {
    const Errors errors = flight_.errors(what, stage, bounds_);
    return showed(errors.right(bounds_) ? errors : flight_.errors(what, stage, bounds_, flight_.largest(nodes, stage)));
  }
  bool showed_smoothed(const Shown& what, int stage, int until, const std::vector<int>& nodes) {
    const Errors errors = flight_.smoothed_errors(what, stage, until, bounds_);
    return showed(errors.right(bounds_) ? errors
                                        : flight_.smoothed_errors(what, stage, until, bounds_,
                                                                  flight_.largest(nodes, until)));
  }
  template <typename Report>
  void look(const Report& report) {
    if constexpr (requires { report.redone; }) out_.redone = out_.redone || report.redone;
  }
  [[nodiscard]] const Outcome& outcome() const { return out_; }

 private:
  const Flight& flight_;
  Bounds bounds_;
  Outcome out_;
};

/// Flies the problem's events. show(stage): judges what the filter shows after a usable answer; false ends the
/// flight.
template <typename Scalar, int n, int p, typename Filter, typename Show>
void fly(Filter& filter, const Model<Scalar, n, p>& model, const Problem& problem, const Flight& flight, Judge& judge,
         const Show& show) {
  if (!judge.answered(filter.status(), -1, Flight::prior()) || !show(Flight::prior())) return;
  for (int k = 0; k < flight.events(); ++k) {
    const Event& event = problem.events[static_cast<std::size_t>(k)];
    const auto sensor = static_cast<std::size_t>(event.sensor);
    const auto y = Model<Scalar, n, p>::y(event);
    const auto went = [&](const auto& report, int stage) {
      judge.look(report);
      return judge.answered(report.status, k, stage) && show(stage);
    };
    if (event.fused) {
      if (!went(filter.step(model.joint[sensor], y), flight.end(k))) return;
      continue;
    }
    if (event.moves && !(judge.answered(filter.predict(), k, flight.moved(k)) && show(flight.moved(k)))) return;
    if (event.rows == Rows::together) {
      if (!went(filter.update(model.joint[sensor], y), flight.end(k))) return;
    } else if (event.rows == Rows::apart) {
      for (int i = 0; i < p; ++i) {
        const jml::Vector<Scalar, 1> number(y(i));
        if (!went(filter.update(model.single[sensor][static_cast<std::size_t>(i)], number), flight.row(k, i))) return;
      }
    }
  }
}

/// One of the two rules that are the same on a linear system, so that each size is instantiated once.
template <int n>
using RuleOf = std::conditional_t<n == 2 || n == 8, jml::Ekf<>, jml::Kalman>;

/// The plain form: P as a matrix.
template <typename Scalar, int n, int p>
Outcome fly_plain(const Problem& problem, const Flight& flight) {
  if (!problem.dense) return {};
  const Model<Scalar, n, p> model(problem);
  jml::Filter filter{RuleOf<n>{}, model.dynamics, model.start()};
  Judge judge(flight, dense_bounds);
  fly(filter, model, problem, flight, judge, [&](int stage) { return judge.showed(shown(filter.belief()), stage); });
  return judge.outcome();
}

/// The factored form.
template <typename Scalar, int n, int p>
Outcome fly_factored(const Problem& problem, const Flight& flight) {
#if JML_TEST_FACTORED
  const Model<Scalar, n, p> model(problem);
  Judge judge(flight, factored_bounds);
  using Rule = RuleOf<n>;
  jml::Filter<jml::Factored<Rule>, Dynamics<Scalar, n>, Scalar> filter{jml::Factored<Rule>{}, model.dynamics, model.start()};
  if (problem.by_factors)
    static_cast<void>(filter.reset(jml::FactoredEstimate<Scalar, n>{model.x0, model.U, model.D}, 0));
  fly(filter, model, problem, flight, judge, [&](int stage) { return judge.showed(shown(filter.belief()), stage); });
  return judge.outcome();
#else
  static_cast<void>(problem);
  static_cast<void>(flight);
  return {};
#endif
}

/// The recursion of the textbook in Scalar, N = F P Fᵀ + G Q Gᵀ and P = N - K S Kᵀ: right throughout the flight?
template <typename Scalar, int n, int p>
bool textbook_is_right(const Problem& problem, const Flight& flight) {
  const Model<Scalar, n, p> model(problem);
  using Covariance = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic, 0, most_states, most_states>;
  using State = Eigen::Matrix<Scalar, Eigen::Dynamic, 1, 0, most_states, 1>;
  State x = model.x0;
  Covariance P = model.P0;
  const auto times = [](const Covariance& a, const Covariance& b) {
    Covariance out = Covariance::Zero(a.rows(), b.cols());
    for (int i = 0; i < a.rows(); ++i) {
      for (int j = 0; j < b.cols(); ++j) {
        for (int k = 0; k < a.cols(); ++k) out(i, j) += a(i, k) * b(k, j);
      }
    }
    return out;
  };
  const auto mirror = [](Covariance& a) {
    for (int i = 0; i < a.rows(); ++i) {
      for (int j = 0; j < i; ++j) a(j, i) = a(i, j);
    }
  };
  const Covariance F = model.dynamics.F, G = model.dynamics.G;
  const Covariance noise = times(times(G, model.dynamics.Q), G.transpose());
  const auto is_right = [&](int stage) {
    return flight.errors(shown<Scalar, n>(x, P), stage, dense_bounds).right(dense_bounds);
  };
  const auto correct = [&](const Covariance& H, const Covariance& R, const State& y) {
    const int rows = static_cast<int>(H.rows());
    const Covariance NH = times(P, H.transpose());
    Covariance S = times(H, NH) + R, L = Covariance::Identity(rows, rows), K = NH;
    for (int k = 0; k < rows; ++k) {  // S = L D Lᵀ, then K = N Hᵀ S⁻¹
      for (int i = k + 1; i < rows; ++i) {
        L(i, k) = S(i, k) / S(k, k);
        for (int j = k + 1; j <= i; ++j) S(i, j) -= L(i, k) * S(j, k);
      }
    }
    for (int a = 0; a < K.rows(); ++a) {
      for (int i = 0; i < rows; ++i) {
        for (int k = 0; k < i; ++k) K(a, i) -= L(i, k) * K(a, k);
      }
      for (int i = rows - 1; i >= 0; --i) {
        K(a, i) /= S(i, i);
        for (int k = i + 1; k < rows; ++k) K(a, i) -= L(k, i) * K(a, k);
      }
    }
    State e = y;
    for (int i = 0; i < rows; ++i) {
      for (int j = 0; j < H.cols(); ++j) e(i) -= H(i, j) * x(j);
    }
    x += times(K, e);
    P -= times(K, NH.transpose());
    mirror(P);
  };
  if (!is_right(Flight::prior())) return false;
  for (int k = 0; k < flight.events(); ++k) {
    const Event& event = problem.events[static_cast<std::size_t>(k)];
    const auto sensor = static_cast<std::size_t>(event.sensor);
    if (event.moves) {
      x = times(F, x);
      P = times(times(F, P), F.transpose()) + noise;
      mirror(P);
      if (!event.fused && !is_right(flight.moved(k))) return false;
    }
    const auto y = Model<Scalar, n, p>::y(event);
    if (event.rows == Rows::together) correct(model.joint[sensor].H, model.joint[sensor].R, y);
    if (event.rows == Rows::apart) {
      for (int i = 0; i < p; ++i) {
        const auto& row = model.single[sensor][static_cast<std::size_t>(i)];
        correct(row.H, row.R, State(y.template segment<1>(i)));
        if (!is_right(flight.row(k, i))) return false;
      }
    } else if (event.rows == Rows::together && !is_right(flight.end(k))) {
      return false;
    }
  }
  return true;
}

/// Stages that end a node, the one before the next move: all that is measured there is in them.
inline std::vector<int> nodes_of(const Problem& problem, const Flight& flight) {
  std::vector<int> out{Flight::prior()};
  for (int k = 0; k < flight.events(); ++k) {
    if (problem.events[static_cast<std::size_t>(k)].moves) out.push_back(0);
    out.back() = flight.end(k);
  }
  return out;
}
/// The most measurements of one type at a node, and of all nodes.
struct Load {
  int at_a_node = 0, all = 0;
};
inline Load load_of(const Problem& problem) {
  Load load;
  int here = 0;
  for (const Event& event : problem.events) {
    if (event.moves) here = 0;
    const int count = event.rows == Rows::none ? 0 : event.rows == Rows::together ? 1 : problem.p;
    here += count;
    load.all += count;
    load.at_a_node = std::max(load.at_a_node, here);
  }
  return load;
}

/// Both sensor types, once where they are one.
template <typename Scalar, int n, int p>
constexpr auto sensor_list() {
  if constexpr (p == 1)
    return jml::sensors<Sensor<Scalar, n, 1>>;
  else
    return jml::sensors<Sensor<Scalar, n, p>, Sensor<Scalar, n, 1>>;
}

/// The fixed lag: the newest state after each verb, and the whole window at the end.
template <typename Scalar, int n, int p>
Outcome fly_fixed_lag(const Problem& problem, const Flight& flight) {
  constexpr int length = 4, room = p + 1;
  if (!problem.dense || load_of(problem).at_a_node > room) return {};
  const Model<Scalar, n, p> model(problem);
  // The default tolerance, 1e-6 deviations, is the bound itself, and not what is asked here.
  jml::Filter filter{jml::FixedLag<length, room>{{.tolerance = 1e-9}}, model.dynamics, sensor_list<Scalar, n, p>(), model.start()};
  Judge judge(flight, dense_bounds);
  const auto finite = [&](const jml::Matrix<Scalar, n, n>& P, int event, int stage) {  // NaN says that P is lost
    return judge.answered(jml::all_finite(P) ? jml::Status::ok : jml::Status::covariance_lost, event, stage);
  };
  const auto nodes = nodes_of(problem, flight);
  const auto window_before = [&](int stage) {
    std::vector<int> out;
    for (const int node : nodes) {
      if (node < stage) out.push_back(node);
    }
    while (static_cast<int>(out.size()) > filter.depth()) out.erase(out.begin());
    return out;
  };
  fly(filter, model, problem, flight, judge, [&](int stage) {
    const jml::Matrix<Scalar, n, n> P = filter.P();
    return finite(P, judge.outcome().event, stage) &&
           judge.showed(shown<Scalar, n>(filter.x(), P), stage, window_before(stage));
  });
  if (!judge.outcome().right()) return judge.outcome();
  const int last = nodes.back();
  const auto window = window_before(last);
  for (int age = 1; age <= filter.depth(); ++age) {
    const jml::Matrix<Scalar, n, n> P = filter.P(age);
    if (!finite(P, flight.events() - 1, last)) break;
    if (!judge.showed_smoothed(shown<Scalar, n>(filter.x(age), P), nodes[nodes.size() - 1 - static_cast<std::size_t>(age)], last, window))
      break;
  }
  return judge.outcome();
}

/// The whole interval at once: every node.
template <typename Scalar, int n, int p>
Outcome fly_batch(const Problem& problem, const Flight& flight) {
  if (!problem.dense) return {};
  const Model<Scalar, n, p> model(problem);
  const auto nodes = nodes_of(problem, flight);
  const int last = nodes.back();
  jml::Batch batch{model.dynamics, sensor_list<Scalar, n, p>(), model.start(),
                   {.steps = static_cast<int>(nodes.size()), .measurements = load_of(problem).all + 1}};
  Judge judge(flight, dense_bounds);
  fly(batch, model, problem, flight, judge, [](int) { return true; });
  if (!judge.outcome().right() || !judge.answered(batch.solve().status, flight.events() - 1, last)) return judge.outcome();
  bool going = true;
  const bool any = batch.covariances([&](int k, const jml::Matrix<Scalar, n, n>& P) {
    if (!going) return;
    going = judge.answered(jml::all_finite(P) ? jml::Status::ok : jml::Status::covariance_lost, flight.events() - 1, last) &&
            judge.showed_smoothed(shown<Scalar, n>(batch.x(k), P), nodes[static_cast<std::size_t>(k)], last, nodes);
  });
  if (!any) judge.answered(jml::Status::covariance_lost, flight.events() - 1, last);
  return judge.outcome();
}

/// The two-pass smoother: every node.
template <typename Scalar, int n, int p>
Outcome fly_smoother(const Problem& problem, const Flight& flight) {
  if (!problem.dense) return {};
  const Model<Scalar, n, p> model(problem);
  const auto nodes = nodes_of(problem, flight);
  const int last = nodes.back();
  jml::Smoother smoother{jml::Filter{RuleOf<n>{}, model.dynamics, model.start()}, static_cast<int>(nodes.size())};
  Judge judge(flight, dense_bounds);
  fly(smoother, model, problem, flight, judge, [](int) { return true; });
  if (!judge.outcome().right() || !judge.answered(smoother.smooth(), flight.events() - 1, last)) return judge.outcome();
  for (std::size_t k = 0; k < nodes.size(); ++k) {
    const int node = static_cast<int>(k);
    if (!judge.showed_smoothed(shown<Scalar, n>(smoother.x(node), smoother.P(node)), nodes[k], last)) break;
  }
  return judge.outcome();
}

}  // namespace rounding
