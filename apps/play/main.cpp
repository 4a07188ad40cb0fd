// vantage-play: publishes a recording as a robot would.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <optional>
#include <thread>

#include "dds/participant.hpp"
#include "io/ros/message_writers.hpp"
#include "live/connection.hpp"
#include "live/live_params.hpp"
#include "live/notices.hpp"
#include "live/received.hpp"
#include "terminal/command_line.hpp"
#include "terminal/counts.hpp"
#include "terminal/input_options.hpp"
#include "terminal/option_values.hpp"
#include "vantage/engine/config.hpp"
#include "vantage/io/read_ahead.hpp"

namespace vantage {
namespace {

using live::Input;

struct Options {
  std::string config;
  double speed = 1.0;
  bool now = false;
  InputOptions inputs;
  cli::CommonOptions common;
};

constexpr const char* kSensorFrame = "lidar";
constexpr double kForever = std::numeric_limits<double>::infinity();

/// Publishes what live::Session reads.
class Robot {
 public:
  /// @param notices  must outlive the robot
  Robot(live::LiveParams params, bool now, live::Notices& notices)
      : params_(std::move(params)),
        now_(now),
        T_base_sensor_(params_.frames.mount().value_or(Pose{})),
        notices_(notices),
        connection_([this] { return connect(); }, [this] { disconnect(); }, notices) {
    for (live::InputTopic input : live::input_topics(params_.topics)) {
      if (input.input == Input::initial_pose || input.input == Input::prior) continue;
      if (input.input == Input::transforms) continue;
      input.topic.qos.reliable = true;  // who reads with best effort gets it, too
      input.topic.qos.depth = std::max(input.topic.qos.depth, 10U);
      topics_.emplace(input.input, input.topic);
    }
  }
  Robot(const Robot&) = delete;
  Robot& operator=(const Robot&) = delete;

  /// Errors: those of Participant.
  [[nodiscard]] Result<void> open() { return connection_.open(); }
  /// Connects again once the first network is up. Call often.
  void follow_network() { connection_.follow(std::chrono::steady_clock::now()); }

  [[nodiscard]] bool is_heard() const {
    const auto points = writers_.find(Input::points);
    return points != writers_.end() && points->second.readers() > 0;
  }
  [[nodiscard]] bool sends(Input input) const { return topics_.contains(input); }
  /// How many messages were sent.
  [[nodiscard]] std::size_t sent(Input input) const {
    const auto found = sent_.find(input);
    return found == sent_.end() ? 0 : found->second;
  }

  /// Begins at a stamp of the recording [s].
  void begin(double stamp, double speed) {
    first_ = stamp;
    speed_ = speed;
    begin_ = std::chrono::steady_clock::now();
    time_of_begin_ = std::chrono::system_clock::now();
  }

  Result<void> send(const io::StampedScan& scan, double end) {
    std::vector<io::ros::CloudField> more;
    if (!scan.seconds.empty()) more.push_back({.name = "time", .values = scan.seconds});
    return send(Input::points, end,
                io::ros::write_point_cloud2(header(scan.stamp, kSensorFrame), scan.points, more));
  }
  Result<void> send(const ImuSample& sample) {
    return send(Input::imu, sample.stamp,
                io::ros::write_imu(header(sample.stamp, "imu"), sample.angular_velocity,
                                   sample.specific_force / params_.force_unit()));
  }
  Result<void> send(const io::StampedPose& T_odom_sensor) {
    return send(Input::odometry, T_odom_sensor.stamp,
                io::ros::write_odometry(header(T_odom_sensor.stamp, params_.frames.odom),
                                        params_.frames.base,
                                        T_odom_sensor.pose * T_base_sensor_.inverse()));
  }

 private:
  [[nodiscard]] Result<void> connect() {
    VANTAGE_TRY(participant_, dds::Participant::open(
                                  live::participant_options(params_, "vantage_play", notices_)));
    for (const auto& [input, topic] : topics_) {
      VANTAGE_TRY(auto writer, participant_->advertise(topic));
      writers_.emplace(input, std::move(writer));
    }
    VANTAGE_CHECK(participant_->announce());
    const io::ros::PoseMessage mount{.header = {.stamp = 0.0, .frame = params_.frames.base},
                                     .child = kSensorFrame,
                                     .pose = T_base_sensor_};
    VANTAGE_TRY(const std::string message, io::ros::write_transforms(std::array{mount}));
    return writers_.at(Input::static_transforms).write(message);
  }
  void disconnect() {
    writers_.clear();
    participant_.reset();
  }

  /// From the beginning to a stamp.
  [[nodiscard]] std::chrono::nanoseconds after(double stamp) const {
    const std::chrono::duration<double> seconds((stamp - first_) / speed_);
    return std::chrono::duration_cast<std::chrono::nanoseconds>(seconds);
  }

  [[nodiscard]] io::ros::Header header(double stamp, const std::string& frame) const {
    if (!now_) return {.stamp = stamp, .frame = frame};
    const std::chrono::duration<double> shown = (time_of_begin_ + after(stamp)).time_since_epoch();
    return {.stamp = shown.count(), .frame = frame};
  }

  Result<void> send(Input input, double due, Result<std::string> message) {
    VANTAGE_TRY(const std::string bytes, std::move(message));
    std::this_thread::sleep_until(begin_ + after(due));
    follow_network();
    const auto writer = writers_.find(input);
    if (writer == writers_.end()) return {};  // a robot drives on while it is not connected
    VANTAGE_CHECK(writer->second.write(bytes));
    ++sent_[input];
    return {};
  }

  live::LiveParams params_;
  bool now_;
  Pose T_base_sensor_;
  live::Notices& notices_;
  std::map<Input, std::size_t> sent_;
  std::map<Input, dds::Topic> topics_;
  std::map<Input, dds::Participant::Writer> writers_;
  live::Connection connection_;
  std::optional<dds::Participant> participant_;
  double first_ = 0.0, speed_ = 1.0;
  std::chrono::steady_clock::time_point begin_;
  std::chrono::system_clock::time_point time_of_begin_;
};

/// Sends everything in the order in which a robot has it: a scan at the end of its sweep.
Result<void> play(Robot& robot, RunInputs& inputs, double speed) {
  VANTAGE_TRY(auto opened, inputs.opened ? inputs.opened->take() : io::open_scans(inputs.scans));
  const auto source = io::read_ahead(std::move(opened));
  VANTAGE_TRY(auto scan, source->next());
  if (scan && inputs.window.start > 0.0) {
    VANTAGE_CHECK(source->seek(scan->stamp + inputs.window.start));
    VANTAGE_TRY(scan, source->next());
  }
  if (!scan) return fail(ErrorCode::invalid_input, "there is no scan");
  const double first = scan->stamp, end = first + inputs.window.duration.value_or(kForever);
  std::span<const ImuSample> imu = samples_of(inputs);
  std::span<const io::StampedPose> odometry;
  if (inputs.odometry) odometry = *inputs.odometry;
  if (!robot.sends(Input::imu)) imu = {};
  if (!robot.sends(Input::odometry)) odometry = {};
  constexpr double kBefore = 1.0;  // of motion before the first scan [s]
  const auto skip = [&](auto& samples) {
    while (!samples.empty() && samples.front().stamp < first - kBefore)
      samples = samples.subspan(1);
    return samples.empty() ? kForever : samples.front().stamp;
  };
  robot.begin(std::min({first, skip(imu), skip(odometry)}), speed);
  while (scan && scan->stamp <= end) {
    const double sweep =
        scan->seconds.empty() ? 0.0 : static_cast<double>(std::ranges::max(scan->seconds));
    const double due = scan->stamp + sweep;
    while (true) {
      const double next_imu = imu.empty() ? kForever : imu.front().stamp;
      const double next_odometry = odometry.empty() ? kForever : odometry.front().stamp;
      if (std::min(next_imu, next_odometry) > due) break;
      if (next_imu <= next_odometry) {
        VANTAGE_CHECK(robot.send(imu.front()));
        imu = imu.subspan(1);
      } else {
        VANTAGE_CHECK(robot.send(odometry.front()));
        odometry = odometry.subspan(1);
      }
    }
    VANTAGE_CHECK(robot.send(*scan, due));
    VANTAGE_TRY(scan, source->next());
  }
  // What follows the last sweep: its motion is known only then.
  if (!imu.empty()) VANTAGE_CHECK(robot.send(imu.front()));
  if (!odometry.empty()) VANTAGE_CHECK(robot.send(odometry.front()));
  return {};
}

Result<void> run(const Options& options) {
  if (options.now && options.speed != 1.0) {
    return cli::usage_error(
        "--now takes no other --speed than 1: the times of points and the rates of an IMU are "
        "those of the recording");
  }
  VANTAGE_TRY(const Config config, load_config(options.config, options.common.overrides));
  VANTAGE_TRY(const auto params, parse<live::LiveParams>(config.live.value_or(Table{})));
  if (!params.topics.followed_pose.empty()) {
    return fail(ErrorCode::invalid_config,
                "'followed_pose' in [live.topics] says that another localizer takes the scans and "
                "`vantage live` none: play takes a configuration without it",
                SourceLocation{options.config, 0, 0});
  }
  VANTAGE_TRY(auto inputs, options.inputs.open());
  live::Notices notices(
      [](const std::string& text) { std::cerr << fmt::format("vantage play: {}\n", text); });
  Robot robot(params, options.now, notices);
  VANTAGE_CHECK(robot.open());
  if (!options.common.quiet && !robot.is_heard()) {
    std::cerr << fmt::format("vantage play: waits for somebody who reads {} in domain {}\n",
                             params.topics.points, params.domain);
  }
  using std::chrono::milliseconds;
  while (!robot.is_heard()) {
    std::this_thread::sleep_for(milliseconds(10));
    robot.follow_network();
  }
  std::this_thread::sleep_for(milliseconds(200));  // the other topics are found, too
  VANTAGE_CHECK(play(robot, inputs, options.speed));
  std::this_thread::sleep_for(milliseconds(200));  // what is on its way arrives
  const std::size_t scans = robot.sent(Input::points), imu = robot.sent(Input::imu),
                    odometry = robot.sent(Input::odometry);
  if (options.common.json) {
    std::cout << fmt::format(R"({{"scans": {}, "imu": {}, "odometry": {}}})", scans, imu, odometry)
              << '\n';
    return {};
  }
  std::cout << fmt::format("{} sent, {} of an IMU, {} of odometry\n", cli::counted(scans, "scan"),
                           cli::counted(imu, "sample"), cli::counted(odometry, "sample"));
  return {};
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  CLI::App app("Publishes a recording over DDS, as the robot's drivers would.", "vantage play");
  vantage::Options options;
  app.add_option("CONFIG", options.config,
                 "configuration (TOML) whose table [live] names domain, topics and frames")
      ->required();
  options.inputs.add_to(app, false);
  app.add_option("--speed", options.speed, "this many times faster than recorded")
      ->capture_default_str()
      ->check(vantage::cli::positive_number());
  app.add_flag("--now", options.now,
               "stamps are those of this moment, not those of the recording; at --speed 1");
  options.common.add_to(app);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
