#include "vantage/io/trajectory_io.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <string>
#include <utility>

#include "io/formats.hpp"
#include "io/text.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/track/rotation.hpp"

namespace vantage::io {
namespace {

using Quaternion = Eigen::Quaternion<double, Eigen::DontAlign>;
using RowMajor3x4 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;

constexpr std::size_t kTumColumns = 8;
constexpr std::size_t kKittiColumns = 12;
constexpr std::size_t kFrameKittiColumns = 13;
constexpr double kRotationTolerance = 1e-3;
constexpr double kStampTolerance = 1e-3;  // [s]

// Either a value, or what was wrong with it; the caller knows the file and the line.
template <class T>
using Checked = tl::expected<T, std::string>;

Checked<Pose> pose_from_tum(std::span<const double, kTumColumns> v) {
  Pose pose;
  pose.translation = {v[1], v[2], v[3]};
  pose.rotation = Quaternion(v[7], v[4], v[5], v[6]);
  const double norm = pose.rotation.norm();
  if (!(std::abs(norm - 1.0) <= kRotationTolerance)) {
    return tl::unexpected(fmt::format("the quaternion has length {}, expected 1 to within {}", norm,
                                      kRotationTolerance));
  }
  // A quaternion that is already normalized keeps its bits.
  constexpr double kRounding = 8.0 * std::numeric_limits<double>::epsilon();
  if (std::abs(pose.rotation.squaredNorm() - 1.0) > kRounding) pose.rotation.normalize();
  return pose;
}

Checked<Pose> pose_from_kitti(std::span<const double, kKittiColumns> v) {
  const Eigen::Map<const RowMajor3x4> matrix(v.data());
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const double off =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off <= kRotationTolerance)) {
    return tl::unexpected(fmt::format(
        "the rotation matrix is not orthonormal: R'R differs from the identity by {:.3g}, "
        "expected at most {}",
        off, kRotationTolerance));
  }
  if (rotation.determinant() < 0.0) {
    return tl::unexpected(
        std::string("the rotation matrix is a reflection (determinant -1), expected +1"));
  }
  Pose pose;
  pose.rotation = Quaternion(rotation).normalized();
  pose.translation = matrix.col(3);
  return pose;
}

Checked<StampedPose> stamped_pose(std::span<const double> values, std::size_t row,
                                  double kitti_rate_hz) {
  StampedPose stamped;
  Checked<Pose> pose;
  if (values.size() == kTumColumns) {
    stamped.stamp = values[0];
    if (auto problem = problem_of_stamp(stamped.stamp)) {
      return tl::unexpected(*std::move(problem));
    }
    pose = pose_from_tum(values.first<kTumColumns>());
  } else {
    double frame = static_cast<double>(row);
    if (values.size() == kFrameKittiColumns) {
      frame = values[0];
      if (frame < 0.0 || frame != std::floor(frame)) {
        return tl::unexpected(
            fmt::format("expected a frame number in the first of 13 columns, found {}", frame));
      }
    }
    stamped.stamp = frame / kitti_rate_hz;
    pose = pose_from_kitti(values.last<kKittiColumns>());
  }
  if (!pose) return tl::unexpected(std::move(pose).error());
  stamped.pose = *pose;
  return stamped;
}

Checked<std::vector<double>> numbers_in(std::string_view line) {
  std::vector<double> values;
  WordReader words(line);
  for (auto word = words.next(); !word.empty(); word = words.next()) {
    const auto value = parse_number<double>(word);
    if (!value || !std::isfinite(*value)) {
      return tl::unexpected(fmt::format("expected a finite number in column {}, found {}",
                                        values.size() + 1, quoted(word)));
    }
    values.push_back(*value);
  }
  return values;
}

Result<void> check(const std::filesystem::path& path, const Trajectory& trajectory) {
  const auto error = [&](std::size_t i, std::string_view what) {
    return fail(ErrorCode::invalid_input,
                fmt::format("pose {} of {} {}", i, trajectory.size(), what),
                SourceLocation{path.string(), 0, 0});
  };
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    if (!std::isfinite(trajectory[i].stamp)) return error(i, "has a stamp that is not finite");
    if (i > 0 && trajectory[i].stamp <= trajectory[i - 1].stamp) {
      return error(i, "has a stamp that is not after the one before");
    }
    if (!is_valid(trajectory[i].pose)) {
      return error(i, "is not finite or its quaternion does not have length 1");
    }
  }
  return {};
}

}  // namespace

Result<Trajectory> read_trajectory(const std::filesystem::path& path, double kitti_rate_hz) {
  VANTAGE_TRY(const auto content,
              read_file(path, fmt::format("a trajectory ({})", text_trajectory_names())));
  return parse_trajectory(content.view(), path.string(), kitti_rate_hz);
}

Result<Trajectory> parse_trajectory(std::string_view content, const std::string& file,
                                    double kitti_rate_hz) {
  if (!(kitti_rate_hz > 0.0) || !std::isfinite(kitti_rate_hz)) {
    return fail(ErrorCode::invalid_input,
                fmt::format("the rate is {} Hz, expected a number above 0", kitti_rate_hz),
                SourceLocation{file, 0, 0});
  }
  LineReader lines(content);
  const auto error = [&](std::string message) {
    return fail(ErrorCode::corrupt_data, std::move(message), SourceLocation{file, lines.line(), 0});
  };

  Trajectory trajectory;
  std::size_t columns = 0;
  while (const auto line = lines.next()) {
    if (is_blank_or_comment(*line)) continue;
    const std::size_t found = WordReader(*line).count();
    if (columns == 0) {
      if (found != kTumColumns && found != kKittiColumns && found != kFrameKittiColumns) {
        return error(
            fmt::format("expected 8 (TUM), 12 (KITTI) or 13 (frame and KITTI) columns, "
                        "found {}: {}",
                        found, quoted(*line)));
      }
      columns = found;
    }
    if (found != columns) {
      return error(
          fmt::format("expected {} columns as in the lines before, found {}", columns, found));
    }
    const auto values = numbers_in(*line);
    if (!values) return error(values.error());
    auto pose = stamped_pose(*values, trajectory.size(), kitti_rate_hz);
    if (!pose) return error(std::move(pose).error());
    if (!trajectory.empty() && pose->stamp <= trajectory.back().stamp) {
      return error(
          fmt::format("stamp {} s does not follow {} s, expected strictly increasing "
                      "stamps",
                      pose->stamp, trajectory.back().stamp));
    }
    trajectory.push_back(*std::move(pose));
  }
  if (trajectory.empty())
    return error(
        fmt::format("no pose in the file, expected one a line ({})", text_trajectory_names()));
  return trajectory;
}

Result<std::string> to_tum(const std::filesystem::path& file, const Trajectory& trajectory) {
  VANTAGE_CHECK(check(file, trajectory));
  std::string text;
  for (const auto& [stamp, pose] : trajectory) {
    const auto& t = pose.translation;
    const auto& q = pose.rotation;
    fmt::format_to(std::back_inserter(text), "{} {} {} {} {} {} {} {}\n", stamp, t.x(), t.y(),
                   t.z(), q.x(), q.y(), q.z(), q.w());
  }
  return text;
}

Result<void> write_tum(const std::filesystem::path& path, const Trajectory& trajectory) {
  VANTAGE_TRY(const std::string text, to_tum(path, trajectory));
  return write_text_atomically(path, text);
}

Result<void> write_kitti(const std::filesystem::path& path, const Trajectory& trajectory) {
  VANTAGE_CHECK(check(path, trajectory));
  std::string text;
  for (const StampedPose& stamped : trajectory) {
    RowMajor3x4 matrix;
    matrix << stamped.pose.rotation.toRotationMatrix(), stamped.pose.translation;
    fmt::format_to(std::back_inserter(text), "{}\n",
                   fmt::join(matrix.data(), matrix.data() + matrix.size(), " "));
  }
  return write_text_atomically(path, text);
}

std::optional<Pose> pose_at(const Trajectory& trajectory, double stamp, double max_gap_s) {
  if (trajectory.empty() || !std::isfinite(stamp)) return std::nullopt;
  const auto after =
      std::lower_bound(trajectory.begin(), trajectory.end(), stamp,
                       [](const StampedPose& pose, double s) { return pose.stamp < s; });
  if (after != trajectory.end() && after->stamp == stamp) return after->pose;
  if (after == trajectory.begin() || after == trajectory.end() ||
      after->stamp - std::prev(after)->stamp > max_gap_s) {
    // Nothing to interpolate here: an end of the trajectory, or a gap in it.
    const auto nearest =
        after == trajectory.begin() ? after
        : after == trajectory.end() || stamp - std::prev(after)->stamp <= after->stamp - stamp
            ? std::prev(after)
            : after;
    if (std::abs(nearest->stamp - stamp) > kStampTolerance) return std::nullopt;
    return nearest->pose;
  }
  const StampedPose& a = *std::prev(after);
  const StampedPose& b = *after;
  return interpolate(a.pose, b.pose, (stamp - a.stamp) / (b.stamp - a.stamp));
}

}  // namespace vantage::io
