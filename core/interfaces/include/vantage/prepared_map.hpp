#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace vantage {

/// A part of a prepared map, in the format of its matcher. Only that matcher can read it.
struct PreparedMap {
  std::vector<std::byte> bytes;
  std::uint64_t elements = 0;  ///< number of things a scan can be compared with: N_point of Eq. 13

  friend bool operator==(const PreparedMap&, const PreparedMap&) = default;
};

}  // namespace vantage
