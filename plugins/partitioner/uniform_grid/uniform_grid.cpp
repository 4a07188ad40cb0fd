#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "vantage/kit/numbers.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/raster_partition.hpp"
#include "vantage/kit/regions.hpp"

namespace {

using vantage::PointsView, vantage::Result;

std::string padded(std::int32_t index, std::size_t digits) {
  const auto wide = std::int64_t{index};
  return (wide < 0 ? "-" : "+") +
         vantage::zero_padded(static_cast<std::uint64_t>(std::abs(wide)), digits);
}

/// `x+012_y-003`: the i and j of G_ij, all of the same width.
std::vector<std::string> labels_of(const std::vector<vantage::PlanCell>& cells) {
  std::size_t digits = 3;
  for (const auto& [j, i] : cells) {
    for (const std::int64_t index : {i, j}) {
      digits = std::max(digits, std::to_string(std::abs(index)).size());
    }
  }
  std::vector<std::string> labels;
  labels.reserve(cells.size());
  for (const auto& [j, i] : cells) {
    labels.push_back("x" + padded(i, digits) + "_y" + padded(j, digits));
  }
  return labels;
}

/// Square cells of one width; those that hold a point become regions (Eqs. 2-3).
struct UniformGrid {
  double cell_width{};                    // L of Eq. 2
  std::optional<Eigen::Vector2d> origin;  // lower left corner of cell (0, 0)

  static constexpr auto schema() {
    constexpr vantage::Source kSource{"Eq. 2", "Yagi et al. 2026, Sec. 2.1"};
    return std::tuple{
        vantage::required("cell_width", &UniformGrid::cell_width, "m", "grid width L",
                          vantage::positive, kSource),
        vantage::optional("origin", &UniformGrid::origin, "m",
                          "[x, y] of the corner between cells; the map's minimum if left out",
                          kSource),
    };
  }

  [[nodiscard]] Result<vantage::Partition> partition(PointsView map, PointsView,
                                                     const vantage::MapSurvey&) const {
    VANTAGE_TRY(const auto raster, raster_over(vantage::bounds_of(map)));
    return partition_of(vantage::occupied_cells(map, raster), raster);
  }

  [[nodiscard]] Result<vantage::Partition> partition_in_passes(const vantage::MapPasses& map,
                                                               PointsView) const {
    VANTAGE_TRY(const auto raster, raster_over(map.bounds()));
    VANTAGE_TRY(const auto cells, vantage::occupied_cells(map, raster));
    return partition_of(cells, raster);
  }

 private:
  [[nodiscard]] Result<vantage::PlanRaster> raster_over(const vantage::Bounds3& bounds) const {
    return vantage::PlanRaster::over(bounds, {cell_width, "cell_width"},
                                     origin.value_or(bounds.min.head<2>()));
  }

  [[nodiscard]] Result<vantage::Partition> partition_of(const std::vector<vantage::PlanCell>& cells,
                                                        const vantage::PlanRaster& raster) const {
    if (cells.size() > vantage::kMaxRegions) {
      return vantage::too_many_regions("cell_width = " + vantage::shortest(cell_width) + " m");
    }
    std::vector<vantage::OwnedCell> owned;
    owned.reserve(cells.size());
    for (const vantage::PlanCell& cell : cells) {
      owned.push_back({cell, static_cast<std::uint32_t>(owned.size())});
    }
    return vantage::partition_of_cells(raster, std::move(owned), labels_of(cells));
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, vantage::PartitionerOf<UniformGrid>, "uniform_grid",
               "square cells of one width (Eqs. 2-3)");
