#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace vantage {

/// The shortest decimal text that reads back as the same double; the same in every locale.
[[nodiscard]] std::string shortest(double x);

/// An integer with leading zeros: at least `digits` digits.
[[nodiscard]] std::string zero_padded(std::uint64_t x, std::size_t digits);

/// `<prefix>000`, `<prefix>001`, ...: `count` names that sort like their numbers.
[[nodiscard]] std::vector<std::string> numbered(const std::string& prefix, std::uint32_t count);

}  // namespace vantage
