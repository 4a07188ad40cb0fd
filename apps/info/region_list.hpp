#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>

#include "terminal/style.hpp"
#include "vantage/region_directory.hpp"

namespace vantage {

/// What a bundle says of each of its regions, by RegionId: a table, a region in each line.
[[nodiscard]] std::string to_text(std::span<const DirectoryEntry> regions, const cli::Style& style);
/// The same with the corners of the footprints; an end of a height interval that is infinite is
/// null.
[[nodiscard]] nlohmann::ordered_json to_json(std::span<const DirectoryEntry> regions);

}  // namespace vantage
