#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "build/build_identity.hpp"
#include "build/plan.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// A plan as bytes, with a checksum.
[[nodiscard]] std::vector<std::byte> encode_plan(const BuildPlan& plan,
                                                 const BuildIdentity& identity);

/// Errors: `corrupt_data` for bytes that encode_plan does not make; `already_exists` for a plan
/// of another identity.
[[nodiscard]] Result<BuildPlan> decode_plan(std::span<const std::byte> bytes,
                                            const BuildIdentity& identity);

}  // namespace vantage
