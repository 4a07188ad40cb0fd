#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "clustering.hpp"
#include "vantage/kit/hash.hpp"
#include "vantage/kit/numbers.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/raster_partition.hpp"

namespace {

using Eigen::Vector2d;
using vantage::ErrorCode, vantage::fail, vantage::PointsView, vantage::Result;
namespace clusters = vantage::visibility_clusters;

constexpr std::size_t kNeighbours = 8;  // the number of neighbours of a cell in a square grid

/// A viewpoint is a mean of points, and the last bits of a sum depend on its order: here they are
/// dropped, so that the order of the map's points does not matter.
vantage::Point rounded(const vantage::Point& viewpoint) {
  constexpr double kPerMetre = 0x1p20;
  return viewpoint.unaryExpr([](double x) { return std::nearbyint(x * kPerMetre) / kPerMetre; });
}

/// The viewpoints sorted by y, then x, then z.
Result<vantage::PointCloud> sorted_viewpoints(const vantage::MapSurvey& survey) {
  VANTAGE_TRY(vantage::PointCloud viewpoints, survey.viewpoints());
  if (viewpoints.empty()) {
    return fail(ErrorCode::invalid_input,
                "partitioner 'visibility_clusters' groups viewpoints, but this map has none");
  }
  VANTAGE_CHECK(vantage::check_points(viewpoints, "the set of viewpoints"));
  for (vantage::Point& viewpoint : viewpoints) viewpoint = rounded(viewpoint);
  std::sort(viewpoints.begin(), viewpoints.end(),
            [](const vantage::Point& a, const vantage::Point& b) {
              return std::array{a.y(), a.x(), a.z()} < std::array{b.y(), b.x(), b.z()};
            });
  return viewpoints;
}

/// The number of the voxel of every map point.
Result<std::vector<std::uint32_t>> voxels_of(PointsView map, double size) {
  using Voxel = std::array<double, 3>;
  const vantage::Bounds3 bounds = vantage::bounds_of(map);
  const double farthest =
      std::max(bounds.min.cwiseAbs().maxCoeff(), bounds.max.cwiseAbs().maxCoeff());
  if (!(farthest / size < 0x1p50)) {
    return fail(ErrorCode::invalid_input, "voxel_size = " + vantage::shortest(size) +
                                              " m is too small for a map that lies up to " +
                                              vantage::shortest(farthest) + " m from the origin");
  }
  std::unordered_map<Voxel, std::uint32_t, vantage::CellHash> numbers;
  std::vector<std::uint32_t> voxels;
  voxels.reserve(map.size());
  for (const vantage::Point& p : map) {
    const Voxel voxel{std::floor(p.x() / size), std::floor(p.y() / size), std::floor(p.z() / size)};
    const auto next = static_cast<std::uint32_t>(numbers.size());
    voxels.push_back(numbers.try_emplace(voxel, next).first->second);
  }
  return voxels;
}

/// The voxels that hold a point visible from each viewpoint.
Result<std::vector<clusters::Voxels>> seen_from(const vantage::PointCloud& viewpoints,
                                                const std::vector<std::uint32_t>& voxel_of_point,
                                                const vantage::MapSurvey& survey) {
  std::vector<clusters::Voxels> seen(viewpoints.size());
  std::vector<std::optional<vantage::Error>> errors(viewpoints.size());
  tbb::parallel_for(std::size_t{0}, viewpoints.size(), [&](std::size_t v) {
    const auto points = survey.visible(viewpoints[v]);
    if (!points) {
      errors[v] = points.error();
      return;
    }
    clusters::Voxels voxels;
    for (const std::uint32_t k : *points) {
      if (voxels.empty() || voxels.back() != voxel_of_point[k]) voxels.push_back(voxel_of_point[k]);
    }
    std::sort(voxels.begin(), voxels.end());
    voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
    seen[v] = clusters::Voxels(voxels.begin(), voxels.end());  // copied, so that it uses no more
                                                               // memory than needed
  });
  for (std::optional<vantage::Error>& error : errors) {
    if (error) return fail(std::move(*error));
  }
  return seen;
}

/// Groups of viewpoints that see alike; the nearest viewpoint's group owns a place.
struct VisibilityClusters {
  double min_overlap{};
  double voxel_size = 2.0, cell_size = 2.0;
  std::optional<double> max_width, fill_radius;

  static constexpr auto schema() {
    return std::tuple{
        vantage::required("min_overlap", &VisibilityClusters::min_overlap, "",
                          "groups are joined while the mean Jaccard index between the views of "
                          "their viewpoints is at least this",
                          vantage::strictly_between(0.0, 1.0)),
        vantage::optional("voxel_size", &VisibilityClusters::voxel_size, "m",
                          "width of the voxels in which views are compared", vantage::positive),
        vantage::optional("max_width", &VisibilityClusters::max_width, "m",
                          "the viewpoints of a group extend over at most this in x and in y; no "
                          "limit if left out",
                          vantage::positive),
        vantage::optional("cell_size", &VisibilityClusters::cell_size, "m",
                          "width of the cells that regions are made of", vantage::positive),
        vantage::optional("fill_radius", &VisibilityClusters::fill_radius, "m",
                          "places in the map's box this near to a viewpoint belong to a region "
                          "even without points; two cell_size if left out",
                          vantage::non_negative),
    };
  }

  [[nodiscard]] Result<vantage::Partition> partition(const vantage::MapPasses& map, PointsView,
                                                     const vantage::MapSurvey& survey) const {
    VANTAGE_TRY(const PointsView points, map.in_memory());
    // What the last step will refuse is refused before anything is computed.
    VANTAGE_CHECK(vantage::PlanRaster::over(map.bounds(), cell_size));
    VANTAGE_TRY(const vantage::PointCloud viewpoints, sorted_viewpoints(survey));
    VANTAGE_TRY(const auto voxels, voxels_of(points, voxel_size));
    VANTAGE_TRY(const auto seen, seen_from(viewpoints, voxels, survey));

    std::vector<Vector2d> places;
    for (const vantage::Point& viewpoint : viewpoints) places.emplace_back(viewpoint.head<2>());
    const clusters::GroupLimits limits{
        .min_overlap = min_overlap,
        .max_width = max_width.value_or(std::numeric_limits<double>::infinity())};
    const clusters::Groups found =
        clusters::group(places, seen, clusters::neighbours_of(places, kNeighbours), limits);

    std::vector<vantage::Seed> seeds;
    for (std::size_t v = 0; v < places.size(); ++v) {
      seeds.push_back({places[v], places[v], found.of_viewpoint[v]});
    }
    return vantage::partition_by_nearest(
        map, seeds, vantage::numbered("group_", found.count),
        {.cell_size = cell_size, .fill_radius = fill_radius.value_or(2.0 * cell_size)});
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, vantage::PartitionerOf<VisibilityClusters>,
               "visibility_clusters",
               "groups of viewpoints with similar views; a place belongs to the group of the "
               "nearest viewpoint");
