#include "hulls.hpp"

#include <algorithm>
#include <cmath>

namespace vantage::test {

using hpr::StarHull;

StarHull::Location GrownHull::put_in(const Point& p) {
  const StarHull::Location location = hull.locate(p);
  if (location.place == StarHull::Place::outside) {
    hull.add(p, location);
    points.push_back(p);
  }
  return location;
}

std::vector<GrownHull::Plane> GrownHull::planes() {
  std::vector<Plane> all;
  for (const StarHull::Index v : hull.vertices()) {
    for (const StarHull::Index f : hull.facets_about(v)) {
      const Eigen::Vector3d outward = hull.normal(f).normalized();
      all.push_back({outward, outward.dot(points[v])});
    }
  }
  return all;
}

std::optional<GrownHull> grown(std::span<const Point> points) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t j = i + 1; j < points.size(); ++j) {
      for (std::size_t k = j + 1; k < points.size(); ++k) {
        GrownHull result;
        if (!result.hull.start(points[i], points[j], points[k])) continue;
        result.points = {Point::Zero(), points[i], points[j], points[k]};
        for (const Point& p : points) result.put_in(p);
        return result;
      }
    }
  }
  return std::nullopt;
}

bool below_all(const std::vector<GrownHull::Plane>& planes, const StarHull::Cone& cone,
               double margin) {
  const double angle = std::atan2(cone.sine, cone.cosine);
  return std::all_of(planes.begin(), planes.end(), [&](const GrownHull::Plane& plane) {
    const double along = plane.outward.dot(cone.axis);
    const double off = std::acos(std::clamp(along, -1.0, 1.0)) - angle;  // of the nearest direction
    const double highest = off <= 0.0 ? 1.0 : std::cos(off);
    return std::max(0.0, cone.length * highest) <= plane.offset - margin;
  });
}

StarHull::Cone cone_about(const Eigen::Vector3d& axis, double angle, double length) {
  return {.axis = axis.normalized(),
          .sine = std::sin(angle),
          .cosine = std::cos(angle),
          .length = length};
}

}  // namespace vantage::test
