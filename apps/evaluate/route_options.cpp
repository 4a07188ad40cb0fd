#include "evaluate/route_options.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "terminal/command_line.hpp"
#include "terminal/option_values.hpp"
#include "vantage/io/formats.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

bool all_differ(const std::vector<std::string>& names) {
  return std::set<std::string>(names.begin(), names.end()).size() == names.size();
}

/// A route's name becomes the name of a folder.
bool is_fit_for_a_folder(const std::string& name) {
  return !name.empty() && name != "." && name != ".." &&
         std::all_of(name.begin(), name.end(),
                     [](unsigned char c) { return c >= ' ' && c != '/' && c != '\\'; });
}

/// Empty if there is no value at that index.
std::string at(const std::vector<std::string>& values, std::size_t i) {
  return values.empty() ? "" : values[i];
}

Result<void> check_count(const char* option, std::size_t given, std::size_t scans) {
  if (given == 0 || given == scans) return {};
  return cli::usage_error(
      fmt::format("{} is given {} times for {} --scans: one for each, in the same order", option,
                  given, scans));
}

}  // namespace

Result<std::vector<std::string>> route_names(const std::vector<fs::path>& scans) {
  std::vector<std::string> own, parents;
  for (const fs::path& path : scans) {
    fs::path whole = fs::absolute(path).lexically_normal();
    if (whole.filename().empty()) whole = whole.parent_path();  // a slash at the end
    own.push_back(whole.stem().string());
    parents.push_back(whole.parent_path().filename().string());
  }
  const bool telling =
      std::none_of(own.begin(), own.end(), [](const auto& name) { return name == "scans"; });
  if (telling && all_differ(own)) return own;
  if (all_differ(parents) && std::all_of(parents.begin(), parents.end(), is_fit_for_a_folder)) {
    return parents;
  }
  return cli::usage_error(
      "the folders of --scans give no distinct route names: give each a --route");
}

void RouteOptions::add_to(CLI::App& app) {
  app.add_option("--scans", scans,
                 fmt::format("folder of {} scans, {}; repeated: several routes",
                             io::format_names(io::FormatUse::scan),
                             io::format_names(io::FormatUse::recording)))
      ->required()
      ->allow_extra_args(false);
  app.add_option(
         "--reference", references,
         fmt::format("true trajectory ({}, or a topic of --scans) of each --scans: errors are "
                     "measured against it",
                     io::format_names(io::FormatUse::trajectory)))
      ->required()
      ->allow_extra_args(false);
  app.add_option("--odometry", odometries,
                 fmt::format("the robot's own odometry ({}, or a topic of --scans) of each --scans",
                             io::format_names(io::FormatUse::trajectory)))
      ->allow_extra_args(false);
  app.add_option("--reference-topic", reference_topics, kPoseTopicHelp)->allow_extra_args(false);
  app.add_option("--odometry-topic", odometry_topics, kPoseTopicHelp)->allow_extra_args(false);
  app.add_option("--prior", priors,
                 fmt::format("absolute poses or GNSS positions ({}, or a topic of --scans) of each "
                             "--scans: each scan gets the one at its stamp, and the run starts "
                             "from it",
                             io::format_names(io::FormatUse::trajectory)))
      ->allow_extra_args(false);
  app.add_option("--prior-topic", prior_topics, kPoseTopicHelp)->allow_extra_args(false);
  app.add_option("--prior-sigma", prior_sigma, kPriorSigmaHelp)->type_name("SIGMAS");
  app.add_option("--map-projector", map_projector, kMapProjectorHelp)->type_name("FILE");
  app.add_option("--mount", mount, kMountHelp)->type_name("POSE");
  app.add_option("--imu", imus,
                 fmt::format("inertial samples ({}, or a topic of --scans) of each --scans",
                             io::format_names(io::FormatUse::imu)))
      ->allow_extra_args(false);
  app.add_option("--imu-topic", imu_topics, kImuTopicHelp)->allow_extra_args(false);
  app.add_flag("--imu-by-frame", imu_by_frame, kImuByFrameHelp);
  choice.add_to(app);
  app.add_option("--topic", topics, "topic of each --scans, if a bag has several")
      ->allow_extra_args(false);
  app.add_option("--route", names, "name of each --scans; the name of its folder if left out")
      ->allow_extra_args(false);
  app.add_option("--rate", rate_hz, "scans per second, if files contain no stamps")
      ->check(cli::positive_number())
      ->capture_default_str();
}

std::vector<fs::path> RouteOptions::paths() const {
  std::vector<fs::path> all;
  const auto add = [&](const auto& some) { all.insert(all.end(), some.begin(), some.end()); };
  add(references);
  add(odometries);
  add(priors);
  add(imus);
  return all;
}

Result<std::vector<NamedInputs>> RouteOptions::open(std::span<const fs::path> map_files) const {
  VANTAGE_CHECK(check_count("--reference", references.size(), scans.size()));
  VANTAGE_CHECK(check_count("--odometry", odometries.size(), scans.size()));
  VANTAGE_CHECK(check_count("--topic", topics.size(), scans.size()));
  VANTAGE_CHECK(check_count("--reference-topic", reference_topics.size(), scans.size()));
  VANTAGE_CHECK(check_count("--odometry-topic", odometry_topics.size(), scans.size()));
  VANTAGE_CHECK(check_count("--prior", priors.size(), scans.size()));
  VANTAGE_CHECK(check_count("--prior-topic", prior_topics.size(), scans.size()));
  VANTAGE_CHECK(check_count("--imu", imus.size(), scans.size()));
  VANTAGE_CHECK(check_count("--imu-topic", imu_topics.size(), scans.size()));
  VANTAGE_CHECK(check_count("--route", names.size(), scans.size()));
  std::vector<std::string> called = names;
  if (called.empty()) {
    VANTAGE_TRY(called, route_names(scans));
  }
  if (!all_differ(called)) return cli::usage_error("two routes have the same name");
  std::vector<NamedInputs> routes;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!is_fit_for_a_folder(called[i])) {
      return cli::usage_error("the route '" + called[i] + "' cannot be the name of a folder");
    }
    const InputOptions options{.scans = scans[i],
                               .reference = references[i],
                               .odometry = odometries.empty() ? fs::path() : odometries[i],
                               .topic = at(topics, i),
                               .reference_topic = at(reference_topics, i),
                               .odometry_topic = at(odometry_topics, i),
                               .prior = at(priors, i),
                               .prior_topic = at(prior_topics, i),
                               .prior_sigma = prior_sigma,
                               .map_projector = map_projector,
                               .mount = mount,
                               .imu = at(imus, i),
                               .imu_topic = at(imu_topics, i),
                               .imu_by_frame = imu_by_frame,
                               .choice = choice,
                               .window = {},
                               .rate_hz = rate_hz};
    VANTAGE_TRY(auto inputs, options.open(map_files));
    routes.push_back({called[i], std::move(inputs)});
  }
  return routes;
}

}  // namespace vantage
