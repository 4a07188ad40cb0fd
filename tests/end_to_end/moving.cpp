// A sensor that moves: raw sweeps of a simulated car, with what the robot has besides.
#include <doctest/doctest.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/small_config.hpp"

namespace vantage::test {
namespace {

/// A car at 8 m/s that never stops, an IMU whose clock is 0.35 s ahead, odometry; and the map.
class Car {
 public:
  Car() {
    const Finished made = test::run(
        "vantage-simulate",
        {std::string(VANTAGE_SOURCE_DIR) + "/configs/simulate/motion.toml", "--out", path("world"),
         "--quiet", "--set", "seed=23", "--set", "drive.speed=8", "--set", "drive.still_start=0",
         "--set", "drive.stops=0", "--set", "imu.clock_offset=0.35"});
    REQUIRE_MESSAGE(made.exit_code == 0, made.err);
    write_text(path("config.toml"), to_text(whole_world()));
    const Finished built = test::run("vantage-build", {path("config.toml"), "--quiet"});
    REQUIRE_MESSAGE(built.exit_code == 0, built.err);
  }

  [[nodiscard]] std::string path(const std::string& file) const {
    return (folder_.path() / file).string();
  }

  [[nodiscard]] Finished localize(std::vector<std::string> more) const {
    std::vector<std::string> arguments{path("config.toml"),
                                       "--quiet",
                                       "--json",
                                       "--scans",
                                       path("world/scans"),
                                       "--reference",
                                       path("world/reference.tum"),
                                       "--out",
                                       path("run")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return test::run("vantage-localize", arguments);
  }

 private:
  TemporaryFolder folder_;
};

/// Every scan is tracked. @return the mean error [cm]
double mean_error(const Finished& run) {
  REQUIRE_MESSAGE(run.exit_code == 0, run.err);
  const auto json = nlohmann::json::parse(run.out);
  CHECK(json["scans"]["total"] > 100);
  CHECK(json["scans"]["tracked"] == json["scans"]["total"]);
  CHECK(json["error_m"]["max"] < 0.3);
  for (const char* part : {"translation", "rotation"}) {
    CHECK(json["errors_within_1_2_3_sigma"][part][2] > 0.98);
  }
  return 100.0 * json["error_m"]["mean"].get<double>();
}

/// Made once.
const Car& car() {
  static const Car car;
  return car;
}

TEST_CASE("a car at 8 m/s is tracked from its first sweep, whatever measures its motion") {
  CHECK(mean_error(car().localize({})) < 3.0);
  CHECK(mean_error(car().localize({"--set", "localizer.motion=\"planar\""})) < 3.0);
  CHECK(mean_error(car().localize({"--odometry", car().path("world/odometry.tum")})) < 1.5);
  // Nobody knows where it is, and how fast it goes.
  CHECK(mean_error(car().localize({"--initial-pose", "auto"})) < 3.0);

  const Finished distorted = car().localize({"--set", "localizer.undistort=false"});
  REQUIRE(distorted.exit_code == 0);
  CHECK(nlohmann::json::parse(distorted.out)["error_m"]["mean"] > 0.1);
}

TEST_CASE("the clock of an IMU may be off, by an offset that is given or found by its turns") {
  const std::string imu = car().path("world/imu.csv");
  const double given = mean_error(car().localize({"--imu", imu, "--imu-offset", "-0.35"}));
  CHECK(given < 1.0);
  const Finished found = car().localize({"--imu", imu, "--imu-offset", "auto"});
  CHECK(mean_error(found) < 1.2 * given + 0.05);
  CHECK_MESSAGE(found.err.find("the stamps of the IMU get -0.3") != std::string::npos, found.err);

  const Finished word = car().localize({"--imu", imu, "--imu-offset", "now"});
  CHECK(word.exit_code != 0);
  CHECK(word.err.find("--imu-offset must be a number of seconds or 'auto'") != std::string::npos);
  const Finished alone = car().localize({"--imu-offset", "1"});
  CHECK(alone.exit_code != 0);
  CHECK(alone.err.find("--imu-offset is given without --imu") != std::string::npos);
}

}  // namespace
}  // namespace vantage::test
