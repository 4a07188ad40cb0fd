#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "terminal/style.hpp"
#include "vantage/io/tiled_map.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What a tiled map contains.
struct TiledInfo {
  std::uint64_t bytes = 0;
  io::TiledMap map;
};

/// The tiled map in a folder; none if the path is something else. Reads every tile, to compare it
/// with its checksum. Errors: those of TiledMap.
/// @param progress  called with the number of points done and the number of all
[[nodiscard]] Result<std::optional<TiledInfo>> inspect_tiled_map(
    const std::filesystem::path& path,
    const std::function<void(std::size_t, std::size_t)>& progress);

[[nodiscard]] std::string to_text(const TiledInfo& info, const cli::Style& style);
[[nodiscard]] nlohmann::ordered_json to_json(const TiledInfo& info);

}  // namespace vantage
