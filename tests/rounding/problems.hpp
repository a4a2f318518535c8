// SPDX-License-Identifier: BSD-3-Clause
// Random linear problems that try to break a covariance filter: a prior, x⁺ = F x + G w, sensors, a schedule of 10 to
// 30 events, and measurements simulated from the prior itself. Made of the raw numbers of std::mt19937_64 by
// arithmetic alone, so that a problem's number is the same problem everywhere.
#pragma once

#include <array>
#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "rounding/exact_filter.hpp"

namespace rounding {

class Random {
 public:
  /// The same for the same pair.
  Random(std::uint64_t seed, std::uint64_t number) : engine_(mixed(mixed(seed) + number)) {}

  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }  // [0, 1)
  double uniform(double from, double to) { return from + (to - from) * uniform(); }
  int below(int count) { return static_cast<int>(engine_() % static_cast<std::uint64_t>(count)); }
  bool chance(double probability) { return uniform() < probability; }
  /// Twelve uniform numbers' sum: normal but for its tails, and no logarithm of any library.
  double normal() {
    double sum = -6;
    for (int i = 0; i < 12; ++i) sum += uniform();
    return sum;
  }
  /// Log-uniform in 10^from … 10^to.
  double decade(double from, double to) { return power_of_ten(uniform(from, to)); }
  /// About 10^e, without pow().
  static double power_of_ten(double e) {
    const double bits = 3.3219280948873626 * e, whole = std::floor(bits);
    return std::ldexp(1 + (bits - whole), static_cast<int>(whole));
  }

 private:
  static std::uint64_t mixed(std::uint64_t z) {
    z += 0x9e3779b97f4a7c15U;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }
  std::mt19937_64 engine_;
};

using Square = std::array<double, most_states * most_states>;  // n×n or p×p or p×n, one row after another
using Column = std::array<double, most_states>;

struct SensorData {
  Square H{}, R{};
};

/// How the rows of an event reach the filter.
enum class Rows { none, together, apart };

struct Event {
  bool moves = true;  ///< a prediction before the measurement
  Rows rows = Rows::none;
  bool fused = false;  ///< prediction and measurement by the one verb step()
  int sensor = 0;
  std::array<double, most_rows> y{};
};

struct Problem {
  int n = 1, p = 1;
  bool single = false;        ///< every number is a float
  bool by_factors = false;    ///< P_0 is given as U, D to a form that takes them
  bool dense = true;          ///< P_0 is the same numbers as a matrix
  Column x0{}, D{};
  Square U{}, P0{}, F{}, G{}, Q{};
  std::array<SensorData, 2> sensors{};
  std::vector<Event> events;
  std::uint64_t seed = 0, number = 0;
  std::string family;  ///< what it was made of, in words

  [[nodiscard]] QuadMatrix prior_root() const {
    return by_factors ? root_of_factors(U.data(), D.data(), n) : root_of(P0.data(), n);
  }
  /// B with B Bᵀ = G Q Gᵀ.
  [[nodiscard]] QuadMatrix noise_root() const {
    const QuadMatrix L = root_of(Q.data(), n);
    QuadMatrix B{};
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        for (int k = j; k < n; ++k) B[i][j] += G[i * n + k] * L[k][j];
      }
    }
    return B;
  }
};

namespace detail {

class Maker {
 public:
  Maker(std::uint64_t seed, std::uint64_t number, int n, int p, bool single)
      : random_(seed, number), n_(n), p_(p), g_(single ? 0.4 : 1) {
    out_.n = n;
    out_.p = p;
    out_.single = single;
    out_.seed = seed;
    out_.number = number;
    hardness_ = random_.chance(0.1) ? 0 : g_ * random_.uniform(0, 24);
    size_ = random_.chance(0.5) ? 1 : random_.decade(-3 * g_, 3 * g_);
  }

  Problem make() {
    prior();
    dynamics();
    disturbances();
    for (auto& sensor : out_.sensors) {
      if (&sensor == &out_.sensors[1] && random_.chance(0.5)) {
        sensor = out_.sensors[0];
        if (random_.chance(0.5)) nudge(sensor);
      } else {
        rows(sensor);
        noise(sensor);
      }
    }
    units();
    schedule();
    round_all();
    simulate();
    return out_;
  }

 private:
  double& at(Square& a, int i, int j) const { return a[static_cast<std::size_t>(i * n_ + j)]; }
  double& at_p(Square& a, int i, int j) const { return a[static_cast<std::size_t>(i * p_ + j)]; }
  void named(const char* what, const char* which) {
    out_.family += out_.family.empty() ? "" : ", ";
    out_.family += what;
    out_.family += which;
  }

  /// Random orthogonal columns.
  QuadMatrix orthogonal(int size) {
    QuadMatrix V{};
    for (int i = 0; i < size; ++i) V[i][i] = 1;
    for (int r = 0; r < size; ++r) {
      QuadVector v{};
      Quad sum = 0;
      for (int i = 0; i < size; ++i) {
        v[i] = random_.normal();
        sum += v[i] * v[i];
      }
      for (int i = 0; i < size; ++i) {
        Quad dot = 0;
        for (int k = 0; k < size; ++k) dot += V[i][k] * v[k];
        for (int k = 0; k < size; ++k) V[i][k] -= 2 * dot / sum * v[k];
      }
    }
    return V;
  }
  /// T C Tᵀ with a C of condition 10^decades and unit size; `spread`: decades of T².
  void correlated(Square& a, int size, double decades, double spread, double scale) {
    const QuadMatrix V = orthogonal(size);
    QuadVector lambda{};
    for (int i = 0; i < size; ++i)
      lambda[i] = Random::power_of_ten(size == 1 ? 0 : -decades * i / (size - 1));
    std::array<double, most_states> T{};
    for (int i = 0; i < size; ++i) T[i] = scale * random_.decade(-spread / 4, spread / 4);
    for (int i = 0; i < size; ++i) {
      for (int j = 0; j <= i; ++j) {
        Quad sum = 0;
        for (int k = 0; k < size; ++k) sum += V[i][k] * lambda[k] * V[j][k];
        a[i * size + j] = a[j * size + i] = static_cast<double>(sum * T[i] * T[j]);
      }
    }
  }

  void prior() {
    const double dense_limit = out_.single ? 4 : 12;
    const int kind = random_.below(20);
    for (int i = 0; i < n_; ++i) at(out_.U, i, i) = 1;
    if (kind < 9) {
      named("P0 ", "factors");
      out_.by_factors = true;
      const int shape = random_.below(4);
      const double large = shape == 3 ? random_.decade(0, 3 * g_) : 1;
      for (int j = 0; j < n_; ++j) {
        out_.D[j] = size_ * size_ * random_.decade(-hardness_ / 2, hardness_ / 2);
        for (int i = 0; i < j; ++i) at(out_.U, i, j) = shape == 1 && random_.chance(0.5) ? 0 : large * random_.normal();
      }
      if (n_ > 1) {  // the ends of the range are always there
        const int first = random_.below(n_), second = (first + 1 + random_.below(n_ - 1)) % n_;
        out_.D[first] = size_ * size_ * Random::power_of_ten(hardness_ / 2);
        out_.D[second] = size_ * size_ * Random::power_of_ten(-hardness_ / 2);
      }
      if (random_.chance(0.15)) {
        named("", "with zeros");
        for (int j = 0; j < n_; ++j) out_.D[j] = random_.chance(0.4) ? 0 : out_.D[j];
      }
    } else if (kind < 13) {
      named("P0 ", "scaled correlations");
      correlated(out_.P0, n_, random_.uniform(0, std::min(hardness_, dense_limit)), hardness_, size_);
    } else if (kind < 15) {
      named("P0 ", "huge multiple of I");
      const double huge = Random::power_of_ten(g_ * random_.uniform(0, 24));
      for (int i = 0; i < n_; ++i) at(out_.P0, i, i) = huge;
    } else if (kind < 18) {
      named("P0 ", "singular, exact");
      const int rank = random_.below(n_);
      Square B{};
      for (int i = 0; i < n_; ++i) {
        const double T = std::ldexp(1, random_.below(1 + static_cast<int>(hardness_)) - static_cast<int>(hardness_) / 2);
        for (int j = 0; j < rank; ++j) at(B, i, j) = T * (random_.below(17) - 8) / 4;
      }
      for (int i = 0; i < n_; ++i) {
        for (int j = 0; j < n_; ++j) {
          for (int k = 0; k < rank; ++k) at(out_.P0, i, j) += at(B, i, k) * at(B, j, k);
        }
      }
    } else if (kind == 18) {
      named("P0 ", "diagonal, some states known");
      for (int i = 0; i < n_; ++i)
        at(out_.P0, i, i) = random_.chance(0.4) ? 0 : size_ * size_ * random_.decade(-hardness_ / 2, hardness_ / 2);
    } else {
      named("P0 ", "I");
      for (int i = 0; i < n_; ++i) at(out_.P0, i, i) = 1;
    }
  }

  void dynamics() {
    Square& F = out_.F;
    const auto unit = [&] {
      for (int i = 0; i < n_; ++i) at(F, i, i) = 1;
    };
    const int kind = random_.below(12);
    if (kind < 3) {
      named("F ", "dense");
      const double gain = random_.uniform(0.4, 1.3) / std::sqrt(double(n_));
      for (int i = 0; i < n_ * n_; ++i) F[i] = gain * random_.normal();
    } else if (kind == 3) {
      named("F ", "I + small");
      const double small = random_.decade(-8 * g_, -1);
      unit();
      for (int i = 0; i < n_ * n_; ++i) F[i] += small * random_.normal();
    } else if (kind < 6) {
      named("F ", "integrators");
      const double dt = random_.decade(-3, out_.single ? 1 : 3);
      const int order = 2 + random_.below(2);
      unit();
      for (int i = 0; i < n_; ++i) {
        if (i + 1 < n_ && i % order < order - 1) at(F, i, i + 1) = dt;
        if (i + 2 < n_ && i % order < order - 2) at(F, i, i + 2) = dt * dt / 2;
      }
    } else if (kind == 6) {
      named("F ", "orthogonal");
      const QuadMatrix V = orthogonal(n_);
      for (int i = 0; i < n_; ++i) {
        for (int j = 0; j < n_; ++j) at(F, i, j) = static_cast<double>(V[i][j]);
      }
    } else if (kind == 7) {
      named("F ", "nearly singular");
      const double small = random_.decade(-16 * g_, -4 * g_);
      Column u{}, v{};
      for (int i = 0; i < n_; ++i) {
        u[i] = random_.normal();
        v[i] = random_.normal() / n_;
      }
      for (int i = 0; i < n_; ++i) {
        for (int j = 0; j < n_; ++j) at(F, i, j) = u[i] * v[j] + small * random_.normal();
      }
    } else if (kind < 10) {
      named("F ", "cancelling rows");
      for (int i = 0; i < n_; ++i) {
        for (int j = i + 1; j < n_; ++j) at(F, i, j) = random_.chance(0.5) ? 1 - 2 * random_.below(2) : 0;
        at(F, i, i) = random_.chance(0.9) ? 1 : 0;
      }
      if (random_.chance(0.5) && n_ > 1) {  // a difference of the last two states replaces one of them
        at(F, n_ - 1, n_ - 2) = -1;
      }
    } else if (kind == 10) {
      named("F ", "I");
      unit();
    } else {
      named("F ", "decays");
      for (int i = 0; i < n_; ++i) at(F, i, i) = random_.chance(0.2) ? random_.uniform(1, 3) : random_.decade(-3, 0);
    }
  }

  void disturbances() {
    Square &G = out_.G, &Q = out_.Q;
    const double s = size_ * size_;
    for (int i = 0; i < n_; ++i) at(G, i, i) = 1;
    const int kind = random_.below(12);
    if (kind < 3) {
      named("Q ", "zero");
    } else if (kind < 5) {
      named("Q ", "diagonal");
      for (int i = 0; i < n_; ++i) at(Q, i, i) = s * random_.decade(-hardness_, 0);
    } else if (kind == 5) {
      named("Q ", "with zeros");
      for (int i = 0; i < n_; ++i) at(Q, i, i) = random_.chance(0.5) ? 0 : s * random_.decade(-hardness_, 0);
    } else if (kind == 6) {
      named("Q ", "tiny");
      for (int i = 0; i < n_; ++i) at(Q, i, i) = s * Random::power_of_ten(-24 * g_);
    } else if (kind == 7) {
      named("Q ", "large");
      for (int i = 0; i < n_; ++i) at(Q, i, i) = s * random_.decade(0, 6 * g_);
    } else if (kind == 8) {
      named("Q ", "correlated");
      correlated(Q, n_, random_.uniform(0, 6 * g_), std::min(hardness_, 12 * g_), size_ * random_.decade(-6 * g_, 0));
    } else if (kind == 9) {
      named("Q ", "of one disturbance");
      at(Q, 0, 0) = s * random_.decade(-hardness_, 0);
      for (int i = 0; i < n_; ++i) at(G, i, 0) = random_.normal();
    } else if (kind == 10) {
      named("Q ", "through a dense G");
      for (int i = 0; i < n_; ++i) at(Q, i, i) = s * random_.decade(-hardness_, 0);
      for (int i = 0; i < n_ * n_; ++i) G[i] = random_.normal();
    } else {
      named("Q ", "at the end of a chain");
      at(Q, n_ - 1, n_ - 1) = s * random_.decade(-hardness_, 0);
      for (int i = 0; i < n_ - 1; ++i) at(G, i, n_ - 1) = random_.decade(-3 * g_, 0);
    }
  }

  void rows(SensorData& sensor) {
    Square& H = sensor.H;
    const int kind = random_.below(9);
    parallel_ = 0;
    if (kind < 2) {
      named("H ", "dense");
      for (int i = 0; i < p_ * n_; ++i) H[i] = random_.normal();
    } else if (kind == 2) {
      named("H ", "hardly observable");
      for (int j = 0; j < n_; ++j) {
        const double weight = random_.decade(-12 * g_, 0);
        for (int i = 0; i < p_; ++i) at(H, i, j) = weight * random_.normal();
      }
    } else if (kind < 5) {
      named("H ", "nearly parallel");
      parallel_ = random_.decade(-12 * g_, 0);
      const bool ones = random_.chance(0.5);
      for (int j = 0; j < n_; ++j) {
        at(H, 0, j) = ones ? 1 : random_.normal();
        for (int i = 1; i < p_; ++i) at(H, i, j) = at(H, 0, j);
      }
      for (int i = 1; i < p_; ++i) at(H, i, n_ - i < 0 ? 0 : n_ - i) += parallel_;
    } else if (kind == 5) {
      named("H ", "single states");
      const int first = random_.below(n_);
      for (int i = 0; i < p_; ++i) at(H, i, (first + i) % n_) = 1;
    } else if (kind == 6) {
      named("H ", "tiny");
      for (int i = 0; i < p_; ++i) {
        const double weight = random_.decade(-12 * g_, -3 * g_);
        for (int j = 0; j < n_; ++j) at(H, i, j) = weight * random_.normal();
      }
    } else if (kind == 7) {
      named("H ", "of 0 and ±1");
      for (int i = 0; i < p_; ++i) {
        for (int j = 0; j < n_; ++j) at(H, i, j) = random_.below(3) - 1;
        at(H, i, random_.below(n_)) = 1;
      }
    } else {
      named("H ", "one row p times");
      for (int j = 0; j < n_; ++j) {
        at(H, 0, j) = random_.normal();
        for (int i = 1; i < p_; ++i) at(H, i, j) = at(H, 0, j);
      }
    }
  }
  /// A row of `sensor` becomes another one nearby.
  void nudge(SensorData& sensor) {
    const double d = random_.decade(-12 * g_, 0);
    for (int i = 0; i < p_; ++i) at(sensor.H, i, random_.below(n_)) += d;
  }

  void noise(SensorData& sensor) {
    Square& R = sensor.R;
    const int kind = random_.below(6);
    if (kind == 0) {
      named("R ", "I");
      for (int i = 0; i < p_; ++i) at_p(R, i, i) = 1;
    } else if (kind == 1) {
      named("R ", "spread");
      for (int i = 0; i < p_; ++i) at_p(R, i, i) = random_.decade(-24 * g_, 6 * g_);
    } else if (kind == 2) {
      named("R ", "as the prior");
      for (int i = 0; i < p_; ++i) at_p(R, i, i) = size_ * size_ * random_.decade(-4, 0);
    } else if (kind == 3 && p_ > 1) {
      named("R ", "correlated");
      correlated(R, p_, random_.uniform(0, out_.single ? 4 : 12), 6 * g_, random_.decade(-10 * g_, 2 * g_));
    } else {
      named("R ", "tiny");
      const double tiny = parallel_ > 0 ? parallel_ * parallel_ : random_.decade(-24 * g_, -6 * g_);
      for (int i = 0; i < p_; ++i) at_p(R, i, i) = tiny;
    }
  }

  void units() {
    Column T{};
    for (int i = 0; i < n_; ++i) T[i] = 1;
    if (random_.chance(0.25)) {
      named("units", "");
      const int most = out_.single ? 8 : 20;
      for (int i = 0; i < n_; ++i) T[i] = std::ldexp(1, random_.below(2 * most + 1) - most);
    }
    for (int i = 0; i < n_; ++i) {
      out_.D[i] *= T[i] * T[i];
      for (int j = 0; j < n_; ++j) {
        at(out_.F, i, j) *= T[i] / T[j];
        at(out_.U, i, j) *= T[i] / T[j];
        at(out_.G, i, j) *= T[i];
        at(out_.P0, i, j) *= T[i] * T[j];
      }
      for (auto& sensor : out_.sensors) {
        for (int k = 0; k < p_; ++k) at(sensor.H, k, i) /= T[i];
      }
    }
  }

  void schedule() {
    const int count = 10 + random_.below(21), kind = random_.below(10);
    const int how = random_.below(3);  // together, apart, both
    const bool fused = random_.chance(0.5), alternate = random_.chance(0.5);
    out_.events.resize(static_cast<std::size_t>(count));
    named("events ", kind < 4 ? "each measured" : kind < 6 ? "gaps" : kind == 6 ? "coast" : kind == 7 ? "still" : "first still");
    int gap = 0;
    for (int k = 0; k < count; ++k) {
      Event& event = out_.events[static_cast<std::size_t>(k)];
      event.rows = how == 2 ? (random_.chance(0.5) ? Rows::together : Rows::apart) : how == 1 ? Rows::apart : Rows::together;
      event.sensor = alternate ? k % 2 : random_.below(4) == 0;
      event.fused = fused;
      if (kind >= 4 && kind < 6) {
        if (gap == 0 && random_.chance(0.3)) gap = 1 + random_.below(10);
        if (gap > 0 && --gap > 0) event.rows = Rows::none;
      }
      if (kind == 6 && k < count / 2) event.rows = Rows::none;
      if (kind == 7) event.moves = k < count - 20 || (count < 20 && k < count / 3);
      if (kind > 7) event.moves = k > 0 && !random_.chance(0.1);
      if (event.rows != Rows::together || !event.moves) event.fused = false;
    }
  }

  void round_all() {
    const auto fit = [&](auto& numbers) {
      for (double& v : numbers) v = rounded(v);
    };
    fit(out_.D);
    fit(out_.U);
    fit(out_.P0);
    fit(out_.F);
    fit(out_.G);
    fit(out_.Q);
    for (auto& sensor : out_.sensors) {
      fit(sensor.H);
      fit(sensor.R);
    }
    if (!out_.by_factors) return;
    for (int i = 0; i < n_; ++i) {  // as a matrix only where that is the same
      for (int j = 0; j <= i; ++j) {
        Quad sum = 0;
        for (int k = i; k < n_; ++k) sum += Quad(at(out_.U, i, k)) * out_.D[k] * at(out_.U, j, k);
        at(out_.P0, i, j) = at(out_.P0, j, i) = rounded(sum);
        if (at(out_.P0, i, j) != sum) out_.dense = false;
      }
    }
    if (out_.dense && random_.chance(0.5)) out_.by_factors = false;
  }
  [[nodiscard]] double rounded(double v) const { return out_.single ? double(static_cast<float>(v)) : v; }
  [[nodiscard]] double rounded(Quad v) const { return rounded(static_cast<double>(v)); }

  /// A flight of the truth from the prior. Measurements that the scalar cannot hold to the noise's size say
  /// something else than the truth: in three quarters of the problems R is at least their rounding.
  void simulate() {
    const QuadMatrix S = out_.prior_root(), B = out_.noise_root();
    QuadVector x{};
    const int start = random_.below(4);  // x̂_0: zero, of the size of its deviation, or far larger
    const double far = random_.decade(0, 5 * g_);
    for (int i = 0; i < n_; ++i) {
      Quad sum = 0;
      for (int j = 0; j <= i; ++j) sum += S[i][j] * S[i][j];
      const auto sd = static_cast<double>(sqrtq(sum));
      if (start > 1) out_.x0[i] = rounded(random_.normal() * (start == 3 ? far : 1) * (sd > 0 ? sd : 1));
      x[i] = out_.x0[i];
    }
    add(x, S);
    std::vector<QuadVector> truth;
    for (const Event& event : out_.events) {
      if (event.moves) {
        const QuadVector old = x;
        for (int i = 0; i < n_; ++i) {
          x[i] = 0;
          for (int j = 0; j < n_; ++j) x[i] += at(out_.F, i, j) * old[j];
        }
        add(x, B);
      }
      truth.push_back(x);
    }
    if (random_.chance(0.75)) {
      for (int s = 0; s < 2; ++s) {
        auto& sensor = out_.sensors[s];
        for (int i = 0; i < p_; ++i) {
          Quad most = 0;
          for (const auto& state : truth) {
            Quad y = 0;
            for (int j = 0; j < n_; ++j) y += at(sensor.H, i, j) * state[j];
            most = fmaxq(most, fabsq(y));
          }
          const double least = (out_.single ? 0x1p-22 : 0x1p-51) * static_cast<double>(most);
          at_p(sensor.R, i, i) = rounded(std::max(at_p(sensor.R, i, i), least * least));
        }
      }
    }
    const QuadMatrix roots[2] = {root_of(out_.sensors[0].R.data(), p_), root_of(out_.sensors[1].R.data(), p_)};
    for (std::size_t k = 0; k < truth.size(); ++k) {
      Event& event = out_.events[k];
      if (event.rows == Rows::none) continue;
      auto& sensor = out_.sensors[event.sensor];
      // Rows given one by one are taken to be independent.
      QuadVector e{};
      for (int j = 0; j < p_; ++j) e[j] = random_.normal();
      for (int i = 0; i < p_; ++i) {
        Quad y = 0;
        for (int j = 0; j < n_; ++j) y += at(sensor.H, i, j) * truth[k][j];
        if (event.rows == Rows::apart) {
          y += sqrtq(at_p(sensor.R, i, i)) * e[i];
        } else {
          for (int j = 0; j <= i; ++j) y += roots[event.sensor][i][j] * e[j];
        }
        event.y[i] = rounded(y);
      }
    }
  }
  void add(QuadVector& x, const QuadMatrix& root) {
    QuadVector e{};
    for (int j = 0; j < n_; ++j) e[j] = random_.normal();
    for (int i = 0; i < n_; ++i) {
      for (int j = 0; j < n_; ++j) x[i] += root[i][j] * e[j];
    }
  }

  Random random_;
  int n_, p_;
  double g_;  // of all decades: fewer in float, whose numbers end at 1e38
  double hardness_ = 0, size_ = 1, parallel_ = 0;
  Problem out_;
};

}  // namespace detail

/// Problem `number` of n states and sensors of p rows.
inline Problem make_problem(std::uint64_t seed, std::uint64_t number, int n, int p, bool single) {
  return detail::Maker(seed, number, n, p, single).make();
}

}  // namespace rounding
