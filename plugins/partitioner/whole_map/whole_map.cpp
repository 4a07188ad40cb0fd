#include <memory>

#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/regions.hpp"

namespace {

using vantage::ErrorCode, vantage::fail, vantage::PointsView, vantage::Result;

/// One region that owns every point: the wide-area map as the paper compares it.
struct WholeMap {
  double margin = 0.0;
  static constexpr auto schema() {
    return std::tuple{vantage::optional("margin", &WholeMap::margin, "m",
                                        "how far the region reaches beyond the map's points",
                                        vantage::non_negative)};
  }

  [[nodiscard]] Result<vantage::Partition> partition(const vantage::MapPasses& map, PointsView,
                                                     const vantage::MapSurvey&) const {
    const vantage::Bounds3 bounds = map.bounds();
    const Eigen::Vector2d around = Eigen::Vector2d::Constant(margin);
    return vantage::Partition::from(
        {{.label = "map",
          .footprint =
              vantage::box_owning(bounds.min.head<2>() - around, bounds.max.head<2>() + around),
          .height = {}}});
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, vantage::PartitionerOf<WholeMap>, "whole_map",
               "one region that owns every point");
