#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Which points of a tile a region has.
namespace vantage::shared_tiles {

/// How the points are written down; the shortest is taken, the first of those that are equal.
enum class Coding : std::uint32_t {
  all = 0,     ///< every point: no bytes
  bitmap = 1,  ///< a bit for each point of the tile, the lowest of a byte first
  runs = 2,    ///< numbers (LEB128): points left out, points taken, left out, taken ...
};

/// @param picks   strictly ascending, below `points`; not empty
/// @param points  of the tile
/// @param bytes   to which the code is appended
[[nodiscard]] Coding append_selection(std::string& bytes, std::span<const std::uint32_t> picks,
                                      std::uint32_t points);

/// Points of a tile that follow each other.
struct Run {
  std::uint32_t begin = 0;
  std::uint32_t end = 0;  ///< behind the last

  friend bool operator==(const Run&, const Run&) = default;
};

/// The points that a code stands for, in ascending runs; nothing if it is no such code.
/// @param count  how many points there must be
[[nodiscard]] std::optional<std::vector<Run>> read_selection(std::string_view bytes, Coding coding,
                                                             std::uint32_t points,
                                                             std::uint32_t count);

}  // namespace vantage::shared_tiles
