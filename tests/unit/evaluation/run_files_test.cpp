#include "vantage/evaluation/run_files.hpp"

#include <doctest/doctest.h>
#include <sys/resource.h>

#include <csignal>
#include <optional>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/evaluation/scan_table.hpp"
#include "vantage/io/trajectory_io.hpp"

using namespace vantage;

namespace {

Run run_of(std::size_t scans) {
  Run run;
  for (std::size_t i = 0; i < scans; ++i) {
    RunScan scan;
    scan.report.stamp = static_cast<double>(i);
    scan.region = "all";
    scan.report.tracking = Tracking::tracked;
    run.scans.push_back(scan);
  }
  return run;
}

std::string csv_of(const Run& run) {
  std::string csv = csv_header();
  Odometer odometer;
  for (const RunScan& scan : run.scans) csv += csv_line(scan, odometer(scan));
  return csv;
}

/// No file may grow beyond so many bytes, as `ulimit -f` says.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) : handler_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &before_);
    rlimit limit = before_;
    limit.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*handler_)(int);
};

}  // namespace

TEST_CASE("a run that cannot be written leaves the files of the one before, all three of them") {
  const test::TemporaryFolder folder;
  const Run before = run_of(2), after = run_of(100);
  REQUIRE(write_run(before, summarize(before), folder.path()));
  const auto content = [&](const char* file) { return test::read_text(folder.path() / file); };
  const std::string trajectory = content("trajectory.tum"), scans = content("scans.csv"),
                    summary = content("summary.json");
  const std::string longer = csv_of(after);
  const std::size_t room = content("scans.csv").size() + 4000;
  REQUIRE(longer.size() > room);  // and the trajectory is smaller
  {
    const FileSizeLimit limit(room);
    CHECK_FALSE(write_run(after, summarize(after), folder.path()));
  }
  CHECK(content("trajectory.tum") == trajectory);
  CHECK(content("scans.csv") == scans);
  CHECK(content("summary.json") == summary);
  CHECK(std::distance(std::filesystem::directory_iterator(folder.path()), {}) == 3);
  REQUIRE(write_run(after, summarize(after), folder.path()));
  CHECK(content("scans.csv") == longer);
}

TEST_CASE("the alert limit of a run is kept in its folder; a run without one has the default") {
  const test::TemporaryFolder folder;
  Run run = run_of(1);
  run.alert_limit = {.metres = 0.2, .degrees = 1.5};
  REQUIRE(write_run(run, summarize(run), folder.path()));
  for (const auto& path : {folder.path(), folder.path() / "scans.csv"}) {
    const auto table = read_scans(path);
    REQUIRE_MESSAGE(table, to_string(table.error()));
    CHECK(table->alert_limit.metres == 0.2);
    CHECK(table->alert_limit.degrees == 1.5);
  }
  const auto summary = folder.path() / "summary.json";
  const auto limit_of = [&](const char* text) {
    test::write_text(summary, text);
    return read_scans(folder.path());
  };
  const auto without = limit_of("{\"scans\": {}}");
  REQUIRE_MESSAGE(without, to_string(without.error()));
  CHECK(without->alert_limit.metres == 0.5);
  CHECK(without->alert_limit.degrees == 3.0);
  for (const char* text : {"[]", "{", "{\"alert_limit\": 1}", "{\"alert_limit\": {\"m\": 1}}",
                           "{\"alert_limit\": {\"m\": 0, \"deg\": 3}}"}) {
    CAPTURE(text);
    const auto wrong = limit_of(text);
    REQUIRE_FALSE(wrong);
    CHECK(wrong.error().code == ErrorCode::corrupt_data);
    CHECK(to_string(wrong.error()).starts_with(summary.string()));
  }
  std::filesystem::remove(summary);
  REQUIRE(read_scans(folder.path()));
}

TEST_CASE("scans.csv has all three states and the risk; the trajectory has tracked poses alone") {
  Run run = run_of(4);
  run.scans[1].report.tracking = Tracking::uncertain;
  run.scans[1].report.reason = "the match is ambiguous";
  run.scans[2].report.tracking = Tracking::lost;
  run.scans[3].report.tracking = Tracking::lost;
  run.scans[3].report.has_pose = false;
  const double risks[] = {2.5e-7, 0.125, 1.0, 1.0};
  for (std::size_t i = 0; i < 4; ++i) run.scans[i].report.risk = risks[i];
  const test::TemporaryFolder folder;
  REQUIRE(write_run(run, summarize(run), folder.path()));
  const auto table = read_scans(folder.path());
  REQUIRE_MESSAGE(table, to_string(table.error()));
  CHECK(table->tracking ==
        std::vector{Tracking::tracked, Tracking::uncertain, Tracking::lost, Tracking::lost});
  using Cells = std::vector<std::optional<double>>;
  CHECK(table->columns.at("risk") == Cells{2.5e-7, 0.125, 1.0, std::nullopt});
  const auto poses = io::read_trajectory(folder.path() / "trajectory.tum");
  REQUIRE_MESSAGE(poses, to_string(poses.error()));
  REQUIRE(poses->size() == 1);
  CHECK(poses->front().stamp == 0.0);
}

TEST_CASE("a run is kept whatever bytes are in the path of its configuration") {
  Run run = run_of(2);
  run.config = "/home/m\xe9tro/c.toml";
  const test::TemporaryFolder folder;
  const auto written = write_run(run, summarize(run), folder.path());
  REQUIRE_MESSAGE(written, to_string(written.error()));
  CHECK(test::read_text(folder.path() / "summary.json").find("/home/m\uFFFDtro/c.toml") !=
        std::string::npos);
}
