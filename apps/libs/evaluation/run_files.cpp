#include "vantage/evaluation/run_files.hpp"

#include <fmt/format.h>

#include <array>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "evaluation/json.hpp"
#include "vantage/evaluation/metrics.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

/// Quotes a text by RFC 4180.
std::string quoted(const std::string& text) {
  std::string cell = "\"";
  for (const char c : text) {
    if (c == '"') cell += '"';
    cell += c;
  }
  return cell + '"';
}

std::string cell(const Metric& metric, const RunScan& scan) {
  const std::optional<double> x = metric.value(scan);
  if (!x) return {};
  const int digits = metric.unit->digits_in_files;
  return digits < 0 ? fmt::format("{}", *x) : fmt::format("{:.{}f}", *x, digits);
}

std::string cells(const std::optional<Pose>& T) {
  if (!T) return std::string(6, ',');
  const auto& [q, t] = *T;
  return fmt::format("{},{},{},{},{},{},{}", t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

/// The upper triangle of the pose's covariance, row by row.
std::string cells_of_covariance(const RunScan& scan) {
  const auto& confidence = scan.report.confidence;
  if (!confidence) return std::string(20, ',');
  std::string cells;
  for (Eigen::Index row = 0; row < 6; ++row) {
    for (Eigen::Index column = row; column < 6; ++column) {
      if (!cells.empty()) cells += ',';
      fmt::format_to(std::back_inserter(cells), "{:.6g}", confidence->covariance(row, column));
    }
  }
  return cells;
}

/// Columns that are no metric.
struct TextColumns {
  std::string_view before;  ///< the metric that follows them; empty: they are the last
  std::string_view names;
  std::string (*cells)(const RunScan&, double way);
};
constexpr std::array kTextColumns{
    TextColumns{"recovered", "stamp,tracking",
                [](const RunScan& scan, double) {
                  return fmt::format("{:.9f},{}", scan.report.stamp,
                                     to_string(scan.report.tracking));
                }},
    TextColumns{"switched", "region", [](const RunScan& scan, double) { return scan.region; }},
    TextColumns{"fitness", "termination",
                [](const RunScan& scan, double) {
                  const auto& a = scan.report.alignment;
                  return std::string(a ? to_string(a->termination) : "");
                }},
    TextColumns{"error_m",
                "x,y,z,qx,qy,qz,qw,cov_x_x,cov_x_y,cov_x_z,cov_x_rx,cov_x_ry,cov_x_rz,cov_y_y,"
                "cov_y_z,cov_y_rx,cov_y_ry,cov_y_rz,cov_z_z,cov_z_rx,cov_z_ry,cov_z_rz,cov_rx_rx,"
                "cov_rx_ry,cov_rx_rz,cov_ry_ry,cov_ry_rz,cov_rz_rz",
                [](const RunScan& scan, double) {
                  const ScanReport& r = scan.report;
                  return cells(r.has_pose ? std::optional(r.T_map_scan) : std::nullopt) + ',' +
                         cells_of_covariance(scan);
                }},
    TextColumns{"held_bytes", "distance_m,ref_x,ref_y,ref_z,ref_qx,ref_qy,ref_qz,ref_qw",
                [](const RunScan& scan, double way) {
                  return fmt::format("{:.4f},{}", way, cells(scan.reference));
                }},
    TextColumns{"", "reason",
                [](const RunScan& scan, double) { return quoted(scan.report.reason); }}};

/// Calls `text` and `metric` for every column of scans.csv in their order.
template <class Text, class Number>
void for_each_column(const Text& text, const Number& number) {
  for (const Metric& metric : metrics()) {
    if (metric.is(kNotInFiles)) continue;
    for (const TextColumns& columns : kTextColumns) {
      if (columns.before == metric.key) text(columns);
    }
    number(metric);
  }
  text(kTextColumns.back());
}

/// Cells with commas between them.
class Line {
 public:
  void add(std::string_view cells) {
    if (!text_.empty()) text_ += ',';
    text_ += cells;
  }
  [[nodiscard]] std::string take() && { return std::move(text_) + '\n'; }

 private:
  std::string text_;
};

}  // namespace

std::string csv_header() {
  Line header;
  for_each_column([&](const TextColumns& columns) { header.add(columns.names); },
                  [&](const Metric& metric) { header.add(metric.key); });
  return std::move(header).take();
}

std::string csv_line(const RunScan& scan, double way) {
  Line line;
  for_each_column([&](const TextColumns& columns) { line.add(columns.cells(scan, way)); },
                  [&](const Metric& metric) { line.add(cell(metric, scan)); });
  return std::move(line).take();
}

Result<RunWriter> RunWriter::create(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) {
    return fail(ErrorCode::io_failure, "cannot create the output folder: " + error.message(),
                SourceLocation{folder.string(), 0, 0});
  }
  VANTAGE_TRY(auto scans, io::OutputFile::create(folder / "scans.csv"));
  VANTAGE_TRY(auto trajectory, io::OutputFile::create(folder / "trajectory.tum"));
  VANTAGE_CHECK(scans.write(csv_header()));
  return RunWriter(folder, std::move(scans), std::move(trajectory));
}

Result<void> RunWriter::add(const RunScan& scan) {
  VANTAGE_CHECK(scans_.write(csv_line(scan, odometer_(scan))));
  if (!is_tracked(scan)) return {};
  VANTAGE_TRY(const std::string pose, io::to_tum(folder_ / "trajectory.tum",
                                                 {{scan.report.stamp, scan.report.T_map_scan}}));
  return trajectory_.write(pose);
}

Result<void> RunWriter::commit(const RunInfo& run, const RunSummary& summary) {
  VANTAGE_TRY(auto file, io::OutputFile::create(folder_ / "summary.json"));
  VANTAGE_CHECK(file.write(json_text(to_json(run, summary))));
  // Every file is on the disk under a temporary name before the first gets its own, so that a full
  // disk leaves all of them as they were.
  for (io::OutputFile* one : {&scans_, &file, &trajectory_}) VANTAGE_CHECK(one->finish());
  for (io::OutputFile* one : {&scans_, &file, &trajectory_}) VANTAGE_CHECK(one->commit());
  return {};
}

Result<void> write_run(const Run& run, const RunSummary& summary,
                       const std::filesystem::path& folder) {
  VANTAGE_TRY(RunWriter writer, RunWriter::create(folder));
  for (const RunScan& scan : run.scans) VANTAGE_CHECK(writer.add(scan));
  return writer.commit(run, summary);
}

}  // namespace vantage
