#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::matching {

/// Checks what MatchTarget::excerpt_of requires of its numbers: `seen` and `kept` ascend, and
/// `kept` are some of `seen`. Error: `invalid_input`.
[[nodiscard]] inline Result<void> check_numbers(std::span<const std::uint32_t> seen,
                                                std::span<const std::uint32_t> kept,
                                                std::size_t elements) {
  const auto ascends = [](std::span<const std::uint32_t> numbers) {
    return std::ranges::adjacent_find(numbers, std::greater_equal()) == numbers.end();
  };
  if (ascends(seen) && ascends(kept) && std::ranges::includes(seen, kept) &&
      (seen.empty() || seen.back() < elements)) {
    return {};
  }
  return fail(ErrorCode::invalid_input,
              "the numbers of elements do not ascend, or are not those of elements");
}

/// The numbers whose flag is set, ascending.
[[nodiscard]] inline std::vector<std::uint32_t> numbers_of(const std::vector<bool>& flags) {
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < flags.size(); ++i) {
    if (flags[i]) numbers.push_back(i);
  }
  return numbers;
}

}  // namespace vantage::matching
