#include <cstdint>
#include <optional>
#include <string>

#include "vantage/kit/plan_cuts.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace {

using vantage::PlanCut, vantage::PlanPart, vantage::PointsView, vantage::Result;

/// Median cuts until a cell holds few enough points.
struct KdSplit {
  std::uint64_t max_points{};
  double min_width = 0.0;

  static constexpr auto schema() {
    return std::tuple{
        vantage::required("max_points", &KdSplit::max_points, "",
                          "a cell with more map points than this is cut", vantage::at_least(1)),
        vantage::optional("min_width", &KdSplit::min_width, "m",
                          "no cell is cut into pieces narrower than this", vantage::non_negative)};
  }

  [[nodiscard]] Result<vantage::Partition> partition(const vantage::MapPasses& map, PointsView,
                                                     const vantage::MapSurvey&) const {
    vantage::PlanCutter cutter(map);
    return cutter.cut_up([&](const PlanPart& part) { return cut(part, cutter); },
                         "max_points = " + std::to_string(max_points));
  }

 private:
  /// None if the part is small enough or cannot be cut.
  [[nodiscard]] Result<std::optional<PlanCut>> cut(const PlanPart& part,
                                                   const vantage::PlanCutter& cutter) const {
    if (part.points <= max_points) return std::nullopt;
    for (const Eigen::Index axis : vantage::longer_first(part.box.max - part.box.min)) {
      if (!vantage::has_room(part, axis, min_width)) continue;
      VANTAGE_TRY(const std::optional<double> median, cutter.median_cut(axis));
      if (!median) continue;
      if (const auto cut = vantage::cut_near(part, axis, *median, min_width)) return cut;
    }
    return std::nullopt;
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, vantage::PartitionerOf<KdSplit>, "kd_split",
               "median cuts until a cell holds few enough points");
