// SPDX-License-Identifier: BSD-3-Clause
// A range from the middle of a channel: the boat is 5 m east or 5 m west, and one box around both says
// neither.
//
// The union of boxes keeps the two places apart, until a range from elsewhere decides. And what is in the one
// box but in no part of the union, a range that fits neither place, is found.
#include <cmath>
#include <cstdio>
#include <jml/bounded/bounded_noise.hpp>

/// x = (east, north), m: a boat that drifts.
struct Boat {
  static constexpr int states = 2, disturbances = 2;
  template <typename T>
  jml::Vector<T, 2> dynamics(const jml::Vector<T, 2>& x) const {
    return x;
  }
  static jml::Matrix<double, 2, 2> disturbance_input() { return jml::Matrix<double, 2, 2>::Identity(); }
  jml::Vector<double, 2> disturbance_bound() const { return {0.2, 0.1}; }  // m a step
};

/// Its distance from a buoy, m.
struct RangeTo {
  static constexpr int measurements = 1;
  double east, north;
  template <typename T>
  jml::Vector<T, 1> measurement(const jml::Vector<T, 2>& x) const {
    using std::hypot;
    return jml::Vector<T, 1>(hypot(x(0) - east, x(1) - north));
  }
  jml::Vector<double, 1> noise_bound() const { return jml::Vector<double, 1>(0.1); }
};

int main() {
  using State = jml::Vector<double, 2>;
  const jml::Box channel{State(-10, -1), State(10, 1)};
  jml::Filter one{jml::Guaranteed{}, Boat{}, channel};
  const auto show = [](const char* what, const jml::Box<double, 2>& box) {
    std::printf("%s: east %6.2f to %5.2f, north %5.2f to %4.2f\n", what, box.lower(0), box.upper(0),
                box.lower(1), box.upper(1));
  };

  // [union]
  jml::Filter filter{jml::Paved<8>{}, Boat{}, channel};
  const RangeTo buoy{0, 0}, next{10, 0};
  auto report = filter.step(buoy, 5.0);  // five metres: east or west?
  for (const jml::Box<double, 2>& part : filter.parts()) show("  a part", part);
  show("around them", filter.box());
  // [/union]
  bool right = report.status == jml::Status::ok && filter.box().contains(State(-5, 0));
  for (const auto& part : filter.parts()) right = right && !part.contains(State(0, 0));
  right = right && one.step(buoy, 5.0).status == jml::Status::ok;

  // [neither]
  report = filter.update(next, 10.0);  // the place between the two
  std::printf("union: %s; by %.1f m\n", jml::describe(report.status), report.violation.excess);
  std::printf("one box: %s\n", jml::describe(one.update(next, 10.0).status));
  // [/neither]
  right = right && report.violation.row == 0;

  report = filter.step(next, 5.0);  // and this decides
  show("decided", filter.box());
  right = right && filter.box().lower(0) > 0 && filter.box().contains(State(5, 0));
  return right ? 0 : 1;
}
