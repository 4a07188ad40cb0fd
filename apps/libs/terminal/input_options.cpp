#include "terminal/input_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>
#include <utility>
#include <vector>

#include "io/ros/message_reader.hpp"
#include "terminal/command_line.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/io/sensor_trajectory.hpp"

namespace vantage {
namespace {

Result<io::PriorSigmas> parse_sigmas(const std::string& text) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  while (at <= end) {
    double x = 0.0;
    const auto [stop, error] = std::from_chars(at, end, x);
    if (error != std::errc{} || !(x > 0.0) || (stop != end && *stop != ',')) break;
    numbers.push_back(x);
    at = stop + 1;
  }
  const bool some =
      std::any_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
  if (at != end + 1 || numbers.size() != 3 || !some) {
    return cli::usage_error(
        fmt::format("--prior-sigma takes three numbers horizontal,vertical,heading [m, m, deg] "
                    "above 0, at least one of them not 'inf', not '{}'",
                    text));
  }
  return io::PriorSigmas{
      .horizontal = numbers[0], .vertical = numbers[1], .heading = numbers[2] * M_PI / 180.0};
}

/// What --prior names: a path, or a topic of the scans' bag.
Result<io::PriorSource> prior_source(const InputOptions& options) {
  io::PriorSource source{.path = options.prior,
                         .topic = options.prior_topic,
                         .rate_hz = options.rate_hz,
                         .map_projector = options.map_projector};
  std::error_code ignored;
  if (!options.prior.starts_with('/') || std::filesystem::exists(source.path, ignored)) {
    return source;
  }
  VANTAGE_TRY(const bool bag, io::ros::is_bag(options.scans));
  if (!bag) {
    return fail(ErrorCode::not_found,
                fmt::format("--prior names neither a file nor a topic of the scans, because {} is "
                            "no bag",
                            options.scans.string()),
                SourceLocation{options.prior, 0, 0});
  }
  if (!options.prior_topic.empty()) {
    return cli::usage_error(
        fmt::format("--prior {} is no file but a topic of the scans, so --prior-topic cannot name "
                    "another one",
                    options.prior));
  }
  source.path = options.scans;
  source.topic = options.prior;
  return source;
}

}  // namespace

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
  app.add_option("--prior", prior,
                 fmt::format("absolute poses or GNSS positions ({}, or a topic of --scans): each "
                             "scan gets the one at its stamp, and the run starts from it",
                             io::format_names(io::FormatUse::trajectory)));
  app.add_option("--prior-topic", prior_topic, kPoseTopicHelp);
  app.add_option("--prior-sigma", prior_sigma, kPriorSigmaHelp)->type_name("SIGMAS");
  app.add_option("--map-projector", map_projector, kMapProjectorHelp)->type_name("FILE");
  app.add_option("--mount", mount, kMountHelp)->type_name("POSE");
  app.add_option("--rate", rate_hz, "scans per second, if files contain no stamps")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

Result<RunInputs> InputOptions::open(std::span<const std::filesystem::path> map_files) const {
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
  if (prior.empty()) {
    for (const auto& [option, given] : {std::pair{"--prior-topic", !prior_topic.empty()},
                                        std::pair{"--prior-sigma", !prior_sigma.empty()},
                                        std::pair{"--map-projector", !map_projector.empty()}}) {
      if (given) return cli::usage_error(fmt::format("{} is given without --prior", option));
    }
  } else {
    VANTAGE_TRY(auto source, prior_source(*this));
    if (!prior_sigma.empty()) {
      VANTAGE_TRY(source.sigmas, parse_sigmas(prior_sigma));
    }
    source.map_files.assign(map_files.begin(), map_files.end());
    auto priors = io::read_priors(source, sensor);
    if (!priors && source.path != prior) {
      return fail(std::move(priors).error().during(
          fmt::format("looking for {}, which is no file, among the topics of the scans", prior)));
    }
    VANTAGE_TRY(inputs.priors, std::move(priors));
  }
  return inputs;
}

}  // namespace vantage
