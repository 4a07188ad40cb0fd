#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace vantage::cli {

/// The bytes of "512MiB" or "1.5 GiB"; nothing for a text without a number above 0 and one of these
/// two units.
[[nodiscard]] std::optional<std::uint64_t> parse_memory(std::string_view text);

/// What to say of another text after --memory.
[[nodiscard]] std::string not_memory(std::string_view text);

/// "12.3 MB", "4.56 GB".
[[nodiscard]] std::string size_text(std::uint64_t bytes);

}  // namespace vantage::cli
