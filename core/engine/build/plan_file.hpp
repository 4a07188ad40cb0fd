#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "build/plan.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A plan as bytes, with a checksum.
/// @param key  of the configuration and the map
[[nodiscard]] std::vector<std::byte> encode_plan(const BuildPlan& plan, std::uint64_t key);

/// Errors: `corrupt_data` for bytes that encode_plan does not make; `already_exists` for a plan
/// with another key.
[[nodiscard]] Result<BuildPlan> decode_plan(std::span<const std::byte> bytes, std::uint64_t key);

}  // namespace vantage
