#include "simulate/map_sampler.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "simulate/random.hpp"
#include "simulate/trails.hpp"

namespace vantage::simulation {
namespace {

using Eigen::Vector2d;

double cut_off_normal(Random& random) { return std::clamp(random.normal(), -3.0, 3.0); }

class Sampler {
 public:
  Sampler(const World& world, const MapParams& params, std::uint64_t seed)
      : world_(world), params_(params), seed_(hash(seed, Purpose::map_point)) {
    const Vector2d size = 2.0 * world.terrain().half_size();
    ground_columns_ = std::max(1L, std::lround(size.x() / params.point_spacing));
    ground_rows_ = std::max(1L, std::lround(size.y() / params.point_spacing));
    split_work();
  }

  [[nodiscard]] std::size_t parts() const { return parts_.size(); }

  [[nodiscard]] PointCloud sample(std::size_t part) const {
    PointCloud points;
    const auto& [kind, first, last] = parts_[part];
    for (std::size_t k = first; k < last; ++k) {
      const PointCloud piece = sample(kind, k);
      points.insert(points.end(), piece.begin(), piece.end());
    }
    return points;
  }

 private:
  enum class Kind : std::uint64_t { ground_row, solid, leaf, trail };
  /// Rows of the ground, solids, leaves or trails [first, last).
  struct Part {
    Kind kind;
    std::size_t first, last;
  };

  [[nodiscard]] PointCloud sample(Kind kind, std::size_t index) const {
    switch (kind) {
      case Kind::ground_row: return sample_ground_row(static_cast<long>(index));
      case Kind::solid: return sample_solid(static_cast<std::uint32_t>(index));
      case Kind::leaf: return sample_leaf(index);
      case Kind::trail:
        return trail_of_vehicle(world_, params_.point_spacing, hash(seed_, Kind::trail, index));
    }
    return {};
  }

  void split_work() {
    const auto split = [&](Kind kind, std::size_t count, std::size_t step) {
      for (std::size_t k = 0; k < count; k += step) {
        parts_.push_back({kind, k, std::min(count, k + step)});
      }
    };
    split(Kind::ground_row, static_cast<std::size_t>(ground_rows_), 16);
    split(Kind::solid, world_.campus().solids.size(), 16);
    split(Kind::leaf, world_.campus().leaves.size(), 4096);
    split(Kind::trail, static_cast<std::size_t>(params_.moving_vehicles), 1);
  }

  [[nodiscard]] PointCloud sample_ground_row(long row) const {
    PointCloud points;
    const Terrain& terrain = world_.terrain();
    const Vector2d& half = terrain.half_size();
    const Vector2d cell = (2.0 * half).cwiseQuotient(Vector2d(ground_columns_, ground_rows_));
    for (long column = 0; column < ground_columns_; ++column) {
      Random random(hash(seed_, Kind::ground_row, row, column));
      const double x = (static_cast<double>(column) + random.uniform()) * cell.x() - half.x();
      const double y = (static_cast<double>(row) + random.uniform()) * cell.y() - half.y();
      const Point p(x, y, terrain.height(x, y));
      if (world_.solids().is_inside(p)) continue;
      const double noise = params_.noise * cut_off_normal(random);
      points.emplace_back(p + noise * terrain.normal({x, y}) + world_.map_origin());
    }
    return points;
  }

  [[nodiscard]] PointCloud sample_solid(std::uint32_t index) const {
    const Solid& solid = world_.campus().solids[index];
    PointCloud points;
    for (std::size_t f = 0; f < solid.faces.size(); ++f) {
      const Face& face = solid.faces[f];
      const PointCloud piece =
          sample_face(face.corners, face.normal, hash(seed_, Kind::solid, index, f), index);
      points.insert(points.end(), piece.begin(), piece.end());
    }
    return points;
  }

  [[nodiscard]] PointCloud sample_leaf(std::size_t index) const {
    const Leaf& leaf = world_.campus().leaves[index];
    const Eigen::Vector3d normal = (leaf[1] - leaf[0]).cross(leaf[2] - leaf[0]).normalized();
    return sample_face(leaf, normal, hash(seed_, Kind::leaf, index), SolidIndex::kNone);
  }

  /// @param corners  of a convex polygon, counter-clockwise around `normal`
  /// @param owner    the solid that may contain the points
  [[nodiscard]] PointCloud sample_face(std::span<const Point> corners,
                                       const Eigen::Vector3d& normal, std::uint64_t face_seed,
                                       std::uint32_t owner) const {
    PointCloud points;
    const Eigen::Vector3d u = (corners[1] - corners[0]).normalized();
    const Eigen::Vector3d v = normal.cross(u);
    Vector2d min = Vector2d::Zero(), max = Vector2d::Zero();
    std::vector<Vector2d> polygon;
    for (const Point& corner : corners) {
      polygon.emplace_back(u.dot(corner - corners[0]), v.dot(corner - corners[0]));
      min = min.cwiseMin(polygon.back());
      max = max.cwiseMax(polygon.back());
    }
    const auto is_in_polygon = [&](const Vector2d& p) {
      for (std::size_t k = 0; k < polygon.size(); ++k) {
        const Vector2d& a = polygon[k];
        const Vector2d edge = polygon[(k + 1) % polygon.size()] - a;
        if (edge.x() * (p.y() - a.y()) - edge.y() * (p.x() - a.x()) < 0.0) return false;
      }
      return true;
    };
    // The grid starts at a random place; otherwise faces smaller than a cell would always or never
    // get a point.
    const double spacing = params_.point_spacing;
    Random shift(face_seed);
    min -= spacing * shift.vector<2>(&Random::uniform);
    const auto columns = static_cast<std::int64_t>(std::ceil((max.x() - min.x()) / spacing));
    const auto rows = static_cast<std::int64_t>(std::ceil((max.y() - min.y()) / spacing));
    for (std::int64_t row = 0; row < rows; ++row) {
      for (std::int64_t column = 0; column < columns; ++column) {
        Random random(hash(face_seed, row, column));
        const Vector2d corner(static_cast<double>(column), static_cast<double>(row));
        const Vector2d in_face = min + spacing * (corner + random.vector<2>(&Random::uniform));
        if (!is_in_polygon(in_face)) continue;
        const Point p = corners[0] + in_face.x() * u + in_face.y() * v;
        if (is_hidden(p, owner)) continue;
        points.emplace_back(p + params_.noise * cut_off_normal(random) * normal +
                            world_.map_origin());
      }
    }
    return points;
  }

  [[nodiscard]] bool is_hidden(const Point& p, std::uint32_t owner) const {
    const Terrain& terrain = world_.terrain();
    return p.z() < terrain.height(p.x(), p.y()) ||
           (p.head<2>().cwiseAbs().array() > terrain.half_size().array()).any() ||
           world_.solids().is_inside(p, owner);
  }

  const World& world_;
  const MapParams& params_;
  std::uint64_t seed_;
  long ground_columns_ = 0, ground_rows_ = 0;
  std::vector<Part> parts_;
};

}  // namespace

PointCloud sample_map(const World& world, const MapParams& params, std::uint64_t seed,
                      const ProgressFunction& progress) {
  const Sampler sampler(world, params, seed);
  std::vector<PointCloud> parts(sampler.parts());
  std::mutex mutex;
  std::size_t done = 0;
  tbb::parallel_for(std::size_t{0}, parts.size(), [&](std::size_t k) {
    parts[k] = sampler.sample(k);
    const std::scoped_lock lock(mutex);
    ++done;
    if (progress) progress(done, parts.size());
  });
  std::size_t total = 0;
  for (const PointCloud& part : parts) total += part.size();
  PointCloud points;
  points.reserve(total);
  for (PointCloud& part : parts) {
    points.insert(points.end(), part.begin(), part.end());
    PointCloud().swap(part);
  }
  return points;
}

Result<void> stream_map(const World& world, const MapParams& params, std::uint64_t seed,
                        const std::function<Result<void>(PointCloud&&)>& take,
                        const ProgressFunction& progress) {
  const Sampler sampler(world, params, seed);
  const auto tokens = 2 * static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  std::size_t next = 0, done = 0;
  std::atomic<bool> stop{false};
  Result<void> outcome;
  tbb::parallel_pipeline(
      tokens,
      tbb::make_filter<void, std::size_t>(tbb::filter_mode::serial_in_order,
                                          [&](tbb::flow_control& flow) {
                                            if (next == sampler.parts() || stop) flow.stop();
                                            return next++;
                                          }) &
          tbb::make_filter<std::size_t, std::shared_ptr<PointCloud>>(
              tbb::filter_mode::parallel,
              [&](std::size_t k) { return std::make_shared<PointCloud>(sampler.sample(k)); }) &
          tbb::make_filter<std::shared_ptr<PointCloud>, void>(
              tbb::filter_mode::serial_in_order, [&](const std::shared_ptr<PointCloud>& piece) {
                if (stop) return;
                outcome = take(std::move(*piece));
                if (!outcome) stop = true;
                ++done;
                if (progress) progress(done, sampler.parts());
              }));
  return outcome;
}

}  // namespace vantage::simulation
