// Losing and finding on simulated drives with kidnappings and holes in the map: what the localizer
// calls lost and tracked against what is true.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <future>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "io/scan_sequence.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/small_config.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace fs = std::filesystem;

namespace vantage::test {
namespace {

using Row = std::map<std::string, std::string>;

/// Lines of comma-separated values under a line of names; only the last value may hold commas.
std::vector<Row> read_csv(const fs::path& path) {
  std::istringstream lines(read_text(path));
  const auto next_cell = [](std::istringstream& cells, bool last) {
    std::string cell;
    std::getline(cells, cell, last ? '\n' : ',');
    return cell;
  };
  std::string line;
  std::getline(lines, line);
  std::vector<std::string> names;
  for (std::istringstream cells(line); !cells.eof();) names.push_back(next_cell(cells, false));
  std::vector<Row> rows;
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    Row row;
    for (const std::string& name : names) row[name] = next_cell(cells, name == names.back());
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Scans of a drive: those of [begin, end).
struct Part {
  std::size_t begin, end;
};

/// A simulated drive, and the region maps of its world.
class Drive {
 public:
  /// @param world  one of configs/simulate
  explicit Drive(std::string world) : name_(std::move(world)) {
    const std::string source = VANTAGE_SOURCE_DIR "/configs/simulate/" + name_ + ".toml";
    simulated_ = test::run("vantage-simulate", {source, "--out", path("world"), "--quiet"});
    write_text(path("config.toml"),
               to_text({.files = R"(["world/map.pcd"])",
                        .partitioner_params = "cell_width = 20.0",
                        .viewpoints = "voxel_size = 2.0\nsensor_height = 1.0\n",
                        .visibility = "plugin = \"keep_all\"\nmax_range = 60.0\n",
                        .store = "content = \"prepared\"\nparams = { root = \"maps\" }\n",
                        .more = "[localizer]\nscan_min_range = 1.0\n"}));
    built_ = test::run("vantage-build", {path("config.toml"), "--quiet"});
  }

  /// To be asked before anything else.
  void require_made() const {
    REQUIRE_MESSAGE(simulated_.exit_code == 0, simulated_.err);
    REQUIRE_MESSAGE(built_.exit_code == 0, built_.err);
  }

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::string path(const std::string& file) const {
    return (folder_.path() / file).string();
  }

  [[nodiscard]] Part whole() const { return {0, scans().size()}; }
  [[nodiscard]] io::ScanSequence scans() const {
    return io::ScanSequence::open(path("world/scans"), 1.0).value();
  }

  /// The folder of a run over a part of the drive.
  [[nodiscard]] std::string localize(Part part, std::vector<std::string> more = {}) const {
    const std::string name = std::to_string(part.begin) + "-" + std::to_string(part.end);
    const fs::path scans = path("scans_" + name), out = path("run_" + name);
    fs::create_directory(scans);
    const io::ScanSequence all = this->scans();
    std::ostringstream times;
    times.precision(17);
    for (std::size_t i = part.begin; i < part.end; ++i) {
      fs::create_symlink(all.file(i), scans / all.file(i).filename());
      times << all.stamp(i) << '\n';
    }
    write_text(scans / "times.txt", times.str());
    std::vector<std::string> arguments{path("config.toml"),
                                       "--quiet",
                                       "--scans",
                                       scans.string(),
                                       "--odometry",
                                       path("world/odometry.tum"),
                                       "--reference",
                                       path("world/reference.tum"),
                                       "--out",
                                       out.string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Finished done = test::run("vantage-localize", arguments);
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    return out.string();
  }

 private:
  TemporaryFolder folder_;
  std::string name_;
  Finished simulated_, built_;
};

/// Whether the pose that a scan was given is within the alert limit.
bool is_right(const Row& scan) {
  const auto below = [&](const std::string& column, double limit) {
    const std::string& value = scan.at(column);
    return !value.empty() && std::stod(value) <= limit;
  };
  return below("error_m", 0.5) && below("error_deg", 3.0);
}

/// What scans are called whose pose is right, and whose pose is wrong.
struct Verdict {
  std::map<std::string, int> right, wrong;  ///< by state
  std::vector<std::size_t> found_after;     ///< scans after each kidnapping
};

/// How many scans after a kidnapping, the first of `scans`, the first tracked and right one is.
std::size_t scans_until_found(std::span<const Row> scans) {
  const auto found = std::find_if(scans.begin(), scans.end(), [](const Row& scan) {
    return scan.at("tracking") == "tracked" && is_right(scan);
  });
  return static_cast<std::size_t>(found - scans.begin());
}

Verdict judge(const Drive& drive, Part part, Verdict verdict) {
  const fs::path run = drive.localize(part);
  const auto summary = nlohmann::json::parse(read_text(run / "summary.json"));
  // Nobody can load ahead of a kidnapping: the regions around its end may be late.
  CHECK(summary["scans"]["blocked"] <= 6);
  const std::vector<Row> rows = read_csv(run / "scans.csv");
  const std::vector<Row> events = read_csv(drive.path("world/events.csv"));
  REQUIRE(rows.size() == part.end - part.begin);
  REQUIRE(events.size() >= part.end);

  for (std::size_t i = part.begin; i < part.end; ++i) {
    const Row& row = rows[i - part.begin];
    const std::string& state = row.at("tracking");
    CHECK((state == "tracked" || state == "uncertain" || state == "lost"));
    const bool right = is_right(row);
    ++(right ? verdict.right : verdict.wrong)[state];
    if (right != (state == "tracked")) {
      MESSAGE(drive.name(), " scan ", i, " is ", state, ", off by ", row.at("error_m"), " m, ",
              row.at("error_deg"), " deg; risk ", row.at("risk"), ", coverage ", row.at("coverage"),
              ", NVTL ", row.at("nvtl"), ", ", row.at("reason"));
    }
    if (events[i].at("kidnapped") == "1") {
      verdict.found_after.push_back(scans_until_found(std::span(rows).subspan(i - part.begin)));
    }
  }
  return verdict;
}

void check_verdict(Verdict v) {
  const int right = v.right["tracked"] + v.right["uncertain"] + v.right["lost"];
  MESSAGE("right: ", v.right["tracked"], " tracked, ", v.right["uncertain"], " uncertain, ",
          v.right["lost"], " lost; wrong: ", v.wrong["tracked"], " tracked, ", v.wrong["uncertain"],
          " uncertain, ", v.wrong["lost"], " lost");
  CHECK(v.wrong["tracked"] == 0);
  CHECK(100 * v.right["lost"] <= right);
  CHECK(20 * v.right["uncertain"] <= right);
  std::string waits;
  for (const std::size_t scans : v.found_after) {
    waits += ' ' + std::to_string(scans);
    CHECK(scans <= 10);
  }
  MESSAGE("tracked and right again, scans after each kidnapping:", waits);
}

}  // namespace

TEST_CASE("what is called tracked is right, what is right is not called lost, the lost are found") {
  auto making = std::async(std::launch::async, [] { return std::make_unique<Drive>("lost_2"); });
  const Drive first("lost");
  const auto second = making.get();
  first.require_made();
  second->require_made();

  // In the first world a kidnapping and half a hole, in the second all of a hole between two.
  Verdict verdict = judge(first, {440, 510}, {});
  verdict = judge(*second, {440, 560}, std::move(verdict));
  CHECK(verdict.found_after.size() == 3);
  check_verdict(verdict);

  const fs::path run = first.localize({0, 6}, {"--initial-pose", "auto"});
  const std::size_t found = scans_until_found(read_csv(run / "scans.csv"));
  MESSAGE("tracked and right without a first pose after scans: ", found);
  CHECK(found <= 3);
}

TEST_CASE("the same over the whole drives (minutes)" * doctest::skip()) {
  Verdict verdict;
  for (const std::string world : {"lost", "lost_2"}) {
    const Drive drive(world);
    drive.require_made();
    verdict = judge(drive, drive.whole(), std::move(verdict));
  }
  CHECK(verdict.found_after.size() == 12);
  check_verdict(verdict);
}

}  // namespace vantage::test
