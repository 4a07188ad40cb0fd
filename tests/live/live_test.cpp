// A robot that speaks DDS by another vendor's library, and the live localizer.
#include <doctest/doctest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <vector>

#include "dds/participant.hpp"
#include "io/ros/message_writers.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "support/ros_client.hpp"
#include "support/small_config.hpp"

namespace vantage {
namespace {

using Row = std::vector<double>;

const std::string kTools = std::string(VANTAGE_TEST_TOOLS) + "/";

/// Lines of numbers: stamp, x, y, z, qx, qy, qz, qw, ...
std::vector<Row> rows_of(const std::string& file) {
  std::vector<Row> rows;
  std::istringstream text(test::read_text(file));
  for (std::string line; std::getline(text, line);) {
    std::istringstream numbers(line);
    Row row;
    for (double x = 0.0; numbers >> x;) row.push_back(x);
    if (row.size() >= 8) rows.push_back(std::move(row));
  }
  return rows;
}

/// By stamp in tenths of milliseconds.
std::map<std::int64_t, Row> by_stamp(const std::vector<Row>& rows) {
  std::map<std::int64_t, Row> found;
  for (const Row& row : rows) found[std::llround(row[0] * 1e4)] = row;
  return found;
}

/// A small campus, a drive of a few seconds, and the map of it.
class World {
 public:
  World() {
    run("vantage-simulate", {std::string(VANTAGE_SOURCE_DIR) + "/configs/simulate/motion.toml",
                             "--out", path("world"), "-q", "--set", "map.point_spacing=0.25",
                             "--set", "campus.size_x=60", "--set", "campus.size_y=60"});
    write_config("");
    run("vantage-build", {config(), "-q"});
    run(kTools + "live_flatten", {path("world/scans"), path("world.flat"), "--imu",
                                  path("world/imu.csv"), "--odometry", path("world/odometry.tum")});
  }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (folder_.path() / name).string();
  }
  [[nodiscard]] std::string config() const { return path("world.toml"); }
  [[nodiscard]] std::string domain() const { return std::to_string(domain_); }

  void write_config(const std::string& live) const {
    test::SmallConfig config;
    config.files = R"(["world/map.pcd"])";
    config.partitioner_params = "cell_width = 20.0";
    config.viewpoints = "voxel_size = 5.0\n";
    config.more =
        "[localizer]\nscan_min_range = 1.0\nT_sensor_imu = [0.0, 0.0, -0.05, 0.0, 0.0, 0.0]\n"
        "[live]\ndomain = " +
        domain() + "\nmotion_wait = 60.0\ntopics = { imu = \"/imu\", odometry = \"/odom\" }\n" +
        live;
    test::write_text(this->config(), to_text(config));
  }

  static test::Finished run(const std::string& program, const std::vector<std::string>& arguments) {
    test::Finished finished = test::run(program, arguments);
    REQUIRE_MESSAGE(finished.exit_code == 0, finished.err);
    return finished;
  }

 private:
  test::TemporaryFolder folder_;
  int domain_ = 100 + getpid() % 100;  // others on this machine may test, too
};

/// The poses that were published are those of `localize` on the recording.
void check_replay(const World& world, const std::string& recording, const std::vector<Row>& poses) {
  World::run("vantage-localize",
             {world.config(), "--scans", recording, "--topic", "/points", "--imu", "/imu",
              "--odometry", recording, "--odometry-topic", "/odom", "--initial-pose", "auto",
              "--out", world.path("again"), "-q"});
  const auto again = by_stamp(rows_of(world.path("again/trajectory.tum")));
  REQUIRE(poses.size() > 20);
  for (const Row& pose : poses) {
    CAPTURE(pose[0]);
    const auto found = again.find(std::llround(pose[0] * 1e4));
    REQUIRE(found != again.end());
    for (std::size_t i = 1; i < 8; ++i) {
      CHECK(std::abs(found->second[i] - pose[i]) < 1e-12);
    }
  }
}

TEST_CASE("a robot by Cyclone DDS gets poses, and a recording of it gives the same") {
  World world;
  world.write_config("state_file = \"state.json\"\n");
  std::string first_tracked;
  {
    test::Running live("vantage-live", {world.config(), "--record", world.path("run.mcap")});
    REQUIRE_MESSAGE(live.says("ready in domain"), live.err());
    const auto robot =
        World::run(kTools + "live_robot", {world.path("world.flat"), world.path("poses.txt"),
                                           "--domain", world.domain(), "--scans", "50"});
    CAPTURE(robot.out);
    CHECK(robot.out.starts_with("50 scans sent"));
    live.signal(SIGTERM);
    const auto ended = live.wait();
    CAPTURE(ended.err);
    CHECK(ended.exit_code == 0);
    CHECK(ended.err.find(": tracked at") != std::string::npos);
    CHECK(ended.out.find("scans: ") != std::string::npos);
    check_replay(world, world.path("run.mcap"), rows_of(world.path("poses.txt")));
  }
  SUBCASE("a restart begins where the session ended") {
    test::Running live("vantage-live", {world.config()});
    REQUIRE_MESSAGE(live.says("ready in domain"), live.err());
    CHECK(live.err().find("begins where the last session ended") != std::string::npos);
    live.signal(SIGINT);
    CHECK(live.wait().exit_code == 0);
  }
}

/// A node that listens to a topic.
class Listening {
 public:
  Listening(const World& world, const dds::Topic& topic)
      : participant_(dds::Participant::open(
            {.domain = static_cast<std::uint32_t>(std::stoul(world.domain()))})) {
    REQUIRE(participant_);
    REQUIRE(participant_->subscribe(topic, [this](std::string&& message) {
      const std::scoped_lock lock(mutex_);
      last_ = std::move(message);
      changed_.notify_all();
    }));
  }
  /// Whether the last message has a text within 20 s.
  [[nodiscard]] bool hears(const std::string& text) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::seconds(20),
                             [&] { return last_.find(text) != std::string::npos; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::string last_;
  Result<dds::Participant> participant_;  // last: its threads use what is above
};

TEST_CASE("`vantage play` is a robot, too") {
  World world;
  test::Running live("vantage-live", {world.config(), "--record", world.path("run.mcap")});
  REQUIRE_MESSAGE(live.says("ready in domain"), live.err());
  const auto played =
      World::run("vantage-play", {world.config(), "--scans", world.path("world/scans"), "--imu",
                                  world.path("world/imu.csv"), "--odometry",
                                  world.path("world/odometry.tum"), "--duration", "5"});
  CHECK(played.out.find("scans sent") != std::string::npos);
  live.signal(SIGTERM);
  const auto ended = live.wait();
  CAPTURE(ended.err);
  REQUIRE(ended.exit_code == 0);
  CHECK(ended.err.find(": tracked at") != std::string::npos);
}

TEST_CASE("`vantage play` refuses what no robot is") {
  const test::TemporaryFolder folder;
  const std::string config = (folder.path() / "c.toml").string();
  const auto refusal = [&](const std::string& topics, std::vector<std::string> more) {
    test::write_text(config, "schema = 1\n[live.topics]\n" + topics);
    std::vector<std::string> arguments{config, "--scans", folder.path().string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto done = test::run("vantage-play", arguments);
    CHECK(done.exit_code == (more.empty() ? 1 : 2));
    return done.err;
  };
  CHECK(
      refusal("followed_pose = \"/pose\"\n", {}).starts_with(config + ": error: 'followed_pose'"));
  CHECK(refusal("", {"--now", "--speed", "2"}).find("--now takes no other --speed than 1") !=
        std::string::npos);
}

TEST_CASE("`vantage play` says whose endpoints do not fit") {
  World world;
  const Listening late(world, {.name = "/points",
                               .type = "sensor_msgs/PointCloud2",
                               .qos = {.reliable = true, .transient_local = true}});
  const Listening other(world, {.name = "/imu", .type = "std_msgs/String"});
  const test::Running robot("vantage-play", {world.config(), "--scans", world.path("world/scans"),
                                             "--imu", world.path("world/imu.csv")});
  CHECK(robot.says("a subscriber of /points requests incompatible QoS (DURABILITY): no message"));
  CHECK(robot.says("a subscriber of /imu expects std_msgs/String, and sensor_msgs/Imu is sent"));
}

TEST_CASE("Autoware's pose initializer has the vehicle found, and switches the localizer on") {
  World world;
  world.write_config("services = { align = \"/ndt_align_srv\", trigger = \"/trigger_node\" }\n");
  test::Running live("vantage-live", {world.config()});
  REQUIRE_MESSAGE(live.says("ready in domain"), live.err());
  const auto domain = static_cast<std::uint32_t>(std::stoul(world.domain()));
  test::RosClient trigger(domain, "/trigger_node", "std_srvs::srv::dds_::SetBool_");
  test::RosClient align(
      domain, "/ndt_align_srv",
      "autoware_internal_localization_msgs::srv::dds_::PoseWithCovarianceStamped_");
  trigger.wait_for_server();
  align.wait_for_server();
  const std::string on{0, 1, 0, 0, 1}, off{0, 1, 0, 0, 0};
  // On the wire, a message may be longer: RTPS rounds up to 4 bytes.
  const auto answered = [&](const std::string& request, const char* text) {
    const std::string answer = trigger.answer_to(trigger.send(request));
    return answer.starts_with(io::ros::write_set_bool_answer(true, text).value());
  };
  CHECK(answered(off, "scans are left out"));

  test::Running robot("vantage-play", {world.config(), "--scans", world.path("world/scans"),
                                       "--imu", world.path("world/imu.csv"), "--odometry",
                                       world.path("world/odometry.tum")});
  const auto truth = rows_of(world.path("world/reference.tum"));
  REQUIRE(truth.size() > 1);
  Pose guess{.translation = {truth[0][1] + 1.0, truth[0][2] - 1.0, truth[0][3]}};
  const io::ros::PoseCovariance covariance = 9.0 * io::ros::PoseCovariance::Identity();
  const std::string found = align.answer_to(align.send(
      io::ros::write_pose_with_covariance({.stamp = 1.0, .frame = "map"}, guess, covariance)
          .value()));
  CHECK(int{found.at(4)} == 1);  // success
  CHECK(int{found.at(5)} == 1);  // reliable
  // Two truths, a header with "map" and its padding are before the position.
  std::array<double, 3> at{};
  REQUIRE(found.size() > 4 + 24 + sizeof at);
  std::memcpy(at.data(), found.data() + 4 + 24, sizeof at);
  double nearest = 1e9;
  for (const Row& row : truth) {
    nearest = std::min(nearest, std::hypot(row[1] - at[0], row[2] - at[1], row[3] - at[2]));
  }
  CHECK(nearest < 0.3);
  CHECK(live.err().find("tracked at") == std::string::npos);  // it is still switched off
  CHECK(answered(on, "scans are localized"));
  CHECK(live.says("tracked at"));
  robot.signal(SIGTERM);
  live.signal(SIGTERM);
  CHECK(live.wait().exit_code == 0);
}

/// A text of a message, with its end.
std::string whole(const std::string& text) { return text + '\0'; }

TEST_CASE("diagnostics say why nothing is localized") {
  World world;
  world.write_config("start = \"wait\"\n");
  Listening diagnostics(world, {.name = "/diagnostics", .type = "diagnostic_msgs/DiagnosticArray"});
  const Listening late(
      world, {.name = "/tf", .type = "tf2_msgs/TFMessage", .qos = {.transient_local = true}});
  const test::Running live("vantage-live", {world.config()});
  REQUIRE_MESSAGE(live.says("ready in domain"), live.err());
  CHECK(live.says("a subscriber of /tf requests incompatible QoS (DURABILITY): no message"));
  CHECK(diagnostics.hears(whole("incompatible_qos /tf DURABILITY")));
  const std::string waits = "waits for a pose on /initialpose";
  const std::string silent = waits + "; no scan has come on /points yet";
  CHECK(diagnostics.hears(whole(silent)));
  {
    auto other = dds::Participant::open(
        {.domain = static_cast<std::uint32_t>(std::stoul(world.domain())), .node = "other"});
    REQUIRE(other);
    REQUIRE(other->advertise({.name = "/points", .type = "std_msgs/String"}));
    const std::string why =
        "a publisher of /points sends std_msgs/String, expected sensor_msgs/PointCloud2: none of "
        "its messages is received";
    CHECK(live.says(why));
    CHECK(diagnostics.hears(whole(silent + "; " + why)));
    CHECK(diagnostics.hears(whole("other_type /points")));
  }
  CHECK(diagnostics.hears(whole(silent)));
  const test::Running robot("vantage-play", {world.config(), "--scans", world.path("world/scans"),
                                             "--imu", world.path("world/imu.csv"), "--odometry",
                                             world.path("world/odometry.tum")});
  CHECK(diagnostics.hears(whole(waits)));
}

TEST_CASE("what cannot be connected is refused, with its place") {
  World world;
  const auto refused = [&](const std::string& live, const std::string& message) {
    world.write_config(live);
    const auto ended = test::run("vantage-live", {world.config()});
    CHECK(ended.exit_code == 1);
    CHECK_MESSAGE(ended.err.find(message) != std::string::npos, ended.err);
  };
  refused("transform = \"map_to_base\"\nfoo = 1\n", "foo");
  refused("[live.frames]\nbase = \"map\"\n", "must be different frames");
  world.write_config("state_file = \"state.json\"\n");
  test::write_text(world.path("state.json"), "{}");
  const auto ended = test::run("vantage-live", {world.config()});
  CHECK(ended.exit_code == 1);
  CHECK(ended.err.find("delete the file to begin anew") != std::string::npos);
}

}  // namespace
}  // namespace vantage
