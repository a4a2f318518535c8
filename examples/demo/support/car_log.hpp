// SPDX-License-Identifier: BSD-3-Clause
// The log of a car that the Python package gtsam installs: 100 Hz of an inertial unit (x forward, y left, z
// up, specific force) and a satellite fix a second in a local frame (x east, y north, z up), each at the time
// of an inertial sample. Its terms forbid commercial use, so nothing of it is here: it is read where the
// package is.
#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <jml/linear_algebra.hpp>
#include <string>
#include <vector>

#include "csv.hpp"

namespace demo {

/// What the inertial unit says of the time since its sample before: its rates and forces, the mean of the
/// two.
struct InertialSample {
  double time, dt;
  jml::Vector<double, 6> rate_and_force;  // rad/s, m/s²
};
struct Fix {
  double time;
  jml::Vector<double, 3> position;
  std::size_t sample;  // the inertial sample of the same time
  bool held_out;
};

class CarLog {
 public:
  std::vector<InertialSample> samples;
  std::vector<Fix> fixes;
  double gyro_noise = 0, force_noise = 0;  // densities, per √Hz
  double gyro_walk = 0, force_walk = 0;    // per √s

  /// The directory of the three files; empty where it is unknown. From the argument, the environment variable
  /// JML_CAR_LOG, or python3 with the package gtsam.
  static std::filesystem::path find(const char* given) {
    if (given != nullptr) return given;
    if (const char* named = std::getenv("JML_CAR_LOG"); named != nullptr && *named != '\0') return named;
    std::string answer;
    std::FILE* python = popen(
        "python3 -c 'import gtsam, os; print(os.path.join(gtsam.__path__[0], \"Data\"))' 2>/dev/null", "r");
    if (python == nullptr) return {};
    for (int c = std::fgetc(python); c != EOF && c != '\n'; c = std::fgetc(python))
      answer += static_cast<char>(c);
    return pclose(python) == 0 ? answer : std::string{};
  }
  static bool is_in(const std::filesystem::path& directory) {
    return !directory.empty() && std::filesystem::exists(directory / inertial_file);
  }

  explicit CarLog(const std::filesystem::path& directory) {
    // Lever arm and angles (6), all zero; noises of force and gyro; of integration; walks a sample; mean dt.
    const auto unit = read_numbers<12>(directory / "KittiEquivBiasedImu_metadata.txt", ' ').at(0);
    for (int i = 0; i < 6; ++i) {
      if (unit[static_cast<std::size_t>(i)] != 0) fail("a lever arm was not expected");
    }
    const double root_of_rate = 1 / std::sqrt(unit[11]);
    force_noise = unit[6];
    gyro_noise = unit[7];
    force_walk = unit[9] * root_of_rate;
    gyro_walk = unit[10] * root_of_rate;
    // Time, dt since the sample before, force (3), rate (3).
    const auto rows = read_numbers<8>(directory / inertial_file, ' ');
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const auto &now = rows[k], &before = rows[k == 0 ? 0 : k - 1];
      InertialSample sample{now[0], k == 0 ? 0 : now[0] - before[0], {}};
      for (std::size_t i = 0; i < 3; ++i) {
        sample.rate_and_force(static_cast<int>(i)) = (now[5 + i] + before[5 + i]) / 2;
        sample.rate_and_force(static_cast<int>(i) + 3) = (now[2 + i] + before[2 + i]) / 2;
      }
      samples.push_back(sample);
    }
    std::size_t at = 0;
    for (const auto& row : read_numbers<4>(directory / "KittiGps_converted.txt", ',')) {
      while (at < samples.size() && samples[at].time < row[0] - 1e-6) ++at;
      if (at == samples.size() || samples[at].time > row[0] + 1e-6) fail("a fix between two samples");
      const bool held_out = fixes.size() > first && fixes.size() % 5 == 0;
      fixes.push_back({row[0], {row[1], row[2], row[3]}, at, held_out});
    }
  }

  /// The fix that an estimator starts at: there is a gap of two seconds before the one before it.
  static constexpr std::size_t first = 2;
  [[nodiscard]] double duration() const { return fixes.back().time - fixes[first].time; }
  /// Between the two fixes that the start is from.
  [[nodiscard]] jml::Vector<double, 3> first_velocity() const {
    const auto &a = fixes[first - 1], &b = fixes[first];
    return (b.position - a.position) / (b.time - a.time);
  }

 private:
  static constexpr const char* inertial_file = "KittiEquivBiasedImu.txt";

  [[noreturn]] static void fail(const char* reason) {
    std::fprintf(stderr, "the log of the car: %s\n", reason);
    std::exit(1);
  }
};

}  // namespace demo
