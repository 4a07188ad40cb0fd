#include "export/union.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

#include "vantage/kit/hash.hpp"

namespace vantage::exporting {
namespace {

constexpr double kCell = 1.0 / 256.0;  // [m]; at least twice any tolerance

/// How far a stored coordinate may be from the map's: 2^-24 of the largest extent, which counts
/// twice since origins are rounded and viewpoints may lie outside; and roundings of doubles.
double error_of(const RegionMap& map) {
  Bounds3 bounds = bounds_of(map.points);
  for (const Point& p : map.viewpoints) bounds.extend(p);
  const double extent = 2.0 * (bounds.max - bounds.min).maxCoeff();
  const double magnitude = bounds.max.cwiseAbs().cwiseMax(bounds.min.cwiseAbs()).maxCoeff();
  return std::ldexp(std::max(extent, 1.0), -24) +
         4.0 * std::numeric_limits<double>::epsilon() * magnitude;
}

}  // namespace

std::size_t UnionOfMaps::slot_of(double x, double y, double z) const {
  // Cells are doubles, which never overflow here. + 0.0 makes -0 the same as 0.
  std::uint64_t key = 0;
  for (const double coordinate : {x, y, z}) {
    key = scatter(key ^ std::bit_cast<std::uint64_t>(std::floor(coordinate / kCell) + 0.0));
  }
  return key & (slots_.size() - 1);
}

void UnionOfMaps::rebuild_slots() {
  slots_.assign(std::bit_ceil(std::max<std::size_t>(4 * points_.size(), 1024)), 0);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    std::size_t slot = slot_of(points_[i].x(), points_[i].y(), points_[i].z());
    while (slots_[slot] != 0) slot = (slot + 1) & (slots_.size() - 1);
    slots_[slot] = i + 1;
  }
}

void UnionOfMaps::insert(const Point& p) {
  points_.push_back(p);
  last_map_.push_back(map_);
  if (2 * points_.size() >= slots_.size()) return rebuild_slots();
  std::size_t slot = slot_of(p.x(), p.y(), p.z());
  while (slots_[slot] != 0) slot = (slot + 1) & (slots_.size() - 1);
  slots_[slot] = points_.size();
}

std::size_t UnionOfMaps::find(const Point& p, double tolerance) const {
  std::size_t best = points_.size();
  if (slots_.empty()) return best;
  double best_distance = std::numeric_limits<double>::infinity();
  const auto look = [&](double x, double y, double z) {
    for (std::size_t slot = slot_of(x, y, z); slots_[slot] != 0;
         slot = (slot + 1) & (slots_.size() - 1)) {
      const std::size_t i = slots_[slot] - 1;
      const double distance = (points_[i] - p).cwiseAbs().maxCoeff();
      const bool same = distance == 0.0 || (distance <= tolerance && last_map_[i] != map_);
      if (!same || distance >= best_distance) continue;
      best = i;
      best_distance = distance;
    }
  };
  // The cells that the cube around p reaches; there is almost always only one.
  const auto is_edge = [&](double c) {
    return std::floor((c - tolerance) / kCell) != std::floor((c + tolerance) / kCell);
  };
  const std::array<bool, 3> edge{is_edge(p.x()), is_edge(p.y()), is_edge(p.z())};
  for (unsigned corner = 0; corner < 8; ++corner) {
    Point at = p;
    bool is_new = true;
    for (unsigned axis = 0; axis < 3; ++axis) {
      const bool high = (corner >> axis & 1U) != 0;
      if (edge[axis]) at[axis] += high ? tolerance : -tolerance;
      is_new = is_new && (edge[axis] || !high);
    }
    if (is_new) look(at.x(), at.y(), at.z());
  }
  return best;
}

void UnionOfMaps::add(const RegionMap& map) {
  if (map.points.empty()) return;
  ++map_;
  const double error = error_of(map);
  const double tolerance = std::min(error + largest_error_, 0.5 * kCell);
  largest_error_ = std::max(largest_error_, error);
  for (const Point& p : map.points) {
    const std::size_t same = find(p, tolerance);
    if (same == points_.size()) {
      insert(p);
    } else {
      last_map_[same] = map_;
      ++repeated_;
    }
  }
}

}  // namespace vantage::exporting
