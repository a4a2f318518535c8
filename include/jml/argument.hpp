// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a caller gives for a vector or matrix of compile-time size: its size is checked before it is read.
#pragma once

#include <jml/linear_algebra.hpp>
#include <limits>

namespace jml {

/// A vector or matrix given by the caller, rows×cols: a Matrix of that size, an Eigen value or expression,
/// or, where rows·cols = 1, a number.
///
/// A size that is wrong at compile time is a compile-time error. One that is known only at run time
/// (Eigen::VectorXd, Eigen::Map, a block) and is wrong makes every entry a NaN, and nothing of it is read: so
/// each estimator refuses it by the argument's own name, as it refuses a NaN.
template <typename Scalar, int rows, int cols = 1>
class Argument : public Matrix<Scalar, rows, cols> {
  using Value = Matrix<Scalar, rows, cols>;

 public:
  using Value::Value;
  Argument() = default;
  JML_INLINE Argument(const Value& value) : Value(value) {}  // NOLINT: a value is an argument
  template <typename Other>
  JML_INLINE Argument(const Eigen::EigenBase<Other>& other)  // NOLINT: so is an expression
      : Value(of_this_size(other.derived())) {}
  template <typename Number>
    requires std::is_arithmetic_v<Number>
  JML_INLINE Argument(Number number) : Value(kernel::filled<Value>(static_cast<Scalar>(number))) {  // NOLINT
    static_assert(rows * cols == 1, "jml: a single number for a vector or matrix of several entries");
  }

 private:
  template <typename Other>
  JML_INLINE static Value of_this_size(const Other& other) {
    if constexpr (!kernel::fixed<int(Other::RowsAtCompileTime), int(Other::ColsAtCompileTime)>) {
      const bool vectors = rows == 1 || cols == 1;  // a row serves as a column, as ever in Eigen
      if (vectors ? other.size() != rows * cols || (other.rows() != 1 && other.cols() != 1)
                  : other.rows() != rows || other.cols() != cols) {
        Value nothing;
        for (int i = 0; i < rows * cols; ++i) nothing.data()[i] = std::numeric_limits<Scalar>::quiet_NaN();
        return nothing;
      }
    }
    return other;
  }
};

}  // namespace jml
