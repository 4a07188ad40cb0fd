#include "export/grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "export/float_points.hpp"
#include "export/sidecar.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/numbers.hpp"

namespace vantage::exporting {
namespace {

constexpr const char* kMetaData = "grid_meta_data.yaml";
constexpr const char* kMetaDataAttachment = "grid_meta_data";  // of the store grid_pcd

/// Square cells of one width that touch.
struct CellGrid {
  double size = 0.0;  // [m]
  Eigen::Vector2d min = Eigen::Vector2d::Zero();
  Eigen::Vector2d last = Eigen::Vector2d::Zero();  // lower corner of the last cell, per axis

  /// Column and row, not rounded.
  [[nodiscard]] Eigen::Array2d index(const HalfOpenBox& box) const {
    return (box.min - min).array() / size;
  }
  [[nodiscard]] std::string file_of(const HalfOpenBox& box) const {
    const Eigen::Array2d at = index(box).round();
    return fmt::format("grid_{:.0f}_{:.0f}.pcd", at.x() + 0.0, at.y() + 0.0);
  }
};

/// What numbers between 0 and `box` may be off by: edges are rounded once, widths twice.
double rounding_at(const HalfOpenBox& box) {
  const double largest = std::max(box.min.cwiseAbs().maxCoeff(), box.max.cwiseAbs().maxCoeff());
  return 16.0 * std::numeric_limits<double>::epsilon() * largest;
}

tl::unexpected<Error> no_grid(const Bundle& bundle, const std::string& label,
                              const std::string& why) {
  return fail(ErrorCode::invalid_input,
              fmt::format("region '{}' {}, but this format knows square cells of one width only: "
                          "build the bundle with the partitioner uniform_grid",
                          label, why),
              SourceLocation{bundle.name(), 0, 0});
}

/// The shortest number that is the width of all cells.
double size_of(const std::vector<HalfOpenBox>& cells, const Eigen::Vector2d& min) {
  const double width = cells.front().max.x() - cells.front().min.x();
  for (int digits = 1; digits < 17; ++digits) {
    const double size = std::strtod(fmt::format("{:.{}g}", width, digits).c_str(), nullptr);
    const bool fits = std::ranges::all_of(cells, [&](const HalfOpenBox& cell) {
      const Eigen::Array2d steps = ((cell.max - min).array() / width).round();
      return ((min.array() + steps * size) - cell.max.array()).abs().maxCoeff() <=
             rounding_at(cell);
    });
    if (fits) return size;
  }
  return width;
}

/// The grid of the regions that have points.
Result<CellGrid> grid_of(const Bundle& bundle) {
  const RegionDirectory& directory = *bundle.directory();
  CellGrid grid;
  std::vector<HalfOpenBox> cells;
  std::vector<std::string> labels;
  for (std::uint32_t r = 0; r < directory.summary().regions; ++r) {
    VANTAGE_TRY(const DirectoryEntry entry, directory.entry(RegionId{r}));
    if (entry.summary.points == 0) continue;
    const auto* const box = std::get_if<HalfOpenBox>(&entry.region.footprint);
    if (box == nullptr) return no_grid(bundle, entry.region.label, "is not one rectangle");
    if (entry.region.height != HeightInterval{}) {
      return no_grid(bundle, entry.region.label, "is bounded in height");
    }
    cells.push_back(*box);
    labels.push_back(entry.region.label);
  }
  grid.min = grid.last = cells.front().min;
  for (const HalfOpenBox& cell : cells) {
    grid.min = grid.min.cwiseMin(cell.min);
    grid.last = grid.last.cwiseMax(cell.min);
  }
  grid.size = size_of(cells, grid.min);
  for (std::size_t k = 0; k < cells.size(); ++k) {
    const HalfOpenBox& cell = cells[k];
    const double rounding = rounding_at(cell);
    const Eigen::Array2d at = grid.index(cell).round(), size = (cell.max - cell.min).array();
    if (!((size - grid.size).abs() <= rounding).all()) {
      return no_grid(
          bundle, labels[k],
          fmt::format("is {} x {} m and not a square of {} m", size.x(), size.y(), grid.size));
    }
    const Eigen::Array2d corner = grid.min.array() + at * grid.size;
    if (!((corner - cell.min.array()).abs() <= rounding).all()) {
      return no_grid(bundle, labels[k], fmt::format("does not lie on a grid of {} m", grid.size));
    }
  }
  return grid;
}

/// The text of the meta data, in the form of the authors' program.
std::string meta_data(const CellGrid& grid, const Point& origin, const Bounds3& viewpoints) {
  const Eigen::Vector2d shift = origin.head<2>();
  Eigen::Vector2d max = viewpoints.max.head<2>();
  for (const Eigen::Index axis : {0, 1}) {
    if (max[axis] >= grid.last[axis] && max[axis] <= grid.last[axis] + grid.size) continue;
    max[axis] = grid.last[axis] + grid.size / 2.0;  // of no use: at least the last cell is meant
  }
  const Eigen::Vector2d from = grid.min - shift, to = max - shift;
  return fmt::format("grid_size: {}\nmin_pt:\n  x: {}\n  y: {}\nmax_pt:\n  x: {}\n  y: {}\n",
                     shortest(grid.size), shortest(from.x()), shortest(from.y()), shortest(to.x()),
                     shortest(to.y()));
}

/// The meta data of a bundle that is a folder of the authors' program; empty for any other bundle.
Result<std::string> kept_meta_data(const Bundle& bundle) {
  VANTAGE_TRY(const auto kept, bundle.attachment(kMetaDataAttachment));
  if (!kept) return std::string();
  return std::string(reinterpret_cast<const char*>(kept->data()), kept->size());
}

/// The file of a region of such a folder, which is named as its file.
Result<std::string> kept_file(const Bundle& bundle, const std::string& label) {
  constexpr std::string_view kPrefix = "grid_";
  if (label.starts_with(kPrefix) &&
      label.find_first_not_of("0123456789_", kPrefix.size()) == std::string::npos) {
    return label + ".pcd";
  }
  return fail(ErrorCode::corrupt_data, "region '" + label + "' is not named grid_<i>_<j>",
              SourceLocation{bundle.name(), 0, 0});
}

Point whole_metres_below(const Bounds3& bounds) {
  if (bounds.empty()) return Point::Zero();
  return bounds.min.array().floor() + 0.0;
}

}  // namespace

Result<GridReport> export_grid(const Bundle& bundle, const std::optional<Point>& origin,
                               const std::filesystem::path& out,
                               io::OutputFolder::Existing existing,
                               const Bundle::Progress& progress) {
  GridReport report;
  report.origin = origin ? *origin : whole_metres_below(bundle.directory()->summary().map_bounds);
  report.regions_without_points = bundle.regions_without_points();
  VANTAGE_TRY(std::string text, kept_meta_data(bundle));
  const bool kept = !text.empty() && report.origin.isZero(0.0);
  CellGrid grid;
  if (!kept) {
    VANTAGE_TRY(grid, grid_of(bundle));
  }
  VANTAGE_TRY(auto folder, io::OutputFolder::create(kind_of_export(), out, existing));
  std::vector<std::string> files;
  Bounds3 viewpoints;
  const auto take = [&](RegionId region, const RegionMap& map) -> Result<void> {
    VANTAGE_TRY(const DirectoryEntry entry, bundle.directory()->entry(region));
    std::string file;
    if (kept) {
      VANTAGE_TRY(file, kept_file(bundle, entry.region.label));
    } else {
      file = grid.file_of(std::get<HalfOpenBox>(entry.region.footprint));
    }
    const std::vector<FloatPoint> points = rounded(map.points, report.origin);
    VANTAGE_TRY(const double rounding,
                rounding_of(map.points, report.origin, points, "these files", bundle.name()));
    report.rounding = std::max(report.rounding, rounding);
    PointCloud cloud;
    cloud.reserve(points.size());
    for (const FloatPoint& p : points) cloud.push_back(p.cast<double>());
    VANTAGE_CHECK(io::write_pcd(folder.path() / file, cloud, io::Precision::float32));
    report.points += cloud.size();
    for (const Point& p : map.viewpoints) viewpoints.extend(p);
    files.push_back(std::move(file));
    return {};
  };
  VANTAGE_CHECK(bundle.for_each_region(take, progress));
  report.files = files.size();
  if (!kept) text = meta_data(grid, report.origin, viewpoints);
  VANTAGE_CHECK(io::write_text_atomically(folder.path() / kMetaData, text));
  files.emplace_back(kMetaData);
  VANTAGE_CHECK(
      write_sidecar(folder.path(),
                    {{"format", "grid"},
                     {"origin", {report.origin.x(), report.origin.y(), report.origin.z()}},
                     {"points", report.points},
                     {"largest_rounding", report.rounding},
                     {"regions_without_points", report.regions_without_points}},
                    files, bundle.directory()->summary()));
  VANTAGE_CHECK(folder.commit());
  return report;
}

}  // namespace vantage::exporting
