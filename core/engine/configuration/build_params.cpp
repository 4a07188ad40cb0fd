#include "vantage/engine/build_params.hpp"

#include <algorithm>
#include <string>

namespace vantage {
namespace {

bool has_twice(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return std::adjacent_find(values.begin(), values.end()) != values.end();
}

}  // namespace

Result<void> ViewpointParams::validate() const {
  const auto check = [](std::string_view key, const std::vector<double>& offsets) -> Result<void> {
    const std::string name = "'" + std::string(key) + "'";
    if (offsets.empty()) {
      return fail_at({key}, name + " is empty, so there is no viewpoint: expected at least 0.0");
    }
    if (has_twice(offsets)) return fail_at({key}, name + " names one offset twice");
    return {};
  };
  VANTAGE_CHECK(check("height_offsets", height_offsets));
  VANTAGE_CHECK(check("lateral_offsets", lateral_offsets));
  const ViewpointParams defaults;
  if (source == ViewpointSource::ground && lateral_offsets != defaults.lateral_offsets) {
    return fail_at(
        {"lateral_offsets"},
        "'lateral_offsets' are measured from a trajectory: expected source = \"trajectory\"");
  }
  if (source == ViewpointSource::trajectory && reachable) {
    return fail_at({"reachable"},
                   "'reachable' applies to ground, but source = \"trajectory\" uses no ground");
  }
  if (source == ViewpointSource::trajectory && sensor_height != defaults.sensor_height) {
    return fail_at({"sensor_height"},
                   "'sensor_height' is measured from the ground, but source = \"trajectory\" is "
                   "the sensor's own path: leave it out, or set 'height_offsets'");
  }
  return {};
}

Result<void> ThinningParams::validate() const {
  if (voxel_size.has_value() != budget.has_value()) return {};
  return fail_at(
      {"voxel_size", "budget"},
      voxel_size
          ? "'voxel_size' and 'budget' both set the amount of thinning; give only one of them"
          : "thinning needs 'voxel_size' or 'budget'");
}

}  // namespace vantage
