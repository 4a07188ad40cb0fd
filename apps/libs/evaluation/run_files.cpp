#include "vantage/evaluation/run_files.hpp"

#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "evaluation/json.hpp"
#include "vantage/evaluation/metrics.hpp"
#include "vantage/io/trajectory_io.hpp"
#include "vantage/kit/atomic_file.hpp"

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

/// Columns that are no metric.
struct TextColumns {
  std::string_view before;  ///< the metric that follows them; empty: they are the last
  std::string_view names;
  std::string (*cells)(const Run&, const RunScan&, double way);
};
constexpr std::array kTextColumns{
    TextColumns{"recovered", "stamp,tracking",
                [](const Run&, const RunScan& scan, double) {
                  return fmt::format("{:.9f},{}", scan.report.stamp,
                                     to_string(scan.report.tracking));
                }},
    TextColumns{"switched", "region",
                [](const Run&, const RunScan& scan, double) { return scan.region; }},
    TextColumns{"fitness", "termination",
                [](const Run&, const RunScan& scan, double) {
                  const auto& a = scan.report.alignment;
                  return std::string(a ? to_string(a->termination) : "");
                }},
    TextColumns{"error_m", "x,y,z,qx,qy,qz,qw",
                [](const Run&, const RunScan& scan, double) {
                  const ScanReport& r = scan.report;
                  return cells(r.has_pose ? std::optional(r.T_map_scan) : std::nullopt);
                }},
    TextColumns{"held_bytes", "distance_m,ref_x,ref_y,ref_z,ref_qx,ref_qy,ref_qz,ref_qw",
                [](const Run&, const RunScan& scan, double way) {
                  return fmt::format("{:.4f},{}", way, cells(scan.reference));
                }},
    TextColumns{"", "reason", [](const Run&, const RunScan& scan, double) {
                  return quoted(scan.report.reason);
                }}};

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

struct File {
  fs::path path;
  std::string content;
};

/// Every file is on the disk under a temporary name before the first gets its own, so that a full
/// disk leaves all of them as they were.
Result<void> write_together(const std::vector<File>& files) {
  std::vector<io::OutputFile> open;
  for (const File& file : files) {
    VANTAGE_TRY(io::OutputFile made, io::OutputFile::create(file.path));
    open.push_back(std::move(made));
    VANTAGE_CHECK(open.back().write(file.content));
    VANTAGE_CHECK(open.back().finish());
  }
  for (io::OutputFile& file : open) VANTAGE_CHECK(file.commit());
  return {};
}

}  // namespace

std::string to_csv(const Run& run) {
  Line header;
  for_each_column([&](const TextColumns& columns) { header.add(columns.names); },
                  [&](const Metric& metric) { header.add(metric.key); });
  std::string csv = std::move(header).take();
  const std::vector<double> way = distances(run);
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const RunScan& scan = run.scans[i];
    Line line;
    for_each_column([&](const TextColumns& columns) { line.add(columns.cells(run, scan, way[i])); },
                    [&](const Metric& metric) { line.add(cell(metric, scan)); });
    csv += std::move(line).take();
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
  const fs::path trajectory = folder / "trajectory.tum";
  VANTAGE_TRY(std::string poses, io::to_tum(trajectory, trajectory_of(run)));
  return write_together({{folder / "scans.csv", to_csv(run)},
                         {folder / "summary.json", to_json(run, summary).dump(2) + "\n"},
                         {trajectory, std::move(poses)}});
}

}  // namespace vantage
