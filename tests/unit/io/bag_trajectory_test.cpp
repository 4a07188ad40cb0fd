#include "io/ros/bag_trajectory.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "io/ros/transform_tree.hpp"
#include "ros_messages.hpp"

namespace vantage::io::ros {
namespace {

using test::check_clear;
using test::MemoryBag;
using test::MessageWriter;
using Messages = std::vector<MemoryBag::Message>;

constexpr auto kLayout = MessageWriter::Layout::cdr_little;
const Topic kOdometry{"/odom", "nav_msgs/Odometry", Encoding::cdr, "cdr", {}};
const Topic kPoses{"/pose", "geometry_msgs/PoseStamped", Encoding::cdr, "cdr", {}};
const Topic kTf{"/tf", "tf2_msgs/TFMessage", Encoding::cdr, "cdr", {}};
const Topic kTfStatic{"/tf_static", "tf2_msgs/TFMessage", Encoding::cdr, "cdr", {}};
const std::vector<Topic> kTopics{kOdometry, kTf, kTfStatic, kPoses};
enum : std::size_t { kOdometryIndex, kTfIndex, kTfStaticIndex, kPosesIndex };

/// A transform with a turn about z.
struct Transform {
  double stamp = 0.0;  // [s]
  std::string parent, child;
  double x = 0.0, y = 0.0, yaw = 0.0;
};

void write(MessageWriter& writer, const Transform& t) {
  const auto seconds = static_cast<std::uint32_t>(t.stamp);
  writer.header(seconds, static_cast<std::uint32_t>(std::lround((t.stamp - seconds) * 1e9)),
                t.parent);
  if (!t.child.empty()) writer.text(t.child);
  writer.numbers(std::array{t.x, t.y, 0.0, 0.0, 0.0, std::sin(t.yaw / 2), std::cos(t.yaw / 2)});
}

MemoryBag::Message transforms(std::size_t topic, const std::vector<Transform>& all) {
  MessageWriter writer(kLayout);
  writer.number(static_cast<std::uint32_t>(all.size()));
  for (const Transform& t : all) write(writer, t);
  return {topic, 0, writer.bytes()};
}

MemoryBag::Message odometry(const Transform& t, std::int64_t log_time = 0) {
  MessageWriter writer(kLayout);
  write(writer, t);
  writer.numbers(std::array<double, 36>{}).numbers(std::array<double, 42>{});
  return {kOdometryIndex, log_time, writer.bytes()};
}

MemoryBag::Message pose(double stamp, double x) {
  MessageWriter writer(kLayout);
  write(writer, {stamp, "/world", "", x});
  return {kPosesIndex, 0, writer.bytes()};
}

BagTrajectory read(const Messages& messages, const std::string& spec,
                   const std::vector<Topic>& topics = kTopics) {
  MemoryBag bag(topics, messages);
  auto found = read_bag_trajectory(bag, spec);
  REQUIRE_MESSAGE(found, to_string(found.error()));
  return *std::move(found);
}

void check_refused(const Messages& messages, const std::string& spec, ErrorCode code,
                   const std::string& expected, const std::vector<Topic>& topics = kTopics) {
  MemoryBag bag(topics, messages);
  const auto found = read_bag_trajectory(bag, spec);
  REQUIRE_FALSE(found);
  check_clear(found.error(), code, "run.bag", expected);
}

/// Frame, child and topic, and how many poses were left out.
void check_told(const BagTrajectory& found, std::string_view names, std::uint64_t skipped,
                std::string_view rule) {
  CHECK(found.frame + " " + found.child + " " + found.topic == names);
  CHECK(found.skipped == skipped);
  CHECK(found.stamp_rule == rule);
}

void check_near(const Pose& pose, double x, double y, double yaw) {
  CHECK(pose.translation.x() == doctest::Approx(x).epsilon(1e-12));
  CHECK(pose.translation.y() == doctest::Approx(y).epsilon(1e-12));
  CHECK(rotation_between(pose, pose_from_xyz_rpy({0, 0, 0}, {0, 0, yaw})) < 1e-9);
}

TEST_CASE("poses of a topic of a bag") {
  const Messages messages{
      odometry({10.5, "/odom", "/base_link", 1, 2, 0.5}),
      pose(3.25, 7),
      odometry({11.5, "odom", "base_link", 3, 4, 1}),
      odometry({11.5, "odom", "base_link"}),
      odometry({11.25, "odom", "base_link"}),
      odometry({12, "odom", "base_link", 5}),
  };
  SUBCASE("of that name") {
    const BagTrajectory found = read(messages, "/odom");
    check_told(found, "odom base_link /odom", 2, "stamps are those of the messages' headers");
    REQUIRE(found.poses.size() == 3);
    CHECK(found.poses[0].stamp == 10.5);
    check_near(found.poses[0].pose, 1, 2, 0.5);
    CHECK(found.poses[1].stamp == 11.5);
    check_near(found.poses[1].pose, 3, 4, 1);
    CHECK(found.poses[2].stamp == 12);
  }
  SUBCASE("of another type") {
    const BagTrajectory found = read(messages, "/pose");
    CHECK(found.frame == "world");
    CHECK(found.child.empty());
    REQUIRE(found.poses.size() == 1);
    CHECK(found.poses[0].stamp == 3.25);
    check_near(found.poses[0].pose, 7, 0, 0);
  }
  SUBCASE("of the only one, which never is one with transforms") {
    CHECK(read({odometry({1, "a", "b"})}, "", {kOdometry, kTf, kTfStatic}).topic == "/odom");
    check_refused(messages, "", ErrorCode::invalid_input,
                  "2 topics have poses, choose one with --topic: /odom (nav_msgs/Odometry), /pose "
                  "(geometry_msgs/PoseStamped)");
    check_refused({}, "", ErrorCode::invalid_input, "topics with poses: /tf (tf2_msgs/TFMessage)",
                  {kTf});
    check_refused({}, "", ErrorCode::invalid_input,
                  "no topic has poses; there are: /a (std_msgs/String)",
                  {{"/a", "std_msgs/String", Encoding::cdr, "cdr", {}}});
  }
  SUBCASE("with log times where the first stamp was never set") {
    const BagTrajectory found = read({odometry({0, "odom", "base_link"}, 5'500'000'000),
                                      odometry({0, "odom", "base_link"}, 6'000'000'000)},
                                     "/odom");
    REQUIRE(found.poses.size() == 2);
    CHECK(found.poses[0].stamp == 5.5);
    CHECK(found.poses[1].stamp == 6.0);
    CHECK(found.stamp_rule.find("were recorded") != std::string::npos);
  }
  SUBCASE("without a first one that alone has no stamp") {
    const BagTrajectory found = read({odometry({0, "odom", "base_link"}, 5'500'000'000),
                                      odometry({100, "odom", "base_link"}, 6'000'000'000)},
                                     "/odom");
    check_told(found, "odom base_link /odom", 1, "stamps are those of the messages' headers");
    REQUIRE(found.poses.size() == 1);
    CHECK(found.poses[0].stamp == 100);
  }
  SUBCASE("that contradict themselves") {
    check_refused({odometry({1, "odom", "base"}), odometry({2, "map", "base"})}, "/odom",
                  ErrorCode::corrupt_data,
                  "the pose is that of 'base' in 'map', expected that of "
                  "'base' in 'odom' as before");
    check_refused({odometry({1, "odom", "base"}), odometry({2, "odom", "imu"})}, "/odom",
                  ErrorCode::corrupt_data, "that of 'imu' in 'odom'");
    check_refused({}, "/odom", ErrorCode::corrupt_data, "topic '/odom' has no pose");
    Messages cut{odometry({1, "odom", "base"})};
    cut[0].bytes.pop_back();
    check_refused(cut, "/odom", ErrorCode::corrupt_data,
                  "(while reading the message at byte 1000 of /odom)");
  }
}

TEST_CASE("what is not a topic with frames is refused") {
  for (const char* spec : {"/tf:map", "/tf:map:", "/tf::base", ":map:base", "/tf:a:b:c", ":",
                           "::", "/tf:map:map", "/tf:/map:map", "/tf:/:map"}) {
    CAPTURE(spec);
    check_refused({}, spec, ErrorCode::invalid_input, "as in /tf:map:base_link, found");
  }
  check_refused({}, "/odom:map:base", ErrorCode::invalid_input,
                "topic '/odom' is of type nav_msgs/Odometry, which has no frames");
  check_refused({}, "/nothing:map:base", ErrorCode::invalid_input, "there is no topic '/nothing'");
}

/// map -> odom every second, odom -> base every half, base -> lidar and base -> imu once.
Messages robot() {
  Messages messages{
      transforms(kTfStaticIndex, {{99, "base", "lidar", 0, 1, 0}, {99, "base", "/imu", 0, -1, 0}})};
  for (int i = 0; i <= 4; ++i) {
    std::vector<Transform> now;
    if (i % 2 == 0) now.push_back({10 + 0.5 * i, "/map", "odom", 100.0 + i, 0, 0});
    now.push_back({10 + 0.5 * i, "odom", "base", 10.0 * i, 0, M_PI / 2});
    messages.push_back(transforms(kTfIndex, now));
  }
  return messages;
}

TEST_CASE("a trajectory through a chain of transforms") {
  SUBCASE("of one step") {
    const BagTrajectory found = read(robot(), "/tf:map:odom");
    REQUIRE(found.poses.size() == 3);
    CHECK(found.poses[1].stamp == 11);
    check_near(found.poses[1].pose, 102, 0, 0);
    CHECK(found.stamp_rule == "stamps are those of the transform map -> odom");
  }
  SUBCASE("at the stamps of the fastest, others interpolated, with one that does not change") {
    const BagTrajectory found = read(robot(), "/tf:/map:lidar");
    check_told(found, "map lidar /tf", 0, "stamps are those of the transform odom -> base");
    REQUIRE(found.poses.size() == 5);
    for (std::size_t i = 0; i < 5; ++i) {
      const double k = static_cast<double>(i);
      CHECK(found.poses[i].stamp == 10 + 0.5 * k);
      // The lidar is 1 m to the left of a robot that was turned to the left.
      check_near(found.poses[i].pose, 100 + k + 10 * k - 1, 0, M_PI / 2);
    }
  }
  SUBCASE("down and up again") {
    const BagTrajectory found = read(robot(), "/tf:base:map");
    REQUIRE(found.poses.size() == 5);
    check_near(found.poses[2].pose, 0, 122, -M_PI / 2);
  }
  SUBCASE("where one of them is not known, stamps are left out and counted") {
    Messages messages = robot();
    messages.push_back(transforms(kTfIndex, {{13, "odom", "base"}, {12.5, "odom", "base"}}));
    messages.push_back(transforms(kTfIndex, {{13, "odom", "base"}, {1e6, "else", "where"}}));
    const BagTrajectory found = read(messages, "/tf:map:base");
    CHECK(found.poses.size() == 5);
    CHECK(found.skipped == 3);  // two not later, and 13 s, when the map's is no longer known
  }
}

TEST_CASE("transforms that lead nowhere are refused") {
  const auto invalid = ErrorCode::invalid_input, corrupt = ErrorCode::corrupt_data;
  check_refused(robot(), "/tf", invalid,
                "name the frames as in /tf:map:base_link; transforms (parent -> child): odom -> "
                "base, base -> imu, base -> lidar, map -> odom");
  check_refused(
      robot(), "/tf:map:camera", invalid,
      "no transforms lead from 'camera' to 'map'; transforms (parent -> child): odom -> ");
  check_refused({}, "/tf:map:base", invalid, "transforms (parent -> child): none");
  check_refused(robot(), "/tf:base:lidar", corrupt, "has no pose that changes");
  check_refused(robot(), "/tf_static:base:lidar", corrupt, "has no pose that changes");

  Messages messages = robot();
  messages.push_back(transforms(kTfIndex, {{20, "ekf", "base"}, {20, "ekf", "base"}}));
  check_refused(messages, "/tf:map:lidar", corrupt,
                "frame 'base' has 2 parents (odom, ekf), expected one");
  CHECK(read(messages, "/tf:map:odom").poses.size() == 3);  // does not meet it
  CHECK(read(messages, "/tf:map:odom").skipped == 0);

  messages = robot();
  messages.push_back(transforms(kTfIndex, {{20, "lidar", "map"}}));
  check_refused(messages, "/tf:world:lidar", corrupt, "is above itself");
  messages.push_back(transforms(kTfIndex, {{20, "self", "self"}}));
  check_refused(messages, "/tf:world:self", corrupt, "frame 'self' is above itself");

  messages = robot();
  std::vector<Transform> many;
  for (int i = 0; i < 10'001; ++i) {
    many.push_back({1, "a" + std::to_string(i), "b" + std::to_string(i)});
  }
  messages.push_back(transforms(kTfIndex, many));
  check_refused(messages, "/tf:map:base", corrupt, "more than 10000 pairs of frames");
}

TEST_CASE("an invalid transform is refused where it is needed") {
  Messages messages = robot();
  messages.push_back(transforms(kTfIndex, {{13, "base", "wheel", std::nan("")}}));
  messages.push_back(transforms(kTfStaticIndex, {{13, "base", "mast", 0, 0, std::nan("")}}));
  CHECK(read(messages, "/tf:map:lidar").poses.size() == 5);
  const std::string place = "(while reading the message at byte 7000 of /tf)";
  check_refused(messages, "/tf:map:wheel", ErrorCode::corrupt_data, "number 1 of 7 of the pose");
  check_refused(messages, "/tf:map:wheel", ErrorCode::corrupt_data, place);
  check_refused(messages, "/tf:map:mast", ErrorCode::corrupt_data, "number 6 of 7 of the pose");
}

TEST_CASE("a long chain of transforms needs no recursion") {
  TransformTree tree;
  const auto frame = [](int i) { return "frame" + std::to_string(i); };
  for (int i = 0; i < 9000; ++i) CHECK(tree.add(frame(i), frame(i + 1)));
  const auto path = tree.path(frame(0), frame(9000), "run.bag");
  REQUIRE(path);
  REQUIRE(*path);
  CHECK((*path)->size() == 9000);
  CHECK((*path)->front().edge == TransformTree::Edge{frame(0), frame(1)});
  CHECK((*path)->back().edge == TransformTree::Edge{frame(8999), frame(9000)});
}

TEST_CASE("transforms between frames that do not move") {
  const auto between = [](const Messages& messages, const std::string& parent,
                          const std::string& child) {
    MemoryBag bag(kTopics, messages);
    auto found = static_transform(bag, parent, child);
    REQUIRE_MESSAGE(found, to_string(found.error()));
    return *found;
  };
  const auto lidar = between(robot(), "/base", "lidar");
  REQUIRE(lidar);
  check_near(*lidar, 0, 1, 0);
  check_near(between(robot(), "lidar", "base").value(), 0, -1, 0);
  check_near(between(robot(), "imu", "lidar").value(), 0, 2, 0);  // over base
  check_near(between(robot(), "/camera", "camera").value(), 0, 0, 0);
  CHECK_FALSE(between(robot(), "odom", "base"));  // moves
  CHECK_FALSE(between({}, "base", "lidar"));

  Messages messages = robot();
  messages.push_back(transforms(kTfStaticIndex, {{99, "base", "lidar", 5}}));
  check_near(between(messages, "base", "lidar").value(), 5, 0, 0);  // the last one
  messages.push_back(transforms(kTfStaticIndex, {{99, "mast", "lidar", 5}}));
  MemoryBag bag(kTopics, messages);
  const auto found = static_transform(bag, "base", "lidar");
  REQUIRE_FALSE(found);
  check_clear(found.error(), ErrorCode::corrupt_data, "run.bag",
              "frame 'lidar' has 2 parents (base, mast)");

  MemoryBag none({kOdometry}, {});
  const auto nothing = static_transform(none, "base", "lidar");
  REQUIRE(nothing);
  CHECK_FALSE(*nothing);
}

}  // namespace
}  // namespace vantage::io::ros
