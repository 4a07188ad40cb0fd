#include "export/autoware.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "export/float_points.hpp"
#include "export/sidecar.hpp"
#include "export/union.hpp"
#include "io/autoware_tiles.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/atomic_file.hpp"

namespace vantage::exporting {
namespace {

namespace fs = std::filesystem;

/// A place below all points: a corner of a tile, in whole metres.
Point origin_below(const Bounds3& bounds, double resolution) {
  if (bounds.empty()) return Point::Zero();
  const auto corner = [&](double c) { return std::floor(c / resolution) * resolution + 0.0; };
  return {corner(bounds.min.x()), corner(bounds.min.y()), std::floor(bounds.min.z()) + 0.0};
}

/// The grid of tiles, counted from the origin.
class Grid {
 public:
  explicit Grid(std::uint32_t resolution) : resolution_(resolution) {}

  /// Column and row.
  [[nodiscard]] Eigen::Vector2d cell(const FloatPoint& p) const {
    return (p.head<2>().cast<double>() / resolution_).array().floor();
  }
  [[nodiscard]] bool less(const FloatPoint& a, const FloatPoint& b) const {
    const Eigen::Vector2d cell_a = cell(a), cell_b = cell(b);
    return std::tuple(cell_a.x(), cell_a.y(), a.x(), a.y(), a.z()) <
           std::tuple(cell_b.x(), cell_b.y(), b.x(), b.y(), b.z());
  }
  /// Its lower-left corner. Precondition: it fits 64 bits.
  [[nodiscard]] io::AutowareTile tile(const Eigen::Vector2d& cell,
                                      const std::string& prefix) const {
    io::AutowareTile tile;
    tile.x = static_cast<std::int64_t>(cell.x() * resolution_);
    tile.y = static_cast<std::int64_t>(cell.y() * resolution_);
    tile.file = fmt::format("{}_{}_{}.pcd", prefix, tile.x, tile.y);
    return tile;
  }

 private:
  double resolution_;
};

Result<io::AutowareTiles> write_tiles(const fs::path& folder, std::span<const FloatPoint> points,
                                      const AutowareOptions& options) {
  const Grid grid(options.resolution);
  io::AutowareTiles written{.x_resolution = static_cast<double>(options.resolution),
                            .y_resolution = static_cast<double>(options.resolution),
                            .tiles = {}};
  for (std::size_t first = 0; first < points.size();) {
    const Eigen::Vector2d cell = grid.cell(points[first]);
    std::size_t end = first + 1;
    while (end < points.size() && grid.cell(points[end]) == cell) ++end;
    const io::AutowareTile tile = grid.tile(cell, options.prefix);
    PointCloud cloud;
    for (const FloatPoint& p : points.subspan(first, end - first))
      cloud.push_back(p.cast<double>());
    VANTAGE_CHECK(io::write_pcd(folder / tile.file, cloud, io::Precision::float32));
    written.tiles.push_back(tile);
    first = end;
  }
  return written;
}

Result<void> check_reach(const Bundle& bundle, std::span<const FloatPoint> points) {
  constexpr float kReach = 1e9F;  // [m]; a tile's corner is a whole number
  for (const FloatPoint& p : points) {
    const float reach = p.cwiseAbs().maxCoeff();
    if (reach <= kReach) continue;
    return fail(ErrorCode::invalid_input,
                fmt::format("a coordinate of {} m, expected {} m at most", reach, kReach),
                SourceLocation{bundle.name(), 0, 0});
  }
  return {};
}

Result<void> write_metadata(const fs::path& folder, const io::AutowareTiles& tiles,
                            const AutowareReport& report, const Bundle& bundle) {
  VANTAGE_CHECK(io::write_text_atomically(folder / io::kAutowareMetadata, io::to_yaml(tiles)));
  std::vector<std::string> files{io::kAutowareMetadata};
  for (const io::AutowareTile& tile : tiles.tiles) {
    files.push_back(fmt::format("{}/{}", io::kAutowareFolder, tile.file));
  }
  return write_sidecar(folder,
                       {{"format", "autoware"},
                        {"origin", {report.origin.x(), report.origin.y(), report.origin.z()}},
                        {"resolution", tiles.x_resolution},
                        {"points", report.points},
                        {"repeated_points", report.repeated},
                        {"largest_rounding", report.rounding},
                        {"regions_without_points", report.regions_without_points}},
                       files, bundle.directory()->summary());
}

}  // namespace

Result<AutowareReport> export_autoware(const Bundle& bundle, const AutowareOptions& options,
                                       const fs::path& out, io::OutputFolder::Existing existing,
                                       const Bundle::Progress& progress) {
  VANTAGE_TRY(auto folder, io::OutputFolder::create(kind_of_export(), out, existing));
  UnionOfMaps all;
  VANTAGE_CHECK(bundle.for_each_region(
      [&](RegionId, const RegionMap& map) {
        all.add(map);
        return Result<void>{};
      },
      progress));
  AutowareReport report;
  report.repeated = all.repeated();
  report.regions_without_points = bundle.regions_without_points();
  report.points = all.points().size();
  report.origin =
      options.origin ? *options.origin : origin_below(bounds_of(all.points()), options.resolution);
  std::vector<FloatPoint> points = rounded(all.points(), report.origin);
  VANTAGE_TRY(report.rounding,
              rounding_of(all.points(), report.origin, points, "Autoware's tiles", bundle.name()));
  VANTAGE_CHECK(check_reach(bundle, points));
  const Grid grid(options.resolution);
  std::sort(points.begin(), points.end(),
            [&](const FloatPoint& a, const FloatPoint& b) { return grid.less(a, b); });

  const fs::path tiles_folder = folder.path() / io::kAutowareFolder;
  std::error_code error;
  if (!fs::create_directory(tiles_folder, error)) {
    return fail(ErrorCode::io_failure,
                fmt::format("the folder cannot be created ({})", error.message()),
                SourceLocation{tiles_folder.string(), 0, 0});
  }
  VANTAGE_TRY(const auto tiles, write_tiles(tiles_folder, points, options));
  report.tiles = tiles.tiles.size();
  VANTAGE_CHECK(write_metadata(folder.path(), tiles, report, bundle));
  VANTAGE_CHECK(folder.commit());
  return report;
}

}  // namespace vantage::exporting
