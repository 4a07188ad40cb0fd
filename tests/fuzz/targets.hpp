#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/error.hpp"

namespace vantage::test {

/// A parser that is fed with anything.
struct FuzzTarget {
  std::string_view name;
  /// Reads all of the input. @return the error that refused it; none if it was read to its end
  std::optional<Error> (*run)(std::string_view input);
  /// Sound inputs, by the project's own writers.
  std::vector<std::string> (*seeds)();
};

[[nodiscard]] std::span<const FuzzTarget> fuzz_targets();

/// What errors call the input.
inline constexpr const char* kFuzzedFile = "fuzzed";

}  // namespace vantage::test
