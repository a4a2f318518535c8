// SPDX-License-Identifier: BSD-3-Clause
// The recording of Plaza 1 (examples/data/plaza1/README.md), and where the estimators of its demos start.
#pragma once

#include <algorithm>
#include <filesystem>
#include <jml/estimate.hpp>
#include <models/plaza.hpp>

#include "csv.hpp"

namespace demo {

struct Plaza {
  std::vector<std::array<double, 4>> truth;                   // time s, x m, y m, heading rad
  std::vector<std::array<double, 3>> odometry, ranges, tags;  // as their files say

  explicit Plaza(const std::filesystem::path& directory)
      : truth(read_csv<4>(directory / "ground_truth.csv")),
        odometry(read_csv<3>(directory / "odometry.csv")),
        ranges(read_csv<3>(directory / "ranges.csv")),
        tags(read_csv<3>(directory / "tags.csv")) {}

  [[nodiscard]] int index_of(double tag) const {
    int i = 0;
    while (tags[static_cast<std::size_t>(i)][0] != tag) ++i;
    return i;
  }
  /// The sensor of one row of `ranges`. biases: 0 or 4.
  template <int biases>
  [[nodiscard]] models::RangeToTag<biases> radio(const std::array<double, 3>& range) const {
    const int tag = index_of(range[1]);
    const auto& at_tag = tags[static_cast<std::size_t>(tag)];
    return {{at_tag[1], at_tag[2]}, tag};
  }
  /// The same with the ranges in order of time, which those of the file are not.
  [[nodiscard]] Plaza in_order_of_time() const {
    Plaza out = *this;
    std::sort(out.ranges.begin(), out.ranges.end());
    return out;
  }
  /// Where the robot is at the end of a row of odometry.
  [[nodiscard]] jml::Vector<double, 2> position(std::size_t row) const {
    return {truth[row + 1][1], truth[row + 1][2]};
  }
};

/// The true start pose, biases 0 ± 3 m.
template <int tags>
jml::Estimate<double, 3 + tags> start(const Plaza& data) {
  jml::Estimate<double, 3 + tags> out;
  for (int i = 0; i < 3; ++i) out.x(i) = data.truth[0][static_cast<std::size_t>(i + 1)];
  out.P.diagonal().setConstant(9);
  out.P.diagonal().template head<3>().setConstant(0.01);
  return out;
}

/// A row of odometry and the ranges that arrived during it.
struct Row {
  std::size_t index;
  double dt;
  jml::Vector<double, 2> control;
  std::size_t first, last;  // ranges first … last - 1
};

template <typename Use>
void for_each_row(const Plaza& data, const Use& use) {
  std::size_t first = 0, last = 0;
  double before = data.truth[0][0];
  for (std::size_t i = 0; i < data.odometry.size(); ++i) {
    const auto [time, distance, turn] = data.odometry[i];
    while (last < data.ranges.size() && data.ranges[last][0] <= time) ++last;
    use(Row{i, time - before, {distance, turn}, first, last});
    before = time;
    first = last;
  }
}

/// step() with the first range of a row, update() with the others, predict() without any, or where the first
/// ones were refused. radio(range): the sensor of a row of ranges. use(report) for each range.
template <typename Estimator, typename Radio, typename Use>
void feed(Estimator& estimator, const Plaza& data, const Row& row, const Radio& radio, const Use& use) {
  bool moved = false;
  for (std::size_t i = row.first; i < row.last; ++i) {
    const auto sensor = radio(data.ranges[i]);
    const double range = data.ranges[i][2];
    const auto report =
        moved ? estimator.update(sensor, range) : estimator.step(sensor, range, row.dt, row.control);
    use(report);
    if constexpr (requires { report.status; })
      moved = moved || jml::usable(report.status);
    else
      moved = moved || jml::usable(report);
  }
  if (!moved) static_cast<void>(estimator.predict(row.dt, row.control));
}

inline std::vector<double> column(const auto& rows, std::size_t index) {
  std::vector<double> out;
  for (const auto& row : rows) out.push_back(row[index]);
  return out;
}

}  // namespace demo
