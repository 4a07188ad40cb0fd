#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace vantage::foxglove {

/// Of a message to the user of a client, as the protocol numbers them.
enum class Level : std::uint8_t { info = 0, warning = 1, error = 2 };

/// JSON, whatever bytes of others are in its texts.
[[nodiscard]] inline std::string to_text(const nlohmann::json& json) {
  return json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

/// A message to the user of a client.
/// @param id  a later status with the same takes its place
[[nodiscard]] inline std::string status(Level level, std::string_view message,
                                        std::string_view id = {}) {
  nlohmann::json json{{"op", "status"}, {"level", static_cast<int>(level)}, {"message", message}};
  if (!id.empty()) json["id"] = id;
  return to_text(json);
}

}  // namespace vantage::foxglove
