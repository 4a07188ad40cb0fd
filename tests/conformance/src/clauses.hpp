#pragma once

#include <span>
#include <string>

#include "vantage/conformance.hpp"

/// Where each kind's clauses are, and what they share.
namespace vantage::conformance {

/// Checks that a call fails, and with this code.
template <class T>
void check_fails(const Result<T>& result, ErrorCode code) {
  REQUIRE_FALSE(result.has_value());
  CHECK_MESSAGE(result.error().code == code, to_string(result.error()));
}

/// Ends a check whose remaining part does not apply to the plugin, as its claims or its answers
/// say. What failed before has failed.
[[noreturn]] void does_not_apply(std::string why);

[[nodiscard]] std::span<const Clause> common_clauses();
/// The clauses of one kind of plugin; each kind's file defines its own.
template <class Interface>
[[nodiscard]] std::span<const Clause> own_clauses();

}  // namespace vantage::conformance
