#include "live/map_server.hpp"

#include <fmt/format.h>

#include <utility>

#include "live/map_poses.hpp"
#include "live/publisher.hpp"

namespace vantage::live {

MapServer::MapServer(Bundle bundle, LiveParams params, double switch_margin, Notices& notices)
    : bundle_(std::move(bundle)),
      params_(std::move(params)),
      switch_margin_(switch_margin),
      notices_(notices),
      regions_(bundle_.directory()) {}

Result<std::optional<std::string>> MapServer::take(const Received& received) {
  VANTAGE_TRY(const auto poses,
              poses_in_map(received.input, received.message, params_.frames.map, notices_));
  if (poses.empty()) return std::nullopt;
  const Point& place = poses.back().pose.translation;
  VANTAGE_TRY(const auto choice, regions_.choose(region_, place, switch_margin_));
  if (choice.outside) {
    notices_.tell("outside", fmt::format("x {:.1f}, y {:.1f} is in no region: a region beside it "
                                         "is used there",
                                         place.x(), place.y()));
  }
  if (region_ == choice.region) return std::nullopt;
  VANTAGE_TRY(const RegionMap map, bundle_.get(choice.region));
  VANTAGE_TRY(std::string message, map_message(params_.frames, map.points, notices_));
  region_ = choice.region;
  notices_.say(fmt::format("x {:.1f}, y {:.1f}: the map of region {}, {} points", place.x(),
                           place.y(), regions_.name_of(choice.region), map.points.size()));
  return std::optional(std::move(message));
}

}  // namespace vantage::live
