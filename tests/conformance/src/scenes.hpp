#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <thread>
#include <vector>

#include "vantage/map_passes.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

/// Invented places with which the clauses test plugins, and ways to vary them.
namespace vantage::conformance {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// A place with coordinates as large as UTM's.
inline const Point kFarAway(1e6, 5e6, 300.0);

/// Uniform numbers that are the same on every platform.
class Random {
 public:
  explicit Random(std::uint32_t seed) : engine_(seed) {}
  /// In [low, high).
  [[nodiscard]] double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_()) / 4294967296.0);
  }
  [[nodiscard]] std::size_t below(std::size_t n) { return engine_() % n; }
  [[nodiscard]] Point in(const Point& min, const Point& max) {
    const double x = uniform(min.x(), max.x()), y = uniform(min.y(), max.y());
    return {x, y, uniform(min.z(), max.z())};
  }
  /// A random order of 0 .. n - 1.
  [[nodiscard]] IndexList order(std::size_t n);

 private:
  std::mt19937 engine_;
};

/// A map that comes in pieces of a size.
class Pieces final : public MapPasses {
 public:
  /// @param map  must outlive the object
  explicit Pieces(PointsView map, std::size_t size = 100'000) : map_(map), size_(size) {}
  [[nodiscard]] Bounds3 bounds() const noexcept override { return bounds_of(map_); }
  [[nodiscard]] std::uint64_t points() const noexcept override { return map_.size(); }
  [[nodiscard]] Result<void> pass(MapVisitor& visitor) const noexcept override {
    for (std::size_t k = 0; k < map_.size(); k += size_) {
      VANTAGE_CHECK(visitor.see(map_.subspan(k, std::min(size_, map_.size() - k))));
    }
    return {};
  }

 private:
  PointsView map_;
  std::size_t size_;
};

[[nodiscard]] PointCloud random_cloud(Random& random, std::size_t n, const Point& min,
                                      const Point& max);
/// The multiples of `step`, `n` by `n` of them in plan view, moved by `offset`: they provoke
/// rounding errors.
[[nodiscard]] PointCloud lattice(double step, int n, const Point& offset = Point::Zero());
[[nodiscard]] PointCloud moved(PointsView points, const Point& by);
[[nodiscard]] Pose moved(const Pose& pose, const Point& by);
/// `points[order[0]], points[order[1]], ...`
[[nodiscard]] PointCloud in_order(PointsView points, const IndexList& order);

/// Runs `work` where 1, then 2, then 7 threads may compute.
void with_threads(const std::function<void()>& work);

/// Runs `work(i)` for every i < n, each in a thread of its own, all at the same time.
void at_once(std::size_t n, const std::function<void(std::size_t)>& work);

}  // namespace vantage::conformance
