#include "vantage/io/pose_priors.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>

#include "files.hpp"
#include "io/ros/message_writers.hpp"
#include "ros_messages.hpp"
#include "support/bags/bags.hpp"
#include "support/bags/nav_sat_fix.hpp"

namespace vantage {
namespace {

using io::PosePriors;
using io::PriorSource;
using test::check_clear;
using test::MessageWriter;
using test::TemporaryFolder;
using test::TestFix;
using test::TestMessage;

using PriorCovariance = std::array<double, 36>;
constexpr std::int64_t kPriorSecond = 1'000'000'000;  // [ns]
constexpr double kInfiniteSigma = std::numeric_limits<double>::infinity();
const double kTenDegrees = 10.0 * M_PI / 180.0;

PriorCovariance covariance_of(double x, double y, double z, double yaw) {
  PriorCovariance covariance{};
  covariance[0] = x;
  covariance[7] = y;
  covariance[14] = z;
  covariance[21] = covariance[28] = 77.0;  // roll and pitch
  covariance[35] = yaw;
  covariance[1] = covariance[6] = 0.125;
  return covariance;
}

std::string pose_with_covariance(std::uint32_t seconds, const PriorCovariance& covariance,
                                 MessageWriter::Layout layout) {
  MessageWriter message(layout);
  message.header(seconds, 0, "map");
  message.numbers(std::array<double, 7>{10.0 + seconds, 20.0, 3.0, 0.0, 0.0, 0.6, 0.8});
  message.numbers(covariance);
  return message.bytes();
}

std::string prior_odometry(std::uint32_t seconds, const PriorCovariance& covariance,
                           MessageWriter::Layout layout) {
  MessageWriter message(layout);
  message.header(seconds, 0, "map").text("base_link");
  message.numbers(std::array<double, 7>{10.0 + seconds, 20.0, 3.0, 0.0, 0.0, 0.6, 0.8});
  message.numbers(covariance).numbers(std::array<double, 6>{}).numbers(PriorCovariance{});
  return message.bytes();
}

/// A bag of ROS 1 or 2 with one message a second from 1 s on.
std::filesystem::path prior_bag(const TemporaryFolder& folder, MessageWriter::Layout layout,
                                const std::string& package, const std::string& type,
                                const std::vector<std::string>& messages) {
  const bool ros1 = layout == MessageWriter::Layout::ros1;
  std::vector<TestMessage> all;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    all.push_back({"/prior", package + (ros1 ? "/" : "/msg/") + type,
                   kPriorSecond * static_cast<std::int64_t>(i + 1), messages[i]});
  }
  return test::put(folder.path() / "prior.bag", ros1 ? test::rosbag1(all) : test::mcap(all));
}

std::filesystem::path fix_bag(const TemporaryFolder& folder, const std::vector<TestFix>& all,
                              MessageWriter::Layout layout = MessageWriter::Layout::cdr_little) {
  std::vector<std::string> messages;
  for (const TestFix& fix : all) messages.push_back(test::nav_sat_fix(fix, layout));
  return prior_bag(folder, layout, "sensor_msgs", "NavSatFix", messages);
}

std::filesystem::path put_projector(const TemporaryFolder& folder) {
  return test::put(folder.path() / "map_projector_info.yaml",
                   "projector_type: MGRS\nvertical_datum: WGS84\nmgrs_grid: 54SUE\n");
}

PosePriors read_sound_priors(const PriorSource& source, const io::SensorFrame& sensor = {}) {
  auto found = io::read_priors(source, sensor);
  REQUIRE_MESSAGE(found, to_string(found.error()));
  REQUIRE_FALSE(found->priors.empty());
  return *std::move(found);
}

void refused_priors(const PriorSource& source, const io::SensorFrame& sensor, ErrorCode code,
                    const std::string& expected) {
  const auto found = io::read_priors(source, sensor);
  REQUIRE_FALSE(found);
  check_clear(found.error(), code, source.path.filename().string(), expected);
}

void check_sigmas(const PosePrior& prior, const Eigen::Vector3d& translation, double heading) {
  for (Eigen::Index i = 0; i < 3; ++i) {
    CAPTURE(i);
    if (std::isinf(translation[i])) {
      CHECK(std::isinf(prior.sigma_translation[i]));
    } else {
      CHECK(prior.sigma_translation[i] == doctest::Approx(translation[i]));
    }
  }
  if (std::isinf(heading)) {
    CHECK(std::isinf(prior.sigma_heading));
  } else {
    CHECK(prior.sigma_heading == doctest::Approx(heading));
  }
}

TEST_CASE("priors: poses with a covariance, in every message and encoding") {
  const PriorCovariance covariance = covariance_of(4.0, 9.0, 16.0, 0.04);
  for (const auto layout : test::kLayouts) {
    for (const bool odom : {false, true}) {
      CAPTURE(odom);
      const TemporaryFolder folder;
      std::vector<std::string> messages;
      for (const std::uint32_t second : {1U, 2U}) {
        messages.push_back(odom ? prior_odometry(second, covariance, layout)
                                : pose_with_covariance(second, covariance, layout));
      }
      const auto path = prior_bag(folder, layout, odom ? "nav_msgs" : "geometry_msgs",
                                  odom ? "Odometry" : "PoseWithCovarianceStamped", messages);
      const auto found = read_sound_priors({.path = path}, {.name = "base_link"});
      REQUIRE(found.priors.size() == 2);
      CHECK(found.priors[1].stamp == 2.0);
      CHECK(found.priors[1].prior.T_map_sensor.translation == Eigen::Vector3d(12.0, 20.0, 3.0));
      check_sigmas(found.priors[1].prior, {2.0, 3.0, 4.0}, 0.2);
      CHECK(found.notes.empty());
      const auto forced = read_sound_priors(
          {.path = path, .topic = "/prior", .sigmas = io::PriorSigmas{1.0, 2.0, kInfiniteSigma}},
          {.name = "base_link"});
      check_sigmas(forced.priors[0].prior, {1.0, 1.0, 2.0}, kInfiniteSigma);
    }
  }
}

TEST_CASE("priors: poses without a covariance") {
  const TemporaryFolder folder;
  const auto message = io::ros::write_pose_stamped({.stamp = 1.0, .frame = "map"}, Pose{}).value();
  const auto path = prior_bag(folder, MessageWriter::Layout::cdr_little, "geometry_msgs",
                              "PoseStamped", {message});
  check_sigmas(read_sound_priors({.path = path}).priors[0].prior, {5.0, 5.0, 1.0}, kTenDegrees);
}

TEST_CASE("priors: variances that say nothing") {
  struct Row {
    double x, y, z, yaw;
    Eigen::Vector3d translation;
    double heading;
  };
  const double nan = std::nan("");
  for (const Row& row : {
           Row{0.0, 0.0, 0.0, 0.0, {5.0, 5.0, 1.0}, kTenDegrees},
           Row{-1.0, nan, 4.0, -1.0, {5.0, 5.0, 2.0}, kTenDegrees},
           Row{1.0, 1.0, 1e5, 1e9, {1.0, 1.0, kInfiniteSigma}, kInfiniteSigma},
           Row{99999.0,
               kInfiniteSigma,
               1.0,
               10.0,
               {std::sqrt(99999.0), kInfiniteSigma, 1.0},
               kInfiniteSigma},
       }) {
    const TemporaryFolder folder;
    const auto layout = MessageWriter::Layout::cdr_little;
    const auto covariance = covariance_of(row.x, row.y, row.z, row.yaw);
    const auto path = prior_bag(folder, layout, "geometry_msgs", "PoseWithCovarianceStamped",
                                {pose_with_covariance(1, covariance, layout)});
    check_sigmas(read_sound_priors({.path = path}).priors[0].prior, row.translation, row.heading);
  }
  SUBCASE("at all") {
    const TemporaryFolder folder;
    const auto layout = MessageWriter::Layout::cdr_little;
    const auto nothing = covariance_of(1e6, 1e6, 1e6, 1e6);
    const auto some = covariance_of(1.0, 1e6, 1e6, 1e6);
    const auto both = prior_bag(
        folder, layout, "geometry_msgs", "PoseWithCovarianceStamped",
        {pose_with_covariance(1, nothing, layout), pose_with_covariance(2, some, layout)});
    const auto found = read_sound_priors({.path = both});
    CHECK(found.priors.size() == 1);
    CHECK(found.notes ==
          std::vector<std::string>{"1 message of /prior whose variances say nothing was left out"});
    const auto none = prior_bag(folder, layout, "geometry_msgs", "PoseWithCovarianceStamped",
                                {pose_with_covariance(1, nothing, layout)});
    refused_priors({.path = none}, {}, ErrorCode::corrupt_data,
                   "the variances of all 1 messages of /prior say that nothing is known");
  }
}

TEST_CASE("priors: a vehicle's poses are carried to its sensor, with what the heading adds") {
  const TemporaryFolder folder;
  const auto layout = MessageWriter::Layout::ros1;
  const auto path = prior_bag(folder, layout, "nav_msgs", "Odometry",
                              {prior_odometry(1, covariance_of(4.0, 9.0, 16.0, 0.04), layout)});
  Pose mount;
  mount.translation = {3.0, 4.0, 2.0};
  const auto found =
      read_sound_priors({.path = path}, {.name = "velodyne", .T_child_sensor = mount});
  const PosePrior& prior = found.priors[0].prior;
  const Pose vehicle{{0.8, 0.0, 0.0, 0.6}, {11.0, 20.0, 3.0}};
  CHECK((prior.T_map_sensor.translation - (vehicle * mount).translation).norm() < 1e-12);
  // 5 m from the vehicle's origin, 0.2 rad
  check_sigmas(prior, {std::hypot(2.0, 1.0), std::hypot(3.0, 1.0), 4.0}, 0.2);
  refused_priors(
      {.path = path}, {.name = "velodyne"}, ErrorCode::invalid_input,
      "the poses of /prior are those of frame 'base_link', the scans are in frame 'velodyne'");
}

TEST_CASE("priors: NavSatFix in every encoding") {
  for (const auto layout : test::kLayouts) {
    const TemporaryFolder folder;
    const auto path =
        fix_bag(folder, {{.seconds = 1}, {.seconds = 2, .covariance_type = 0}}, layout);
    const auto found = read_sound_priors({.path = path, .map_projector = put_projector(folder)});
    REQUIRE(found.priors.size() == 2);
    CHECK(found.priors[0].stamp == 1.5);
    const PosePrior& prior = found.priors[0].prior;
    // echo 35.6586 139.7454 | GeoConvert -u -p 6, from the corner of 54SUE
    const Eigen::Vector3d expected(86437.602781, 46808.155174, 50.0);
    CHECK((prior.T_map_sensor.translation - expected).norm() < 2e-6);
    check_sigmas(prior, {2.0, 3.0, 4.0}, kInfiniteSigma);
    check_sigmas(found.priors[1].prior, {5.0, 5.0, 1.0}, kInfiniteSigma);
    CHECK(found.notes.empty());
    const auto forced = read_sound_priors({.path = path,
                                           .sigmas = io::PriorSigmas{1.0, 2.0, 0.1},
                                           .map_projector = put_projector(folder)});
    check_sigmas(forced.priors[0].prior, {1.0, 1.0, 2.0}, kInfiniteSigma);  // it has no heading
  }
}

TEST_CASE("priors: messages of NavSatFix that cannot be used are left out and counted") {
  const TemporaryFolder folder;
  const double nan = std::nan("");
  const auto projector = put_projector(folder);
  const auto path = fix_bag(folder, {{.seconds = 1, .status = -1},
                                     {.seconds = 2, .status = -2, .latitude = nan},
                                     {.seconds = 3, .latitude = nan},
                                     {.seconds = 4, .longitude = nan},
                                     {.seconds = 6},
                                     {.seconds = 6},
                                     {.seconds = 7, .latitude = 0.0, .longitude = 0.0},
                                     {.seconds = 8, .latitude = 95.0}});
  const auto found = read_sound_priors({.path = path, .map_projector = projector});
  CHECK(found.priors.size() == 1);
  CHECK(found.priors[0].stamp == 6.5);
  CHECK(found.notes ==
        std::vector<std::string>{
            "2 messages of /prior without a fix were left out",
            "2 messages of /prior whose position is not finite were left out",
            "2 messages of /prior far from the map or not on the earth were left out",
            "1 message of /prior stamped no later than the one before was left out"});
  const auto none =
      fix_bag(folder, {{.seconds = 1, .status = -1}, {.seconds = 2, .longitude = nan}});
  refused_priors(
      {.path = none, .map_projector = projector}, {}, ErrorCode::corrupt_data,
      "no message of /prior can be used: 1 without a fix, 1 whose position is not finite");
  const auto moved = fix_bag(folder, {{.seconds = 1}, {.seconds = 2, .frame = "other"}});
  refused_priors({.path = moved, .map_projector = projector}, {}, ErrorCode::corrupt_data,
                 "the position is that of 'other', expected that of 'gnss' as before");
}

TEST_CASE("priors: a message of NavSatFix without an altitude says where it is in the plan") {
  const TemporaryFolder folder;
  const double nan = std::nan("");
  const auto projector = put_projector(folder);
  const auto known =
      read_sound_priors({.path = fix_bag(folder, {{.seconds = 1}}), .map_projector = projector});
  const Eigen::Vector3d expected = known.priors[0].prior.T_map_sensor.translation;
  const auto path = fix_bag(
      folder, {{.seconds = 1, .altitude = nan}, {.seconds = 2}, {.seconds = 3, .altitude = nan}});
  for (const bool forced : {false, true}) {
    PriorSource source{.path = path, .map_projector = projector};
    if (forced) source.sigmas = io::PriorSigmas{2.0, 4.0, 0.1};
    const auto found = read_sound_priors(source);
    REQUIRE(found.priors.size() == 3);
    for (std::size_t i = 0; i < 3; ++i) {
      CAPTURE(i);
      const PosePrior& prior = found.priors[i].prior;
      CHECK((prior.T_map_sensor.translation - expected).norm() < 1e-9);
      CHECK(std::isinf(prior.sigma_translation.z()) == (i != 1));
      CHECK(prior.sigma_translation.x() == doctest::Approx(2.0));
    }
    CHECK(found.notes ==
          std::vector<std::string>{"2 messages of /prior have no altitude and give no height"});
  }
  // Between measurements, z is not drawn to a height that nobody knows.
  const auto between =
      io::prior_at(read_sound_priors({.path = path, .map_projector = projector}), 2.75);
  REQUIRE(between);
  CHECK(between->T_map_sensor.translation.z() == doctest::Approx(expected.z()));
  CHECK(between->sigma_translation.z() == doctest::Approx(4.0));
  const auto none = read_sound_priors(
      {.path = fix_bag(folder, {{.seconds = 1, .altitude = nan}}), .map_projector = projector});
  CHECK(std::isinf(none.priors[0].prior.sigma_translation.z()));
  CHECK((none.priors[0].prior.T_map_sensor.translation - expected).head<2>().norm() < 1e-6);
}

TEST_CASE("priors: a bag that is cut off gives the positions before the cut, and says it") {
  const TemporaryFolder folder;
  const std::filesystem::path projector = put_projector(folder);
  std::vector<TestFix> fixes(20);
  for (std::uint32_t i = 0; i < fixes.size(); ++i) fixes[i].seconds = i + 1;
  for (const auto layout : {MessageWriter::Layout::ros1, MessageWriter::Layout::cdr_little}) {
    const auto path = fix_bag(folder, fixes, layout);
    const PriorSource source{.path = path, .map_projector = projector};
    const PosePriors all = read_sound_priors(source);
    CHECK(all.priors.size() == 20);
    CHECK_FALSE(all.damage);
    std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
    const PosePriors some = read_sound_priors(source);
    CHECK(some.priors.size() >= 2);
    CHECK(some.priors.size() < 20);
    REQUIRE(some.damage);
    check_clear(*some.damage, ErrorCode::corrupt_data, "prior.bag", "the file ends at byte");
  }
}

TEST_CASE("priors: where the sensor is from the antenna") {
  const TemporaryFolder folder;
  const auto projector = put_projector(folder);
  const auto path = fix_bag(folder, {{.seconds = 1}});
  Pose mount;
  mount.translation = {3.0, 4.0, -2.0};
  for (const std::string name : {"velodyne", ""}) {
    const auto found = read_sound_priors({.path = path, .map_projector = projector},
                                         {.name = name, .T_child_sensor = mount});
    const PosePrior& prior = found.priors[0].prior;
    CHECK(prior.T_map_sensor.translation.x() == doctest::Approx(86437.602781).epsilon(1e-10));
    CHECK(prior.T_map_sensor.translation.z() == 48.0);
    check_sigmas(prior, {std::hypot(2.0, 5.0), std::hypot(3.0, 5.0), 4.0}, kInfiniteSigma);
  }
  refused_priors(
      {.path = path, .map_projector = projector}, {.name = "velodyne"}, ErrorCode::invalid_input,
      "the positions of /prior are those of frame 'gnss', the scans are in frame 'velodyne'");
  const auto same = read_sound_priors({.path = path, .map_projector = projector}, {.name = "gnss"});
  CHECK(same.priors[0].prior.T_map_sensor.translation.z() == 50.0);
}

TEST_CASE("priors: NavSatFix needs a projection, which may be beside the map") {
  const TemporaryFolder folder;
  const auto path = fix_bag(folder, {{.seconds = 1}});
  refused_priors(
      {.path = path}, {}, ErrorCode::invalid_input,
      "/prior has latitudes and longitudes, and no map_projector_info.yaml says where the map "
      "is on the earth; name one with --map-projector");
  const auto map = folder.path() / "map.pcd";
  const auto without = io::read_priors({.path = path, .map_files = {map}}, {});
  REQUIRE_FALSE(without);
  CHECK(without.error().message.find("(there is no " +
                                     (folder.path() / "map_projector_info.yaml").string() + ")") !=
        std::string::npos);
  put_projector(folder);
  CHECK(read_sound_priors({.path = path, .map_files = {map}}).priors.size() == 1);
  test::put(folder.path() / "map_projector_info.yaml", "projector_type: local\n");
  const auto local = io::read_priors({.path = path, .map_files = {map}}, {});
  REQUIRE_FALSE(local);
  CHECK(local.error().message.find("has no georeference") != std::string::npos);
}

TEST_CASE("priors: heights that are unknown have an infinite sigma and a note") {
  const TemporaryFolder folder;
  const auto projector =
      test::put(folder.path() / "p.yaml",
                "projector_type: LocalCartesianUTM\nvertical_datum: WGS84\n"
                "map_origin: {latitude: 35.6, longitude: 139.7, altitude: 12}\n");
  const auto found =
      read_sound_priors({.path = fix_bag(folder, {{.seconds = 1}}), .map_projector = projector});
  check_sigmas(found.priors[0].prior, {2.0, 3.0, kInfiniteSigma}, kInfiniteSigma);
  REQUIRE(found.notes.size() == 1);
  CHECK(found.notes[0].find("heights are not used") == 0);
}

TEST_CASE("priors: the topic of a bag") {
  const TemporaryFolder folder;
  const auto layout = MessageWriter::Layout::cdr_little;
  const auto put_bag = [&](const std::vector<TestMessage>& messages) {
    return test::put(folder.path() / "run.mcap", test::mcap(messages));
  };
  const TestMessage odom{"/odom", "nav_msgs/msg/Odometry", kPriorSecond,
                         prior_odometry(1, PriorCovariance{}, layout)};
  const TestMessage fix{"/fix", "sensor_msgs/msg/NavSatFix", kPriorSecond,
                        test::nav_sat_fix({.seconds = 1}, layout)};
  const TestMessage pose{"/gnss_pose", "geometry_msgs/msg/PoseWithCovarianceStamped", kPriorSecond,
                         pose_with_covariance(1, PriorCovariance{}, layout)};
  const auto projector = put_projector(folder);
  const auto source_of = [&](const std::vector<TestMessage>& messages, const std::string& topic) {
    const auto path = put_bag(messages);
    const auto found =
        io::read_priors({.path = path, .topic = topic, .map_projector = projector}, {.name = ""});
    return found ? found->source.substr(path.string().size()) : found.error().message;
  };
  CHECK(source_of({odom}, "") == " /odom");
  CHECK(source_of({odom, fix}, "") == " /fix");
  CHECK(source_of({odom, pose}, "") == " /gnss_pose");
  CHECK(source_of({odom, fix, pose}, "/odom") == " /odom");
  CHECK(source_of({odom, fix, pose}, "").find("2 topics have absolute poses or positions") == 0);
  CHECK(source_of({odom, fix}, "/imu")
            .find("there is no topic '/imu'; topics with absolute poses "
                  "or positions: /fix (sensor_msgs/NavSatFix), /odom") == 0);
}

TEST_CASE("priors: sigmas that are none are refused") {
  const TemporaryFolder folder;
  const auto file = test::put(folder.path() / "a.tum", "1 1 0 0 0 0 0 1\n2 2 0 0 0 0 0 1\n");
  for (const io::PriorSigmas& sigmas :
       {io::PriorSigmas{0.0, 1.0, 1.0}, io::PriorSigmas{1.0, -1.0, 1.0},
        io::PriorSigmas{1.0, 1.0, std::nan("")},
        io::PriorSigmas{kInfiniteSigma, kInfiniteSigma, kInfiniteSigma}}) {
    refused_priors({.path = file, .sigmas = sigmas}, {}, ErrorCode::invalid_input,
                   "expected numbers above 0, at least one of them finite");
  }
  refused_priors({.path = file, .topic = "/gnss"}, {}, ErrorCode::invalid_input, "no topics");
}

TEST_CASE("prior_at: poses between measurements, sigmas of the nearer one, none in gaps") {
  const auto prior = [](double stamp, double x, double sigma) {
    return io::StampedPrior{stamp,
                            {.T_map_sensor = {{}, {x, 0.0, 0.0}},
                             .sigma_translation = {sigma, sigma, sigma},
                             .sigma_heading = sigma}};
  };
  const PosePriors priors{
      .priors = {prior(1.0, 0.0, 1.0), prior(3.0, 4.0, 2.0), prior(5.6, 5.0, 3.0)},
      .source = "memory"};
  const auto at = [&](double stamp) { return io::prior_at(priors, stamp); };
  REQUIRE(at(1.5));
  CHECK(at(1.5)->T_map_sensor.translation.x() == doctest::Approx(1.0));
  CHECK(at(1.5)->sigma_heading == 1.0);
  CHECK(at(2.0)->sigma_heading == 1.0);  // the earlier one of two that are as near
  CHECK(at(2.5)->sigma_heading == 2.0);
  CHECK(at(3.0)->sigma_translation.x() == 2.0);
  CHECK(at(3.0)->T_map_sensor.translation.x() == 4.0);
  CHECK_FALSE(at(4.0));  // 2.6 s without a measurement
  CHECK(at(3.0005)->sigma_heading == 2.0);
  CHECK(at(0.9995)->sigma_heading == 1.0);
  CHECK(at(5.6005)->sigma_heading == 3.0);
  CHECK_FALSE(at(0.9));
  CHECK_FALSE(at(5.7));
  CHECK_FALSE(at(std::nan("")));
  CHECK(io::prior_at(priors, 4.0, 3.0));
}

}  // namespace
}  // namespace vantage
