// SPDX-License-Identifier: BSD-3-Clause
// Images of filters: of another one they are foreign, and a policy's counters go along, without the heap.
#include <gtest/gtest.h>

#include <jml/jml.hpp>

#include "heap_trap.hpp"

namespace {

using jml::Status, jml::Vector;

struct Small {
  int count = 0;
  bool ready = false;
  friend bool operator==(const Small&, const Small&) = default;
};
struct Fall {
  static constexpr int states = 2;
  template <typename T>
  Vector<T, 2> dynamics(const Vector<T, 2>& x) const {
    return {x(0) + x(1), x(1)};
  }
  jml::Matrix<double, 2, 2> disturbance_covariance() const {
    return 0.1 * jml::Matrix<double, 2, 2>::Identity();
  }
};
struct OtherFall : Fall {};
struct Height {
  static constexpr int measurements = 1;
  template <typename T>
  Vector<T, 1> measurement(const Vector<T, 2>& x) const {
    return Vector<T, 1>(x(0));
  }
  jml::Matrix<double, 1, 1> noise_covariance() const { return jml::Matrix<double, 1, 1>(0.01); }
};
const jml::Estimate<double, 2> start{{1, 0.5}, jml::Matrix<double, 2, 2>::Identity()};

// A compiler spells a default argument out or leaves it away, as it was written where it met the type first.
TEST(ImageOfAFilter, ItsNameIsTheSameOfEveryCompiler) {
  using Lag = jml::FixedLag<4, 1, jml::Sensors<Height>>;
  using Point = jml::Sddre<jml::AboutPoint<double, 2>>;
  EXPECT_EQ((jml::detail::name_of<jml::Filter<Lag, Fall, double>>()), 0x9AD6D4C7BE7C51A6U);
  EXPECT_EQ((jml::detail::name_of<jml::Filter<jml::Factored<jml::Continuous<jml::Ekf<>>>, Fall, float>>()),
            0xACB11822D2EDAC3DU);
  EXPECT_EQ((jml::detail::name_of<jml::Filter<Point, Fall>>()), 0xE8F9962FEF16D3DU);
}

// Whatever has the same numbers in the same order, and is something else.
TEST(ImageOfAFilter, OfAnotherFilterIsForeign) {
  const jml::Filter ekf{jml::Ekf{}, Fall{}, start};
  jml::ImageOf<decltype(ekf)> image;
  ASSERT_EQ(jml::save(image, ekf), Status::ok);
  jml::Filter sddre{jml::Sddre{}, Fall{}, start};
  jml::Filter another{jml::Ekf{}, OtherFall{}, start};
  jml::Filter jml_rule{jml::Jml{}, Fall{}, start};
  jml::Filter single{jml::Ekf{}, Fall{},
                     jml::Estimate<float, 2>{{1, 0.5}, jml::Matrix<float, 2, 2>::Identity()}};
  jml::Filter lag{jml::FixedLag<3>{}, Fall{}, jml::sensors<Height>, start};
  EXPECT_EQ(jml::restore(image, sddre), Status::foreign_image);
  EXPECT_EQ(jml::restore(image, another), Status::foreign_image);
  jml::Filter at_prediction{jml::Ekf<jml::EvaluatedAt::prediction>{}, Fall{}, start};
  EXPECT_EQ(jml::restore(image, at_prediction), Status::foreign_image);
  EXPECT_EQ(jml::restore(image, jml_rule), Status::foreign_image);
  EXPECT_EQ(jml::restore(image, single), Status::foreign_image);
  EXPECT_EQ(jml::restore(image, lag), Status::foreign_image);
  Small beside{};
  jml::Filter same = ekf;
  EXPECT_EQ(jml::restore(image, same, beside), Status::foreign_image);
  EXPECT_EQ(jml::restore(image, same), Status::ok);
}

// A filter and a policy's counters in one image, without the heap.
TEST(ImageOfAFilter, AFilterAndWhatStandsBesideIt) {
  jml::Filter filter{jml::FixedLag<3>{}, Fall{}, jml::sensors<Height>, start}, other = filter;
  Small counters{3, true}, others{};
  for (int k = 0; k < 6; ++k) ASSERT_TRUE(jml::usable(filter.step(Height{}, 1.0 + 0.5 * k).status));
  std::array<std::byte, jml::saved_size(filter, counters)> image;
  static_assert(sizeof(image) == sizeof(jml::ImageOf<decltype(filter), Small>));
  Status saved, restored;
  {
    heap_trap::Armed trap;
    saved = jml::save(image, filter, counters);
    restored = jml::restore(image, other, others);
  }
  EXPECT_EQ(heap_trap::allocations, 0);
  EXPECT_EQ(saved, Status::ok);
  EXPECT_EQ(restored, Status::ok);
  EXPECT_TRUE(others == counters);
  EXPECT_EQ(other.x(), filter.x());
}

// A filter whose start was refused carries that, and the model of this program its own.
TEST(ImageOfAFilter, AStartThatWasRefusedStaysRefused) {
  jml::Filter filter{jml::Ekf{}, Fall{},
                     jml::Estimate<double, 2>{{1, 0.5}, -jml::Matrix<double, 2, 2>::Identity()}};
  jml::Filter other{jml::Ekf{}, Fall{}, start};
  jml::ImageOf<decltype(filter)> image;
  ASSERT_EQ(jml::save(image, filter), Status::ok);
  ASSERT_EQ(jml::restore(image, other), Status::ok);
  EXPECT_EQ(other.status(), Status::invalid_covariance);
}

struct Tuned {
  static constexpr int states = 2;
  jml::Matrix<double, 2, 2> Q = jml::Matrix<double, 2, 2>::Identity();
  template <typename T>
  Vector<T, 2> dynamics(const Vector<T, 2>& x) const {
    return {x(0) + x(1), x(1)};
  }
  jml::Matrix<double, 2, 2> disturbance_covariance() const { return Q; }
};

// The model is the program's own: an image does not bring another one, nor excuse one that is none.
TEST(ImageOfAFilter, TheModelIsTheProgramsOwn) {
  jml::Filter filter{jml::Ekf{}, Tuned{}, start}, other{jml::Ekf{}, Tuned{2 * Tuned{}.Q}, start},
      without{jml::Ekf{}, Tuned{-Tuned{}.Q}, start};
  ASSERT_TRUE(jml::usable(filter.predict()));
  jml::ImageOf<decltype(filter)> image;
  ASSERT_EQ(jml::save(image, filter), Status::ok);
  ASSERT_EQ(jml::restore(image, other), Status::ok);
  const double before = other.P()(1, 1);
  EXPECT_EQ(before, filter.P()(1, 1));
  ASSERT_TRUE(jml::usable(other.predict()));
  EXPECT_EQ(other.P()(1, 1), before + 2);
  ASSERT_EQ(jml::restore(image, without), Status::ok);
  EXPECT_EQ(without.status(), Status::invalid_disturbance_covariance);
  EXPECT_EQ(without.predict(), Status::invalid_disturbance_covariance);
}

}  // namespace
