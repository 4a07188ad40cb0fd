#include "hidden_point_removal.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "eye.hpp"
#include "sight.hpp"
#include "unknown_points.hpp"

namespace vantage::hpr {
namespace {

// The number of viewpoints that one thread visits in a row: what occludes from one helps at the
// next.
constexpr std::size_t kTour = 128;

// One viewpoint of this many is visited first, to see most of what its neighbours see.
constexpr std::size_t kScouts = 12;
constexpr std::size_t kScoutsTour = 16;

// Computing the whole hull is faster as long as one viewpoint adds more than one part in this many
// of what all viewpoints see.
constexpr std::size_t kMuch = 32;

// Sights are kept for the next call, unless this call had this many viewpoints. In such a call,
// starting again costs almost nothing, while the memory of the sights matters.
constexpr std::size_t kLongCall = 512;

// The number of a cell of a 2^16 x 2^16 grid along a Hilbert curve: cells with close numbers are
// close to each other.
std::uint32_t hilbert_number(std::uint32_t x, std::uint32_t y) {
  std::uint32_t number = 0;
  for (std::uint32_t half = 1U << 15U; half > 0; half /= 2) {
    const bool right = (x & half) != 0, upper = (y & half) != 0;
    number = 4 * number + (right ? (upper ? 2 : 3) : (upper ? 1 : 0));
    if (!upper) {
      if (right) {
        x = ~x;
        y = ~y;
      }
      std::swap(x, y);
    }
  }
  return number;
}

// The viewpoints in an order in which each is near the one before it.
PointCloud along_a_curve(std::span<const Point> viewpoints) {
  const Bounds3 bounds = bounds_of(viewpoints);
  const double extent = (bounds.max - bounds.min).head<2>().maxCoeff();
  const double cells_per_metre = extent > 0.0 ? 65535.0 / extent : 0.0;
  struct Stop {
    std::uint32_t number;
    Point viewpoint;
  };
  std::vector<Stop> stops;
  stops.reserve(viewpoints.size());
  for (const Point& q : viewpoints) {
    const Eigen::Vector2d cell = cells_per_metre * (q - bounds.min).head<2>();
    stops.push_back(
        {hilbert_number(static_cast<std::uint32_t>(cell.x()), static_cast<std::uint32_t>(cell.y())),
         q});
  }
  std::sort(stops.begin(), stops.end(), [](const Stop& a, const Stop& b) {
    return std::tuple(a.number, a.viewpoint.x(), a.viewpoint.y(), a.viewpoint.z()) <
           std::tuple(b.number, b.viewpoint.x(), b.viewpoint.y(), b.viewpoint.z());
  });
  PointCloud tour;
  tour.reserve(stops.size());
  for (const Stop& stop : stops) {
    if (tour.empty() || tour.back() != stop.viewpoint) tour.push_back(stop.viewpoint);
  }
  return tour;
}

}  // namespace

HiddenPointRemoval::HiddenPointRemoval(PointsView map, const Settings& settings)
    : octree_(map), settings_(settings) {}

Result<void> HiddenPointRemoval::check_radius(const Point& viewpoint) const {
  if (settings_.kernel == Kernel::inversion) return {};
  const double radius = settings_.radius;
  const PointOctree::Node& root = octree_.nodes()[0];
  const Eigen::Vector3d offset = octree_.origin() - viewpoint;
  const Eigen::Vector3d farthest = (root.min.cast<double>() + offset)
                                       .cwiseAbs()
                                       .cwiseMax((root.max.cast<double>() + offset).cwiseAbs());
  if (std::min(settings_.max_range, 1.001 * farthest.norm()) <= radius) return {};

  const Eye eye(viewpoint, settings_);
  double longest = 0.0;
  std::optional<Point> place;
  bool one_place = true;
  for (const Point& p : octree_.points()) {
    const Point relative = eye.relative(p);
    if (!eye.takes_part(relative.squaredNorm())) continue;
    longest = std::max(longest, relative.norm());
    one_place = one_place && relative == place.value_or(relative);
    place = relative;
  }
  if (longest <= radius || one_place) return {};
  return fail(ErrorCode::invalid_input,
              "a map point is " + std::to_string(longest) +
                  " m from the viewpoint; the spherical flip needs R (" + std::to_string(radius) +
                  " m) to be at least the distance of every point: raise alpha or gap, or lower "
                  "max_range");
}

// A sight that was used before, preferably near a viewpoint: what occluded there helps here.
class HiddenPointRemoval::LentSight {
 public:
  LentSight(const HiddenPointRemoval& owner, const Point& viewpoint) : owner_(owner) {
    {
      const std::scoped_lock lock(owner.mutex_);
      const auto nearest = std::min_element(owner.idle_.begin(), owner.idle_.end(),
                                            [&](const auto& a, const auto& b) {
                                              return (a->viewpoint() - viewpoint).squaredNorm() <
                                                     (b->viewpoint() - viewpoint).squaredNorm();
                                            });
      if (nearest != owner.idle_.end()) {
        std::swap(*nearest, owner.idle_.back());
        sight_ = std::move(owner.idle_.back());
        owner.idle_.pop_back();
      }
    }
    if (sight_ != nullptr) return;
    sight_ = std::make_unique<Sight>(owner.octree_, owner.settings_);
    const std::scoped_lock lock(owner.mutex_);
    owner.idle_.reserve(++owner.sights_);  // so that giving a sight back needs no memory
  }
  ~LentSight() {
    const std::scoped_lock lock(owner_.mutex_);
    owner_.idle_.push_back(std::move(sight_));
  }
  LentSight(const LentSight&) = delete;
  LentSight& operator=(const LentSight&) = delete;

  Sight* operator->() { return sight_.get(); }

 private:
  const HiddenPointRemoval& owner_;
  std::unique_ptr<Sight> sight_;
};

void HiddenPointRemoval::forget_idle() const {
  const std::scoped_lock lock(mutex_);
  idle_.clear();
}

Result<IndexList> HiddenPointRemoval::visible(const Point& viewpoint) const {
  VANTAGE_CHECK(check_radius(viewpoint));
  return map_indices(Sight(octree_, settings_).visible_from(viewpoint));
}

Result<IndexList> HiddenPointRemoval::visible_from_any(std::span<const Point> viewpoints,
                                                       const VisibilityProgress* progress) const {
  for (const Point& viewpoint : viewpoints) VANTAGE_CHECK(check_radius(viewpoint));
  if (viewpoints.empty()) return IndexList{};
  const PointCloud tour = along_a_curve(viewpoints);
  PointCloud scouts, others;
  for (std::size_t k = 0; k < tour.size(); ++k) {
    (k % kScouts == kScouts / 2 ? scouts : others).push_back(tour[k]);
  }
  UnknownPoints unknown(octree_);
  const std::size_t points = octree_.points().size();
  const auto visit = [&](const PointCloud& stops, std::size_t in_a_row) {
    const auto visit_range = [&](const tbb::blocked_range<std::size_t>& range) {
      LentSight sight(*this, stops[range.begin()]);
      bool much = 2 * unknown.left() > points;
      for (std::size_t k = range.begin(); k < range.end(); ++k) {
        const std::size_t added = much ? sight->mark_all_visible(stops[k], unknown)
                                       : sight->mark_visible(stops[k], unknown);
        much = kMuch * added > points - unknown.left();
        if (progress != nullptr) progress->advanced(1);
      }
    };
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, stops.size(), in_a_row), visit_range);
  };
  visit(scouts, kScoutsTour);
  visit(others, kTour);
  if (tour.size() > kLongCall) forget_idle();
  const std::size_t repeated = viewpoints.size() - tour.size();
  if (progress != nullptr && repeated > 0) progress->advanced(repeated);
  return map_indices(unknown.seen());
}

IndexList HiddenPointRemoval::map_indices(std::vector<PointOctree::Index> positions) const {
  for (PointOctree::Index& position : positions) position = octree_.map_index(position);
  std::sort(positions.begin(), positions.end());
  return positions;
}

Result<IndexList> hidden_point_removal(PointsView map, const Point& viewpoint,
                                       const Settings& settings) {
  return HiddenPointRemoval(map, settings).visible(viewpoint);
}

}  // namespace vantage::hpr
