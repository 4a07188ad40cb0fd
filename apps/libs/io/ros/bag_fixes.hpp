#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "io/map_projection.hpp"
#include "io/ros/message_reader.hpp"
#include "vantage/result.hpp"

namespace vantage::io::ros {

/// Where an antenna was.
struct StampedFix {
  double stamp = 0.0;    ///< [s]
  GeoPosition position;  ///< an altitude that the receiver does not know is NaN
  std::optional<std::array<double, 3>> variances;  ///< east, north, up [m^2], as they were sent
  bool has_altitude = true;
};

/// The positions of a topic of sensor_msgs/NavSatFix.
struct BagFixes {
  std::vector<StampedFix> fixes;  ///< stamps increase strictly
  std::string frame;              ///< of the antenna, without a leading slash; may be empty
  std::uint64_t without_fix = 0;  ///< messages that say so
  std::uint64_t not_finite = 0;   ///< messages with a fix, but no finite latitude and longitude
  std::uint64_t not_later = 0;    ///< stamped no later than the one before
  std::optional<Error> damage;    ///< at which a bag that is cut off or damaged ends
};

/// Reads the whole bag and selects other topics. Stamps are those of the headers, or log times if
/// the first header has none (0).
/// @param topics  indices into the topics of the reader, all of sensor_msgs/NavSatFix
/// Errors (`where` is the file): `corrupt_data` for a frame that changes; those of MessageReader
/// and parse_nav_sat_fix.
[[nodiscard]] Result<BagFixes> read_bag_fixes(MessageReader& reader,
                                              const std::vector<std::size_t>& topics);

}  // namespace vantage::io::ros
