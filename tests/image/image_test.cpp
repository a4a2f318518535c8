// SPDX-License-Identifier: BSD-3-Clause
// What an image is: its bytes, written down by hand; every kind of part, there and back; what is refused, and
// by which name, also of an image that somebody forged with its checksum right.
#include <gtest/gtest.h>

#include <cstring>
#include <jml/jml.hpp>
#include <string_view>

namespace {

using jml::Status, jml::Vector;

enum class Mode : std::uint8_t { off, on, failed };
constexpr Mode last_value(Mode) { return Mode::failed; }

struct Small {
  std::int16_t count;
  bool ready;
  double level;
  Mode mode;
  friend bool operator==(const Small&, const Small&) = default;
};

template <std::size_t size>
std::string hex(const std::array<std::byte, size>& bytes, std::size_t from, std::size_t to) {
  std::string out;
  for (std::size_t i = from; i < to; ++i) {
    constexpr const char* digits = "0123456789abcdef";
    out += digits[std::to_integer<int>(bytes[i]) / 16];
    out += digits[std::to_integer<int>(bytes[i]) % 16];
  }
  return out;
}
/// The checksum made right again, as a forger would.
template <std::size_t size>
void seal(std::array<std::byte, size>& image) {
  jml::detail::end_image(image);
}

// The check value of CRC-64/XZ in the catalogue of parametrised CRC algorithms.
TEST(Image, ChecksumIsTheOneOfTheCatalogue) {
  const char text[] = "123456789";
  EXPECT_EQ(jml::detail::crc64(std::as_bytes(std::span(text, 9))), 0x995DC9BBDF1939FAU);
  static_assert(jml::detail::crc64({}) == 0);
}

TEST(Image, BytesAsWrittenByHand) {
  const Small small{-2, true, 1.5, Mode::failed};
  jml::ImageOf<Small> image;
  static_assert(sizeof(image) == 24 + 8 + 1 + 8 + 1 + 8 && jml::saved_size<Small>() == sizeof(image));
  EXPECT_EQ(jml::saved_size(small), image.size());
  ASSERT_EQ(jml::save(image, small), Status::ok);
  EXPECT_EQ(hex(image, 0, 8), "6a6d6c7361766501");    // "jmlsave", version 1
  EXPECT_EQ(hex(image, 16, 24), "1200000000000000");  // 18 bytes follow
  EXPECT_EQ(hex(image, 24, 42),
            "feffffffffffffff"
            "01"
            "000000000000f83f"
            "02");
}

// The same of GCC and Clang, and so of a Cortex-M7: an image of the target is read on the desk. (Of what else
// it is nothing is asked; these numbers change with the format.)
TEST(Image, FingerprintIsTheSameOfEveryCompiler) {
  EXPECT_EQ(jml::detail::layout_of_all<Small>().shape, 0x9A360CF545CFF5D2U);
  EXPECT_EQ((jml::detail::name_of<jml::OnePass<jml::Sddre<jml::AboutPoint<double, 2>>>>()),
            0x13B4FFE3D075C46DU);
}

// Of one name and as many bytes, and yet not the same.
namespace a {
struct Table {
  std::array<std::array<double, 2>, 3> rows;
};
}  // namespace a
namespace b {
struct Table {
  std::array<std::array<double, 3>, 2> rows;
};
}  // namespace b
namespace c {
struct Table {
  std::array<std::array<std::int64_t, 3>, 2> rows;
};
}  // namespace c
template <typename T>
constexpr std::uint64_t print = jml::detail::layout_of_all<T>().shape;
static_assert(jml::saved_size<a::Table>() == jml::saved_size<b::Table>());
static_assert(print<a::Table> != print<b::Table> && print<b::Table> != print<c::Table>);
static_assert(print<Vector<double, 6>> != print<jml::Matrix<double, 2, 3>>);
static_assert(print<jml::Matrix<double, 3, 2>> != print<jml::Matrix<double, 2, 3>>);

struct Inner {
  Vector<double, 3> v{1, 2, 3};
  float f = 0.5F;
};
struct Nothing {};
struct InC {
  double table[2][2] = {{1, 2}, {3, 4}};
  std::array<int, 2> pair{5, 6};
  Inner inner[2];
  int last = 7;
};
class Ring {
 public:
  void push(double x) {
    last_ = (last_ + 1) % 3;
    values_[last_] = x;
    if (used_ < 3) ++used_;
  }
  [[nodiscard]] double back() const { return values_[last_]; }
  auto each_part(auto&& f) {
    return f(jml::in_range(last_, 0, 2), jml::in_range(used_, 0, 3), jml::part_series<3>([this](int i) {
               return jml::part_if([this, i] { return i < used_; }, values_[i]);
             }));
  }

 private:
  int last_ = 2, used_ = 0;
  double values_[3] = {7, 8, 9};
};
struct Everything {
  Inner inner;
  Nothing nothing;
  InC in_c;
  std::array<std::uint8_t, 3> bytes{1, 2, 3};
  std::pair<long, unsigned> pair{-5, 6};
  std::tuple<bool, Inner> tuple{true, {}};
  std::optional<Inner> maybe;
  std::variant<double, Inner, Mode> either;
  Ring ring;
  std::uint64_t many = ~std::uint64_t(0);
  signed char letter = -3;
};

TEST(Image, EveryKindOfPartThereAndBack) {
  Everything a, b;
  a.inner.v = {4, -0.0, std::numeric_limits<double>::quiet_NaN()};
  a.inner.f = -2.5F;
  a.in_c.table[1][0] = -3;
  a.in_c.inner[1].f = 6;
  a.in_c.last = 70;
  a.bytes = {9, 0, 255};
  a.pair = {std::numeric_limits<long>::min(), 4'000'000'000U};
  std::get<1>(a.tuple).f = 8;
  a.maybe.emplace().f = 3;
  a.either = Mode::failed;
  a.ring.push(5);
  a.letter = -128;
  jml::ImageOf<Everything> image, again;
  ASSERT_EQ(jml::save(image, a), Status::ok);
  ASSERT_EQ(jml::restore(image, b), Status::ok);
  EXPECT_EQ(b.inner.v(0), 4);
  EXPECT_TRUE(std::signbit(b.inner.v(1)));
  EXPECT_EQ(std::bit_cast<std::uint64_t>(b.inner.v(2)), std::bit_cast<std::uint64_t>(a.inner.v(2)));
  EXPECT_EQ(b.inner.f, -2.5F);
  EXPECT_EQ(b.in_c.table[1][0], -3);
  EXPECT_EQ(b.in_c.inner[1].f, 6);
  EXPECT_EQ(b.in_c.last, 70);
  EXPECT_EQ(b.bytes, a.bytes);
  EXPECT_EQ(b.pair, a.pair);
  EXPECT_EQ(std::get<1>(b.tuple).f, 8);
  ASSERT_TRUE(b.maybe.has_value());
  EXPECT_EQ(b.maybe->f, 3);
  ASSERT_EQ(b.either.index(), 2U);
  EXPECT_EQ(std::get<2>(b.either), Mode::failed);
  EXPECT_EQ(b.ring.back(), 5);
  EXPECT_EQ(b.letter, -128);
  ASSERT_EQ(jml::save(again, b), Status::ok);
  EXPECT_TRUE(image == again);
  // And what is no longer there.
  a.maybe.reset();
  a.either = 2.5;
  ASSERT_EQ(jml::save(image, a), Status::ok);
  ASSERT_EQ(jml::restore(image, b), Status::ok);
  EXPECT_FALSE(b.maybe.has_value());
  EXPECT_EQ(std::get<0>(b.either), 2.5);
}

TEST(Image, RefusedByName) {
  const Small small{7, false, 2, Mode::on}, before{1, true, 3, Mode::off};
  Small other = before;
  jml::ImageOf<Small> image;
  EXPECT_EQ(jml::save(std::span(image).first(image.size() - 1), small), Status::memory_full);
  ASSERT_EQ(jml::save(image, small), Status::ok);
  const auto refused = [&](std::span<const std::byte> bytes) {
    const Status status = jml::restore(bytes, other);
    EXPECT_TRUE(other == before);
    return status;
  };
  EXPECT_EQ(refused({}), Status::damaged_image);
  EXPECT_EQ(refused(std::span(image).first(image.size() - 1)), Status::damaged_image);
  const std::array<std::byte, 200> zeros{};
  EXPECT_EQ(refused(zeros), Status::damaged_image);
  // Forged: the checksum is right.
  const auto forged = [&](std::size_t at, unsigned char value) {
    auto bytes = image;
    bytes[at] = std::byte(value);
    seal(bytes);
    return refused(bytes);
  };
  EXPECT_EQ(forged(0, 'J'), Status::damaged_image) << "no image";
  EXPECT_EQ(forged(7, 2), Status::foreign_image) << "another version";
  EXPECT_EQ(forged(8, 0x55), Status::foreign_image) << "another fingerprint";
  EXPECT_EQ(forged(26, 1), Status::damaged_image) << "a count beyond 16 bits";
  EXPECT_EQ(forged(32, 2), Status::damaged_image) << "a bool of 2";
  EXPECT_EQ(forged(41, 3), Status::damaged_image) << "a mode that is none";
  // Longer memory is no fault: what follows is not read.
  std::array<std::byte, image.size() + 20> page{};
  std::copy(image.begin(), image.end(), page.begin());
  EXPECT_EQ(jml::restore(page, other), Status::ok);
  EXPECT_TRUE(other == small);
}

TEST(Image, ForgedIndicesAreRefused) {
  Everything a, b;
  jml::ImageOf<Everything> image;
  ASSERT_EQ(jml::save(image, a), Status::ok);
  // Inner: 28. In C: 32, 16, 56 and 8. Bytes 3, pair 16, tuple 29, optional 29, variant 29, then the ring.
  const std::size_t variant = 24 + 28 + 112 + 3 + 16 + 29 + 29, ring = variant + 29;
  for (const auto& [at, value] :
       {std::pair{variant, 3}, std::pair{ring, 3}, std::pair{ring + 7, 0x80}, std::pair{ring + 8, 4}}) {
    auto bytes = image;
    bytes[at] = std::byte(value);
    seal(bytes);
    EXPECT_EQ(jml::restore(bytes, b), Status::damaged_image) << at;
  }
}

TEST(Image, EveryStatusHasWords) {
  const auto last = static_cast<int>(last_value(Status::ok));
  for (int i = 0; i <= last; ++i)
    EXPECT_NE(std::string_view(describe(static_cast<Status>(i))), "unknown status") << i;
  EXPECT_EQ(std::string_view(describe(static_cast<Status>(last + 1))), "unknown status");
}

}  // namespace
