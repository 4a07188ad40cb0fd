#include "localize/run_page.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <fstream>
#include <utility>

#include "localize/run_parts.hpp"
#include "report/html.hpp"
#include "terminal/counts.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage {
namespace {

using namespace run_page;  // NOLINT(google-build-using-namespace)

/// The memory of this process that is resident [bytes]; none where the system does not say.
double resident_bytes() {
  std::ifstream status("/proc/self/statm");
  double pages = kNone;
  status >> pages >> pages;
  return status ? pages * static_cast<double>(sysconf(_SC_PAGESIZE)) : kNone;
}

/// A reason without its numbers, so that equal ones can be counted.
std::string kind_of(const std::string& reason) {
  std::string kind;
  bool number = false;
  for (std::size_t i = 0; i < reason.size(); ++i) {
    const bool digit = reason[i] >= '0' && reason[i] <= '9';
    number = digit || (number && reason[i] == '.' && i + 1 < reason.size() && reason[i + 1] != ' ');
    if (!number) {
      kind += reason[i];
    } else if (!kind.ends_with("…")) {
      kind += "…";
    }
  }
  return kind;
}

}  // namespace

RunPage::RunPage(const std::filesystem::path& folder) : values_(kPlaces + kDrawn.size(), folder) {}

Result<void> RunPage::add(const RunScan& scan) {
  constexpr std::size_t kMostReasons = 64;
  const ScanReport& r = scan.report;
  if (!first_stamp_) first_stamp_ = r.stamp;
  const auto& at = r.T_map_scan.translation;
  const std::array<double, kPlaces> places{
      r.stamp - *first_stamp_,         odometer_(scan),
      r.has_pose ? at.x() : kNone,     r.has_pose ? at.y() : kNone,
      static_cast<double>(r.tracking), static_cast<double>(r.region.value),
      r.switched ? 1.0 : 0.0,          resident_bytes()};
  for (std::size_t place = 0; place < kPlaces; ++place) {
    VANTAGE_CHECK(values_.push(place, places[place]));
  }
  for (const std::string_view key : kDrawn) {
    const Metric& metric = *find_metric(key);
    const auto x = metric.value(scan);
    VANTAGE_CHECK(values_.push(column_of(key), x ? metric.unit->scale * *x : kNone));
  }
  if (r.reason.empty()) return {};
  const std::string reason = fmt::format("{}: {}", to_string(r.tracking), kind_of(r.reason));
  if (reasons_.size() < kMostReasons || reasons_.contains(reason)) ++reasons_[reason];
  return {};
}

Result<std::string> RunPage::html(const RunFacts& facts) const {
  const ColumnReader read = [&](std::size_t column) { return values_.read(column); };
  Scans scans;
  VANTAGE_TRY(scans.time, read(kTime));
  VANTAGE_TRY(scans.way, read(kWay));
  VANTAGE_TRY(scans.tracking, read(kTracking));
  VANTAGE_TRY(std::string driven, drive(facts, scans, read));
  VANTAGE_TRY(std::string risks, risk_over_time(facts, scans, read));
  VANTAGE_TRY(std::string fits, fit_over_time(scans, read));
  VANTAGE_TRY(std::string stalls, times(facts, scans, read));
  VANTAGE_TRY(std::string bytes, memory(scans, read));
  return to_html(report::Page{
      .title = "A run in region maps",
      .subtitle = fmt::format("{}, {} in {}", facts.run.config, cli::counted(scans.size(), "scan"),
                              cli::counted(facts.run.regions, "region")),
      .sections = {{"verdict", "Verdict", verdict(facts, scans, reasons_)},
                   {"drive", "Drive", std::move(driven)},
                   {"risk", "Risk", std::move(risks)},
                   {"fit", "Fit", std::move(fits)},
                   {"times", "Stalls and times", std::move(stalls)},
                   {"memory", "Memory", std::move(bytes)}}});
}

}  // namespace vantage
