#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "vantage/kit/json_text.hpp"

namespace vantage::foxglove {

/// Of a message to the user of a client, as the protocol numbers them.
enum class Level : std::uint8_t { info = 0, warning = 1, error = 2 };

/// A message to the user of a client.
/// @param id  a later status with the same takes its place
[[nodiscard]] inline std::string status(Level level, std::string_view message,
                                        std::string_view id = {}) {
  nlohmann::json json{{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}};
  if (!id.empty()) json["id"] = id;
  return json_line(json);
}

}  // namespace vantage::foxglove
