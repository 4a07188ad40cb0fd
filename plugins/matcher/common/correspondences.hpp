#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "common/point_tree.hpp"
#include "common/surfel_map.hpp"

namespace vantage::matching {

/// The nearest map point of each scan point. A search also finds a distance below which there is no
/// other map point. It is repeated only when the scan point has moved so far that another map point
/// may be nearer.
class Correspondences {
 public:
  /// Starts a new scan and forgets the previous one.
  void begin(std::size_t scan_points, double max_distance) {
    found_.assign(scan_points, {});
    radius_ = kReserve * max_distance;
  }

  /// The map point nearest to `x`, the current position of scan point i; kNone if it is farther
  /// than `limit`. Precondition: limit <= max_distance.
  [[nodiscard]] std::uint32_t nearest(const SurfelMap& map, std::size_t i, const Eigen::Vector3d& x,
                                      double limit) {
    if (!map.reaches(x, limit)) return kNone;
    Found& f = found_[i];
    const double moved = (x - f.at).norm();
    const double others = f.others - moved;
    if (f.index == kNone) {
      if (others > limit) return kNone;
    } else {
      const double distance = (x - map.points()[f.index]).norm();
      if (distance < others) return distance <= limit ? f.index : kNone;
    }
    // The second nearest point is still within this radius, or no point is within the radius at
    // all.
    const double radius =
        f.index == kNone ? radius_ : std::min(radius_, kRounding * (f.others + moved));
    const PointTree::Nearest found = map.tree().nearest(x, radius);
    f = {.at = x, .others = found.others, .index = found.index};
    if (found.index == kNone || (x - map.points()[found.index]).norm() > limit) return kNone;
    return found.index;
  }

 private:
  // The search reaches a little farther than max_distance, so that a point without a match may move
  // before the next search.
  static constexpr double kReserve = 1.1;
  static constexpr double kRounding = 1.0 + 1e-9;
  struct Found {
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    double others = -std::numeric_limits<double>::infinity();
    std::uint32_t index = kNone;
  };
  std::vector<Found> found_;
  double radius_ = 0.0;
};

}  // namespace vantage::matching
