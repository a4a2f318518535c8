// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How a model function is found and called, whichever arguments it takes, and what it must not return.
#include <jml/warnings_begin.hpp>
#pragma once

#include <jml/model/hooks.hpp>
#include <type_traits>

namespace jml {

namespace detail {

/// Calls function(x, at), function(x) or function(), the first that exists.
template <typename Function, typename X, typename At>
constexpr auto call(const Function& function, const X& x, const At& at) {
  if constexpr (std::is_invocable_v<Function, X, At>)
    return function(x, at);
  else if constexpr (std::is_invocable_v<Function, X>)
    return function(x);
  else
    return function();
}
template <typename Function, typename X, typename At>
concept Callable =
    std::is_invocable_v<Function, X, At> || std::is_invocable_v<Function, X> || std::is_invocable_v<Function>;

/// What call() would return, found without looking into the function: a body meant for double alone must not
/// be instantiated for anything else.
template <typename Function, typename X, typename At>
struct Result : std::invoke_result<Function> {};
template <typename Function, typename X, typename At>
  requires(std::is_invocable_v<Function, X> && !std::is_invocable_v<Function, X, At>)
struct Result<Function, X, At> : std::invoke_result<Function, X> {};
template <typename Function, typename X, typename At>
  requires std::is_invocable_v<Function, X, At>
struct Result<Function, X, At> : std::invoke_result<Function, X, At> {};

/// Callable, and answers in the scalar of x: a function written for double alone does not serve dual numbers.
template <typename Function, typename X, typename At>
concept Generic = Callable<Function, X, At> &&
                  std::is_same_v<typename std::remove_cvref_t<typename Result<Function, X, At>::type>::Scalar,
                                 typename X::Scalar>;

/// Refuses at compile time what a model function must not return. False: what follows would not compile.
template <int rows, int cols, typename Value>
consteval bool require_value() {
  if constexpr (requires { Value::RowsAtCompileTime; }) {
    constexpr bool plain = std::is_base_of_v<Eigen::PlainObjectBase<Value>, Value>;
    constexpr bool fits = int(Value::RowsAtCompileTime) == rows && int(Value::ColsAtCompileTime) == cols;
    static_assert(
        plain,
        "jml: a model function must return a jml::Vector or jml::Matrix, not auto of an Eigen expression, "
        "which would refer to what is gone");
    static_assert(
        fits || !plain,
        "jml: a model function returns a matrix of the wrong size: f n, f_x and F n×n, G n×q, Q q×q, "
        "w̄ q, m p, m_x and M p×n, R p×p");
    return plain && fits;
  } else {
    static_assert(
        requires { Value::RowsAtCompileTime; },
        "jml: a model function must return a jml::Vector or jml::Matrix, also where it is 1×1");
    return false;
  }
}
/// The same of f(x) and m(x), which answer in the scalar of x.
template <int rows, typename T, typename Value>
consteval bool require_value_of() {
  if constexpr (require_value<rows, 1, Value>()) {
    constexpr bool same = std::is_same_v<typename Value::Scalar, T>;
    static_assert(same,
                  "jml: dynamics(x) or measurement(x) does not answer in the scalar of x: make it a template "
                  "over the scalar T, and return a jml::Vector<T, …>");
    return same;
  } else {
    return false;
  }
}
template <int rows, int cols, typename Function, typename X, typename At>
consteval bool require_shape() {
  if constexpr (Callable<Function, X, At>)
    return require_value<rows, cols, std::remove_cvref_t<typename Result<Function, X, At>::type>>();
  else
    return true;
}

/// A member function, no template, whose first argument is a vector of another size than n: Eigen would take
/// x for it, and fail to convert it.
template <typename Member, int n>
inline constexpr bool takes_other_state = false;
template <typename R, typename Model, typename X, typename... A, int n>
  requires requires { std::remove_cvref_t<X>::RowsAtCompileTime; }
inline constexpr bool takes_other_state<R (Model::*)(X, A...) const, n> =
    int(std::remove_cvref_t<X>::RowsAtCompileTime) != n &&
    int(std::remove_cvref_t<X>::RowsAtCompileTime) != Eigen::Dynamic;

/// The type &Model::member of numbers, where a function is meant.
template <typename T>
concept Numbers = std::is_arithmetic_v<T> || requires { T::RowsAtCompileTime; };
template <typename Member>
inline constexpr bool is_data = false;
template <typename Value>
  requires Numbers<std::remove_cv_t<Value>>
inline constexpr bool is_data<Value*> = true;
template <typename Value, typename Model>
  requires Numbers<std::remove_cv_t<Value>>
inline constexpr bool is_data<Value Model::*> = true;

/// A function of a model, of whatever arguments its trait says.
template <typename Hook, typename Model>
constexpr auto hook(const Model& model) {
  return [&model](const auto&... a) -> decltype(Hook::of(model, a...)) { return Hook::of(model, a...); };
}
template <typename Hook, typename Model>
using HookOf = decltype(hook<Hook>(std::declval<const Model&>()));

/// A function that the model has reads time, dt or control; or reads the state; or may be asked for nothing.
template <typename Hook, typename Model, typename X, typename At>
concept ReadsContext = requires(const Model& model, const X& x, const At& at) { Hook::of(model, x, at); };
template <typename Hook, typename Model, typename X>
concept ReadsState = requires(const Model& model, const X& x) { Hook::of(model, x); };
template <typename Hook, typename Model>
concept AsksNothing = requires(const Model& model) { Hook::of(model); };
/// The model has it, as (), (x) or (x, at).
template <typename Hook, typename Model, typename X, typename At>
concept HasHook = ReadsContext<Hook, Model, X, At> || ReadsState<Hook, Model, X> || AsksNothing<Hook, Model>;
/// … and it is the same at every state and time.
template <typename Hook, typename Model, typename X, typename At>
concept ConstantHook =
    AsksNothing<Hook, Model> && !ReadsState<Hook, Model, X> && !ReadsContext<Hook, Model, X, At>;

/// call() of a function of a model.
template <typename Hook, typename Model, typename X, typename At>
constexpr auto ask(const Model& model, const X& x, const At& at) {
  if constexpr (ReadsContext<Hook, Model, X, At>)
    return Hook::of(model, x, at);
  else if constexpr (ReadsState<Hook, Model, X>)
    return Hook::of(model, x);
  else
    return Hook::of(model);
}

/// Its type is all that is asked for: to know it, a compiler looks into the function of the model.
template <typename Hook, typename Model, typename X, typename At>
auto look_into(const Model& model, const X& x, const At& at) {
  static_cast<void>(ask<Hook>(model, x, at));
  return true;
}

/// Its value, rows×cols, in the scalar of x.
template <typename Hook, int rows, int cols, typename Model, typename T, int n, typename At>
JML_INLINE inline Matrix<T, rows, cols> evaluate(const Model& model, const Vector<T, n>& x, const At& at) {
  if constexpr (require_value<rows, cols, decltype(ask<Hook>(model, x, at))>())
    return kernel::cast<T>(ask<Hook>(model, x, at));
  else
    return {};
}

}  // namespace detail

}  // namespace jml
#include <jml/warnings_end.hpp>
