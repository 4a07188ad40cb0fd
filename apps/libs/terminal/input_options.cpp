#include "terminal/input_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>
#include <vector>

#include "io/ros/message_reader.hpp"
#include "terminal/command_line.hpp"
#include "terminal/option_values.hpp"
#include "vantage/io/formats.hpp"
#include "vantage/io/map_files.hpp"
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

/// A file, or a topic of a bag.
struct Place {
  std::filesystem::path path;
  std::string topic;
};

/// What an option names: a path, or a topic of the scans' bag.
/// @param option  "--prior", which has an option "--prior-topic" beside it
Result<Place> named_place(const std::string& option, const std::string& named,
                          const std::string& topic, const std::filesystem::path& scans) {
  std::error_code ignored;
  if (!named.starts_with('/') || std::filesystem::exists(named, ignored)) {
    return Place{named, topic};
  }
  VANTAGE_TRY(const bool bag, io::ros::is_bag(scans));
  if (!bag) {
    return fail(
        ErrorCode::not_found,
        fmt::format("{} names neither a file nor a topic of the scans, because {} is not a bag",
                    option, scans.string()),
        SourceLocation{named, 0, 0});
  }
  if (!topic.empty()) {
    return cli::usage_error(fmt::format(
        "{0} {1} is not a file but a topic of the scans, so {0}-topic cannot name another "
        "one",
        option, named));
  }
  return Place{scans, named};
}

/// Adds to the error of what was read that a path was taken for a topic.
template <class Read>
Result<Read> of_place(Result<Read> read, const Place& place, const std::string& named) {
  if (read || place.path == named) return read;
  return fail(std::move(read).error().during(
      fmt::format("looking for {}, which is not a file, among the topics of the scans", named)));
}

/// Checks that options are not given without the one that they belong to.
Result<void> check_unused(std::string_view owner,
                          std::initializer_list<std::pair<std::string_view, bool>> options) {
  for (const auto& [option, given] : options) {
    if (given) return cli::usage_error(fmt::format("{} is given without {}", option, owner));
  }
  return {};
}

/// Checks that there are poses that --mount converts.
Result<void> check_mount(const InputOptions& options) {
  if (options.mount.empty()) return {};
  bool is_alone = true;
  for (const auto& [option, named, topic] :
       {std::tuple("--reference", options.reference.string(), options.reference_topic),
        std::tuple("--odometry", options.odometry.string(), options.odometry_topic),
        std::tuple("--prior", options.prior, options.prior_topic)}) {
    if (named.empty()) continue;
    is_alone = false;
    VANTAGE_TRY(const auto place, named_place(option, named, topic, options.scans));
    VANTAGE_TRY(const bool bag, io::ros::is_bag(place.path));
    if (bag) return {};
  }
  if (is_alone) {
    return cli::usage_error("--mount is given without --reference, --odometry and --prior");
  }
  return cli::usage_error(
      "--mount converts the poses of bags, and those given are in text files, which are not "
      "converted: a reference and a prior must be poses of the sensor, and for odometry, "
      "localizer.T_sensor_body states the mount");
}

/// Checks that the scans are not the map: its file, or a folder that holds it. Beside a bag, a map
/// does no harm.
/// @param map_files  patterns; one that cannot be read is left to those who read the map
Result<void> check_not_map(const std::filesystem::path& scans,
                           std::span<const std::filesystem::path> map_files) {
  const auto map = io::map_files(map_files);
  if (!map || map_files.empty()) return {};
  VANTAGE_TRY(const bool bag, io::ros::is_bag(scans));
  if (bag) return {};
  for (const std::filesystem::path& file : map->files) {
    std::error_code ignored;
    const bool is_it = std::filesystem::equivalent(scans, file, ignored);
    const bool holds_it = std::filesystem::is_regular_file(file, ignored) &&
                          std::filesystem::equivalent(scans, file.parent_path(), ignored);
    if (!is_it && !holds_it) continue;
    return fail(ErrorCode::invalid_input,
                is_it ? std::string("is the map, expected the recorded scans")
                      : fmt::format("the folder holds the map ({}), expected recorded scans only",
                                    file.filename().string()),
                SourceLocation{scans.string(), 0, 0});
  }
  return {};
}

/// @param option  "--odometry", which has an option "--odometry-topic" beside it
Result<io::SensorTrajectory> read_poses(const std::string& option, const std::string& named,
                                        const std::string& topic, const InputOptions& options,
                                        const io::SensorFrame& sensor) {
  VANTAGE_TRY(const auto place, named_place(option, named, topic, options.scans));
  return of_place(io::read_sensor_trajectory({place.path, place.topic, options.rate_hz}, sensor),
                  place, named);
}

Result<io::PosePriors> read_priors(const InputOptions& options, const io::SensorFrame& sensor,
                                   std::span<const std::filesystem::path> map_files) {
  VANTAGE_TRY(const auto place,
              named_place("--prior", options.prior, options.prior_topic, options.scans));
  io::PriorSource source{.path = place.path,
                         .topic = place.topic,
                         .rate_hz = options.rate_hz,
                         .map_projector = options.map_projector,
                         .map_files = {map_files.begin(), map_files.end()}};
  if (!options.prior_sigma.empty()) {
    VANTAGE_TRY(source.sigmas, parse_sigmas(options.prior_sigma));
  }
  return of_place(io::read_priors(source, sensor), place, options.prior);
}

Result<io::ImuRecording> read_imu(const InputOptions& options) {
  VANTAGE_TRY(const auto place,
              named_place("--imu", options.imu, options.imu_topic, options.scans));
  io::ImuSource source{.path = place.path, .topic = place.topic};
  if (options.imu_by_frame) source.frame_rate_hz = options.rate_hz;
  return of_place(io::read_imu(source), place, options.imu);
}

}  // namespace

void ScanChoice::add_to(CLI::App& app) {
  app.add_option(
         "--stamp", stamped,
         "point of a scan to which its stamp belongs: first, middle or last; if left out, the "
         "times of the points decide")
      ->transform(cli::one_of<io::StampedPoint>({{"first", io::StampedPoint::first},
                                                 {"middle", io::StampedPoint::middle},
                                                 {"last", io::StampedPoint::last}}))
      ->type_name("first|middle|last");
  app.add_option(
         "--livox-tags", tags,
         "points of a Livox to use: all (if left out), or those that are tagged as normal and not "
         "as noise")
      ->transform(cli::one_of<io::Tags>({{"all", io::Tags::all}, {"normal", io::Tags::normal}}))
      ->type_name("all|normal");
}

void InputOptions::add_to(CLI::App& app, bool reference_required, const std::string& recording) {
  app.add_option(recording, scans,
                 fmt::format("folder of {} scans, {}", io::format_names(io::FormatUse::scan),
                             io::format_names(io::FormatUse::recording)))
      ->required();
  app.add_option("--topic", topic, "topic of the scans, if a bag has several");
  app.add_option("--start", window.start,
                 "skip this many seconds at the beginning of the recording")
      ->check(cli::non_negative_number());
  app.add_option("--duration", window.duration, "stop after this many seconds")
      ->check(cli::positive_number());
  app.add_option("--reference", reference,
                 fmt::format("true trajectory ({}, or a topic of --scans): errors are measured "
                             "against it",
                             io::format_names(io::FormatUse::trajectory)))
      ->required(reference_required);
  app.add_option("--reference-topic", reference_topic, kPoseTopicHelp);
  app.add_option(
      "--odometry", odometry,
      fmt::format("the robot's own odometry ({}, or a topic of --scans): how the sensor moves, "
                  "also during scans",
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
  app.add_option("--imu", imu,
                 fmt::format("inertial samples ({}, or a topic of --scans)",
                             io::format_names(io::FormatUse::imu)));
  app.add_option("--imu-topic", imu_topic, kImuTopicHelp);
  app.add_flag("--imu-by-frame", imu_by_frame, kImuByFrameHelp);
  choice.add_to(app);
  app.add_option("--rate", rate_hz, "scans per second, if files contain no stamps")
      ->check(cli::positive_number())
      ->capture_default_str();
}

Result<RunInputs> InputOptions::open(std::span<const std::filesystem::path> map_files) const {
  RunInputs inputs{.scans = {.path = scans,
                             .topic = topic,
                             .rate_hz = rate_hz,
                             .stamped = choice.stamped,
                             .tags = choice.tags},
                   .window = window};
  // What is wrong is said before any work is done.
  VANTAGE_CHECK(check_mount(*this));
  VANTAGE_CHECK(check_not_map(scans, map_files));
  VANTAGE_TRY(inputs.opened, io::OpenedScans::open(inputs.scans));
  io::SensorFrame sensor{
      .name = inputs.opened->describe().frame, .scans = scans, .T_child_sensor = {}};
  if (!mount.empty()) {
    VANTAGE_TRY(sensor.T_child_sensor, cli::parse_pose("--mount", mount));
  }
  if (reference.empty()) {
    VANTAGE_CHECK(check_unused("--reference", {{"--reference-topic", !reference_topic.empty()}}));
  } else {
    VANTAGE_TRY(auto read,
                read_poses("--reference", reference.string(), reference_topic, *this, sensor));
    add_damage(inputs, read.damage);
    inputs.reference = std::move(read.poses);
  }
  if (odometry.empty()) {
    VANTAGE_CHECK(check_unused("--odometry", {{"--odometry-topic", !odometry_topic.empty()}}));
  } else {
    VANTAGE_TRY(auto read,
                read_poses("--odometry", odometry.string(), odometry_topic, *this, sensor));
    add_damage(inputs, read.damage);
    inputs.odometry = std::move(read.poses);
  }
  if (prior.empty()) {
    VANTAGE_CHECK(check_unused("--prior", {{"--prior-topic", !prior_topic.empty()},
                                           {"--prior-sigma", !prior_sigma.empty()},
                                           {"--map-projector", !map_projector.empty()}}));
  } else {
    VANTAGE_TRY(inputs.priors, read_priors(*this, sensor, map_files));
    add_damage(inputs, inputs.priors->damage);
  }
  if (imu.empty()) {
    VANTAGE_CHECK(check_unused(
        "--imu", {{"--imu-topic", !imu_topic.empty()}, {"--imu-by-frame", imu_by_frame}}));
  } else {
    VANTAGE_TRY(inputs.imu, read_imu(*this));
    add_damage(inputs, inputs.imu->damage);
  }
  return inputs;
}

}  // namespace vantage
