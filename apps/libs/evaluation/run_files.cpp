#include "vantage/evaluation/run_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "evaluation/json.hpp"
#include "vantage/kit/atomic_file.hpp"

namespace vantage {
namespace {

constexpr double kDegrees = 180.0 / M_PI;

/// Quotes a text by RFC 4180.
std::string quoted(const std::string& text) {
  std::string cell = "\"";
  for (const char c : text) {
    if (c == '"') cell += '"';
    cell += c;
  }
  return cell + '"';
}

std::string cell(const std::optional<double>& x) { return x ? fmt::format("{}", *x) : ""; }

}  // namespace

std::string to_csv(const Run& run) {
  std::string csv =
      "stamp,tracking,recovered,region,switched,outside,blocked,N_point,N_scan,N_dropped,T_align_"
      "ms,"
      "stall_ms,search_ms,T_load_ms,T_prepare_ms,iterations,termination,fitness,NVTL,coverage,LCP,"
      "sigma_m,sigma_deg,degenerate,correction_m,x,y,z,qx,qy,qz,qw,error_m,error_deg,"
      "distance_m,ref_x,ref_y,ref_z,ref_qx,ref_qy,ref_qz,ref_qw,held_bytes,reason\n";
  const std::vector<double> way = distances(run);
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const RunScan& scan = run.scans[i];
    const ScanReport& r = scan.report;
    const auto& a = r.alignment;
    const auto score = [&](double ScanScore::*member) {
      return cell(a ? std::optional(a->score.*member) : std::nullopt);
    };
    const auto pose = [](const std::optional<Pose>& T) {
      if (!T) return std::string(6, ',');
      const auto& [q, t] = *T;
      return fmt::format("{},{},{},{},{},{},{}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
    };
    csv += fmt::format("{:.9f},{},{:d},{},{:d},{:d},{:d},{},{},{},", r.stamp, to_string(r.tracking),
                       r.recovered, run.index.partition[r.region].label, r.switched, r.outside,
                       r.blocked, r.map_points, r.scan_points,
                       r.dropped_points + scan.dropped_by_reader);
    csv += fmt::format("{:.4f},{:.4f},{:.4f},{:.4f},{:.4f},{},{},{},{},{},{},",
                       1e3 * r.seconds_align, 1e3 * r.seconds_stall, 1e3 * r.seconds_search,
                       1e3 * r.seconds_load, 1e3 * r.seconds_prepare,
                       a ? std::to_string(a->iterations) : "", a ? to_string(a->termination) : "",
                       score(&ScanScore::fitness), score(&ScanScore::nvtl),
                       score(&ScanScore::coverage), cell(a ? std::optional(r.lcp) : std::nullopt));
    const auto& c = r.confidence;
    csv += fmt::format(
        "{},{},{},{},", cell(c ? std::optional(c->sigma_translation[0]) : std::nullopt),
        cell(c ? std::optional(c->sigma_rotation[0] * kDegrees) : std::nullopt),
        c ? std::to_string(c->degenerate) : "",
        cell(a && r.has_pose
                 ? std::optional(
                       (a->T_map_scan.translation - r.T_map_scan_predicted.translation).norm())
                 : std::nullopt));
    csv += fmt::format("{},{},{},{:.4f},{},{},{}\n",
                       pose(r.has_pose ? std::optional(r.T_map_scan) : std::nullopt),
                       cell(scan.error ? std::optional(scan.error->metres) : std::nullopt),
                       cell(scan.error ? std::optional(scan.error->degrees) : std::nullopt), way[i],
                       pose(scan.reference), r.held_bytes, quoted(r.reason));
  }
  return csv;
}

Result<void> write_run(const Run& run, const RunSummary& summary,
                       const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) {
    return fail(ErrorCode::io_failure, "cannot create the output folder: " + error.message(),
                SourceLocation{folder.string(), 0, 0});
  }
  // All three are written before the first one appears under its name.
  VANTAGE_TRY(auto csv, io::OutputFile::create(folder / "scans.csv"));
  VANTAGE_CHECK(csv.write(to_csv(run)));
  VANTAGE_TRY(auto json, io::OutputFile::create(folder / "summary.json"));
  VANTAGE_CHECK(json.write(to_json(run, summary).dump(2) + "\n"));
  VANTAGE_CHECK(io::write_tum(folder / "trajectory.tum", trajectory_of(run)));
  VANTAGE_CHECK(csv.commit());
  return json.commit();
}

}  // namespace vantage
