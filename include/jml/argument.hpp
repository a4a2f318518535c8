// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a caller gives for a vector or matrix of compile-time size: its size is checked before it is read.
#include <jml/warnings_begin.hpp>
#pragma once

#include <concepts>
#include <jml/linear_algebra.hpp>
#include <limits>

namespace jml {

namespace detail {

template <typename List>
concept ListOfNumbers = std::is_arithmetic_v<typename List::value_type> && requires(const List& list) {
  list.data();
  list.begin();
  requires !requires { List::RowsAtCompileTime; };
};

/// What a caller gives fits rows×cols, as far as that is known at compile time. A row serves as a column.
template <typename Scalar, int rows, int cols, typename Other>
consteval bool require_fitting() {
  constexpr int r = Other::RowsAtCompileTime, c = Other::ColsAtCompileTime;
  constexpr auto is = [](int given, int wanted) { return given == wanted || given == Eigen::Dynamic; };
  constexpr bool vector = (cols == 1 || rows == 1) && (r == 1 || c == 1);
  constexpr bool fits = vector ? is(r == 1 ? c : r, rows * cols) : is(r, rows) && is(c, cols);
  static_assert(
      fits,
      "jml: a vector or matrix of the wrong size is given: y has `measurements` entries, a control "
      "`controls` (none where the model does not say so), a state and a box `states`, P states×states");
  if constexpr (fits)
    static_assert(
        std::is_same_v<typename Other::Scalar, Scalar>,
        "jml: a vector or matrix of another scalar is given, float for double: convert it by .cast<…>()");
  return fits;
}

}  // namespace detail

/// A vector or matrix given by the caller, rows×cols: a Matrix of that size, an Eigen value or expression,
/// or, where rows·cols = 1, a number.
///
/// A size that is wrong at compile time is a compile-time error. One that is known only at run time
/// (Eigen::VectorXd, Eigen::Map, a block) and is wrong makes every entry a NaN, and nothing of it is read: so
/// each estimator refuses it by the argument's own name, as it refuses a NaN.
template <typename Scalar, int rows, int cols = 1>
class Argument : public Matrix<Scalar, rows, cols> {
  using Value = Matrix<Scalar, rows, cols>;
  static constexpr int entries = rows * cols;

 public:
  using Value::Value;
  Argument() = default;
  /// From a matrix of the size, an Eigen expression that has it, or a number where there is one entry.
  /// Another size is refused at compile time where it is known there; what has its size at run time becomes
  /// NaN.
  /// @{
  JML_INLINE Argument(const Value& value) : Value(value) {}  // NOLINT: a value is an argument
  template <typename Other>
  JML_INLINE Argument(const Eigen::EigenBase<Other>& other)  // NOLINT: so is an expression
      : Value(of_this_size(other.derived())) {}
  template <typename List>
    requires detail::ListOfNumbers<List>
  Argument(const List&) {  // NOLINT: refused in words
    static_assert(!sizeof(List*),
                  "jml: a std::vector or std::array in place of a jml::Vector: give "
                  "Eigen::Map<const jml::Vector<double, n>>(list.data())");
  }
  template <typename Number>
    requires std::is_arithmetic_v<Number>
  JML_INLINE Argument(Number number) : Value(kernel::filled<Value>(static_cast<Scalar>(number))) {  // NOLINT
    static_assert(entries != 0, "jml: a control for a model that says no `static constexpr int controls`");
    static_assert(entries <= 1, "jml: a single number for a vector or matrix of several entries");
  }
  /// @}
  /// Braces with another count of numbers: refused at compile time.
  /// @{
  Argument(const Scalar&, const Scalar&)
    requires(entries != 2)
  {
    refuse_count<2>();
  }
  Argument(const Scalar&, const Scalar&, const Scalar&)
    requires(entries != 3)
  {
    refuse_count<3>();
  }
  Argument(const Scalar&, const Scalar&, const Scalar&, const Scalar&)
    requires(entries != 4)
  {
    refuse_count<4>();
  }
  /// @}

  using Value::operator();
  /// An entry of nothing: the control of a model that has none.
  template <std::integral Index>
    requires(entries == 0)
  const Scalar& operator()(Index) const {
    static_assert(
        !sizeof(Index*),
        "jml: the model reads at.control, and does not say how many: `static constexpr int controls`");
    return *this->data();
  }

 private:
  template <int numbers>
  static consteval void refuse_count() {
    static_assert(entries == numbers, "jml: braces with more or fewer numbers than the vector has entries");
  }

  template <typename Other>
  JML_INLINE static Value of_this_size(const Other& other) {
    constexpr bool fits = detail::require_fitting<Scalar, rows, cols, Other>();
    if constexpr (!fits || !std::is_same_v<typename Other::Scalar, Scalar>) {
      return {};
    } else if constexpr (!kernel::fixed<int(Other::RowsAtCompileTime), int(Other::ColsAtCompileTime)>) {
      const bool vectors = rows == 1 || cols == 1;  // a row serves as a column, as ever in Eigen
      if (vectors ? other.size() != rows * cols || (other.rows() != 1 && other.cols() != 1)
                  : other.rows() != rows || other.cols() != cols) {
        Value nothing;
        for (int i = 0; i < rows * cols; ++i) nothing.data()[i] = std::numeric_limits<Scalar>::quiet_NaN();
        return nothing;
      }
      return other;
    } else {
      return other;
    }
  }
};

}  // namespace jml
#include <jml/warnings_end.hpp>
