#include "simulate/simulation.hpp"

#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>

#include "io/scan_sequence.hpp"
#include "simulate/odometry.hpp"
#include "small_world.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/io/map_files.hpp"
#include "vantage/io/point_cloud_io.hpp"
#include "vantage/io/trajectory_io.hpp"

namespace vantage::simulation {
namespace {

namespace fs = std::filesystem;
using vantage::test::read_text;
using vantage::test::run;
using vantage::test::TemporaryFolder;
using vantage::test::write_text;

/// Relative path to content of all files below a directory.
std::map<std::string, std::string> contents(const fs::path& directory) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file()) {
      files[fs::relative(entry.path(), directory).string()] = read_text(entry.path());
    }
  }
  return files;
}

WorldParams short_drive() {
  WorldParams params = test::small_world();
  params.map.point_spacing = 0.5;
  params.drive.length = 9.0;
  params.drive.scan_every = 10;
  return params;
}

TEST_CASE("the files of a simulation") {
  const TemporaryFolder scratch;
  const WorldParams params = short_drive();
  const auto summary = simulate(params, scratch.path() / "a");
  REQUIRE_MESSAGE(summary, to_string(summary.error()));

  SUBCASE("hold what the summary says") {
    const auto map = io::read_point_cloud(scratch.path() / "a/map.pcd");
    REQUIRE_MESSAGE(map, to_string(map.error()));
    CHECK(map->points.size() == summary->map_points);
    CHECK(summary->precision == io::Precision::float32);
    CHECK((bounds_of(map->points).max - summary->map_bounds.max).norm() < 1e-4);

    const auto scans = io::ScanSequence::open(scratch.path() / "a/scans", 10.0);
    REQUIRE_MESSAGE(scans, to_string(scans.error()));
    CHECK(scans->size() == 6);
    CHECK(summary->scans == 6);
    const auto reference = io::read_trajectory(scratch.path() / "a/reference.tum");
    const auto odometry = io::read_trajectory(scratch.path() / "a/odometry.tum");
    REQUIRE(reference);
    REQUIRE(odometry);
    REQUIRE(reference->size() == 6);
    REQUIRE(odometry->size() == 6);
    std::uint64_t points = 0;
    for (std::size_t k = 0; k < 6; ++k) {
      CHECK(scans->stamp(k) == (*reference)[k].stamp);
      CHECK(scans->stamp(k) == (*odometry)[k].stamp);
      const auto scan = scans->read(k);
      REQUIRE(scan);
      points += scan->points.size();
    }
    CHECK(points == summary->scan_points);
    CHECK(summary->distance == doctest::Approx(7.5));
    CHECK(summary->seconds == doctest::Approx(5.0));
  }
  SUBCASE("are the same again with one thread, and from their own world.toml") {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const auto reread = load_world(scratch.path() / "a/world.toml");
    REQUIRE_MESSAGE(reread, to_string(reread.error()));
    REQUIRE(simulate(*reread, scratch.path() / "b"));
    const auto a = contents(scratch.path() / "a");
    CHECK(a.size() == 6 + 6);
    CHECK((a == contents(scratch.path() / "b")));
  }
  SUBCASE("have the same map in several files, and without a drive only the map") {
    WorldParams files = params;
    files.map.points_per_file = 3000;
    files.map.moving_vehicles = 2;
    WorldParams whole = files;
    whole.map.points_per_file = 0;
    const auto in_files = simulate(files, scratch.path() / "b", false, Extent::map);
    REQUIRE_MESSAGE(in_files, to_string(in_files.error()));
    const auto in_one = simulate(whole, scratch.path() / "c");
    REQUIRE(in_one);
    CHECK(in_files->map_points == in_one->map_points);
    CHECK(in_files->map_bounds.max == in_one->map_bounds.max);
    CHECK(in_files->precision == in_one->precision);
    CHECK(in_files->scans == 0);
    const auto found = io::map_files(std::array{scratch.path() / "b/map"});
    REQUIRE(found);
    CHECK(found->files.size() == (in_one->map_points + 2999) / 3000);
    const auto joined = io::read_point_clouds(found->files);
    REQUIRE(joined);
    CHECK(joined->points == io::read_point_cloud(scratch.path() / "c/map.pcd").value().points);
    CHECK(fs::exists(scratch.path() / "b/world.toml"));
    CHECK_FALSE(fs::exists(scratch.path() / "b/map.pcd"));
    CHECK_FALSE(fs::exists(scratch.path() / "b/scans"));
    CHECK_FALSE(fs::exists(scratch.path() / "b/reference.tum"));
  }
  SUBCASE("differ with another seed") {
    WorldParams other = params;
    other.seed += 1;
    REQUIRE(simulate(other, scratch.path() / "b"));
    const auto a = contents(scratch.path() / "a"), b = contents(scratch.path() / "b");
    CHECK((a.at("map.pcd") != b.at("map.pcd")));
    CHECK((a.at("scans/000000.pcd") != b.at("scans/000000.pcd")));
    CHECK((a.at("odometry.tum") != b.at("odometry.tum")));
  }
  SUBCASE("far from the origin: the same scans, a map in float64") {
    WorldParams far = params;
    far.campus.origin_y = 5e6;
    const auto far_summary = simulate(far, scratch.path() / "b");
    REQUIRE(far_summary);
    CHECK(far_summary->precision == io::Precision::float64);
    auto a = contents(scratch.path() / "a"), b = contents(scratch.path() / "b");
    for (const char* scan : {"scans/000000.pcd", "scans/000005.pcd", "scans/times.txt"}) {
      CHECK((a.at(scan) == b.at(scan)));
    }
    const auto map = io::read_point_cloud(scratch.path() / "b/map.pcd");
    const auto near_map = io::read_point_cloud(scratch.path() / "a/map.pcd");
    REQUIRE(map);
    REQUIRE(map->points.size() == near_map->points.size());
    CHECK((map->points[77] - Point(0, 5e6, 0) - near_map->points[77]).norm() < 1e-4);
    const auto reference = io::read_trajectory(scratch.path() / "b/reference.tum");
    const auto near_reference = io::read_trajectory(scratch.path() / "a/reference.tum");
    REQUIRE(reference);
    CHECK(((*reference)[3].pose.translation - Point(0, 5e6, 0) -
           (*near_reference)[3].pose.translation)
              .norm() < 1e-8);
  }
  SUBCASE("are not overwritten unless asked for") {
    const auto before = contents(scratch.path() / "a");
    WorldParams other = params;
    other.seed += 1;
    const auto again = simulate(other, scratch.path() / "a/");
    REQUIRE_FALSE(again);
    CHECK(again.error().code == ErrorCode::already_exists);
    CHECK((contents(scratch.path() / "a") == before));
    REQUIRE(simulate(other, scratch.path() / "a/", true));
    CHECK((contents(scratch.path() / "a") != before));
    CHECK_FALSE(fs::exists(scratch.path() / "a.partial"));
  }
}

TEST_CASE("nothing is lost and nothing half-written stays behind") {
  const TemporaryFolder scratch;
  const WorldParams params = short_drive();
  SUBCASE("a directory of something else is never overwritten") {
    write_text(scratch.path() / "precious.txt", "x");
    const auto refused = simulate(params, scratch.path(), true);
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::already_exists);
    CHECK(read_text(scratch.path() / "precious.txt") == "x");
  }
  SUBCASE("nor is a file") {
    write_text(scratch.path() / "file", "x");
    CHECK_FALSE(simulate(params, scratch.path() / "file"));
    CHECK_FALSE(simulate(params, scratch.path() / "file", true));
    CHECK(read_text(scratch.path() / "file") == "x");
  }
  SUBCASE("a folder that is a file") {
    write_text(scratch.path() / "file", "x");
    const auto failed = simulate(params, scratch.path() / "file/out");
    REQUIRE_FALSE(failed);
    CHECK(failed.error().code == ErrorCode::io_failure);
  }
  SUBCASE("a failure in the middle removes what was written") {
    WorldParams impossible = params;
    impossible.drive.route = 2;
    const auto failed = simulate(impossible, scratch.path() / "out");
    REQUIRE_FALSE(failed);
    CHECK(failed.error().code == ErrorCode::invalid_config);
    CHECK(fs::is_empty(scratch.path()));
  }
  SUBCASE("the remains of an interrupted run do not disturb") {
    fs::create_directories(scratch.path() / "out.partial/scans");
    write_text(scratch.path() / "out.partial/scans/999999.pcd", "half");
    write_text(scratch.path() / "out.partial/.vantage-partial", "");
    REQUIRE(simulate(params, scratch.path() / "out"));
    CHECK_FALSE(fs::exists(scratch.path() / "out.partial"));
    CHECK_FALSE(fs::exists(scratch.path() / "out/scans/999999.pcd"));
  }
  SUBCASE("a folder of the user with the name of such remains is left alone") {
    fs::create_directories(scratch.path() / "out.partial/scans");
    write_text(scratch.path() / "out.partial/scans/mine.pcd", "mine");
    const auto refused = simulate(params, scratch.path() / "out");
    REQUIRE_FALSE(refused);
    CHECK(refused.error().code == ErrorCode::already_exists);
    CHECK(read_text(scratch.path() / "out.partial/scans/mine.pcd") == "mine");
  }
}

TEST_CASE("odometry") {
  io::Trajectory truth;
  for (int k = 0; k <= 200; ++k) {
    truth.push_back({0.1 * k, pose_from_xyz_rpy({5e5 + 0.5 * k, std::sin(0.1 * k), 3.0},
                                                {0.01, 0.02, 0.1 * std::cos(0.1 * k) + 1.0})});
  }
  SUBCASE("without noise is the truth from the first pose") {
    OdometryParams params;
    params.translation_noise = params.rotation_noise = 0.0;
    const auto odometry = simulate_odometry(truth, params, 1);
    REQUIRE(odometry.size() == truth.size());
    CHECK(odometry.front().pose.translation.norm() == 0.0);
    for (std::size_t k = 0; k < truth.size(); ++k) {
      CHECK(odometry[k].stamp == truth[k].stamp);
      const Pose joined = truth[0].pose * odometry[k].pose;
      CHECK((joined.translation - truth[k].pose.translation).norm() < 1e-8);
      CHECK(rotation_between(joined, truth[k].pose) < 1e-9);
    }
  }
  SUBCASE("drifts like a random walk over the distance") {
    OdometryParams params;
    params.translation_noise = 0.02;
    params.rotation_noise = 0.0;
    double squares_half = 0.0, squares = 0.0, distance_half = 0.0, distance = 0.0;
    for (std::size_t k = 1; k < truth.size(); ++k) {
      distance += (truth[k].pose.translation - truth[k - 1].pose.translation).norm();
      if (k == 100) distance_half = distance;
    }
    constexpr int kRuns = 400;
    for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
      const auto odometry = simulate_odometry(truth, params, seed);
      const auto error = [&](std::size_t k) {
        return Point((truth[0].pose * odometry[k].pose).translation - truth[k].pose.translation);
      };
      squares_half += error(100).squaredNorm() / kRuns;
      squares += error(200).squaredNorm() / kRuns;
    }
    const auto expected = [&](double driven) { return 3.0 * 0.02 * 0.02 * driven; };
    CHECK(squares_half == doctest::Approx(expected(distance_half)).epsilon(0.15));
    CHECK(squares == doctest::Approx(expected(distance)).epsilon(0.15));
  }
  SUBCASE("turns away") {
    OdometryParams params;
    params.translation_noise = 0.0;
    params.rotation_noise = 0.1;
    double squares = 0.0;
    for (std::uint64_t seed = 0; seed < 400; ++seed) {
      const auto odometry = simulate_odometry(truth, params, seed);
      squares +=
          std::pow(rotation_between(truth[0].pose * odometry.back().pose, truth.back().pose) *
                       180.0 / std::numbers::pi,
                   2) /
          400;
    }
    CHECK(squares == doctest::Approx(3.0 * 0.1 * 0.1 * 106.0).epsilon(0.2));
  }
}

TEST_CASE("wrong world files are refused with the place of the error") {
  struct Case {
    const char* text;
    const char* message;
  };
  const Case cases[] = {
      {"schema = 1\n[campus]\nsize_y = 80\nsize_z = 80\n",
       "w.toml:4:1: error: unknown key 'size_z'"},
      {"schema = 1\n[campuss]\n", "w.toml:2:2: error: unknown key 'campuss'"},
      {"schema = 1\n\n[campus]\nsize_x = 20.0\n", "w.toml:4:10: error: "},
      {"schema = 1\n[lidar]\nrings = 16.5\n", "w.toml:3:9: error: "},
      {"schema = 1\n[lidar]\nmotion_distortion = 1\n", "w.toml:3:21: error: "},
      {"schema = 1\n\n[lidar]\nmin_range = 50.0\nmax_range = 20.0\n",
       "w.toml:4:13: error: min_range"},
      {"schema = 1\n[lidar]\ncovered_from = 0.0\n",
       "w.toml:3:16: error: covered_from and covered_to belong together"},
      {"schema = 1\n[lidar]\ndisturbed_from = 1.0\n",
       "w.toml:3:18: error: disturbed_from must be below"},
      {"schema = 1\n[drive]\nroute = 3\n", "w.toml:3:9: error: "},
      {"schema = 2\n", "w.toml:1:10: error: "},
      {"seed = 2\n", "missing"},
      {"schema = 1\nseed = -1\n", "w.toml:2:8: error: "},
      {"schema = 1\n[map]\npoint_spacing = nan\n", "w.toml:3:17: error: "},
      {"schema = 1\n[campus\n", "w.toml:2:"},
      {"schema = 1\n[drive]\nroute = 2\n",
       "w.toml:3:9: error: drive.route = 2 needs at least 3 streets each way"},
      {"schema = 1\n[drive]\nlateral_offset = -3.0\n", "w.toml:3:18: error: drive.lateral_offset"},
      {"schema = 1\n[drive]\nturn_radius = 9.0\n", "w.toml:3:15: error: drive.turn_radius"},
      {"schema = 1\n[campus]\nstreet_width = 12.0\n", "w.toml:3:16: error: campus.street_width"},
      {"schema = 1\n[campus]\nstreet_jitter = 6.0\n", "w.toml:3:17: error: campus.street_jitter"},
      {"schema = 1\n[campus]\nsize_x = 5000\nsize_y = 5000\n[map]\npoint_spacing = 0.1\n",
       "map.point_spacing"},
      {"schema = 1\n[drive]\nlength = 1e6\nspeed = 0.1\n", "drive.scan_every"},
  };
  for (const Case& c : cases) test::check_refused(c.text, c.message);
}

TEST_CASE("the program") {
  const TemporaryFolder scratch;
  const std::string out = (scratch.path() / "out").string();
  const std::string world = (scratch.path() / "w.toml").string();
  write_text(world,
             "schema = 1\nseed = 3\n[campus]\nsize_x = 60\nsize_y = 60\n"
             "[map]\npoint_spacing = 1.0\n[drive]\nlength = 3\nscan_every = 10\n");
  SUBCASE("succeeds") {
    const auto done = run("vantage-simulate",
                          {world, "--out", out, "--jobs", "1", "--set", "drive.length=6", "-q"});
    CHECK_MESSAGE(done.exit_code == 0, done.err);
    CHECK(done.err.empty());
    CHECK(done.out.find("scans      4,") != std::string::npos);
    CHECK(fs::exists(scratch.path() / "out/scans/000003.pcd"));
    CHECK_FALSE(fs::exists(scratch.path() / "out/scans/000004.pcd"));
    CHECK(read_text(scratch.path() / "out/world.toml").find("length = 6") != std::string::npos);

    const auto again = run("vantage-simulate", {world, "--out", out});
    CHECK(again.exit_code == 1);
    CHECK(again.err.find("out: error: exists already") != std::string::npos);
    CHECK(again.out.empty());
  }
  SUBCASE("fails in one clear line") {
    const auto typo = run("vantage-simulate", {world, "--out", out, "--set", "campus.sizex=70"});
    CHECK(typo.exit_code == 1);
    CHECK(typo.err.find("unknown key 'sizex'; did you mean 'size_x'?") != std::string::npos);
    CHECK(std::count(typo.err.begin(), typo.err.end(), '\n') == 1);
    const auto missing = run("vantage-simulate", {world + "x", "--out", out});
    CHECK(missing.exit_code == 1);
    CHECK(std::count(missing.err.begin(), missing.err.end(), '\n') == 1);
    CHECK_FALSE(fs::exists(out));
  }
  SUBCASE("knows wrong usage") {
    CHECK(run("vantage-simulate", {world}).exit_code == 2);
    CHECK(run("vantage-simulate", {world, "--out", out, "--jobs", "many"}).exit_code == 2);
    CHECK(run("vantage-simulate", {"--help"}).exit_code == 0);
  }
}

TEST_CASE("the world files that come with the project are valid") {
  int files = 0;
  for (const auto& entry :
       fs::directory_iterator(fs::path(VANTAGE_SOURCE_DIR) / "configs/simulate")) {
    const auto world = load_world(entry.path());
    CHECK_MESSAGE(world, to_string(world.error()));
    ++files;
  }
  CHECK(files >= 3);
}

}  // namespace
}  // namespace vantage::simulation
