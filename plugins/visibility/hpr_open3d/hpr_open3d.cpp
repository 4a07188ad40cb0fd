#include <open3d/geometry/PointCloud.h>
#include <open3d/geometry/TriangleMesh.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <exception>
#include <limits>
#include <memory>
#include <numeric>
#include <string>
#include <tuple>
#include <vector>

#include "vantage/kit/plugin_of.hpp"
#include "vantage/kit/scene_by_viewpoint.hpp"
#include "vantage/kit/visibility_checks.hpp"

namespace {

using vantage::ErrorCode, vantage::fail, vantage::IndexList, vantage::Point, vantage::PointsView,
    vantage::Result, vantage::SceneByViewpoint, vantage::VisibilityLimits, vantage::VisibilityScene;

constexpr double kDefaultAlpha = 100.0;  // Sec. 3.2.2

// Squared [m^2]: 1.5e-154 m is the least distance whose square is a normal number.
constexpr double kAtViewpoint = std::numeric_limits<double>::min();

// How flat the points given to Qhull may be. Qhull stops if its own first tetrahedron has no height
// (about 1e-15), and warns on std::cerr if two of its faces are 1e-4 rad apart.
constexpr double kFlatness = 1e-3;
constexpr double kOnOneLine = 1e-9;
constexpr std::size_t kSample = 4096;  // number of places among which a tetrahedron is searched for
                                       // first

/// HiddenPointRemoval reads one element beyond the last point (it puts the viewpoint there and
/// removes it again), so there must be room for one.
open3d::geometry::PointCloud empty_cloud(std::size_t room) {
  open3d::geometry::PointCloud cloud;
  cloud.points_.reserve(room + 1);
  return cloud;
}

/// The different places of a map, in an order that depends on them alone. Qhull's answer depends on
/// the order if its tolerance decides, and Qhull takes only one of the points at one place.
class Places {
 public:
  explicit Places(PointsView map) : cloud_(empty_cloud(map.size())), members_(map.size()) {
    std::iota(members_.begin(), members_.end(), 0U);
    const auto key = [&](std::uint32_t i) {
      return std::tuple(map[i].x(), map[i].y(), map[i].z(), i);
    };
    std::sort(members_.begin(), members_.end(),
              [&](std::uint32_t i, std::uint32_t j) { return key(i) < key(j); });
    for (std::size_t k = 0; k < members_.size(); ++k) {
      const Point& p = map[members_[k]];
      if (!cloud_.points_.empty() && cloud_.points_.back() == p) continue;
      cloud_.points_.push_back(p);
      first_.push_back(k);
    }
    first_.push_back(members_.size());
  }

  [[nodiscard]] std::size_t size() const { return cloud_.points_.size(); }
  [[nodiscard]] const Point& operator[](std::size_t place) const { return cloud_.points_[place]; }
  [[nodiscard]] const open3d::geometry::PointCloud& cloud() const { return cloud_; }

  /// The map points at these places, strictly ascending.
  [[nodiscard]] IndexList points_at(const std::vector<std::size_t>& places) const {
    IndexList points;
    for (const std::size_t place : places) {
      for (std::size_t k = first_[place]; k < first_[place + 1]; ++k) points.push_back(members_[k]);
    }
    std::sort(points.begin(), points.end());
    return points;
  }

 private:
  open3d::geometry::PointCloud cloud_;
  std::vector<std::size_t> first_;  // into `members_`, one more than the number of places
  std::vector<std::uint32_t> members_;
};

/// Whether a greedy choice among every `step`-th place finds a tetrahedron with the viewpoint that
/// is not flat after turning. Without one, Qhull ends with an error. If another plugin has loaded
/// libqhull_r before, Qhull reports that error through the wrong function and crashes.
bool spans_space(const Places& places, const std::vector<std::size_t>& of, const Point& viewpoint,
                 double radius, std::size_t step) {
  const auto turned = [&](std::size_t place) -> Point {
    const Point p = places[place] - viewpoint;
    return (2.0 * radius / p.norm() - 1.0) * p;
  };
  const auto best = [&](const auto& measure) {
    Point farthest = Point::Zero();
    double most = -1.0;
    for (std::size_t k = 0; k < of.size(); k += step) {
      const Point p = turned(of[k]);
      const double value = measure(p);
      if (!(value > most)) continue;
      most = value;
      farthest = p;
    }
    return farthest;
  };
  const Point a = best([](const Point& p) { return p.norm(); });
  const Point along = a.normalized();
  const Point b = best([&](const Point& p) { return along.cross(p).norm(); });
  const double width = along.cross(b).norm();
  if (!(width > kOnOneLine * a.norm())) return false;
  const Point normal = along.cross(b).normalized();
  const Point c = best([&](const Point& p) { return std::abs(normal.dot(p)); });
  return std::abs(normal.dot(c)) > kFlatness * width;
}

/// @return  indices into the cloud, in Open3D's order
Result<std::vector<std::size_t>> hidden_point_removal(const open3d::geometry::PointCloud& cloud,
                                                      const Point& viewpoint, double radius) {
  try {
    return std::get<1>(cloud.HiddenPointRemoval(viewpoint, radius));
  } catch (const std::exception& e) {
    const std::string message = e.what();
    return fail(ErrorCode::internal, "Open3D: " + message.substr(0, message.find('\n')));
  }
}

class Scene final : public SceneByViewpoint {
 public:
  Scene(PointsView map, double radius, double max_range)
      : SceneByViewpoint(map.size()),
        places_(map),
        radius_(radius),
        max_squared_(max_range * max_range) {}

  [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
    return vantage::guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(vantage::check_viewpoints({&viewpoint, 1}));
      VANTAGE_TRY(const auto seen, seen_places(viewpoint, taking_part(viewpoint)));
      return places_.points_at(seen);
    });
  }

 private:
  [[nodiscard]] double squared_distance(std::size_t place, const Point& viewpoint) const {
    return (places_[place] - viewpoint).squaredNorm();
  }

  [[nodiscard]] std::vector<std::size_t> taking_part(const Point& viewpoint) const {
    std::vector<std::size_t> places;
    places.reserve(places_.size());
    for (std::size_t k = 0; k < places_.size(); ++k) {
      const double squared = squared_distance(k, viewpoint);
      if (squared > kAtViewpoint && squared <= max_squared_) places.push_back(k);
    }
    return places;
  }

  [[nodiscard]] Result<std::vector<std::size_t>> seen_places(
      const Point& viewpoint, const std::vector<std::size_t>& places) const {
    if (places.size() <= 1) return places;
    VANTAGE_CHECK(check_radius(viewpoint, places));
    const std::size_t step = std::max<std::size_t>(1, places.size() / kSample);
    if (!spans_space(places_, places, viewpoint, radius_, step) &&
        !spans_space(places_, places, viewpoint, radius_, 1)) {
      return fail(ErrorCode::invalid_input, "the points in reach (at " +
                                                std::to_string(places.size()) +
                                                " places) and the viewpoint lie in one plane, or "
                                                "nearly: Open3D cannot make a hull of them");
    }
    if (places.size() == places_.size()) {
      return hidden_point_removal(places_.cloud(), viewpoint, radius_);
    }
    auto some = empty_cloud(places.size());
    for (const std::size_t k : places) some.points_.push_back(places_[k]);
    VANTAGE_TRY(auto seen, hidden_point_removal(some, viewpoint, radius_));
    for (std::size_t& k : seen) k = places[k];
    return seen;
  }

  [[nodiscard]] Result<void> check_radius(const Point& viewpoint,
                                          const std::vector<std::size_t>& places) const {
    double farthest = 0.0;
    for (const std::size_t k : places) {
      farthest = std::max(farthest, squared_distance(k, viewpoint));
    }
    farthest = std::sqrt(farthest);
    if (farthest <= radius_) return {};
    return fail(ErrorCode::invalid_input,
                "a map point is " + std::to_string(farthest) +
                    " m from the viewpoint; the spherical flip needs R (" +
                    std::to_string(radius_) +
                    " m) to be at least the distance of every point: raise alpha, or lower "
                    "max_range");
  }

  Places places_;
  double radius_;
  double max_squared_;
};

/// Hidden point removal as Open3D computes it.
struct Params {
  double alpha = kDefaultAlpha;  // of Eq. 6

  static constexpr auto schema() {
    return std::tuple{vantage::optional(
        "alpha", &Params::alpha, "", "R = alpha * diagonal of the map", vantage::between(1.0, 1e6),
        vantage::Source{"Eq. 6", "Yagi et al. 2026, Sec. 2.3"})};
  }

  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const {
    VANTAGE_CHECK(check_map(map, limits));
    const double radius = alpha * limits.map_bounds.diagonal();  // Eq. 6
    VANTAGE_CHECK(vantage::check_flip_radius(radius, limits));
    return std::make_unique<Scene>(map, radius, limits.max_range);
  }

  [[nodiscard]] static Result<void> check_map(PointsView map, const VisibilityLimits& limits) {
    VANTAGE_CHECK(vantage::check_map_in_bounds(map, limits));
    if (map.size() <= static_cast<std::size_t>(std::numeric_limits<int>::max()) / 2) return {};
    return fail(ErrorCode::invalid_input, "too many points for Qhull");
  }
};

}  // namespace

VANTAGE_PLUGIN(vantage::VisibilityOperator, vantage::VisibilityOperatorOf<Params>, "hpr_open3d",
               "hidden point removal by Open3D, for comparison and tests only");
