#include "targets.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "bundle_seeds.hpp"
#include "bundle_targets.hpp"
#include "io/autoware_tiles.hpp"
#include "io/imu_text.hpp"
#include "io/map_projection.hpp"
#include "io/ros/message_reader.hpp"
#include "io/ros/messages.hpp"
#include "io/velodyne/capture.hpp"
#include "place_index.hpp"
#include "seeds.hpp"
#include "support/bags/message_writer.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::test {
namespace {

using io::ros::Encoding;
using Outcome = std::optional<Error>;

const SourceLocation kWhere{kFuzzedFile, 0, 0};

template <class T>
Outcome outcome_of(const Result<T>& result) {
  if (result) return std::nullopt;
  return result.error();
}

io::InputFile file_of(std::string_view input) {
  return io::InputFile::of_memory(input, kFuzzedFile);
}

Outcome read_cloud(std::string_view input) {
  return outcome_of(io::read_point_cloud(file_of(input), io::ReadTimes::yes));
}

Outcome parse_message(const io::ros::Topic& topic, std::string_view bytes) {
  if (!topic.encoding) return std::nullopt;
  if (topic.type == io::ros::kPointCloud2) {
    return outcome_of(io::ros::parse_point_cloud2(bytes, *topic.encoding, kWhere));
  }
  if (topic.type == io::ros::kLivoxMessages.back()) {
    return outcome_of(io::ros::parse_livox(bytes, *topic.encoding, kWhere));
  }
  if (topic.type == io::ros::kImu) {
    return outcome_of(io::ros::parse_imu(bytes, *topic.encoding, kWhere));
  }
  if (topic.type == "velodyne_msgs/VelodyneScan") {
    return outcome_of(io::ros::parse_velodyne_scan(bytes, *topic.encoding, kWhere));
  }
  if (topic.type == io::ros::kNavSatFix) {
    return outcome_of(io::ros::parse_nav_sat_fix(bytes, *topic.encoding, kWhere));
  }
  if (!io::ros::has_poses(topic.type)) return std::nullopt;
  return outcome_of(io::ros::parse_poses(bytes, topic.type, *topic.encoding, kWhere));
}

/// All messages in their order, then those of the second half again.
Outcome read_bag(Result<std::unique_ptr<io::ros::MessageReader>> opened) {
  if (!opened) return opened.error();
  io::ros::MessageReader& reader = **opened;
  std::int64_t middle = 0;
  for (const bool again : {false, true}) {
    if (again) {
      if (const auto sought = reader.seek(middle); !sought) return sought.error();
    }
    while (true) {
      const auto message = reader.next();
      if (!message) return message.error();
      if (!*message) break;
      if (auto error = parse_message(reader.topics().at((*message)->topic), (*message)->bytes)) {
        return error;
      }
      if (!again) middle = (*message)->log_time / 2;
    }
  }
  return std::nullopt;
}

Outcome read_rosbag1(std::string_view input) {
  return read_bag(io::ros::open_rosbag1(file_of(input)));
}
Outcome read_rosbag2(std::string_view input) {
  return read_bag(io::ros::open_rosbag2_sqlite(file_of(input)));
}
Outcome read_mcap(std::string_view input) { return read_bag(io::ros::open_mcap(file_of(input))); }

Encoding encoding_of(char byte) { return (byte & 1) == 0 ? Encoding::ros1 : Encoding::cdr; }

Outcome too_short() { return Error{ErrorCode::corrupt_data, "too short", kWhere, {}}; }

Outcome read_point_cloud2(std::string_view input) {
  if (input.empty()) return too_short();
  return outcome_of(
      io::ros::parse_point_cloud2(input.substr(1), encoding_of(input.front()), kWhere));
}

Outcome read_poses(std::string_view input) {
  if (input.size() < 2) return too_short();
  const auto type = static_cast<unsigned char>(input[1]) % std::size(kPoseTypes);
  return outcome_of(
      io::ros::parse_poses(input.substr(2), kPoseTypes[type], encoding_of(input.front()), kWhere));
}

Outcome read_nav_sat_fix(std::string_view input) {
  if (input.empty()) return too_short();
  return outcome_of(
      io::ros::parse_nav_sat_fix(input.substr(1), encoding_of(input.front()), kWhere));
}

Outcome read_livox(std::string_view input) {
  if (input.empty()) return too_short();
  return outcome_of(io::ros::parse_livox(input.substr(1), encoding_of(input.front()), kWhere));
}

Outcome read_imu(std::string_view input) {
  if (input.empty()) return too_short();
  return outcome_of(io::ros::parse_imu(input.substr(1), encoding_of(input.front()), kWhere));
}

Outcome read_imu_csv(std::string_view input) {
  return outcome_of(io::parse_imu_csv(input, kFuzzedFile));
}

Outcome read_velodyne(std::string_view input) {
  auto opened = io::open_velodyne_capture(file_of(input), "");
  if (!opened) return opened.error();
  while (true) {
    const auto scan = (*opened)->next();
    if (!scan) return scan.error();
    if (!*scan) return std::nullopt;
  }
}

Outcome read_trajectory(std::string_view input) {
  return outcome_of(io::parse_trajectory(input, kFuzzedFile));
}

Outcome read_tiles(std::string_view input) {
  return outcome_of(io::parse_autoware_tiles(input, kFuzzedFile));
}

/// The projection, and a place in it.
Outcome read_map_projector(std::string_view input) {
  const auto projection = io::MapProjection::parse(input, kFuzzedFile);
  if (!projection) return projection.error();
  auto point = projection->project({.latitude = 35.6586, .longitude = 139.7454, .altitude = 50.0});
  if (point) return std::nullopt;
  point.error().where = kWhere;  // a position has no place in a file
  return point.error();
}

Outcome read_places(std::string_view input) {
  auto index = voxel_search::PlaceIndex::decode(std::as_bytes(std::span(input)));
  if (index) return std::nullopt;
  index.error().where = kWhere;  // the store knows the file, the index does not
  return index.error();
}

constexpr std::array kTargets{
    FuzzTarget{"pcd", read_cloud, seeds::pcd},
    FuzzTarget{"ply", read_cloud, seeds::ply},
    FuzzTarget{"las", read_cloud, seeds::las},
    FuzzTarget{"rosbag1", read_rosbag1, seeds::rosbag1},
    FuzzTarget{"rosbag2", read_rosbag2, seeds::rosbag2},
    FuzzTarget{"mcap", read_mcap, seeds::mcap},
    FuzzTarget{"point_cloud2", read_point_cloud2, seeds::point_cloud2},
    FuzzTarget{"poses", read_poses, seeds::poses},
    FuzzTarget{"nav_sat_fix", read_nav_sat_fix, seeds::nav_sat_fix},
    FuzzTarget{"livox", read_livox, seeds::livox},
    FuzzTarget{"imu", read_imu, seeds::imu},
    FuzzTarget{"imu_csv", read_imu_csv, seeds::imu_csv},
    FuzzTarget{"velodyne", read_velodyne, seeds::velodyne},
    FuzzTarget{"trajectory", read_trajectory, seeds::trajectory},
    FuzzTarget{"tiles", read_tiles, seeds::tiles},
    FuzzTarget{"map_projector", read_map_projector, seeds::map_projector},
    FuzzTarget{"places", read_places, seeds::places},
    FuzzTarget{"bundle_index", bundle_targets::read_index, seeds::bundle_index},
    FuzzTarget{"bundle_regions", bundle_targets::read_regions, seeds::bundle_regions},
    FuzzTarget{"build_plan", bundle_targets::read_plan, seeds::build_plan},
    FuzzTarget{"build_parts", bundle_targets::read_parts, seeds::build_parts},
    FuzzTarget{"tiled_map", bundle_targets::read_pack, seeds::tiled_map},
    FuzzTarget{"shared_region", bundle_targets::read_shared_region, seeds::shared_region},
    FuzzTarget{"pcd_region", bundle_targets::read_pcd_region, seeds::pcd_region},
};

}  // namespace

std::span<const FuzzTarget> fuzz_targets() { return kTargets; }

}  // namespace vantage::test
