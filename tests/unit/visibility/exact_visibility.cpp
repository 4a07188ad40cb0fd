#include "exact_visibility.hpp"

#include <algorithm>
#include <limits>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "exact_hull.hpp"
#include "qhull.hpp"
#include "support/plugins.hpp"

namespace vantage::test {
namespace {

std::string_view name_of(hpr::Kernel kernel) {
  for (const auto& [name, value] : enum_names(kernel)) {
    if (value == kernel) return name;
  }
  return {};
}

double turned_length(double distance, const hpr::Settings& settings) {
  return settings.kernel == hpr::Kernel::spherical_flip ? 2.0 * settings.radius - distance
                                                        : 1.0 / distance;
}

}  // namespace

hpr::Settings Question::settings(const Bounds3& bounds) const {
  return {.kernel = kernel, .radius = alpha * bounds.diagonal(), .max_range = max_range};
}

std::string Question::params() const {
  std::ostringstream toml;
  toml << std::showpoint << "kernel = \"" << name_of(kernel) << "\"\nalpha = " << alpha;
  return toml.str();
}

std::string to_string(const Question& question) {
  std::ostringstream text;
  text << name_of(question.kernel) << ", alpha " << question.alpha << ", max_range "
       << question.max_range;
  return text.str();
}

Answers by_function(PointsView map, const Bounds3& bounds, const Question& question) {
  return [map, settings = question.settings(bounds)](const Point& viewpoint) {
    return hpr::hidden_point_removal(map, viewpoint, settings);
  };
}

std::shared_ptr<const VisibilityScene> scene_of(PointsView map, const Bounds3& bounds,
                                                const Question& question) {
  struct Loaded {
    PluginPtr<VisibilityOperator> hpr;  // keeps the scene's code, so it goes last
    std::unique_ptr<VisibilityScene> scene;
  };
  const auto loaded =
      std::make_shared<Loaded>(plugin<VisibilityOperator>("hpr", question.params()), nullptr);
  auto scene = loaded->hpr->prepare(map, {.map_bounds = bounds, .max_range = question.max_range});
  if (!scene) throw std::runtime_error(to_string(scene.error()));
  loaded->scene = *std::move(scene);
  return {loaded, loaded->scene.get()};
}

Answers by_scene(std::shared_ptr<const VisibilityScene> scene) {
  return [scene = std::move(scene)](const Point& viewpoint) { return scene->visible(viewpoint); };
}

TurnedPoints turned_points(PointsView map, const Point& viewpoint, const hpr::Settings& settings) {
  TurnedPoints result;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    const Point p = map[i] - viewpoint;  // Eq. 7
    const double squared = p.squaredNorm();
    constexpr double kAtViewpoint = 1e-30;  // [m]
    if (!(squared > kAtViewpoint * kAtViewpoint &&
          squared <= settings.max_range * settings.max_range)) {
      continue;
    }
    const double distance = p.norm();
    if (!result.indices.empty() && p != map[result.indices.front()] - viewpoint) {
      result.at_one_place = false;
    }
    result.indices.push_back(i);
    result.turned.emplace_back((turned_length(distance, settings) / distance) * p);  // Eq. 8
    result.farthest = std::max(result.farthest, distance);
  }
  return result;
}

Result<IndexList> exactly_seen(PointsView map, const Point& viewpoint,
                               const hpr::Settings& settings) {
  const TurnedPoints points = turned_points(map, viewpoint, settings);
  if (points.at_one_place) return points.indices;
  if (settings.kernel == hpr::Kernel::spherical_flip && points.farthest > settings.radius) {
    return fail(ErrorCode::invalid_input, "a point is farther than R");
  }
  IndexList seen;
  for (const std::uint32_t k : hull_vertices(points.turned)) seen.push_back(points.indices[k]);
  return seen;
}

IndexList exactly_seen_from_any(PointsView map, std::span<const Point> viewpoints,
                                const hpr::Settings& settings) {
  IndexList all;
  for (const Point& viewpoint : viewpoints) {
    const auto seen = exactly_seen(map, viewpoint, settings);
    if (!seen) throw std::runtime_error(to_string(seen.error()));
    all.insert(all.end(), seen->begin(), seen->end());
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

Result<Comparison> compare_with_qhull(const IndexList& seen, PointsView map, const Point& viewpoint,
                                      const hpr::Settings& settings) {
  const TurnedPoints points = turned_points(map, viewpoint, settings);
  VANTAGE_TRY(const auto vertices, qhull_vertices(points.turned));
  std::vector<bool> by_qhull(points.indices.size());
  for (const RoughVertex& v : vertices) by_qhull[v.index] = true;

  Comparison result{.seen = seen.size()};
  std::vector<std::uint32_t> disputed;  // positions among those that take part
  for (std::uint32_t k = 0; k < points.indices.size(); ++k) {
    const bool ours = std::binary_search(seen.begin(), seen.end(), points.indices[k]);
    if (ours != by_qhull[k]) disputed.push_back(k);
  }
  result.differences = disputed.size();
  if (disputed.empty()) return result;

  std::vector<Point> shuffled = points.turned;
  std::shuffle(shuffled.begin(), shuffled.end(), std::mt19937(4));
  ExactHull hull(points.turned);
  for (const Point& p : shuffled) hull.add(p);
  for (const std::uint32_t k : disputed) {
    if (hull.is_vertex(points.turned[k]) == by_qhull[k]) {
      ++result.for_qhull;
    } else {
      ++result.for_us;
    }
  }
  return result;
}

}  // namespace vantage::test
