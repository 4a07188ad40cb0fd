#pragma once

namespace vantage {

/// Several lambdas as one overload set, for std::visit. Code that lacks a lambda for one of the
/// alternatives does not compile.
template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;  // Clang 14 needs it

}  // namespace vantage
