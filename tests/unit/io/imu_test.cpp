#include "vantage/io/imu_io.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "bags.hpp"
#include "files.hpp"
#include "io/imu_text.hpp"
#include "io/ros/messages.hpp"
#include "ros_messages.hpp"
#include "support/bags/imu_messages.hpp"

namespace vantage::io {
namespace {

using test::check_clear;
using test::imu_message;
using test::MessageWriter;
using test::put;
using test::TemporaryFolder;
using test::TestImu;
using test::TestMessage;
using Layout = MessageWriter::Layout;

constexpr std::int64_t kMillisecond = 1'000'000;  // [ns]

/// A message stamped `milliseconds` after 100 s and recorded 3 s later.
TestMessage at(std::int64_t milliseconds, TestImu imu = {}, Layout layout = Layout::ros1,
               const std::string& topic = "/imu") {
  imu.seconds = static_cast<std::uint32_t>(100 + milliseconds / 1000);
  imu.nanoseconds = static_cast<std::uint32_t>(milliseconds % 1000 * kMillisecond);
  return {topic, layout == Layout::ros1 ? "sensor_msgs/Imu" : "sensor_msgs/msg/Imu",
          (103'000 + milliseconds) * kMillisecond, imu_message(imu, layout)};
}

ImuRecording read(const ImuSource& source) {
  auto recording = read_imu(source);
  REQUIRE_MESSAGE(recording, to_string(recording.error()));
  return *std::move(recording);
}

ImuRecording read_bag(const std::vector<TestMessage>& messages) {
  const TemporaryFolder folder;
  return read({.path = put(folder.path() / "a.bag", test::rosbag1(messages))});
}

/// `seconds` of samples at 100 Hz, of a rate and a force at a time after the first sample.
std::vector<TestMessage> recorded(double seconds, const std::function<TestImu(double)>& imu) {
  std::vector<TestMessage> messages;
  for (std::int64_t i = 0; i < std::llround(seconds * 100.0); ++i) {
    messages.push_back(at(10 * i, imu(0.01 * static_cast<double>(i))));
  }
  return messages;
}

void check_error(const ImuSource& source, ErrorCode code, const std::string& file,
                 const std::string& expected) {
  const auto recording = read_imu(source);
  REQUIRE_FALSE(recording);
  check_clear(recording.error(), code, file, expected);
}

TEST_CASE("imu: a message in each encoding, whatever its orientation") {
  const TestImu imu{.seconds = 7,
                    .nanoseconds = 250'000'000,
                    .frame = "/livox_imu",
                    .rate = {0.1, -0.2, 0.3},
                    .force = {1.0, 2.0, -9.0}};
  for (const Layout layout : test::kLayouts) {
    const std::string bytes = imu_message(imu, layout);
    const auto encoding = test::encoding_of(layout);
    const auto message = ros::parse_imu(bytes, encoding, test::kWhere);
    REQUIRE_MESSAGE(message, to_string(message.error()));
    CHECK(message->header.stamp == 7.25);
    CHECK(message->header.frame == "/livox_imu");
    CHECK(message->angular_velocity == Eigen::Vector3d(0.1, -0.2, 0.3));
    CHECK(message->linear_acceleration == Eigen::Vector3d(1.0, 2.0, -9.0));
    CHECK(message->is_measured);
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      const std::string cut = bytes.substr(0, size);
      const auto refused = ros::parse_imu(cut, encoding, test::kWhere);
      REQUIRE_FALSE(refused);
      check_clear(refused.error(), ErrorCode::corrupt_data, "run.bag", "byte");
    }
  }
  TestImu none = imu;
  none.rate_variance = -1.0;
  CHECK_FALSE(
      ros::parse_imu(imu_message(none, Layout::ros1), ros::Encoding::ros1, {})->is_measured);
  none = imu;
  none.force_variance = -1.0;
  CHECK_FALSE(
      ros::parse_imu(imu_message(none, Layout::ros1), ros::Encoding::ros1, {})->is_measured);
}

TEST_CASE("imu: bags of every kind") {
  for (const Layout layout : {Layout::ros1, Layout::cdr_little, Layout::cdr_big}) {
    std::vector<TestMessage> messages;
    for (int i = 0; i < 20; ++i) {
      messages.push_back(at(5 * i, {.frame = "/imu_link", .rate = {0.25 * i, 0.0, 1.0}}, layout));
    }
    std::vector<std::string> bags;
    if (layout == Layout::ros1) bags = {test::rosbag1(messages)};
    if (layout != Layout::ros1) bags = {test::rosbag2(messages), test::mcap(messages)};
    for (const std::string& bag : bags) {
      const TemporaryFolder folder;
      const auto path = put(folder.path() / "bag", bag);
      const ImuRecording found = read({.path = path});
      REQUIRE(found.samples.size() == 20);
      CHECK(found.samples[1].stamp == 100.005);
      CHECK(found.samples[1].angular_velocity == Eigen::Vector3d(0.25, 0.0, 1.0));
      CHECK(found.samples[1].specific_force == Eigen::Vector3d(0.0, 0.0, 9.81));
      CHECK(found.rate_hz == doctest::Approx(200.0));
      CHECK(found.frame == "imu_link");
      CHECK(found.topic == "/imu");
      CHECK(found.source == path.string() + " /imu");
      CHECK(found.stamp_rule == "stamps are those of the messages' headers");
      CHECK(found.unit == ForceUnit::metres_per_second_squared);
    }
  }
}

TEST_CASE("imu: a bag that is cut off gives the samples before the cut, and says it") {
  std::vector<TestMessage> messages;
  for (int i = 0; i < 40; ++i) messages.push_back(at(5 * i, {}, Layout::cdr_little));
  for (const bool indexed : {true, false}) {
    CAPTURE(indexed);
    const std::string whole = test::mcap(messages, {.indexed = indexed});
    const TemporaryFolder folder;
    const auto path = put(folder.path() / "a.mcap", whole.substr(0, whole.size() / 2));
    const ImuRecording found = read({.path = path});
    CHECK(found.samples.size() >= 10);
    CHECK(found.samples.size() < 40);
    REQUIRE(found.damage);
    check_clear(*found.damage, ErrorCode::corrupt_data, "a.mcap", "the file ends at byte");
    CHECK_FALSE(read({.path = put(folder.path() / "b.mcap", test::mcap(messages))}).damage);
  }
  const std::string whole = test::mcap(messages, {.indexed = false});
  const TemporaryFolder folder;
  check_error({.path = put(folder.path() / "c.mcap", whole.substr(0, 40))}, ErrorCode::corrupt_data,
              "c.mcap", "the file ends at byte 40");
}

TEST_CASE("imu: a topic is chosen as that of scans is") {
  const TemporaryFolder folder;
  std::vector<TestMessage> messages{at(0), at(5), at(0, {.frame = "other"}, Layout::ros1, "/b")};
  messages.push_back({"/name", "std_msgs/String", 0, "\1\0\0\0a"});
  const auto path = put(folder.path() / "a.bag", test::rosbag1(messages));
  CHECK(read({.path = path, .topic = "/imu"}).samples.size() == 2);
  CHECK(read({.path = path, .topic = "/b"}).frame == "other");
  check_error({.path = path}, ErrorCode::invalid_input, "a.bag",
              "2 topics have inertial samples, choose one with --imu-topic: /b "
              "(sensor_msgs/Imu), /imu (sensor_msgs/Imu)");
  check_error({.path = path, .topic = "/name"}, ErrorCode::invalid_input, "a.bag",
              "topic '/name' is of type 'std_msgs/String'");
  check_error({.path = path, .topic = "/c"}, ErrorCode::invalid_input, "a.bag",
              "there is no topic '/c'");
  messages.resize(4);
  messages.erase(messages.begin(), messages.begin() + 3);
  const auto none = put(folder.path() / "b.bag", test::rosbag1(messages));
  check_error({.path = none}, ErrorCode::invalid_input, "b.bag", "no topic has inertial samples");
  check_error({.path = path, .topic = "/b", .frame_rate_hz = 10.0}, ErrorCode::invalid_input,
              "a.bag", "has stamps of its own");
}

TEST_CASE("imu: the rate is that between pauses, of stamps that are not even") {
  std::vector<TestMessage> messages;
  for (int i = 0; i < 100; ++i)
    messages.push_back(at(i / 3 * 31 + i % 3 * 10 + (i < 50 ? 0 : 5000)));
  CHECK(read_bag(messages).rate_hz == doctest::Approx(1000.0 / 31 * 3).epsilon(0.01));
}

TEST_CASE("imu: late, equal and missing stamps, and numbers that are none") {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  std::vector<TestMessage> messages{at(0), at(20), at(10, {.rate = {0.5, 0.0, 0.0}}), at(30),
                                    at(30, {.rate = {9.0, 9.0, 9.0}})};
  messages.push_back(at(40, {.rate = {kNan, 0.0, 0.0}}));
  messages.push_back(at(50, {.force = {0.0, 0.0, kInfinite}}));
  messages.push_back(at(60, {.rate_variance = -1.0}));
  messages.push_back(at(70));
  TestMessage unstamped = at(80);
  unstamped.bytes = imu_message({}, Layout::ros1);
  messages.push_back(unstamped);
  for (std::size_t i = 0; i < messages.size(); ++i) {
    messages[i].log_time = static_cast<std::int64_t>(i) * kMillisecond;
  }
  const ImuRecording found = read_bag(messages);
  CHECK(found.out_of_order == 1);
  CHECK(found.duplicates == 1);
  CHECK(found.not_finite == 4);
  std::vector<double> stamps;
  for (const ImuSample& sample : found.samples) stamps.push_back(sample.stamp);
  CHECK(stamps == std::vector<double>{100.0, 100.01, 100.02, 100.03, 100.07});
  CHECK(found.samples[1].angular_velocity.x() == 0.5);
  CHECK(found.samples[3].angular_velocity.x() == 0.0);  // the first of two is kept

  SUBCASE("nothing that can be used is an error") {
    const TemporaryFolder folder;
    const auto path =
        put(folder.path() / "a.bag",
            test::rosbag1({at(0, {.rate = {kNan, 0.0, 0.0}}), at(5, {.force_variance = -1.0})}));
    check_error({.path = path}, ErrorCode::corrupt_data, "a.bag",
                "no inertial sample of /imu, expected at least one (2 left out");
  }
  SUBCASE("without stamps at all, log times are taken") {
    for (TestMessage& message : messages) message.bytes = imu_message({}, Layout::ros1);
    const ImuRecording logged = read_bag(messages);
    CHECK(logged.samples.size() == messages.size());
    CHECK(logged.samples[3].stamp == 0.003);
    CHECK(logged.stamp_rule.find("recorded") != std::string::npos);
  }
  SUBCASE("a first sample alone without a stamp is left out") {
    messages.front().bytes = imu_message({}, Layout::ros1);
    const ImuRecording headers = read_bag(messages);
    CHECK(headers.stamp_rule == "stamps are those of the messages' headers");
    CHECK(headers.samples.size() == 4);
    CHECK(headers.not_finite == 5);
  }
  SUBCASE("a frame that changes is an error") {
    messages.push_back(at(90, {.frame = "hand"}));
    messages.back().log_time = 90 * kMillisecond;
    const TemporaryFolder folder;
    const auto path = put(folder.path() / "a.bag", test::rosbag1(messages));
    check_error({.path = path}, ErrorCode::corrupt_data, "a.bag",
                "the sample is that of 'hand', expected that of 'imu' as before");
  }
}

TEST_CASE("imu: the unit is told by the norm while the sensor moves least") {
  const auto norm_of = [](double still, double moving) {
    // Shaken for two seconds, still for one, shaken again.
    return recorded(5.0, [=](double t) {
      const bool is_still = t >= 2.0 && t < 3.0;
      const double swing = std::sin(40.0 * t);
      return TestImu{.rate = {is_still ? 0.0 : swing, 0.0, 0.0},
                     .force = {is_still ? 0.0 : 3.0 * moving * swing, 0.0, still}};
    });
  };
  const ImuRecording metres = read_bag(norm_of(9.81, 9.81));
  CHECK(metres.unit == ForceUnit::metres_per_second_squared);
  CHECK(to_string(metres.unit) == "m/s^2");
  CHECK(metres.still_force == doctest::Approx(9.81));
  CHECK(metres.samples[250].specific_force.z() == 9.81);
  const ImuRecording gs = read_bag(norm_of(1.0, 1.0));
  CHECK(gs.unit == ForceUnit::standard_gravity);
  CHECK(to_string(gs.unit) == "g");
  CHECK(gs.still_force == doctest::Approx(1.0));
  CHECK(gs.samples[250].specific_force.z() == doctest::Approx(9.80665));
  CHECK(gs.samples[10].specific_force.x() == doctest::Approx(9.80665 * 3.0 * std::sin(40.0 * 0.1)));
  for (const double edge : {0.81, 1.19}) {
    CHECK(read_bag(norm_of(edge, edge)).unit == ForceUnit::standard_gravity);
  }
  for (const double edge : {7.01, 11.99}) {
    CHECK(read_bag(norm_of(edge, edge)).unit == ForceUnit::metres_per_second_squared);
  }
  for (const double wrong : {0.0, 0.79, 1.21, 6.99, 12.01, 981.0}) {
    const TemporaryFolder folder;
    const auto path = put(folder.path() / "a.bag", test::rosbag1(norm_of(wrong, wrong)));
    check_error({.path = path}, ErrorCode::corrupt_data, "a.bag",
                fmt::format("a mean norm of {:.4g} in the second in which the sensor moves least, "
                            "expected gravity: 0.8 to 1.2 (g) or 7 to 12 (m/s^2)",
                            wrong));
  }
}

TEST_CASE("imu: a recording that begins at rest gives the bias and gravity, in any mount") {
  std::mt19937 random(7);
  std::normal_distribution<double> noise;
  const Eigen::Vector3d bias(0.04, -0.05, 0.03);  // of a hot sensor
  for (const Eigen::Vector3d& up :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0.6, -0.8, 0.0)}) {
    for (const double unit : {1.0, 9.81}) {
      const auto imu = [&](double rest) {
        return recorded(20.0, [&, rest](double t) {
          const double turn = t < rest ? 0.0 : std::sin(t - rest);
          TestImu sample;
          for (std::size_t i = 0; i < 3; ++i) {
            const auto axis = static_cast<Eigen::Index>(i);
            sample.rate[i] = bias[axis] + turn + 0.002 * noise(random);
            sample.force[i] = unit * (up[axis] + 0.001 * noise(random));
          }
          return sample;
        });
      };
      const ImuRecording found = read_bag(imu(4.0));
      REQUIRE(found.rest);
      CHECK(found.rest->seconds > 2.9);
      CHECK(found.rest->seconds < 4.1);
      CHECK((found.rest->gyro_bias - bias).norm() < 0.001);
      CHECK((found.rest->gravity + up).norm() < 0.001);
      CHECK(found.rest->gravity.norm() == doctest::Approx(1.0));
      CHECK(found.rest->force == doctest::Approx(unit == 1.0 ? 9.80665 : 9.81).epsilon(0.001));
      CHECK(read_bag(imu(30.0)).rest->seconds < 10.0);
      CHECK_FALSE(read_bag(imu(0.0)).rest);
      CHECK_FALSE(read_bag(imu(0.5)).rest);
    }
  }
  SUBCASE("not so a sensor that turns evenly") {
    CHECK_FALSE(read_bag(recorded(5.0, [](double) {
                  return TestImu{.rate = {0.0, 0.0, 0.2}};
                })).rest);
  }
  SUBCASE("or that is shaken") {
    CHECK_FALSE(read_bag(recorded(5.0, [](double t) {
                  return TestImu{.force = {std::sin(60.0 * t), 0.0, 9.81}};
                })).rest);
  }
  SUBCASE("or a few samples") {
    CHECK_FALSE(read_bag({at(0), at(10), at(20), at(30), at(40), at(50)}).rest);
    CHECK(read_bag({at(0)}).rate_hz == 0.0);
  }
}

const std::string kOwn = "t,wx,wy,wz,ax,ay,az\n";
const std::string kEuroc =
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n";

ImuRecording read_csv(const std::string& content) {
  const TemporaryFolder folder;
  const auto path = put(folder.path() / "imu.csv", content);
  CHECK(is_imu(path));
  return read({.path = path});
}

TEST_CASE("imu: CSV with Vantage's columns and with EuRoC's") {
  const ImuRecording own = read_csv("\n" + kOwn +
                                    "1.5,0.1,0.2,0.3,0,0.6,0.8\r\n"
                                    "# a comment\n1.51, 0.4 ,0.5,-0.6,0.0,0.0,-1e0\n\n");
  REQUIRE(own.samples.size() == 2);
  CHECK(own.unit == ForceUnit::standard_gravity);
  CHECK(own.samples[1].stamp == 1.51);
  CHECK(own.samples[1].angular_velocity == Eigen::Vector3d(0.4, 0.5, -0.6));
  CHECK(own.samples[1].specific_force.z() == -9.80665);
  CHECK(own.topic.empty());
  CHECK(own.frame.empty());

  // The digits of a double do not suffice for nanoseconds since the epoch.
  const ImuRecording euroc =
      read_csv(kEuroc + "1403636579758555392,-0.099,0.147,0.0279,8.1476,-0.375,-2.404\n" +
               "1403636579763555584,-0.1,0.15,0.03,8.0330,-0.4,-2.4\n");
  REQUIRE(euroc.samples.size() == 2);
  CHECK(euroc.samples[0].stamp == ros::seconds_from(1403636579758555392));
  CHECK(euroc.samples[0].angular_velocity == Eigen::Vector3d(-0.099, 0.147, 0.0279));
  CHECK(euroc.samples[0].specific_force == Eigen::Vector3d(8.1476, -0.375, -2.404));
  CHECK(euroc.rate_hz == doctest::Approx(200.0).epsilon(0.001));

  SUBCASE("columns in any order, and others") {
    const ImuRecording found =
        read_csv("temperature,az,ay,ax,timestamp [us],wz,wy,wx\n17,9.8,2,1,1500000,0.3,0.2,0.1\n");
    CHECK(found.samples[0].stamp == 1.5);
    CHECK(found.samples[0].angular_velocity == Eigen::Vector3d(0.1, 0.2, 0.3));
    CHECK(found.samples[0].specific_force == Eigen::Vector3d(1.0, 2.0, 9.8));
  }
  SUBCASE("gaps in the data") {
    const ImuRecording found =
        read_csv(kOwn + "1,0,0,0,0,0,1\n2,,0,0,0,0,1\n3,nan,0,0,0,0,1\ninf,0,0,0,0,0,1\n");
    CHECK(found.samples.size() == 1);
    CHECK(found.not_finite == 3);
  }
}

TEST_CASE("imu: CSV that is refused, with the line") {
  const auto refused = [](const std::string& content, std::uint32_t line,
                          const std::string& expected) {
    CAPTURE(content);
    const auto raw = parse_imu_csv(content, "imu.csv");
    REQUIRE_FALSE(raw);
    check_clear(raw.error(), ErrorCode::corrupt_data, "imu.csv", expected);
    REQUIRE(raw.error().where.has_value());
    CHECK(raw.error().where->line == line);
  };
  refused("", 0, "no line, expected t,wx,wy,wz,ax,ay,az");
  refused("1,2,3,4,5,6,7\n", 1, "no column t in the first line '1,2,3,4,5,6,7', expected t,wx");
  refused("t,wx,wy,ax,ay,az\n", 1, "no column wz in the first line");
  refused("t,t,wx,wy,wz,ax,ay,az\n", 1, "two columns are named 't'");
  refused("t [h],wx,wy,wz,ax,ay,az\n", 1, "stamps are in 'h', expected s, us or ns");
  refused("t,wx [deg/s],wy,wz,ax,ay,az\n", 1, "'wx' is in 'deg/s', expected rad/s");
  refused(kOwn + "1600000000000000000,2,3,4,5,6,7\n", 2, "1.6e+18 is no stamp in seconds");
  refused(kOwn + "1,2,3,4,5,6\n", 2, "expected 7 columns as in the first line, found 6");
  refused(kOwn + "\n1,2,3,x,5,6,7\n", 3, "expected a number in column 4, found 'x'");
  refused(kEuroc + "1.5,2,3,4,5,6,7\n", 2, "expected a whole number in column 1, found '1.5'");
  const TemporaryFolder folder;
  check_error({.path = put(folder.path() / "a.csv", kOwn)}, ErrorCode::corrupt_data, "a.csv",
              "no inertial sample, expected at least one");
  const auto words = put(folder.path() / "b.csv", "some words\n");
  CHECK_FALSE(is_imu(words));
  CHECK_FALSE(is_imu(folder.path()));
  CHECK_FALSE(is_imu(folder.path() / "none.csv"));
  check_error({.path = words, .topic = "/imu"}, ErrorCode::invalid_input, "b.csv",
              "only bags have topics");
  check_error({.path = folder.path() / "none.csv"}, ErrorCode::not_found, "none.csv",
              "expected inertial samples (IMU CSV, KITTI oxts, ROS bag or MCAP)");
  check_error({.path = folder.path()}, ErrorCode::invalid_input, folder.path(),
              "neither a bag nor KITTI's oxts");
}

/// A frame of oxts whose column i is i, but for the force.
std::string oxts_frame(double force) {
  std::string line;
  for (int i = 0; i < 30; ++i) {
    line += i == 13              ? fmt::format("{} ", force)
            : i == 11 || i == 12 ? "0.5 "
                                 : fmt::format("{} ", i);
  }
  return line + "\n";
}

TEST_CASE("imu: KITTI's oxts") {
  const TemporaryFolder folder;
  const auto oxts = folder.path() / "oxts";
  std::filesystem::create_directories(oxts / "data");
  put(oxts / "data" / "0000000000.txt", oxts_frame(9.8));
  put(oxts / "data" / "0000000002.txt", oxts_frame(9.9));  // one was not recorded
  put(oxts / "data" / "readme.md", "no frame");
  const auto times = put(oxts / "timestamps.txt",
                         "2011-09-26 13:04:32.349659964\n2011-09-26 13:04:32.459792166\n"
                         "2012-02-29 00:00:00.500000000\n");
  CHECK(is_imu(oxts));
  const ImuRecording own = read({.path = oxts});
  REQUIRE(own.samples.size() == 2);
  CHECK(own.samples[0].stamp == doctest::Approx(1317042272.349659964).epsilon(1e-15));
  CHECK(own.samples[1].stamp == 1330473600.5);
  CHECK(own.samples[0].angular_velocity == Eigen::Vector3d(17, 18, 19));
  CHECK(own.samples[1].specific_force == Eigen::Vector3d(0.5, 0.5, 9.9));
  const ImuRecording by_frame = read({.path = oxts, .frame_rate_hz = 10.0});
  REQUIRE(by_frame.samples.size() == 2);
  CHECK(by_frame.samples[0].stamp == 0.0);
  CHECK(by_frame.samples[1].stamp == 0.2);
  CHECK(by_frame.stamp_rule == "stamps are frame numbers / 10 Hz");

  SUBCASE("that is refused") {
    const auto refused = [&](ErrorCode code, const std::string& file, const std::string& expected) {
      check_error({.path = oxts}, code, file, expected);
    };
    check_error({.path = oxts, .frame_rate_hz = 0.0}, ErrorCode::invalid_input, "oxts",
                "the rate is 0 Hz, expected a number above 0");
    put(times, "2011-09-26 13:04:32.3\n2011-09-26 13:04:32.4\n");
    refused(ErrorCode::corrupt_data, "timestamps.txt",
            "there are 2 stamps, expected one for the frame 0000000002.txt");
    for (const char* wrong :
         {"2011-13-26 13:04:32.3", "2011-02-29 13:04:32.3", "2011-09-26T13:04:32.3",
          "2011-09-26 13:04", "13:04:32.3", "2011-09-26 13:04:61.0", "2011-09-26 13:04:x"}) {
      put(times, std::string("2011-09-26 13:04:32.3\n") + wrong + "\n");
      refused(ErrorCode::corrupt_data, "timestamps.txt:2", "expected a time as in 2011-09-26");
    }
    put(oxts / "data" / "0000000002.txt", "1 2 3 four\n");
    CHECK_FALSE(read_imu({.path = oxts, .frame_rate_hz = 10.0}).has_value());
    check_error({.path = oxts, .frame_rate_hz = 10.0}, ErrorCode::corrupt_data, "0000000002.txt:1",
                "expected a number in column 4 of 30, found 'four'");
    put(oxts / "data" / "0000000002.txt", "1 2 3\n");
    check_error({.path = oxts, .frame_rate_hz = 10.0}, ErrorCode::corrupt_data, "0000000002.txt:1",
                "expected a number in column 4 of 30, found the end");
    std::filesystem::remove(times);
    put(oxts / "dataformat.txt", "lat: latitude");
    refused(ErrorCode::not_found, "timestamps.txt", "");
  }
}

TEST_CASE("imu: recorded sensors, upright, upside down and on a car") {
  if (const auto path = test::real_data("imu/phidgets_imu_upside_down.bag")) {
    const ImuRecording found = read({.path = *path});
    CHECK(found.unit == ForceUnit::metres_per_second_squared);
    CHECK(found.frame == "imu");
    CHECK(found.samples.size() == 13964);
    CHECK(found.rate_hz == doctest::Approx(250.0).epsilon(0.01));
    REQUIRE(found.rest);
    CHECK(found.rest->gravity.z() > 0.99);
    CHECK(found.rest->gyro_bias.norm() < 0.003);
  }
  if (const auto path = test::real_data("imu/robot_localization_test1.bag")) {
    const ImuRecording found = read({.path = *path});
    CHECK(found.unit == ForceUnit::metres_per_second_squared);
    CHECK_FALSE(found.rest);  // it drives from the first second on
    CHECK(found.still_force == doctest::Approx(9.8).epsilon(0.01));
    CHECK(found.samples.size() == 11865);
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const ImuSample& sample : found.samples) mean += sample.specific_force / 11865.0;
    CHECK(mean.normalized().y() > 0.99);
  }
  if (const auto path = test::real_data("kitti_street/oxts")) {
    const ImuRecording found = read({.path = *path});
    CHECK(found.samples.size() == 154);
    CHECK(found.unit == ForceUnit::metres_per_second_squared);
    CHECK(found.still_force == doctest::Approx(9.81).epsilon(0.05));
    CHECK(1.0 / found.rate_hz == doctest::Approx(0.1033).epsilon(0.001));
    CHECK_FALSE(found.rest);
    const ImuRecording by_frame = read({.path = *path, .frame_rate_hz = 10.0});
    CHECK(by_frame.samples.back().stamp == doctest::Approx(15.3));
  }
}

}  // namespace
}  // namespace vantage::io
