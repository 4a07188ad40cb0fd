#include "vantage/io/pose_priors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <string_view>
#include <system_error>
#include <utility>

#include "io/map_projection.hpp"
#include "io/ros/bag_fixes.hpp"
#include "io/ros/bag_trajectory.hpp"
#include "io/ros/message_reader.hpp"
#include "io/ros/messages.hpp"
#include "io/ros/topic_choice.hpp"
#include "io/ros/transform_tree.hpp"
#include "io/sensor_mount.hpp"
#include "terminal/counts.hpp"

namespace vantage::io {
namespace {

Result<void> check(const PriorSigmas& sigmas, const std::string& file) {
  const std::array all{sigmas.horizontal, sigmas.vertical, sigmas.heading};
  const bool positive = std::all_of(all.begin(), all.end(), [](double s) { return s > 0.0; });
  const bool some = std::any_of(all.begin(), all.end(), [](double s) { return std::isfinite(s); });
  if (positive && some) return {};
  return fail(ErrorCode::invalid_input,
              fmt::format("the sigmas of the prior are {} m, {} m and {} rad, expected numbers "
                          "above 0, at least one of them finite",
                          sigmas.horizontal, sigmas.vertical, sigmas.heading),
              SourceLocation{file, 0, 0});
}

/// The sigma that a variance states: nothing above 0 is none, and large values say nothing.
double sigma_of(double variance, double if_unknown, double infinite_from) {
  if (!(variance > 0.0)) return if_unknown;
  return variance < infinite_from ? std::sqrt(variance) : std::numeric_limits<double>::infinity();
}

/// The sigmas of one measurement: the user's, else those of the message, else the defaults.
class SigmaRule {
 public:
  explicit SigmaRule(const std::optional<PriorSigmas>& forced)
      : sigmas_(forced.value_or(PriorSigmas{})), is_forced_(forced.has_value()) {}

  Eigen::Vector3d translation(const std::array<double, 3>* variances) const {
    constexpr double kInfinite = 1e5;  // [m^2]
    Eigen::Vector3d sigma(sigmas_.horizontal, sigmas_.horizontal, sigmas_.vertical);
    if (is_forced_ || variances == nullptr) return sigma;
    for (Eigen::Index i = 0; i < 3; ++i) {
      sigma[i] = sigma_of((*variances)[static_cast<std::size_t>(i)], sigma[i], kInfinite);
    }
    return sigma;
  }
  double heading(const double* variance) const {
    constexpr double kInfinite = M_PI * M_PI;  // [rad^2]
    if (is_forced_ || variance == nullptr) return sigmas_.heading;
    return sigma_of(*variance, sigmas_.heading, kInfinite);
  }

 private:
  PriorSigmas sigmas_;
  bool is_forced_;
};

/// Adds an error along x and along y in quadrature [m].
void add_horizontally(PosePrior& prior, double error) {
  for (Eigen::Index i = 0; i < 2; ++i) {
    prior.sigma_translation[i] = std::hypot(prior.sigma_translation[i], error);
  }
}

bool says_something(const PosePrior& prior) {
  return std::isfinite(prior.sigma_heading) || prior.sigma_translation.array().isFinite().any();
}

/// "12 messages of /fix without a fix were left out", unless there are none.
void note_left_out(PosePriors& found, std::uint64_t count, const std::string& topic,
                   std::string_view which) {
  if (count == 0) return;
  found.notes.push_back(fmt::format("{} of {} {} {} left out", cli::counted(count, "message"),
                                    topic, which, cli::form(count, "was", "were")));
}

Result<PosePriors> priors_in_file(const PriorSource& source, const SensorFrame& sensor,
                                  const SigmaRule& rule) {
  VANTAGE_TRY(const auto poses,
              read_sensor_trajectory({source.path, source.topic, source.rate_hz}, sensor));
  PosePriors found{.priors = {}, .source = source.path.string()};
  for (const StampedPose& moment : poses.poses) {
    found.priors.push_back({moment.stamp,
                            {.T_map_sensor = moment.pose,
                             .sigma_translation = rule.translation(nullptr),
                             .sigma_heading = rule.heading(nullptr)}});
  }
  return found;
}

Result<PosePriors> priors_of_poses(ros::MessageReader& reader, const PriorSource& source,
                                   const std::string& topic, const SensorFrame& sensor,
                                   const SigmaRule& rule) {
  VANTAGE_TRY(const auto poses, ros::read_bag_trajectory(reader, topic));
  VANTAGE_TRY(const auto T_child_sensor,
              sensor_mount("poses of " + poses.topic, poses.child, source.path, sensor));
  PosePriors found{.priors = {}, .source = fmt::format("{} {}", source.path.string(), topic)};
  found.damage = poses.damage;
  std::uint64_t empty = 0;
  for (std::size_t i = 0; i < poses.poses.size(); ++i) {
    const ros::PoseVariances* const stated =
        i < poses.variances.size() && poses.variances[i] ? &*poses.variances[i] : nullptr;
    const StampedPose& moment = poses.poses[i];
    PosePrior prior{
        .T_map_sensor = moment.pose,
        .sigma_translation = rule.translation(stated == nullptr ? nullptr : &stated->translation),
        .sigma_heading = rule.heading(stated == nullptr ? nullptr : &stated->heading)};
    if (!says_something(prior)) {
      ++empty;
      continue;
    }
    if (T_child_sensor) {
      prior.T_map_sensor = prior.T_map_sensor * *T_child_sensor;
      // A wrong heading turns the sensor around the place of the pose: by two radii at most.
      add_horizontally(
          prior, T_child_sensor->translation.head<2>().norm() * std::min(prior.sigma_heading, 2.0));
    }
    found.priors.push_back({moment.stamp, prior});
  }
  note_left_out(found, poses.skipped, topic, "stamped no later than the one before");
  note_left_out(found, empty, topic, "whose variances say nothing");
  if (!found.priors.empty()) return found;
  return fail(ErrorCode::corrupt_data,
              fmt::format("the variances of all {} messages of {} say that nothing is known; state "
                          "what is, with --prior-sigma",
                          empty, topic),
              SourceLocation{source.path.string(), 0, 0});
}

Result<MapProjection> projection_for(const PriorSource& source, const std::string& topic) {
  if (!source.map_projector.empty()) return MapProjection::read(source.map_projector);
  std::vector<std::string> missing;
  for (const auto& file : projector_files_beside(source.map_files)) {
    std::error_code ignored;
    if (std::filesystem::exists(file, ignored)) return MapProjection::read(file);
    missing.push_back(file.string());
  }
  return fail(
      ErrorCode::invalid_input,
      fmt::format(
          "{} has latitudes and longitudes, and no {} says where the map is on the "
          "earth{}; name one with --map-projector",
          topic, kMapProjectorInfo,
          missing.empty() ? "" : fmt::format(" (there is no {})", fmt::join(missing, ", no "))),
      SourceLocation{source.path.string(), 0, 0});
}

/// T_antenna_sensor, as far as it is known.
Result<Eigen::Vector3d> antenna_offset(const ros::BagFixes& fixes, const std::string& topic,
                                       const PriorSource& source, const SensorFrame& sensor) {
  const bool same = !fixes.frame.empty() && fixes.frame == ros::frame_name(sensor.name);
  if (sensor.T_child_sensor && !same) return sensor.T_child_sensor->translation;
  VANTAGE_TRY(const auto T_antenna_sensor,
              sensor_mount("positions of " + topic, fixes.frame, source.path, sensor));
  return T_antenna_sensor ? T_antenna_sensor->translation : Eigen::Vector3d::Zero().eval();
}

/// Gives fixes without an altitude that of the one before, or else of the first that has one: it
/// says nothing, but z can be interpolated. @return  how many have none
std::uint64_t fill_altitudes(std::vector<ros::StampedFix>& fixes) {
  const auto first = std::ranges::find_if(fixes, &ros::StampedFix::has_altitude);
  double altitude = first == fixes.end() ? 0.0 : first->position.altitude;
  std::uint64_t unknown = 0;
  for (ros::StampedFix& fix : fixes) {
    unknown += fix.has_altitude ? 0 : 1;
    if (fix.has_altitude) altitude = fix.position.altitude;
    fix.position.altitude = altitude;
  }
  return unknown;
}

Result<PosePriors> priors_of_fixes(ros::MessageReader& reader,
                                   const std::vector<std::size_t>& topics,
                                   const PriorSource& source, const SensorFrame& sensor,
                                   const SigmaRule& rule) {
  const std::string topic = reader.topics()[topics.front()].name;
  VANTAGE_TRY(const auto projection, projection_for(source, topic));
  VANTAGE_TRY(auto fixes, ros::read_bag_fixes(reader, topics));
  const std::uint64_t without_altitude = fill_altitudes(fixes.fixes);
  VANTAGE_TRY(const Eigen::Vector3d offset, antenna_offset(fixes, topic, source, sensor));
  constexpr double kUnknown = std::numeric_limits<double>::infinity();
  PosePriors found{.priors = {}, .source = fmt::format("{} {}", source.path.string(), topic)};
  found.damage = fixes.damage;
  if (!projection.unknown_heights().empty()) found.notes.push_back(projection.unknown_heights());
  std::uint64_t empty = 0, not_in_map = 0;
  for (const ros::StampedFix& fix : fixes.fixes) {
    const auto point = projection.project(fix.position);
    if (!point && point.error().code == ErrorCode::invalid_input) {
      ++not_in_map;
      continue;
    }
    VANTAGE_CHECK(point);
    PosePrior prior{
        .T_map_sensor = {},
        .sigma_translation = rule.translation(fix.variances ? &*fix.variances : nullptr),
        .sigma_heading = kUnknown};
    prior.T_map_sensor.translation = *point + Eigen::Vector3d(0.0, 0.0, offset.z());
    if (!fix.has_altitude || !projection.unknown_heights().empty()) {
      prior.sigma_translation.z() = kUnknown;
    }
    add_horizontally(prior, offset.head<2>().norm());
    if (says_something(prior)) {
      found.priors.push_back({fix.stamp, prior});
    } else {
      ++empty;
    }
  }
  if (without_altitude > 0) {
    found.notes.push_back(fmt::format("{} of {} {} no altitude and {} no height",
                                      cli::counted(without_altitude, "message"), topic,
                                      cli::form(without_altitude, "has", "have"),
                                      cli::form(without_altitude, "gives", "give")));
  }
  note_left_out(found, fixes.without_fix, topic, "without a fix");
  note_left_out(found, fixes.not_finite, topic, "whose position is not finite");
  note_left_out(found, not_in_map, topic, "far from the map or not on the earth");
  note_left_out(found, fixes.not_later, topic, "stamped no later than the one before");
  note_left_out(found, empty, topic, "whose variances say nothing");
  if (!found.priors.empty()) return found;
  return fail(ErrorCode::corrupt_data,
              fmt::format("no message of {} can be used: {} without a fix, {} whose position is "
                          "not finite, {} far from the map or not on the earth, {} whose variances "
                          "say nothing",
                          topic, fixes.without_fix, fixes.not_finite, not_in_map, empty),
              SourceLocation{source.path.string(), 0, 0});
}

/// Of two groups, the one that states how uncertain it is comes first; odometry drifts and is no
/// prior unless there is nothing else.
ros::TopicNeed priors_needed() {
  return {.what = "absolute poses or positions",
          .choices = {{"geometry_msgs/PoseWithCovarianceStamped", ros::kNavSatFix},
                      {"nav_msgs/Odometry", "geometry_msgs/PoseStamped"}},
          .by_name = {"geometry_msgs/TransformStamped", "tf2_msgs/TFMessage", "tf/tfMessage"}};
}

}  // namespace

Result<PosePriors> read_priors(const PriorSource& source, const SensorFrame& sensor) {
  if (source.sigmas) VANTAGE_CHECK(check(*source.sigmas, source.path.string()));
  const SigmaRule rule(source.sigmas);
  VANTAGE_TRY(const bool bag, ros::is_bag(source.path));
  if (!bag) return priors_in_file(source, sensor, rule);
  VANTAGE_TRY(const auto reader, ros::open_bag(source.path));
  const bool has_frames = source.topic.find(':') != std::string::npos;
  if (has_frames) return priors_of_poses(*reader, source, source.topic, sensor, rule);
  VANTAGE_TRY(const auto topics, ros::choose_topic(*reader, source.topic, priors_needed()));
  const ros::Topic topic = reader->topics()[topics.front()];
  if (topic.type == ros::kNavSatFix) return priors_of_fixes(*reader, topics, source, sensor, rule);
  return priors_of_poses(*reader, source, topic.name, sensor, rule);
}

std::optional<PosePrior> prior_at(const PosePriors& priors, double stamp, double max_gap_s) {
  const auto& all = priors.priors;
  const auto after =
      std::lower_bound(all.begin(), all.end(), stamp,
                       [](const StampedPrior& prior, double s) { return prior.stamp < s; });
  const StampedPrior* const before = after == all.begin() ? nullptr : &*std::prev(after);
  const StampedPrior* const next = after == all.end() ? nullptr : &*after;
  Trajectory around;
  for (const StampedPrior* measured : {before, next}) {
    if (measured != nullptr) around.push_back({measured->stamp, measured->prior.T_map_sensor});
  }
  const auto pose = pose_at(around, stamp, max_gap_s);
  if (!pose) return std::nullopt;
  const bool is_before =
      next == nullptr || (before != nullptr && stamp - before->stamp <= next->stamp - stamp);
  PosePrior prior = is_before ? before->prior : next->prior;
  prior.T_map_sensor = *pose;
  return prior;
}

}  // namespace vantage::io
