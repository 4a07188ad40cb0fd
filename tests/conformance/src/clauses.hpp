#pragma once

#include <span>

#include "vantage/conformance.hpp"

/// Where each kind's clauses are.
namespace vantage::conformance {

[[nodiscard]] std::span<const Clause> common_clauses();
[[nodiscard]] std::span<const Clause> partitioner_clauses();
[[nodiscard]] std::span<const Clause> ground_clauses();
[[nodiscard]] std::span<const Clause> visibility_clauses();
[[nodiscard]] std::span<const Clause> store_clauses();
[[nodiscard]] std::span<const Clause> matcher_clauses();

}  // namespace vantage::conformance
