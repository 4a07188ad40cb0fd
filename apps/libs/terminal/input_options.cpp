#include "terminal/input_options.hpp"

#include <fmt/format.h>

#include "terminal/command_line.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/io/sensor_trajectory.hpp"

namespace vantage {

void InputOptions::add_to(CLI::App& app, bool reference_required) {
  app.add_option("--scans", scans,
                 fmt::format("folder of {} scans, {}", io::format_names(io::FormatUse::scan),
                             io::format_names(io::FormatUse::recording)))
      ->required();
  app.add_option("--topic", topic, "topic of the scans, if a bag has several");
  app.add_option("--start", window.start,
                 "skip this many seconds at the beginning of the recording")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--duration", window.duration, "stop after this many seconds")
      ->check(CLI::PositiveNumber);
  app.add_option("--reference", reference,
                 fmt::format("true trajectory ({}): errors are measured against it",
                             io::format_names(io::FormatUse::trajectory)))
      ->required(reference_required);
  app.add_option("--reference-topic", reference_topic, kPoseTopicHelp);
  app.add_option("--odometry", odometry,
                 fmt::format("odometry ({}) to predict with, instead of constant velocity",
                             io::format_names(io::FormatUse::trajectory)));
  app.add_option("--odometry-topic", odometry_topic, kPoseTopicHelp);
  app.add_option("--mount", mount, kMountHelp)->type_name("POSE");
  app.add_option("--rate", rate_hz, "scans per second, if files contain no stamps")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}
Result<RunInputs> InputOptions::open() const {
  RunInputs inputs{.scans = {.path = scans, .topic = topic, .rate_hz = rate_hz}, .window = window};
  // What is wrong is said before any work is done.
  VANTAGE_TRY(inputs.opened, io::OpenedScans::open(inputs.scans));
  io::SensorFrame sensor{
      .name = inputs.opened->describe().frame, .scans = scans, .T_child_sensor = {}};
  if (!mount.empty()) {
    VANTAGE_TRY(sensor.T_child_sensor, cli::parse_pose("--mount", mount));
  }
  if (!reference.empty()) {
    VANTAGE_TRY(inputs.reference,
                io::read_sensor_trajectory({reference, reference_topic, rate_hz}, sensor));
  }
  if (!odometry.empty()) {
    VANTAGE_TRY(inputs.odometry,
                io::read_sensor_trajectory({odometry, odometry_topic, rate_hz}, sensor));
  }
  return inputs;
}
}  // namespace vantage
