#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/result.hpp"

namespace vantage::view {

struct Size {
  int width = 1600, height = 1000;  ///< [pixels]
  friend bool operator==(const Size&, const Size&) = default;
};

/// "1600x1000"; nothing for any other text, or for a side outside 64 .. 8192.
[[nodiscard]] std::optional<Size> parse_size(std::string_view text);

/// Rows from the top, three bytes per pixel.
struct Picture {
  Size size;
  std::vector<std::uint8_t> rgb;
};

/// Averages factor x factor pixels to one. Precondition: the factor divides both sides.
[[nodiscard]] Picture scaled_down(const Picture& picture, int factor);

/// The content of a PNG file. Errors: `internal` with what libpng says.
[[nodiscard]] Result<std::string> to_png(const Picture& picture);

}  // namespace vantage::view
