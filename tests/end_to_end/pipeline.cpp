// The main job through the programs themselves: one TOML file, build, localize, evaluate.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <random>
#include <set>

#include "io/ros/message_reader.hpp"
#include "world.hpp"

namespace fs = std::filesystem;

namespace vantage::test {

Street::Street(bool with_kiosk) {
  std::mt19937 random(7);
  const auto uniform = [&](double a, double b) {
    return a + (b - a) * (static_cast<double>(random()) / 4294967296.0);
  };
  PointCloud map;
  const auto noise = [&] { return uniform(-0.02, 0.02); };
  for (double x = 0; x < 60; x += 0.2) {
    for (double y = -6; y < 6; y += 0.2) map.push_back({x + noise(), y + noise(), noise()});
    // House fronts step in and out every 7 m.
    const double step = static_cast<int>(x / 7) % 2 == 0 ? 0.0 : 2.0;
    for (double z = 0.2; z < 5; z += 0.2) {
      map.push_back({x + noise(), -6 - step + noise(), z});
      map.push_back({x + noise(), 6 + step + noise(), z});
    }
  }
  for (int house = 1; house <= 8; ++house) {
    for (double depth = 0; depth < 2; depth += 0.2) {
      for (double z = 0.2; z < 5; z += 0.2) {
        map.push_back({7.0 * house + noise(), -6 - depth, z});
        map.push_back({7.0 * house + noise(), 6 + depth, z});
      }
    }
  }
  for (int post = 0; post < 12; ++post) {
    const double x = 5.0 * post + uniform(-1, 1), y = post % 2 == 0 ? -4.5 : 4.5;
    for (double z = 0; z < 3; z += 0.05) {
      map.push_back({x + 0.1 * std::cos(40 * z), y + 0.1 * std::sin(40 * z), z});
    }
  }
  for (double along = 0; with_kiosk && along < 3; along += 0.2) {
    for (double z = 0.2; z < 3; z += 0.2) {
      map.push_back({20 + along + noise(), 3 + noise(), z});
      map.push_back({20 + noise(), 3 + along + noise(), z});
      map.push_back({23 + noise(), 3 + along + noise(), z});
    }
  }
  REQUIRE(io::write_pcd(folder() / "map.pcd", map, io::Precision::float64));

  fs::create_directory(folder() / "scans");
  io::Trajectory reference;
  for (int i = 0; i < kScans; ++i) {
    Pose pose = pose_from_xyz_rpy({10.0 + 0.8 * i, 0.8 * std::sin(0.15 * i), 1.0},
                                  {0.0, 0.0, 0.1 * std::cos(0.15 * i)});
    PointCloud scan;
    for (const Point& p : map) {
      if ((p - pose.translation).norm() < 18 && random() % 8 == 0) {
        scan.push_back(pose.inverse() * (p + Point(noise(), noise(), noise()) / 2));
      }
    }
    char name[32];
    std::snprintf(name, sizeof name, "%06d.pcd", i);
    REQUIRE(io::write_pcd(folder() / "scans" / name, scan, io::Precision::float32));
    reference.push_back({0.1 * i, pose});
  }
  REQUIRE(io::write_tum(folder() / "reference.tum", reference));
}

std::string Street::write_config(const std::string& name, double cell_width,
                                 const std::string& bundle, const std::string& extra) const {
  const std::string partitioner =
      cell_width > 0
          ? "plugin = \"uniform_grid\"\nparams = { cell_width = " + std::to_string(cell_width) +
                " }"
          : "plugin = \"whole_map\"";
  write_text(folder() / name, R"(schema = 1
[map]
files = ["map.pcd"]
[partitioner]
)" + partitioner + R"(
[ground]
plugin = "pmf"
[viewpoints]
voxel_size = 3.0
[visibility]
plugin = ")" + (cell_width > 0 ? "hpr" : "keep_all") +
                                  R"("
[store]
plugin = "pcd_tiles"
content = "points"
params = { root = ")" + bundle + R"(" }
[matcher]
plugin = "ndt"
)" + extra);
  return path(name);
}

Finished Street::localize(const std::string& config, const std::string& out,
                          std::vector<std::string> more) const {
  std::vector<std::string> arguments{
      config, "--scans", path("scans"), "--reference", path("reference.tum"), "--out", path(out)};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run("vantage-localize", arguments);
}

}  // namespace vantage::test

using namespace vantage;

namespace {

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) names.push_back(fs::relative(entry.path(), folder));
  }
  std::sort(names.begin(), names.end());
  return names;
}

void check_same_files(const fs::path& a, const fs::path& b) {
  REQUIRE(files_in(a) == files_in(b));
  REQUIRE(files_in(a).size() > 1);
  for (const fs::path& name : files_in(a)) {
    CHECK_MESSAGE(test::read_text(a / name) == test::read_text(b / name), name.string());
  }
}

/// The fronts of the street are alike: the first scan alone may leave open which one it sees.
void check_tracked(const nlohmann::json& summary) {
  CHECK(summary["scans"]["tracked"] >= test::Street::kScans - 1);
  CHECK(summary["scans"]["lost"] == 0);
}

}  // namespace

TEST_CASE("build, localize, evaluate: region maps with switches and the wide-area map") {
  const test::Street street;
  const std::string regions = street.write_config("L10.toml", 10, "maps/L10");
  const std::string wide = street.write_config("wide.toml", 0, "maps/wide");
  for (const std::string& config : {regions, wide}) {
    const auto built = test::run("vantage", {"build", config, "--json", "--quiet"});
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
    CHECK(built.err.empty());
    const auto report = nlohmann::json::parse(built.out);
    CHECK(report["regions"].size() == (config == wide ? 1 : 14));
    const double core_seconds = report["core_seconds"]["visibility"];
    CHECK(core_seconds > 0.0);
    CHECK(report["core_seconds"]["a_viewpoint_and_million_points"].get<double>() ==
          doctest::Approx(1e6 * core_seconds / report["viewpoints"].get<double>() /
                          report["map_points"].get<double>()));
    CHECK(report["peak_memory_bytes"] > 1'000'000);
    std::uintmax_t on_disk = 0;
    const fs::path bundle = street.folder() / (config == wide ? "maps/wide" : "maps/L10");
    for (const fs::path& name : files_in(bundle)) on_disk += fs::file_size(bundle / name);
    CHECK(report["bytes"] == on_disk);
  }

  const auto localized = street.localize(regions, "run");
  REQUIRE_MESSAGE(localized.exit_code == 0, localized.err);
  CHECK(localized.err.find("localizing (scans): 40/40") != std::string::npos);
  const auto summary = nlohmann::json::parse(test::read_text(street.folder() / "run/summary.json"));
  check_tracked(summary);
  CHECK(summary["scans"]["switched"] >= 3);
  CHECK(summary["error_m"]["mean"] < 0.05);
  CHECK(summary["error_deg"]["mean"] < 0.3);

  const auto trajectory = io::read_trajectory(street.folder() / "run/trajectory.tum");
  REQUIRE(trajectory);
  CHECK(trajectory->size() >= test::Street::kScans - 1);
  const std::string csv = test::read_text(street.folder() / "run/scans.csv");
  CHECK(std::count(csv.begin(), csv.end(), '\n') == test::Street::kScans + 1);

  const auto evaluated = test::run(
      "vantage", {"evaluate", regions, wide, "--scans", street.path("scans"), "--reference",
                  street.path("reference.tum"), "--out", street.path("evaluation"), "--quiet"});
  REQUIRE_MESSAGE(evaluated.exit_code == 0, evaluated.err);
  CHECK(evaluated.out.find("L10") != std::string::npos);
  const auto both = nlohmann::json::parse(
      test::read_text(street.folder() / "evaluation/summary.json"))["configs"];
  REQUIRE(both.size() == 2);
  CHECK(both[0]["name"] == "L10");
  CHECK(both[0]["routes"][0]["error_m"]["mean"] == summary["error_m"]["mean"]);
  CHECK(both[1]["reduction"] == 0.0);
}

TEST_CASE(
    "two runs, and runs with one and two threads, give byte-identical bundles and trajectories") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 10, "unused");
  const auto build = [&](const std::string& bundle, const std::string& jobs,
                         const std::string& use = "localizer.switch_margin=0") {
    const auto done =
        test::run("vantage-build", {config, "--quiet", "--jobs", jobs, "--set",
                                    "store.params.root=" + street.path(bundle), "--set", use});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  };
  build("one", "1");
  build("two", "2");
  build("again", "2");
  build("used_otherwise", "2", "localizer.switch_margin=1");
  check_same_files(street.folder() / "one", street.folder() / "two");
  check_same_files(street.folder() / "one", street.folder() / "again");
  check_same_files(street.folder() / "one", street.folder() / "used_otherwise");

  for (const std::string jobs : {"1", "2"}) {
    const auto done = street.localize(
        config, "run" + jobs, {"--jobs", jobs, "--set", "store.params.root=" + street.path("one")});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  }
  CHECK(test::read_text(street.folder() / "run1/trajectory.tum") ==
        test::read_text(street.folder() / "run2/trajectory.tum"));
}

TEST_CASE("graded and thinned maps are the same for any number of threads, and localize") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 10, "unused");
  constexpr int kBudget = 12000;
  for (const std::string jobs : {"1", "2"}) {
    const auto built = test::run(
        "vantage-build", {config, "--jobs", jobs, "--quiet", "--min-views", "2", "--json", "--set",
                          "store.views=true", "--set", "thinning.budget=" + std::to_string(kBudget),
                          "--set", "store.params.root=" + street.path("graded" + jobs)});
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
    const auto report = nlohmann::json::parse(built.out);
    bool thinned = false;
    for (const auto& region : report["regions"]) {
      CHECK(region["points"] <= kBudget);
      CHECK(region["points"] <= region["points_seen"]);
      thinned = thinned || region["points_seen"] > kBudget;
    }
    CHECK(thinned);
  }
  check_same_files(street.folder() / "graded1", street.folder() / "graded2");
  // Larger voxels: in those of 1 m too few have the six points that it takes to find the first
  // step.
  const auto localized = street.localize(config, "run",
                                         {"--quiet", "--set", "matcher.params.resolution=1.5",
                                          "--set", "store.params.root=" + street.path("graded1")});
  REQUIRE_MESSAGE(localized.exit_code == 0, localized.err);
  const auto summary =
      nlohmann::json::parse(test::read_text(street.folder() / "run" / "summary.json"));
  check_tracked(summary);
  CHECK(summary["error_m"]["mean"] < 0.1);
}

TEST_CASE(
    "a selector keeps a region within its bytes, for any number of threads, and it localizes") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 10, "unused");
  constexpr std::uintmax_t kBytes = 4000, kFrame = 1500;  // of the file around it: its viewpoints
  const auto build = [&](const std::string& jobs, const std::string& selector) {
    const auto built = test::run(
        "vantage-build",
        {config, "--jobs", jobs, "--quiet", "--set", "store.content=prepared", "--set",
         "selector.plugin=" + selector, "--set", "selector.max_bytes=" + std::to_string(kBytes),
         "--set", "store.params.root=" + street.path(selector + jobs)});
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  };
  for (const char* jobs : {"1", "2"}) build(jobs, "contribution");
  check_same_files(street.folder() / "contribution1", street.folder() / "contribution2");
  for (const char* selector : {"contribution", "random", "fullest", "grid"}) {
    CAPTURE(std::string(selector));
    if (selector != std::string("contribution")) build("1", selector);
    const fs::path bundle = street.path(selector + std::string("1"));
    for (const fs::path& file : files_in(bundle)) {
      if (file.extension() == ".pcd") CHECK(fs::file_size(bundle / file) < kBytes + kFrame);
    }
    const auto localized = street.localize(
        config, selector,
        {"--quiet", "--set", "store.params.root=" + bundle.string(), "--set",
         "store.content=prepared", "--set", "selector.plugin=" + std::string(selector), "--set",
         "selector.max_bytes=" + std::to_string(kBytes)});
    REQUIRE_MESSAGE(localized.exit_code == 0, localized.err);
    const auto summary =
        nlohmann::json::parse(test::read_text(street.folder() / selector / "summary.json"));
    check_tracked(summary);
    MESSAGE(std::string(selector) << ": mean error " << summary["error_m"]["mean"].get<double>()
                                  << " m");
    CHECK(summary["error_m"]["mean"] < 0.05);
    const auto& predictions = summary["predictions"];
    CHECK(predictions["errors"] > test::Street::kScans / 2);
    CHECK(predictions["errors"].get<int>() + predictions["unpromised"].get<int>() ==
          summary["scans"]["tracked"]);
    CHECK(summary["expected_m"]["mean"] > 0.0);
    CHECK(summary["expected_m"]["mean"] < summary["promised_m"]["mean"]);
    CHECK(localized.out.find("what the bundle promises for 95 % of scans") != std::string::npos);
  }
  const auto judged = test::run(
      "vantage-evaluate",
      {config, "--scans", street.path("scans"), "--reference", street.path("reference.tum"),
       "--out", street.path("judged"), "--quiet", "--no-baselines", "--gate", "promised=1m",
       "--set", "store.content=prepared", "--set", "selector.plugin=contribution", "--set",
       "selector.max_bytes=" + std::to_string(kBytes), "--set",
       "store.params.root=" + street.path("contribution1")});
  CHECK_MESSAGE(judged.exit_code == 0, judged.err);
  CHECK(judged.out.find("pass  c: promised ") != std::string::npos);
  const auto wrong = test::run("vantage-build", {config, "--set", "selector.plugin=random", "--set",
                                                 "selector.max_bytes=4000"});
  CHECK(wrong.exit_code != 0);
  CHECK(wrong.err.find("[selector] chooses elements of prepared maps") != std::string::npos);
}

TEST_CASE(
    "a selector keeps no more than a target of the error takes, and the bundle says how much") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 10, "unused");
  struct Built {
    std::uint64_t elements = 0;
    nlohmann::json predicted;
  };
  const auto build = [&](const std::string& root, const std::vector<std::string>& budget) {
    std::vector<std::string> arguments{config, "--quiet", "--json"};
    for (const std::string& set :
         {std::string("store.content=prepared"), std::string("selector.plugin=contribution"),
          "store.params.root=" + street.path(root)}) {
      arguments.insert(arguments.end(), {"--set", set});
    }
    for (const std::string& set : budget) arguments.insert(arguments.end(), {"--set", set});
    const auto built = test::run("vantage-build", arguments);
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
    const auto told = test::run("vantage-info", {street.path(root), "--json"});
    REQUIRE_MESSAGE(told.exit_code == 0, told.err);
    const auto info = nlohmann::json::parse(told.out);
    return Built{
        static_cast<std::uint64_t>(std::llround(info["region_elements"]["mean"].get<double>() *
                                                info["regions"].get<double>())),
        info["predicted_error"]};
  };
  const Built all = build("all", {"selector.share=1.0"});
  const Built loose = build("loose", {"selector.target_error=0.05"});
  const Built tight = build("tight", {"selector.target_error=0.01"});
  const Built capped = build("capped", {"selector.target_error=0.000001", "selector.share=0.1"});
  const Built hopeless = build("hopeless", {"selector.target_error=0.000001"});
  CHECK(loose.elements < tight.elements);
  CHECK(tight.elements < all.elements);
  CHECK(hopeless.elements < all.elements);  // more would not be better
  CHECK(hopeless.predicted["regions_missing_it"] > 0);
  CHECK(capped.elements < all.elements / 5);  // of each region, a tenth and less than one more
  CHECK(all.predicted["target"].is_null());
  CHECK(all.predicted["places"] > 0);
  CHECK(all.predicted["expected"] > 0.0);
  CHECK(all.predicted["expected"] < all.predicted["median"]);
  CHECK(capped.predicted["expected"] > all.predicted["expected"]);
  CHECK(loose.predicted["target"] == 0.05);
  CHECK(capped.predicted["regions_missing_it"] > 0);
  // Without a limit where the few elements of a region do not hold the pose.
  const auto& missing = capped.predicted["worst_regions"];
  const auto found = std::ranges::find_if(
      missing, [](const nlohmann::json& region) { return region["p95"].is_number(); });
  REQUIRE(found != missing.end());
  const auto& worst = *found;
  REQUIRE(worst["p95_with_all_elements"].is_number());
  CHECK(worst["p95"] > worst["p95_with_all_elements"]);
  const auto text = test::run("vantage-info", {street.path("capped")});
  CHECK(text.out.find("target of 1e-06 m    missed in ") != std::string::npos);

  const auto none = test::run("vantage-build", {config, "--set", "store.content=prepared", "--set",
                                                "selector.plugin=contribution"});
  CHECK(none.exit_code != 0);
  CHECK(none.err.find("a selector needs 'max_bytes', 'share' or 'target_error'") !=
        std::string::npos);
}

TEST_CASE("a selector chooses with the scans of the map's recording") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 20, "unused");
  const auto build = [&](const std::string& root, const std::vector<std::string>& sets) {
    std::vector<std::string> arguments{config,
                                       "--set",
                                       "store.content=prepared",
                                       "--set",
                                       "selector.plugin=contribution",
                                       "--set",
                                       "selector.max_bytes=4000",
                                       "--set",
                                       "store.params.root=" + street.path(root)};
    for (const std::string& set : sets) arguments.insert(arguments.end(), {"--set", set});
    return test::run("vantage-build", arguments);
  };
  const std::string scans = "selector.scans=" + street.path("scans");
  const std::string poses = "selector.poses=" + street.path("reference.tum");
  const auto recorded = build("recorded", {scans, poses});
  REQUIRE_MESSAGE(recorded.exit_code == 0, recorded.err);
  CHECK(recorded.err.find("scans for the selector, at least 2 m apart") != std::string::npos);
  CHECK(recorded.out.find("core-seconds for choosing elements") != std::string::npos);
  const auto along = build("along", {scans, "map.trajectory=" + street.path("reference.tum")});
  REQUIRE_MESSAGE(along.exit_code == 0, along.err);
  REQUIRE(build("virtual", {}).exit_code == 0);
  bool same = true;
  std::size_t regions = 0;
  for (const fs::path& file : files_in(street.path("recorded"))) {
    if (file.extension() != ".pcd") continue;
    ++regions;
    const std::string bytes = test::read_text(fs::path(street.path("recorded")) / file);
    CHECK(bytes == test::read_text(fs::path(street.path("along")) / file));
    same = same && bytes == test::read_text(fs::path(street.path("virtual")) / file);
  }
  CHECK(regions > 0);
  CHECK_FALSE(same);  // other scans, another choice

  const auto no_poses = build("bad", {scans});
  CHECK(no_poses.exit_code != 0);
  CHECK(no_poses.err.find("'scans' need 'poses'") != std::string::npos);
  const auto no_scans = build("bad", {poses});
  CHECK(no_scans.err.find("'poses' are those of 'scans', which is missing") != std::string::npos);
  test::write_text(street.path("late.tum"), "9000 0 0 0 0 0 0 1\n9001 0 0 0 0 0 0 1\n");
  const auto late = build("bad", {scans, "selector.poses=" + street.path("late.tum")});
  CHECK(late.exit_code != 0);
  CHECK(late.err.find("late.tum: error: none of the ") != std::string::npos);
  CHECK(late.err.find("the poses 9000.000 to 9001.000 s") != std::string::npos);
  CHECK_FALSE(fs::exists(street.path("bad")));
}

TEST_CASE("every partitioner makes maps to localize in, and budget keeps its budget") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 10, "unused");
  constexpr int kBudget = 25000;
  const std::vector<std::pair<std::string, std::string>> partitioners{
      {"kd_split", "{ max_points = 12000 }"},
      {"budget", "{ max_points = " + std::to_string(kBudget) + " }"},
      {"trajectory", "{ segment_length = 8.0 }"},
      {"visibility_clusters", "{ min_overlap = 0.4 }"}};
  for (const auto& [plugin, params] : partitioners) {
    CAPTURE(plugin);
    std::vector<std::string> use;
    for (const std::string& set : {"partitioner.plugin=" + plugin, "partitioner.params=" + params,
                                   "map.trajectory=" + street.path("reference.tum"),
                                   "store.params.root=" + street.path("maps/" + plugin)}) {
      use.insert(use.end(), {"--set", set});
    }
    std::vector<std::string> build{config, "--json", "--quiet"};
    build.insert(build.end(), use.begin(), use.end());
    const auto built = test::run("vantage-build", build);
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
    const auto report = nlohmann::json::parse(built.out);
    CHECK(report["regions"].size() >= 2);
    if (plugin == "budget") {
      for (const auto& region : report["regions"]) CHECK(region["points"] <= kBudget);
    }
    use.push_back("--quiet");
    const auto localized = street.localize(config, "run_" + plugin, use);
    REQUIRE_MESSAGE(localized.exit_code == 0, localized.err);
    const auto summary = nlohmann::json::parse(
        test::read_text(street.folder() / ("run_" + plugin) / "summary.json"));
    check_tracked(summary);
    CHECK(summary["scans"]["switched"] >= 1);
    CHECK(summary["error_m"]["mean"] < 0.1);
  }
}

TEST_CASE("a map without ground: built along its trajectory by any number of threads, localized") {
  const test::Street street;
  auto map = io::read_point_cloud(street.path("map.pcd")).value().points;
  std::erase_if(map, [](const Point& p) { return p.z() < 0.1; });
  REQUIRE(io::write_pcd(street.folder() / "map.pcd", map, io::Precision::float64));
  const std::string config = street.write_config("c.toml", 10, "unused");
  std::string text = test::read_text(config);
  const std::string ground = "[ground]\nplugin = \"pmf\"\n";
  REQUIRE(text.find(ground) != std::string::npos);
  text.erase(text.find(ground), ground.size());
  test::write_text(config, text);

  std::vector<std::string> use{"--quiet"};
  for (const std::string& set :
       {"map.trajectory=" + street.path("reference.tum"), std::string("viewpoints.voxel_size=1"),
        std::string("viewpoints.source=trajectory"),
        std::string("viewpoints.lateral_offsets=[0.0, 1.5]"),
        std::string("viewpoints.min_gain=0.02"), std::string("store.content=prepared"),
        std::string("localizer.min_coverage=0.2"), std::string("localizer.min_nvtl=0.4")}) {
    use.insert(use.end(), {"--set", set});
  }
  for (const std::string threads : {"1", "2"}) {
    std::vector<std::string> build{config,   "--json",
                                   "--jobs", threads,
                                   "--set",  "store.params.root=" + street.path("maps" + threads)};
    build.insert(build.end(), use.begin(), use.end());
    const auto built = test::run("vantage-build", build);
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
    const auto report = nlohmann::json::parse(built.out);
    CHECK(report["ground_points"] == 0);
    CHECK(report["viewpoints"] > 30);
    CHECK(report["skipped_viewpoints"] > 0);
    CHECK(report["regions_without_viewpoints"] > 0);
    CHECK(report["places_outside"] == 0);
  }
  check_same_files(street.folder() / "maps1", street.folder() / "maps2");

  use.insert(use.end(), {"--set", "store.params.root=" + street.path("maps1")});
  const auto localized = street.localize(config, "run", use);
  REQUIRE_MESSAGE(localized.exit_code == 0, localized.err);
  const auto summary =
      nlohmann::json::parse(test::read_text(street.folder() / "run" / "summary.json"));
  MESSAGE("mean error " << summary["error_m"]["mean"].get<double>() << " m");
  check_tracked(summary);
  CHECK(summary["error_m"]["mean"] < 0.1);
}

TEST_CASE("--initial-pose and --odometry stand in for the reference") {
  const test::Street street;
  const std::string config = street.write_config("c.toml", 0, "bundle");
  REQUIRE(test::run("vantage-build", {config, "--quiet"}).exit_code == 0);
  const auto done = test::run(
      "vantage-localize",
      {config, "--scans", street.path("scans"), "--out", street.path("run"), "--initial-pose",
       "10.1,-0.1,1.0,0,0,0.12", "--odometry", street.path("reference.tum"), "--json", "--quiet"});
  REQUIRE_MESSAGE(done.exit_code == 0, done.err);
  const auto summary = nlohmann::json::parse(done.out);
  check_tracked(summary);
  CHECK(summary["error_m"]["count"] == 0);
  const auto estimated = io::read_trajectory(street.folder() / "run/trajectory.tum").value();
  const auto reference = io::read_trajectory(street.folder() / "reference.tum").value();
  for (std::size_t i = 0; i < reference.size(); ++i) {
    CHECK((estimated[i].pose.translation - reference[i].pose.translation).norm() < 0.2);
  }
}

namespace {

/// All texts in a layout that name a topic or a part of its messages.
void collect_paths(const nlohmann::json& json, std::set<std::string>& paths) {
  if (json.is_string() && json.get<std::string>().starts_with('/')) paths.insert(json);
  if (!json.is_structured()) return;
  for (const auto& [key, value] : json.items()) {
    if (json.is_object() && key.starts_with('/')) paths.insert(key);
    collect_paths(value, paths);
  }
}

/// The panels that a part of the window has.
void collect_panels(const nlohmann::json& part, std::set<std::string>& panels) {
  if (part.is_string()) {
    panels.insert(part);
    return;
  }
  collect_panels(part.at("first"), panels);
  collect_panels(part.at("second"), panels);
}

}  // namespace

TEST_CASE("localize: a page about the run, and a recording with its layout for Foxglove") {
  const test::Street street;
  const std::string config = street.write_config("L10.toml", 10, "maps/L10");
  REQUIRE(test::run("vantage-build", {config, "--quiet"}).exit_code == 0);
  const auto localize = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{config,  "--scans",          street.path("scans"),
                                       "--out", street.path("run"), "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::run("vantage-localize", arguments);
  };
  const std::string start = "--initial-pose=10.1,-0.1,1.0,0,0,0.12";
  const auto holds = [](const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
  };

  SUBCASE("without a reference") {
    const fs::path page = street.folder() / "pages/run.html";
    const fs::path recording = street.folder() / "recordings/run.mcap";
    const auto done = localize({start, "--html", page.string(), "--mcap", recording.string()});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    // Rows without a number are left out.
    CHECK(holds(done.out, "coverage [%]"));
    CHECK_FALSE(holds(done.out, "error ["));
    CHECK_FALSE(holds(done.out, " - "));
    CHECK(holds(done.out, "report: " + page.string()));

    const std::string html = test::read_text(page);
    for (const std::string id : {"verdict", "drive", "risk", "fit", "times", "memory"}) {
      CHECK_MESSAGE(holds(html, "<section id=\"" + id + "\">"), id);
    }
    const auto scans =
        nlohmann::json::parse(test::read_text(street.folder() / "run/summary.json"))["scans"];
    for (const std::string state : {"tracked", "uncertain", "lost"}) {
      CHECK_MESSAGE(holds(html, "data-metric=\"scans." + state + "\" data-value=\"" +
                                    scans[state].dump() + "\""),
                    state);
    }
    CHECK(holds(html, "Without a reference"));
    CHECK(files_in(page.parent_path()) == std::vector<fs::path>{"run.html"});

    const auto bag = io::ros::open_bag(recording);
    REQUIRE(bag);
    std::set<std::string> topics;
    for (const auto& topic : (*bag)->topics()) topics.insert(topic.name);
    const auto layout =
        nlohmann::json::parse(test::read_text(street.folder() / "recordings/run.foxglove.json"));
    std::set<std::string> paths, panels, configured;
    collect_paths(layout, paths);
    CHECK(paths.size() > 8);
    const std::string header = test::read_text(street.folder() / "run/scans.csv");
    std::set<std::string> shown;
    for (const std::string& path : paths) {
      const std::string topic = path.substr(0, path.find('.'));
      CHECK_MESSAGE(topics.contains(topic), path);
      shown.insert(topic);
      const std::string key = "{key==\"";
      if (const auto at = path.find(key); at != std::string::npos) {
        const auto begin = at + key.size();
        const std::string metric = path.substr(begin, path.find('"', begin) - begin);
        CHECK_MESSAGE(holds(header, "," + metric + ","), path);
      }
    }
    CHECK(shown == std::set<std::string>{"/diagnostics", "/map", "/pose", "/region", "/scan"});
    collect_panels(layout.at("layout"), panels);
    for (const auto& [panel, unused] : layout.at("configById").items()) configured.insert(panel);
    CHECK(panels == configured);
  }
  SUBCASE("with a reference, and without a recording") {
    const auto done = localize(
        {"--reference", street.path("reference.tum"), "--html", street.path("run/run.html")});
    REQUIRE_MESSAGE(done.exit_code == 0, done.err);
    CHECK(holds(done.out, "error [cm]"));
    CHECK(holds(test::read_text(street.folder() / "run/run.html"),
                "This page does not use it: <code>vantage evaluate</code>"));
    CHECK(files_in(street.folder() / "run") ==
          std::vector<fs::path>{"run.html", "scans.csv", "summary.json", "trajectory.tum"});
  }
  SUBCASE("a page that cannot be written is told before any scan is localized") {
    const auto done = localize({start, "--html", street.path("map.pcd/run.html")});
    CHECK(done.exit_code == 1);
    CHECK_MESSAGE(holds(done.err, "map.pcd/run.html"), done.err);
    CHECK_FALSE(fs::exists(street.folder() / "run"));
  }
}
