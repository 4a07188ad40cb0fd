#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

#include "vantage/error.hpp"

namespace vantage {

/// A value, or the reason why there is none. tl::expected is not [[nodiscard]], so every function
/// that returns a Result is declared [[nodiscard]] itself.
template <class T>
using Result = tl::expected<T, Error>;

[[nodiscard]] inline tl::unexpected<Error> fail(Error error) {
  return tl::unexpected<Error>(std::move(error));
}
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message) {
  return fail(Error{.code = code, .message = std::move(message), .where = {}, .context = {}});
}
[[nodiscard]] inline tl::unexpected<Error> fail(ErrorCode code, std::string message,
                                                SourceLocation where) {
  return fail(
      Error{.code = code, .message = std::move(message), .where = std::move(where), .context = {}});
}

}  // namespace vantage

#define VANTAGE_CONCAT_(a, b) a##b
#define VANTAGE_CONCAT(a, b) VANTAGE_CONCAT_(a, b)

/// `VANTAGE_TRY(auto x, f());` declares x from f's value, or returns f's error to the caller.
#define VANTAGE_TRY(declaration, expression) \
  VANTAGE_TRY_(declaration, expression, VANTAGE_CONCAT(vantage_try_, __COUNTER__))
#define VANTAGE_TRY_(declaration, expression, tmp)          \
  auto tmp = (expression);                                  \
  if (!tmp) return ::vantage::fail(std::move(tmp).error()); \
  declaration = *std::move(tmp)

/// `VANTAGE_CHECK(f());` continues if f succeeded, or returns f's error to the caller.
#define VANTAGE_CHECK(expression) \
  VANTAGE_CHECK_(expression, VANTAGE_CONCAT(vantage_check_, __COUNTER__))
#define VANTAGE_CHECK_(expression, tmp) \
  if (auto tmp = (expression); !tmp) return ::vantage::fail(std::move(tmp).error())
