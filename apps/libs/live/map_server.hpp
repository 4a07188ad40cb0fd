#pragma once

#include <optional>
#include <string>

#include "live/live_params.hpp"
#include "live/notices.hpp"
#include "live/received.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/engine/regions_ahead.hpp"
#include "vantage/result.hpp"

namespace vantage::live {

/// The maps for another localizer, which has one map at a time: that of the region it is in.
class MapServer {
 public:
  /// @param switch_margin  a region is left this far outside of it [m]
  MapServer(Bundle bundle, LiveParams params, double switch_margin, Notices& notices);

  /// Takes a pose in. Returns the map's message if the region is another than before.
  /// Errors: those of poses_in_map, of the bundle, and of a map that cannot be encoded.
  [[nodiscard]] Result<std::optional<std::string>> take(const Received& received);

  /// The next pose gets its map again.
  void forget() { region_.reset(); }

  [[nodiscard]] const std::optional<RegionId>& region() const noexcept { return region_; }

 private:
  Bundle bundle_;
  LiveParams params_;
  double switch_margin_;
  Notices& notices_;
  RegionsAhead regions_;
  std::optional<RegionId> region_;  // whose map was given last
};

}  // namespace vantage::live
