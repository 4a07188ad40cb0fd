#include "simulate/solid.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace vantage::simulation {

double Solid::signed_distance(const Point& p) const noexcept {
  double distance = -std::numeric_limits<double>::infinity();
  for (const Face& face : faces) {
    distance = std::max(distance, face.normal.dot(p - face.corners.front()));
  }
  return distance;
}

Solid make_solid(Surface surface, std::vector<std::vector<Point>> faces) {
  Solid solid{.surface = surface, .faces = {}, .bounds = {}};
  Point centre = Point::Zero();
  double corners = 0.0;
  for (const auto& face : faces) {
    for (const Point& corner : face) {
      solid.bounds.extend(corner);
      centre += corner;
      corners += 1.0;
    }
  }
  centre /= corners;
  solid.faces.reserve(faces.size());
  for (auto& face : faces) {
    Eigen::Vector3d normal = (face[1] - face[0]).cross(face[2] - face[0]).normalized();
    if (normal.dot(face[0] - centre) < 0.0) {
      std::reverse(face.begin(), face.end());
      normal = -normal;
    }
    solid.faces.push_back({std::move(face), normal});
  }
  return solid;
}

Solid make_profile(Surface surface, const Pose& frame, std::span<const Eigen::Vector2d> profile,
                   double y_min, double y_max) {
  const auto corner = [&](std::size_t i, double y) {
    const Eigen::Vector2d& xz = profile[i % profile.size()];
    return frame * Point(xz.x(), y, xz.y());
  };
  std::vector<std::vector<Point>> faces(2);
  for (std::size_t i = 0; i < profile.size(); ++i) {
    faces[0].push_back(corner(i, y_min));
    faces[1].push_back(corner(i, y_max));
    faces.push_back(
        {corner(i, y_min), corner(i + 1, y_min), corner(i + 1, y_max), corner(i, y_max)});
  }
  return make_solid(surface, std::move(faces));
}

Solid make_box(Surface surface, const Pose& frame, const Point& min, const Point& max) {
  const std::array profile{Eigen::Vector2d(min.x(), min.z()), Eigen::Vector2d(max.x(), min.z()),
                           Eigen::Vector2d(max.x(), max.z()), Eigen::Vector2d(min.x(), max.z())};
  return make_profile(surface, frame, profile, min.y(), max.y());
}

Solid make_turned(Surface surface, const Pose& frame, int sides,
                  std::span<const Eigen::Vector2d> radius_z) {
  const auto corner = [&](int side, const Eigen::Vector2d& ring) {
    const double angle = 2.0 * std::numbers::pi * (side % sides) / sides;
    return frame * Point(ring.x() * std::cos(angle), ring.x() * std::sin(angle), ring.y());
  };
  const bool has_tip = radius_z.back().x() == 0.0;
  std::vector<std::vector<Point>> faces(has_tip ? 1 : 2);
  for (int side = 0; side < sides; ++side) {
    faces[0].push_back(corner(side, radius_z.front()));
    if (!has_tip) faces[1].push_back(corner(side, radius_z.back()));
    for (std::size_t k = 0; k + 1 < radius_z.size(); ++k) {
      faces.push_back({corner(side, radius_z[k]), corner(side + 1, radius_z[k]),
                       corner(side + 1, radius_z[k + 1])});
      if (radius_z[k + 1].x() > 0.0) faces.back().push_back(corner(side, radius_z[k + 1]));
    }
  }
  return make_solid(surface, std::move(faces));
}

namespace {
constexpr double kBin = 6.0;  // [m]
}

SolidIndex::SolidIndex(std::span<const Solid> solids, const Eigen::Vector2d& half_size)
    : solids_(solids),
      half_size_(half_size),
      columns_(static_cast<int>(2.0 * half_size.x() / kBin) + 1),
      rows_(static_cast<int>(2.0 * half_size.y() / kBin) + 1) {
  const auto bins = static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_);
  const auto for_each_bin = [&](const Solid& solid, const auto& use) {
    const auto [i0, j0] = bin(solid.bounds.min.x(), solid.bounds.min.y());
    const auto [i1, j1] = bin(solid.bounds.max.x(), solid.bounds.max.y());
    for (int j = j0; j <= j1; ++j) {
      for (int i = i0; i <= i1; ++i) use(static_cast<std::size_t>(j * columns_ + i));
    }
  };
  first_.assign(bins + 1, 0);
  for (const Solid& solid : solids_) for_each_bin(solid, [&](std::size_t b) { ++first_[b + 1]; });
  for (std::size_t b = 0; b < bins; ++b) first_[b + 1] += first_[b];
  members_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t s = 0; s < solids_.size(); ++s) {
    for_each_bin(solids_[s], [&](std::size_t b) { members_[next[b]++] = s; });
  }
}

std::array<int, 2> SolidIndex::bin(double x, double y) const noexcept {
  const auto index = [](double offset, int count) {
    return static_cast<int>(std::clamp(offset / kBin, 0.0, count - 1.0));
  };
  return {index(x + half_size_.x(), columns_), index(y + half_size_.y(), rows_)};
}

bool SolidIndex::is_inside(const Point& p, std::uint32_t except, double depth) const noexcept {
  const auto [i, j] = bin(p.x(), p.y());
  const auto b = static_cast<std::size_t>(j * columns_ + i);
  for (std::uint32_t k = first_[b]; k < first_[b + 1]; ++k) {
    const std::uint32_t s = members_[k];
    const Bounds3& box = solids_[s].bounds;
    if (s == except || (p.array() < box.min.array()).any() || (p.array() > box.max.array()).any()) {
      continue;
    }
    if (solids_[s].signed_distance(p) < -depth) return true;
  }
  return false;
}

}  // namespace vantage::simulation
