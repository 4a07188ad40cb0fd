#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "vantage/kit/hash.hpp"
#include "vantage/kit/numbers.hpp"
#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/raster_partition.hpp"

namespace {

using Eigen::Vector2d;
using vantage::ErrorCode, vantage::fail, vantage::PointsView, vantage::Result;

/// The path is divided into steps of this share of a segment.
constexpr std::uint32_t kStepsPerSegment = 16;
constexpr double kMaxSegments = 1'000'000;

double distance(const Vector2d& a, const Vector2d& b) noexcept {
  return std::hypot(b.x() - a.x(), b.y() - a.y());
}

/// The positions in plan view that are at least `spacing` from the position kept before, and the
/// last position. A vehicle that stands still goes nowhere, even if its receiver's noise says
/// otherwise.
std::vector<Vector2d> thinned(PointsView trajectory, double spacing) {
  std::vector<Vector2d> path{trajectory.front().head<2>()};
  for (const vantage::Point& p : trajectory) {
    if (distance(path.back(), p.head<2>()) >= spacing) path.emplace_back(p.head<2>());
  }
  const Vector2d last = trajectory.back().head<2>();
  if (path.back() != last) path.push_back(last);
  return path;
}

double length_of(const std::vector<Vector2d>& path) noexcept {
  double length = 0.0;
  for (std::size_t k = 1; k < path.size(); ++k) length += distance(path[k - 1], path[k]);
  return length;
}

/// A piece of the path.
struct Step {
  std::vector<Vector2d> corners;  // at least two, or one for a path that goes nowhere
  Vector2d middle;
};

/// Cuts the path at every multiple of `length` of its arc length.
std::vector<Step> steps_of(const std::vector<Vector2d>& path, double length) {
  std::vector<Step> steps;
  std::vector<Vector2d> corners{path.front()};
  const auto finish = [&] {
    steps.push_back({corners, 0.5 * (corners.front() + corners.back())});
    corners = {corners.back()};
  };
  double before = 0.0;  // arc length of path[k - 1]
  for (std::size_t k = 1; k < path.size(); ++k) {
    const Vector2d& from = path[k - 1];
    const double edge = distance(from, path[k]);
    for (double cut = static_cast<double>(steps.size() + 1) * length; cut < before + edge;
         cut = static_cast<double>(steps.size() + 1) * length) {
      corners.emplace_back(from + (cut - before) / edge * (path[k] - from));
      finish();
    }
    corners.push_back(path[k]);
    before += edge;
  }
  if (corners.size() > 1 || steps.empty()) finish();
  return steps;
}

/// Finds the nearest of the inserted steps within a radius.
class Driven {
 public:
  Driven(const std::vector<Step>& steps, double radius) : steps_(steps), radius_(radius) {}

  void insert(std::uint32_t step) { buckets_[bucket(steps_[step].middle)].push_back(step); }

  /// @return  the nearest step within the radius; of two equally near, the earlier
  [[nodiscard]] std::optional<std::uint32_t> nearest(const Vector2d& p) const {
    std::optional<std::uint32_t> best;
    double least = radius_;
    const Bucket here = bucket(p);
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto found = buckets_.find({here[0] + dx, here[1] + dy});
        if (found == buckets_.end()) continue;
        for (const std::uint32_t step : found->second) {
          const double d = distance(steps_[step].middle, p);
          if (d > least || (d == least && best && step > *best)) continue;
          least = d;
          best = step;
        }
      }
    }
    return best;
  }

 private:
  using Bucket = std::array<double, 2>;  // whole numbers

  [[nodiscard]] Bucket bucket(const Vector2d& p) const noexcept {
    return {std::floor(p.x() / radius_), std::floor(p.y() / radius_)};
  }

  const std::vector<Step>& steps_;
  double radius_;
  std::unordered_map<Bucket, std::vector<std::uint32_t>, vantage::CellHash> buckets_;
};

/// For each step, the earlier step at the same place, if there is one. Path that lies less than a
/// segment and two radii behind is not an earlier visit: the vehicle is just coming from there.
std::vector<std::optional<std::uint32_t>> revisited(const std::vector<Step>& steps,
                                                    double step_length, double radius) {
  std::vector<std::optional<std::uint32_t>> twin(steps.size());
  if (!(radius > 0.0)) return twin;
  const double behind = std::max<double>(kStepsPerSegment, std::ceil(2.0 * radius / step_length));
  if (!(behind < static_cast<double>(steps.size()))) return twin;
  const auto gap = static_cast<std::uint32_t>(behind);
  Driven driven(steps, radius);
  for (std::uint32_t k = gap; k < steps.size(); ++k) {
    if (!twin[k - gap]) driven.insert(k - gap);
    twin[k] = driven.nearest(steps[k].middle);
  }
  return twin;
}

/// The segment of each step, and the number of segments.
struct Segments {
  std::vector<std::uint32_t> of_step;
  std::uint32_t count = 0;
};

Segments segments_of(const std::vector<std::optional<std::uint32_t>>& twin) {
  Segments segments;
  segments.of_step.resize(twin.size());
  for (std::size_t begin = 0; begin < twin.size();) {
    if (twin[begin]) {
      segments.of_step[begin] = segments.of_step[*twin[begin]];
      ++begin;
      continue;
    }
    std::size_t end = begin;  // of the stretch that is driven for the first time
    while (end < twin.size() && !twin[end]) ++end;
    const auto steps = static_cast<std::uint32_t>(end - begin);
    std::uint32_t pieces = (steps + kStepsPerSegment / 2) / kStepsPerSegment;
    std::uint32_t first = segments.count;
    if (pieces == 0) {
      // Too short for a segment of its own, so it belongs to the stretch driven before.
      pieces = 1;
      if (begin > 0) first = segments.of_step[begin - 1];
    }
    for (std::uint32_t k = 0; k < steps; ++k) {
      segments.of_step[begin + k] = first + std::min(k / kStepsPerSegment, pieces - 1);
    }
    segments.count = std::max(segments.count, first + pieces);
    begin = end;
  }
  return segments;
}

/// The path as it was first driven. Later passes would blur the borders between segments.
std::vector<vantage::Seed> seeds_of(const std::vector<Step>& steps,
                                    const std::vector<std::optional<std::uint32_t>>& twin,
                                    const Segments& segments) {
  std::vector<vantage::Seed> seeds;
  for (std::size_t k = 0; k < steps.size(); ++k) {
    if (twin[k]) continue;
    const std::vector<Vector2d>& corners = steps[k].corners;
    if (corners.size() == 1) seeds.push_back({corners[0], corners[0], segments.of_step[k]});
    for (std::size_t c = 1; c < corners.size(); ++c) {
      seeds.push_back({corners[c - 1], corners[c], segments.of_step[k]});
    }
  }
  return seeds;
}

/// Segments of the driven path; the nearest one owns a place.
struct Trajectory {
  double segment_length{};
  double cell_size = 1.0;
  std::optional<double> revisit_distance, fill_radius;

  static constexpr auto schema() {
    return std::tuple{
        vantage::required("segment_length", &Trajectory::segment_length, "m",
                          "length of path that makes a region", vantage::positive),
        vantage::optional("cell_size", &Trajectory::cell_size, "m",
                          "width of the cells that regions are made of", vantage::positive),
        vantage::optional("revisit_distance", &Trajectory::revisit_distance, "m",
                          "path this near to an earlier part of the path counts as the same place; "
                          "half a segment_length if left out, 0 for never",
                          vantage::non_negative),
        vantage::optional(
            "fill_radius", &Trajectory::fill_radius, "m",
            "places in the map's box this near to the path, where it was first driven, belong to a "
            "region even without points; half a segment_length if left out",
            vantage::non_negative),
    };
  }

  [[nodiscard]] Result<vantage::Partition> partition(const vantage::MapPasses& map,
                                                     PointsView trajectory,
                                                     const vantage::MapSurvey&) const {
    if (trajectory.empty()) {
      return fail(ErrorCode::invalid_input,
                  "partitioner 'trajectory' cuts along the driven path, but there is none: name "
                  "its file in map.trajectory");
    }
    VANTAGE_CHECK(vantage::check_points(trajectory, "the trajectory (map.trajectory)"));

    const double half = 0.5 * segment_length;
    const double step = segment_length / kStepsPerSegment;
    const std::vector<Vector2d> path = thinned(trajectory, 0.5 * step);
    const double length = length_of(path);
    if (!(length / segment_length < kMaxSegments)) {
      return fail(ErrorCode::invalid_input,
                  "segment_length = " + vantage::shortest(segment_length) +
                      " m is too small for a trajectory of " + vantage::shortest(length) +
                      " m: at most 1000000 segments");
    }
    const std::vector<Step> steps = steps_of(path, step);
    const auto twin = revisited(steps, step, revisit_distance.value_or(half));
    const Segments segments = segments_of(twin);
    return vantage::partition_by_nearest(
        map, seeds_of(steps, twin, segments), vantage::numbered("segment_", segments.count),
        {.cell_size = cell_size, .fill_radius = fill_radius.value_or(half)});
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, vantage::PartitionerOf<Trajectory>, "trajectory",
               "segments of the driven path; a place belongs to the nearest segment");
