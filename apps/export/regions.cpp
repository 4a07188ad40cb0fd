#include "export/regions.hpp"

#include <string>
#include <utility>
#include <vector>

#include "export/sidecar.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/kit/max_views_of.hpp"

namespace vantage::exporting {
namespace {

namespace fs = std::filesystem;

const char* name_of(CloudFormat format) {
  switch (format) {
    case CloudFormat::pcd: return "pcd";
    case CloudFormat::ply: return "ply";
    case CloudFormat::las: return "las";
  }
  return "";
}

Result<void> write(const fs::path& path, CloudFormat format, const RegionMap& map) {
  const io::Precision precision = io::lossless_precision(map.points);
  switch (format) {
    case CloudFormat::pcd: return io::write_pcd(path, map.points, precision, map.views);
    case CloudFormat::ply: return io::write_ply(path, map.points, precision, map.views);
    case CloudFormat::las: return io::write_las(path, map.points, map.views);
  }
  return fail(ErrorCode::internal, "unknown format");
}

}  // namespace

Result<RegionsReport> export_regions(const Bundle& bundle, CloudFormat format, const fs::path& out,
                                     io::OutputFolder::Existing existing,
                                     const Bundle::Progress& progress) {
  VANTAGE_TRY(auto folder, io::OutputFolder::create(kind_of_export(), out, existing));
  RegionsReport report;
  report.regions_without_points = bundle.regions_without_points();
  std::vector<std::string> files;
  nlohmann::ordered_json regions = nlohmann::ordered_json::array();
  const auto take = [&](RegionId region, const RegionMap& map) -> Result<void> {
    VANTAGE_TRY(const DirectoryEntry entry, bundle.directory()->entry(region));
    const std::string& label = entry.region.label;
    files.push_back(label + "." + name_of(format));
    VANTAGE_CHECK(write(folder.path() / files.back(), format, map));
    VANTAGE_TRY(const std::uint32_t max_views, max_views_of(map));
    report.has_views = report.has_views || max_views > 0;
    report.points += map.points.size();
    nlohmann::ordered_json viewpoints = nlohmann::ordered_json::array();
    for (const Point& p : map.viewpoints) viewpoints.push_back({p.x(), p.y(), p.z()});
    regions.push_back({{"label", label},
                       {"file", files.back()},
                       {"points", map.points.size()},
                       {"max_views", max_views},
                       {"viewpoints", std::move(viewpoints)}});
    return {};
  };
  VANTAGE_CHECK(bundle.for_each_region(take, progress));
  report.files = files.size();
  VANTAGE_CHECK(write_sidecar(folder.path(),
                              {{"format", name_of(format)},
                               {"points", report.points},
                               {"regions_without_points", report.regions_without_points},
                               {"regions", std::move(regions)}},
                              files, bundle.directory()->summary()));
  VANTAGE_CHECK(folder.commit());
  return report;
}

}  // namespace vantage::exporting
