#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <variant>
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

constexpr const char* kGround = "ground";

/// The parameters, but for the word that may stand for `origin`.
struct Keys {
  double cell_width{};                    // L of Eq. 2
  std::optional<Eigen::Vector2d> origin;  // lower left corner of cell (0, 0)

  static constexpr auto schema() {
    constexpr vantage::Source kSource{"Eq. 2", "Yagi et al. 2026, Sec. 2.1"};
    return std::tuple{
        vantage::required("cell_width", &Keys::cell_width, "m", "grid width L", vantage::positive,
                          kSource),
        vantage::optional("origin", &Keys::origin, "m",
                          "[x, y] of the corner between cells, or ground: the minimum of the "
                          "ground; the map's minimum if left out",
                          kSource),
    };
  }
};

/// Square cells of one width; those that hold a point become regions (Eqs. 2-3).
struct UniformGrid : Keys {
  bool from_ground = false;  // the origin is the minimum of the ground

  [[nodiscard]] Result<vantage::Partition> partition(const vantage::MapPasses& map, PointsView,
                                                     const vantage::MapSurvey& survey) const {
    VANTAGE_TRY(const Eigen::Vector2d corner, corner_for(map, survey));
    VANTAGE_TRY(const auto raster,
                vantage::PlanRaster::over(map.bounds(), {cell_width, "cell_width"}, corner));
    VANTAGE_TRY(const auto cells, vantage::occupied_cells(map, raster));
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

 private:
  /// The lower left corner of cell (0, 0).
  [[nodiscard]] Result<Eigen::Vector2d> corner_for(const vantage::MapPasses& map,
                                                   const vantage::MapSurvey& survey) const {
    if (!from_ground) return origin.value_or(map.bounds().min.head<2>());
    auto ground = survey.ground_bounds();
    if (ground) return ground->min.head<2>();
    return vantage::fail(
        ground.error().code,
        ground.error().message + ": give the origin as [x, y] instead of \"ground\"");
  }
};

}  // namespace

// What a schema does not say: `origin` is a word or numbers.
namespace vantage {

template <>
Result<UniformGrid> parse<UniformGrid>(const Table& table) {
  const Value* const origin = table.find("origin");
  const auto* const word = origin == nullptr ? nullptr : std::get_if<std::string>(&origin->data);
  Table keys = table;
  if (word != nullptr) {
    if (*word != kGround) return detail::wrong_choice(*origin, "origin", {kGround});
    std::erase_if(keys.entries, [](const Entry& entry) { return entry.key == "origin"; });
  }
  VANTAGE_TRY(const Keys numbers, parse<Keys>(keys));
  return UniformGrid{numbers, word != nullptr};
}

template <>
Table to_table<UniformGrid>(const UniformGrid& grid) {
  Table table = to_table<Keys>(grid);
  if (grid.from_ground) table.entries.push_back({"origin", {std::string(kGround), {}}, {}});
  return table;
}

template <>
std::vector<ParameterDoc> describe<UniformGrid>() {
  std::vector<ParameterDoc> docs = describe<Keys>();
  docs.back().type += " or choice";
  docs.back().choices = {kGround};
  return docs;
}

}  // namespace vantage

VANTAGE_PLUGIN(vantage::Partitioner, vantage::PartitionerOf<UniformGrid>, "uniform_grid",
               "square cells of one width (Eqs. 2-3)");
