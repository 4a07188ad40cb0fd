#pragma once

#include <span>

#include "vantage/conformance.hpp"

/// Where each kind's clauses are, and what they share.
namespace vantage::conformance {

/// Checks that a call fails, and with this code.
template <class T>
void check_fails(const Result<T>& result, ErrorCode code) {
  REQUIRE_FALSE(result.has_value());
  CHECK_MESSAGE(result.error().code == code, to_string(result.error()));
}

[[nodiscard]] std::span<const Clause> common_clauses();
[[nodiscard]] std::span<const Clause> partitioner_clauses();
[[nodiscard]] std::span<const Clause> ground_clauses();
[[nodiscard]] std::span<const Clause> visibility_clauses();
[[nodiscard]] std::span<const Clause> store_clauses();
[[nodiscard]] std::span<const Clause> matcher_clauses();

}  // namespace vantage::conformance
