#include "hidden_point_removal.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "convex_hull.hpp"
#include "direction_bins.hpp"
#include "star_hull.hpp"

namespace vantage::hpr {
namespace {

// What Qhull may take for one plane: its tolerance is about 1e-15 of the largest coordinate for
// one distance, and merged facets add a few of them up. Points deeper than this are no vertex.
constexpr double kQhullMargin = 1e-12;

// Points this close to a line, relative to their distance, are on it.
constexpr double kFlatness = 1e-14;

// Covers the rounding of the turned length, relative to the longest one.
constexpr double kLengthMargin = 1e-14;

// The points of the map as one viewpoint has them.
class View {
 public:
  View(PointsView map, const Point& viewpoint, const Settings& settings)
      : map_(map),
        viewpoint_(viewpoint),
        settings_(settings),
        max_squared_(settings.max_range * settings.max_range) {}

  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(map_.size()); }
  [[nodiscard]] Point relative(std::uint32_t i) const { return map_[i] - viewpoint_; }  // Eq. 7

  [[nodiscard]] bool takes_part(double squared_distance) const {
    return squared_distance > std::numeric_limits<double>::min() &&
           squared_distance <= max_squared_;
  }

  // |p*| of a point at that distance.
  [[nodiscard]] double turned_length(double distance) const {
    switch (settings_.kernel) {
      case Kernel::spherical_flip: return 2.0 * settings_.radius - distance;
      case Kernel::inversion: return 1.0 / distance;
    }
    return 0.0;
  }
  // Its inverse.
  [[nodiscard]] double distance_of(double turned_length) const {
    switch (settings_.kernel) {
      case Kernel::spherical_flip: return 2.0 * settings_.radius - turned_length;
      case Kernel::inversion: return 1.0 / turned_length;
    }
    return 0.0;
  }
  // p* of Eq. 8; the inversion for R = 1 m, for all R only scale it.
  [[nodiscard]] Point turned(std::uint32_t i) const {
    const Point p = relative(i);
    const double distance = p.norm();
    return (turned_length(distance) / distance) * p;
  }

  [[nodiscard]] Error too_far(double distance) const {
    return {.code = ErrorCode::invalid_input,
            .message = "a map point is " + std::to_string(distance) +
                       " m from the viewpoint; the spherical flip needs R (" +
                       std::to_string(settings_.radius) +
                       " m) to be at least the distance of every point: raise alpha or gap, or "
                       "lower max_range",
            .where = {},
            .context = {}};
  }
  [[nodiscard]] const Settings& settings() const { return settings_; }

 private:
  PointsView map_;
  Point viewpoint_;
  Settings settings_;
  double max_squared_;
};

// What is learnt about all points in one pass.
struct Survey {
  DirectionBins bins;
  std::vector<BinId> bin_of;           // of each point; kNoBin for those that take no part
  std::vector<std::uint32_t> nearest;  // of each bin; kNobody for an empty one
  std::size_t bins_taken = 0;
  double shortest = std::numeric_limits<double>::infinity(), longest = 0.0;  // distances [m]
};

constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();

Survey survey(const View& view) {
  const auto bins = DirectionBins::for_points(view.size());
  Survey result{.bins = bins,
                .bin_of = std::vector<BinId>(view.size()),
                .nearest = std::vector<std::uint32_t>(bins.size(), kNobody)};
  std::vector<double> squared_of_nearest(bins.size(), std::numeric_limits<double>::infinity());
  double shortest = std::numeric_limits<double>::infinity(), longest = 0.0;
  for (std::uint32_t i = 0; i < view.size(); ++i) {
    const Point p = view.relative(i);
    const double squared = p.squaredNorm();
    if (!view.takes_part(squared)) {
      result.bin_of[i] = kNoBin;
      continue;
    }
    const BinId bin = bins.bin_of(p);
    result.bin_of[i] = bin;
    const std::uint32_t number = number_of(bin);
    if (squared < squared_of_nearest[number]) {
      squared_of_nearest[number] = squared;
      result.nearest[number] = i;
    }
    shortest = std::min(shortest, squared);
    longest = std::max(longest, squared);
  }
  result.shortest = std::sqrt(shortest);
  result.longest = std::sqrt(longest);
  result.bins_taken = static_cast<std::size_t>(std::count_if(
      result.nearest.begin(), result.nearest.end(), [](std::uint32_t i) { return i != kNobody; }));
  return result;
}

// The nearest point of each bin, level by level from few wide bins to all: a hull that grows evenly
// keeps its facets compact.
std::vector<std::vector<std::uint32_t>> representatives(const View& view, const Survey& survey) {
  const DirectionBins& bins = survey.bins;
  std::vector<std::vector<std::uint32_t>> levels;
  std::vector<std::uint8_t> taken(bins.size(), 0);
  for (const int shift : {DirectionBins::kMaxShift, 2, 0}) {
    const std::uint32_t wide_bins = bins.coarser(shift).size();
    std::vector<std::uint32_t> bin_of_best(wide_bins, kNobody);
    std::vector<double> squared_of_best(wide_bins, std::numeric_limits<double>::infinity());
    for (std::uint32_t bin = 0; bin < bins.size(); ++bin) {
      const std::uint32_t i = survey.nearest[bin];
      if (i == kNobody) continue;
      const std::uint32_t wide = bins.coarser_bin(bin, shift);
      const double squared = view.relative(i).squaredNorm();
      if (squared < squared_of_best[wide]) {
        squared_of_best[wide] = squared;
        bin_of_best[wide] = bin;
      }
    }
    std::vector<std::uint32_t>& level = levels.emplace_back();
    for (const std::uint32_t bin : bin_of_best) {
      if (bin == kNobody || taken[bin] != 0) continue;
      taken[bin] = 1;
      level.push_back(survey.nearest[bin]);
    }
  }
  return levels;
}

// The hull of everything that could be decided, and how its vertices relate to the map.
struct Solution {
  StarHull hull;
  std::vector<std::uint32_t> point_of;  // the map point that became each vertex
  std::vector<std::pair<std::uint32_t, std::uint32_t>> coincident;  // map point, vertex
  bool complete = true;  // false: some point was too close to a facet to tell
};

void put_in(Solution& solution, std::uint32_t i, const Point& turned) {
  const StarHull::Insertion insertion = solution.hull.insert(turned);
  switch (insertion.verdict) {
    case StarHull::Verdict::inserted: solution.point_of.push_back(i); break;
    case StarHull::Verdict::inside: break;
    case StarHull::Verdict::coincident:
      solution.coincident.emplace_back(i, insertion.vertex);
      break;
    case StarHull::Verdict::undecided: solution.complete = false; break;
  }
}

// A tetrahedron of the viewpoint and three of the points, as large as a greedy choice makes it.
std::optional<Solution> first_tetrahedron(const View& view, const Survey& survey,
                                          const std::vector<std::uint32_t>& among) {
  const auto best = [&](const auto& measure) {
    return *std::max_element(among.begin(), among.end(), [&](std::uint32_t i, std::uint32_t j) {
      return measure(view.turned(i)) < measure(view.turned(j));
    });
  };
  const std::uint32_t i = best([](const Point& p) { return p.squaredNorm(); });
  const Point a = view.turned(i);
  const std::uint32_t j = best([&](const Point& p) { return a.cross(p).squaredNorm(); });
  const Point b = view.turned(j);
  const Eigen::Vector3d ab = a.cross(b);
  const std::uint32_t k = best([&](const Point& p) { return std::abs(ab.dot(p)); });
  auto hull = StarHull::from(a, b, view.turned(k), 1.001 * view.turned_length(survey.shortest),
                             survey.bins_taken + survey.bins_taken / 2);
  if (!hull) return std::nullopt;
  return Solution{.hull = *std::move(hull), .point_of = {kNobody, i, j, k}, .coincident = {}};
}

// For each bin the squared distance beyond which a point in it is certainly inside the hull.
//
// With r the least reach of the hull in the directions of the bin's four corners, the corners'
// points at r are in the hull, and so is all of the bin's cone up to r sqrt(1 - L^2 / 3 r^2), L the
// longest distance between two of them: the foot of the perpendicular on the plane of a triangle
// is its circumcentre, not farther than L / sqrt(3) from its corners unless the angle there is
// obtuse, when the nearest point is the middle of the longest edge.
std::vector<double> hiding_distances(const View& view, const Survey& survey, StarHull& hull) {
  const DirectionBins& bins = survey.bins;
  const double edge = bins.edge();
  const double shrink = std::sqrt(1.0 - 8.0 / (3.0 * edge * edge));  // L^2 <= 8 r^2 / edge^2
  const double margin = kLengthMargin * view.turned_length(survey.shortest);
  std::vector<double> squared(bins.size(), std::numeric_limits<double>::infinity());
  std::vector<double> reach_at(bins.corners(), -1.0);
  for (std::uint32_t bin = 0; bin < bins.size(); ++bin) {
    if (survey.nearest[bin] == kNobody) continue;
    double reach = std::numeric_limits<double>::infinity();
    for (const std::uint32_t corner : bins.corners_of(bin)) {
      if (reach_at[corner] < 0.0) reach_at[corner] = hull.reach(bins.direction_of_corner(corner));
      reach = std::min(reach, reach_at[corner]);
    }
    const double length = shrink * reach - margin;
    if (length <= 0.0) continue;
    const double distance = view.distance_of(length) * (1.0 + 4.0 * kLengthMargin);
    squared[bin] = distance * distance;
  }
  return squared;
}

// In the order of their bins, so that the hull is walked over from neighbour to neighbour.
std::vector<std::uint32_t> not_yet_hidden(const View& view, const Survey& survey,
                                          const std::vector<double>& hidden_beyond) {
  const std::uint32_t bins = survey.bins.size();
  std::vector<std::uint32_t> points;
  std::vector<std::uint32_t> first(bins + 1, 0);
  for (std::uint32_t i = 0; i < view.size(); ++i) {
    const BinId bin = survey.bin_of[i];
    if (bin == kNoBin) continue;
    const std::uint32_t number = number_of(bin);
    if (survey.nearest[number] == i) continue;
    if (!near_edge(bin) && view.relative(i).squaredNorm() > hidden_beyond[number]) continue;
    points.push_back(i);
    ++first[number + 1];
  }
  for (std::uint32_t bin = 0; bin < bins; ++bin) first[bin + 1] += first[bin];
  std::vector<std::uint32_t> sorted(points.size());
  for (const std::uint32_t i : points) sorted[first[number_of(survey.bin_of[i])]++] = i;
  return sorted;
}

// Nothing where no first tetrahedron is certain to have a volume.
std::optional<Solution> solve(const View& view, const Survey& survey) {
  const auto levels = representatives(view, survey);
  auto solution = first_tetrahedron(view, survey, levels.front());
  if (!solution) return std::nullopt;
  for (const auto& level : levels) {
    for (const std::uint32_t i : level) put_in(*solution, i, view.turned(i));
  }
  const auto hidden_beyond = hiding_distances(view, survey, solution->hull);
  for (const std::uint32_t i : not_yet_hidden(view, survey, hidden_beyond)) {
    put_in(*solution, i, view.turned(i));
  }
  return solution;
}

IndexList observable(const Solution& solution) {
  const auto vertices = solution.hull.vertices();
  IndexList result;
  result.reserve(vertices.size() + solution.coincident.size());
  for (const std::uint32_t v : vertices) result.push_back(solution.point_of[v]);
  for (const auto& [i, v] : solution.coincident) {
    if (std::binary_search(vertices.begin(), vertices.end(), v)) result.push_back(i);
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

// Turned points in an order that their places alone decide, each place once.
struct Places {
  std::vector<Point> turned;
  std::vector<std::vector<std::uint32_t>::size_type> first;  // into `members`, one more than places
  std::vector<std::uint32_t> members;                        // map points, place by place
};

Places places_of(const View& view, std::vector<std::uint32_t> points) {
  std::vector<std::pair<Point, std::uint32_t>> entries;
  entries.reserve(points.size());
  for (const std::uint32_t i : points) entries.emplace_back(view.turned(i), i);
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) {
    return std::tie(a.first.x(), a.first.y(), a.first.z(), a.second) <
           std::tie(b.first.x(), b.first.y(), b.first.z(), b.second);
  });
  Places places;
  for (const auto& [turned, i] : entries) {
    if (places.turned.empty() || places.turned.back() != turned) {
      places.turned.push_back(turned);
      places.first.push_back(places.members.size());
    }
    places.members.push_back(i);
  }
  places.first.push_back(places.members.size());
  return places;
}

// Vertices of the hull of points on one line through the origin.
std::vector<std::uint32_t> ends_of_line(const std::vector<Point>& turned, const Point& along) {
  std::vector<std::uint32_t> ends;
  for (const double direction : {1.0, -1.0}) {
    std::uint32_t end = kNobody;
    double farthest = 0.0;
    for (std::uint32_t k = 0; k < turned.size(); ++k) {
      const double reach = direction * turned[k].dot(along);
      if (reach > farthest) {
        farthest = reach;
        end = k;
      }
    }
    if (end != kNobody) ends.push_back(end);
  }
  std::sort(ends.begin(), ends.end());
  return ends;
}

std::vector<double> with_origin(const std::vector<Point>& turned, const std::vector<int>& axes) {
  std::vector<double> coordinates;
  coordinates.reserve(axes.size() * (turned.size() + 1));
  for (const Point& p : turned) {
    for (const int axis : axes) coordinates.push_back(p[axis]);
  }
  coordinates.resize(coordinates.size() + axes.size(), 0.0);
  return coordinates;
}

// The hull of the points and the origin in space, in a plane or on a line: whatever they span.
Result<std::vector<std::uint32_t>> hull_of_places(const std::vector<Point>& turned) {
  if (turned.empty()) return {};
  auto vertices = convex_hull_vertices(with_origin(turned, {0, 1, 2}), 3);
  if (!vertices && vertices.error().code == ErrorCode::invalid_input) {
    const auto best = [&](const auto& measure) {
      return *std::max_element(turned.begin(), turned.end(), [&](const Point& a, const Point& b) {
        return measure(a) < measure(b);
      });
    };
    const Point a = best([](const Point& p) { return p.squaredNorm(); });
    const Point b = best([&](const Point& p) { return a.cross(p).squaredNorm(); });
    const Eigen::Vector3d normal = a.cross(b);
    const bool on_a_line = normal.norm() <= kFlatness * a.squaredNorm();
    if (!on_a_line) {
      // Leaving out the axis most upright on the plane keeps the other coordinates as they are.
      Eigen::Index upright = 0;
      normal.cwiseAbs().maxCoeff(&upright);
      const int axis = static_cast<int>(upright);
      vertices = convex_hull_vertices(with_origin(turned, {(axis + 1) % 3, (axis + 2) % 3}), 2);
    }
    if (on_a_line || (!vertices && vertices.error().code == ErrorCode::invalid_input)) {
      return ends_of_line(turned, a.normalized());
    }
  }
  if (!vertices) return fail(std::move(vertices).error());
  std::erase(*vertices, static_cast<std::uint32_t>(turned.size()));
  return *std::move(vertices);
}

Result<IndexList> by_qhull(const View& view, std::vector<std::uint32_t> points) {
  const Places places = places_of(view, std::move(points));
  VANTAGE_TRY(const auto vertices, hull_of_places(places.turned));
  IndexList result;
  for (const std::uint32_t v : vertices) {
    for (auto k = places.first[v]; k < places.first[v + 1]; ++k)
      result.push_back(places.members[k]);
  }
  std::sort(result.begin(), result.end());
  return result;
}

std::vector<std::uint32_t> participants(const Survey& survey) {
  std::vector<std::uint32_t> points;
  for (std::uint32_t i = 0; i < survey.bin_of.size(); ++i) {
    if (survey.bin_of[i] != kNoBin) points.push_back(i);
  }
  return points;
}

Result<IndexList> by_culled_qhull(const View& view, const Survey& survey,
                                  std::optional<Solution> solution) {
  if (!solution) return by_qhull(view, participants(survey));
  const double margin = kQhullMargin * view.turned_length(survey.shortest);
  std::vector<std::uint32_t> candidates;
  for (const std::uint32_t i : not_yet_hidden(
           view, survey,
           std::vector<double>(survey.bins.size(), std::numeric_limits<double>::infinity()))) {
    if (!solution->hull.holds_ball(view.turned(i), margin)) candidates.push_back(i);
  }
  for (const std::uint32_t i : survey.nearest) {
    if (i != kNobody) candidates.push_back(i);
  }
  return by_qhull(view, std::move(candidates));
}

// One place is never hidden, whatever R is.
bool all_at_one_place(const View& view, const std::vector<std::uint32_t>& points) {
  return std::all_of(points.begin(), points.end(), [&](std::uint32_t i) {
    return view.relative(i) == view.relative(points.front());
  });
}

template <class Method>
Result<IndexList> run(PointsView map, const Point& viewpoint, const Settings& settings,
                      const Method& method) {
  const View view(map, viewpoint, settings);
  const Survey found = survey(view);
  if (found.bins_taken == 0) return IndexList{};
  if (found.bins_taken == 1) {
    auto points = participants(found);
    if (all_at_one_place(view, points)) return points;
  }
  if (settings.kernel == Kernel::spherical_flip && found.longest > settings.radius) {
    return fail(view.too_far(found.longest));
  }
  return method(view, found);
}

}  // namespace

Result<IndexList> hidden_point_removal(PointsView map, const Point& viewpoint,
                                       const Settings& settings) {
  return run(map, viewpoint, settings,
             [](const View& view, const Survey& found) -> Result<IndexList> {
               auto solution = solve(view, found);
               if (solution && solution->complete) return observable(*solution);
               return by_culled_qhull(view, found, std::move(solution));
             });
}

Result<IndexList> hidden_point_removal_by_qhull(PointsView map, const Point& viewpoint,
                                                const Settings& settings) {
  return run(map, viewpoint, settings,
             [](const View& view, const Survey& found) -> Result<IndexList> {
               return by_qhull(view, participants(found));
             });
}

Result<IndexList> hidden_point_removal_by_culled_qhull(PointsView map, const Point& viewpoint,
                                                       const Settings& settings) {
  return run(map, viewpoint, settings,
             [](const View& view, const Survey& found) -> Result<IndexList> {
               return by_culled_qhull(view, found, solve(view, found));
             });
}

}  // namespace vantage::hpr
