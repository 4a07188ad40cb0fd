// `vantage evaluate`: routes, baselines of equal size, gates; its numbers judged from outside.
#include <doctest/doctest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/process.hpp"
#include "support/text.hpp"
#include "world.hpp"

namespace fs = std::filesystem;
using namespace vantage;
using nlohmann::json;

namespace {

/// A street with a region bundle and the wide-area map, and two names for its one drive.
struct Evaluated {
  test::Street street;
  std::string regions = street.write_config("L10.toml", 10, "maps/L10");
  std::string wide = street.write_config("wide.toml", 0, "maps/wide");

  Evaluated() {
    for (const std::string& config : {regions, wide}) {
      const auto built = test::run("vantage-build", {config, "--quiet"});
      REQUIRE_MESSAGE(built.exit_code == 0, built.err);
    }
  }

  [[nodiscard]] test::Finished evaluate(std::vector<std::string> more) const {
    std::vector<std::string> arguments{regions,       wide,
                                       "--scans",     street.path("scans"),
                                       "--reference", street.path("reference.tum"),
                                       "--out",       street.path("evaluation"),
                                       "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::run("vantage-evaluate", arguments);
  }

  [[nodiscard]] test::Finished recompute() const {
    return test::run("/usr/bin/python3", {VANTAGE_SOURCE_DIR "/tests/end_to_end/recompute.py",
                                          street.path("evaluation")});
  }
};

/// map_points of every region that a run was in.
std::map<std::string, std::string> points_of_regions(const fs::path& scans_csv) {
  std::istringstream csv(test::read_text(scans_csv));
  std::map<std::string, std::string> points;
  std::string line;
  std::getline(csv, line);
  while (std::getline(csv, line)) {
    std::istringstream cells(line);
    std::vector<std::string> first(8);
    for (std::string& cell : first) std::getline(cells, cell, ',');
    points[first[3]] = first[7];
  }
  return points;
}

}  // namespace

TEST_CASE("evaluate: routes, baselines with equally many points, numbers that can be recomputed") {
  const Evaluated world;
  const auto done = world.evaluate({"--scans", world.street.path("scans"), "--reference",
                                    world.street.path("reference.tum"), "--route", "there",
                                    "--route", "and_again"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  const fs::path out = world.street.folder() / "evaluation";
  const json summary = json::parse(test::read_text(out / "summary.json"));
  CHECK(summary["routes"] == json({"there", "and_again"}));
  const json& regions = summary["configs"][0];
  REQUIRE(regions["routes"].size() == 2);
  for (const json& route : regions["routes"]) {
    for (const std::string baseline : {"random", "voxel", "radius"}) {
      CAPTURE(baseline);
      const json& run = route["baselines"][baseline];
      CHECK(run["scans"]["total"] == test::Street::kScans);
      const fs::path folder = out / "L10" / route["route"].get<std::string>();
      const auto own = points_of_regions(folder / "scans.csv");
      std::size_t shared = 0;
      for (const auto& [region, points] : points_of_regions(folder / baseline / "scans.csv")) {
        if (const auto same = own.find(region); same != own.end()) {
          CHECK_MESSAGE(same->second == points, region);
          ++shared;
        }
      }
      CHECK(shared >= 1);
      CHECK(run["fitness"]["mean"] != route["fitness"]["mean"]);
    }
    CHECK(fs::exists(out / "L10" / route["route"].get<std::string>() / "voxel" / "scans.csv"));
  }
  CHECK_FALSE(regions.contains("no_baselines"));
  CHECK_FALSE(regions.contains("passed"));
  CHECK(summary["configs"][1]["no_baselines"] == "its region maps hold every point within reach");
  // The same drive twice: the same poses, whichever other thread was at work.
  CHECK(test::read_text(out / "L10/there/trajectory.tum") ==
        test::read_text(out / "L10/and_again/trajectory.tum"));

  const auto again = world.evaluate({"--scans", world.street.path("scans"), "--reference",
                                     (out / "L10/and_again/voxel/trajectory.tum").string(),
                                     "--route", "there", "--route", "and_again"});
  CHECK(again.exit_code == 2);
  CHECK(again.err.find("--out would overwrite") != std::string::npos);

  const auto judged = world.recompute();
  CHECK_MESSAGE(judged.exit_code == 0, judged.out << judged.err);
  CHECK(judged.out.find(" 0 differ") != std::string::npos);

  SUBCASE("the judge notices a number that is not that of the scans") {
    json changed = summary;
    double& error = changed["configs"][0]["routes"][1]["error_m"]["p95"].get_ref<double&>();
    error *= 1.001;
    test::write_text(out / "summary.json", changed.dump());
    const auto noticed = world.recompute();
    CHECK(noticed.exit_code == 1);
    CHECK(noticed.out.find("error_m.p95") != std::string::npos);
  }
  SUBCASE("the judge notices a wrong cell of the report") {
    const double lost = 1.0 + regions["routes"][0]["scans"]["lost"].get<double>();
    std::ostringstream cell, other;
    cell << "data-metric=\"scans.lost\" data-value=\"" << lost - 1.0 << '"';
    other << "data-metric=\"scans.lost\" data-value=\"" << lost << '"';
    test::replace_in_file(out / "report.html", cell.str(), other.str());
    const auto noticed = world.recompute();
    CHECK(noticed.exit_code == 1);
    CHECK(noticed.out.find("scans.lost") != std::string::npos);
  }
}

TEST_CASE("evaluate: gates decide the exit code, and everything is written all the same") {
  const Evaluated world;
  auto done = world.evaluate(
      {"--no-baselines", "--gate", "error=10cm,lost=0", "--gate", "wide:reduction<=0%"});
  CHECK_MESSAGE(done.exit_code == 0, done.err);
  CHECK(done.out.find("pass  L10: error ") != std::string::npos);
  const fs::path summary = world.street.folder() / "evaluation/summary.json";
  json written = json::parse(test::read_text(summary));
  CHECK(written["configs"][0]["passed"] == true);
  CHECK(written["configs"][0]["gates"].size() == 2);
  CHECK(written["configs"][1]["gates"].size() == 3);
  CHECK(written["configs"][0]["no_baselines"] == "they were not asked for");

  fs::remove(summary);
  done = world.evaluate({"--no-opponents", "--gate", "L10:error=0.001mm"});  // as it was called
  CHECK(done.exit_code == 1);
  CHECK(done.out.find("FAIL  L10: error ") != std::string::npos);
  CHECK(done.err.find("1 of 2 configurations failed a gate") != std::string::npos);
  written = json::parse(test::read_text(summary));
  CHECK(written["configs"][0]["passed"] == false);
  CHECK(fs::exists(world.street.folder() / "evaluation/report.html"));
}

TEST_CASE("evaluate: gates and names that mean nothing are told before any scan is localized") {
  const Evaluated world;
  const auto refused = [&](const std::vector<std::string>& more, const char* why) {
    const auto done = world.evaluate(more);
    CHECK(done.exit_code == 2);
    CHECK_MESSAGE(done.err.find(why) != std::string::npos, done.err);
    CHECK_FALSE(fs::exists(world.street.folder() / "evaluation"));
  };
  refused({"--gate", "eror=1cm"}, "did you mean 'error'");
  refused({"--gate", "L11:error=1cm"}, "no configuration is called 'L11'");
  refused({"--excess-over", "broad"}, "no configuration is called 'broad'");
  refused({"--baseline", "broad"}, "no configuration is called 'broad'");  // as it was called
  refused({"--scans", world.street.path("scans")}, "--reference is given 1 times for 2 --scans");
  refused({"--route", "a/b"}, "cannot be the name of a folder");
}

TEST_CASE("evaluate: without the wide-area map there are no baselines, and that is said") {
  const Evaluated world;
  fs::remove(world.street.folder() / "map.pcd");
  const auto done = world.evaluate({});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  CHECK(done.out.find("L10 has no baselines: the wide-area map is not available") !=
        std::string::npos);
}
