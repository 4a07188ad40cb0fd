#include "localize/contrast.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <numbers>
#include <utility>
#include <vector>

#include "localize/matched.hpp"
#include "vantage/kit/evenly_picked.hpp"

namespace vantage {
namespace {

// A lattice around the pose is scored with so many points, and its summits with more of them.
constexpr int kNodes = 5;                                                   // to each side
constexpr double kStep = kBasin / kNodes;                                   // [m]
constexpr double kFarthest = (kNodes + 1) * kStep, kFinest = 0.25 * kStep;  // [m], of climbs
constexpr std::size_t kPlaces = 8 * (kNodes + 1) + 1;  // to both sides, kFinest apart
// A line of nodes above and below, ends [m] and steps [m]: ground is thin, and a search may be off
// by metres where a map shows little of it.
constexpr double kHighest = 5.0, kHeightStep = 0.05;
constexpr std::size_t kAtNodes = 128, kAtSummits = 256, kMostSummits = 4;

double normal_density(double x, double mean, double sigma) {
  const double z = (x - mean) / sigma;
  return std::exp(-0.5 * z * z) / (sigma * std::sqrt(2.0 * std::numbers::pi));
}

// Of right poses: a summit lies farther away than a slope.
constexpr double kUsualSummit = kContrast + 0.5 * kContrastSpread;
constexpr double kUsualSlope = kContrast - 0.5 * kContrastSpread;

/// The same for a summit or a slope. Contrasts are normal, but for a few. The mean of twins is 0.
/// @param usual  the mean of right poses
double ratio_of(double contrast, double usual, double noise) {
  const double x = std::clamp(contrast, 0.0, usual);
  const double sigma = std::hypot(kContrastSpread, noise);
  return normal_density(x, 0.0, sigma) / std::lerp(normal_density(x, usual, sigma), 1.0, kOutlier);
}

struct Node {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  // ahead and to the left [m]
  double level = 0.0;
};

/// The levels of a scan around a pose: in plan view, and above and below it.
class Surroundings {
 public:
  Surroundings(const MatchTarget& target, PointsView scan, const Pose& T_map_scan, double limit)
      : target_(target),
        T_map_scan_(T_map_scan),
        level_(T_map_scan.rotation.toRotationMatrix() * level_axes(up_of(T_map_scan))),
        limit_(limit),
        few_(evenly_picked(scan, kAtNodes)),
        some_(evenly_picked(scan, kAtSummits)),
        climbed_(kPlaces * kPlaces) {}

  struct Levels {
    double here = 0.0, compared = 0.0;  // points that were compared with the map here
    double summit = 0.0;                // the highest summit beyond the limit, or 0 without one
    double slope = 0.0;                 // the highest level beyond the limit
    double height = 0.0;                // the highest summit above or below
  };
  [[nodiscard]] Result<Levels> levels() {
    VANTAGE_TRY(const ScanScore here, target_.score(some_, T_map_scan_));
    Levels levels{.here = level_of(here),
                  .compared = here.compared * here.coverage * static_cast<double>(some_.size())};
    VANTAGE_TRY(const auto summits, summits_of_lattice());
    Node highest;
    for (const Node& from : summits) {
      VANTAGE_TRY(const Node summit, climb(from, 0.0));
      if (summit.at.norm() >= limit_ && summit.level > highest.level) highest = summit;
    }
    VANTAGE_TRY(levels.summit, level_aligned(highest));
    for (const double side : {-1.0, 1.0}) {
      VANTAGE_TRY(const double summit, summit_at_other_height(side));
      levels.height = std::max(levels.height, summit);
    }
    if (summits.empty()) return levels;
    VANTAGE_TRY(const Node slope, climb(summits.front(), limit_));
    levels.slope = std::max(levels.summit, slope.level);
    return levels;
  }

 private:
  /// @param by  map frame [m]
  [[nodiscard]] Result<double> level_moved(PointsView points, const Point& by) const {
    Pose moved = T_map_scan_;
    moved.translation += by;
    VANTAGE_TRY(const ScanScore score, target_.score(points, moved));
    return level_of(score);
  }
  [[nodiscard]] Result<double> level_at(PointsView points, const Eigen::Vector2d& at) const {
    return level_moved(points, level_ * Point(at.x(), at.y(), 0.0));
  }

  /// The level to which matching comes from a summit.
  [[nodiscard]] Result<double> level_aligned(const Node& summit) const {
    if (!(summit.level > 0.0)) return 0.0;
    Pose start = T_map_scan_;
    start.translation += level_ * Point(summit.at.x(), summit.at.y(), 0.0);
    VANTAGE_TRY(const auto alignment, aligned_at(target_, some_, start));
    if (!alignment) return summit.level;
    const Point off = alignment->T_map_scan.translation - T_map_scan_.translation;
    return off.norm() >= limit_ ? std::max(summit.level, level_of(alignment->score)) : summit.level;
  }

  /// The highest summit of the line above or below the pose, beyond the limit; 0 without one.
  /// @param side  1 above, -1 below
  [[nodiscard]] Result<double> summit_at_other_height(double side) const {
    std::vector<double> line;  // from a step nearer than the limit to a step farther than kHighest
    const auto up = [&](std::size_t k) {
      return Point(0.0, 0.0, side * (limit_ + (static_cast<double>(k) - 1.0) * kHeightStep));
    };
    const auto nodes =
        static_cast<std::size_t>(std::max(0.0, (kHighest - limit_) / kHeightStep)) + 3;
    for (std::size_t k = 0; k < nodes; ++k) {
      VANTAGE_TRY(line.emplace_back(), level_moved(few_, up(k)));
    }
    std::size_t best = 0;
    for (std::size_t k = 1; k + 1 < nodes; ++k) {
      const bool is_summit = line[k] >= line[k - 1] && line[k] >= line[k + 1] && line[k] > 0.0;
      if (is_summit && (best == 0 || line[k] > line[best])) best = k;
    }
    if (best == 0) return 0.0;
    return level_moved(some_, up(best));
  }

  /// The nodes beyond the limit that are as high as those around them there, the highest ones.
  [[nodiscard]] Result<std::vector<Node>> summits_of_lattice() const {
    std::vector<Node> nodes, summits;
    for (int x = -kNodes; x <= kNodes; ++x) {
      for (int y = -kNodes; y <= kNodes; ++y) {
        const Eigen::Vector2d at = kStep * Eigen::Vector2d(x, y);
        if (at.norm() < limit_) continue;
        VANTAGE_TRY(const double level, level_at(few_, at));
        nodes.push_back({at, level});
      }
    }
    std::ranges::copy_if(nodes, std::back_inserter(summits), [&](const Node& node) {
      return std::ranges::none_of(nodes, [&](const Node& other) {
        return other.level > node.level && (other.at - node.at).cwiseAbs().maxCoeff() < 1.5 * kStep;
      });
    });
    std::ranges::stable_sort(summits, std::greater(), &Node::level);
    summits.resize(std::min(summits.size(), kMostSummits));
    return summits;
  }

  /// The level at a place of the climbs, which meet each other. It is computed once.
  [[nodiscard]] Result<double> level_of_climb(const Eigen::Vector2d& at) {
    const auto index = [](double x) {
      return static_cast<std::size_t>(std::lround((x + kFarthest) / kFinest));
    };
    std::optional<double>& level = climbed_[index(at.x()) * kPlaces + index(at.y())];
    if (!level) {
      VANTAGE_TRY(level, level_at(some_, at));
    }
    return *level;
  }

  /// The highest level nearby, no nearer to the pose than this.
  [[nodiscard]] Result<Node> climb(Node node, double least) {
    VANTAGE_TRY(node.level, level_of_climb(node.at));
    for (const double step : {0.5 * kStep, kFinest}) {
      for (bool moved = true; std::exchange(moved, false);) {
        const Eigen::Vector2d from = node.at;
        for (const Eigen::Index axis : {0, 1}) {
          for (const double side : {step, -step}) {
            const Eigen::Vector2d at = from + side * Eigen::Vector2d::Unit(axis);
            if (at.norm() < least || at.cwiseAbs().maxCoeff() > kFarthest) continue;
            VANTAGE_TRY(const double level, level_of_climb(at));
            if (!(level > node.level)) continue;
            node = {at, level};
            moved = true;
          }
        }
      }
    }
    return node;
  }

  const MatchTarget& target_;
  const Pose& T_map_scan_;
  Eigen::Matrix3d level_;  // ahead, to the left and up, map frame
  double limit_;
  PointCloud few_, some_;
  std::vector<std::optional<double>> climbed_;  // by place, row by row
};

}  // namespace

Result<std::optional<Contrast>> contrast_at(const MatchTarget& target, PointsView scan,
                                            const Pose& T_map_scan, double limit,
                                            const Evidence& evidence) {
  const double sharpness = evidence.sharpness, share = evidence.share;
  if (!(sharpness > 0.0) || !(share > 0.0)) return std::optional<Contrast>();
  Surroundings around(target, scan, T_map_scan, limit);
  VANTAGE_TRY(const auto levels, around.levels());
  const double noise = noise_of_level(levels.compared) * levels.here / sharpness;
  const double changed = kChange * std::max(0.0, 1.0 - share) / share;
  const double deviation = std::hypot(noise, changed);
  const auto less = [&](double level) {
    return std::clamp((levels.here - level) / sharpness, -1.0, 1.0);
  };
  // Where a map has no ground, heights differ little: only a clearly better one counts.
  const double height = less(levels.height), other = height < -deviation ? height : 1.0;
  return std::optional(Contrast{std::min(less(levels.summit), other),
                                std::min(less(levels.slope), other), deviation});
}

double ratio_of_twin(const Contrast& contrast) noexcept {
  return std::max(ratio_of(contrast.summit, kUsualSummit, contrast.noise),
                  ratio_of(contrast.slope, kUsualSlope, contrast.noise));
}

double weight_of(const Contrast& contrast) noexcept {
  const double z = contrast.noise / kContrastSpread;
  return 1.0 / (1.0 + z * z);
}

}  // namespace vantage
