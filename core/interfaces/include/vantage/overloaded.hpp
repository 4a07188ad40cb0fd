#pragma once

namespace vantage {

/// Several lambdas as one overload set, for std::visit: an alternative without a lambda does not
/// compile.
template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};

}  // namespace vantage
