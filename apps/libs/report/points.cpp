#include "report/points.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace vantage::report {
namespace {

using Voxel = std::array<std::int64_t, 3>;

struct VoxelHash {
  std::size_t operator()(const Voxel& v) const noexcept {
    std::uint64_t hash = 0x9e3779b97f4a7c15U;
    for (const std::int64_t i : v) {
      hash ^= static_cast<std::uint64_t>(i) + 0x9e3779b97f4a7c15U + (hash << 6U) + (hash >> 2U);
      hash *= 0xff51afd7ed558ccdU;
    }
    return hash ^ (hash >> 33U);
  }
};

bool before(const Point& a, const Point& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
}

/// The first point of each voxel in the order of the coordinates; empty if there are more than
/// `most`.
PointCloud one_a_voxel(PointsView points, double size, std::size_t most) {
  std::unordered_map<Voxel, Point, VoxelHash> firsts;
  firsts.reserve(std::min(points.size(), most + 1));
  for (const Point& p : points) {
    const Voxel voxel{std::llround(std::floor(p.x() / size)),
                      std::llround(std::floor(p.y() / size)),
                      std::llround(std::floor(p.z() / size))};
    const auto [place, added] = firsts.try_emplace(voxel, p);
    if (!added && before(p, place->second)) place->second = p;
    if (firsts.size() > most) return {};
  }
  PointCloud kept;
  for (const auto& [voxel, p] : firsts) kept.push_back(p);
  std::sort(kept.begin(), kept.end(), before);
  return kept;
}

}  // namespace

Point QuantizedPoints::at(std::size_t i) const {
  return origin + step.cwiseProduct(Point(points[i][0], points[i][1], points[i][2]));
}

QuantizedPoints quantized(PointsView points, const Bounds3& box) {
  QuantizedPoints result;
  if (box.empty()) return result;
  constexpr double kMost = 65535.0;
  result.origin = box.min;
  result.step = (box.max - box.min) / kMost;
  result.points.reserve(points.size());
  for (const Point& p : points) {
    std::array<std::uint16_t, 3> q{};
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (result.step[axis] <= 0.0) continue;
      const double along = (p[axis] - result.origin[axis]) / result.step[axis];
      q[static_cast<std::size_t>(axis)] =
          static_cast<std::uint16_t>(std::lround(std::clamp(along, 0.0, kMost)));
    }
    result.points.push_back(q);
  }
  return result;
}

std::string base64(std::span<const std::uint8_t> bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8U | (k < n ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) {
      text += k <= n ? kDigits[group >> (18U - 6U * k) & 63U] : '=';
    }
  }
  return text;
}

std::string base64(const QuantizedPoints& points) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(points.points.size() * 6);
  for (const auto& p : points.points) {
    for (const std::uint16_t q : p) {
      bytes.push_back(static_cast<std::uint8_t>(q & 0xffU));
      bytes.push_back(static_cast<std::uint8_t>(q >> 8U));
    }
  }
  return base64(bytes);
}

PointCloud thinned(PointsView points, std::size_t most) {
  if (points.size() <= most) {
    PointCloud all(points.begin(), points.end());
    std::sort(all.begin(), all.end(), before);
    return all;
  }
  if (most == 0) return {};
  const Bounds3 box = bounds_of(points);
  // Starts with voxels that are certainly too small, and makes them a tenth larger each time.
  const Point extent = (box.max - box.min).cwiseMax(1e-3);
  double size = std::sqrt(extent.x() * extent.y() / static_cast<double>(most)) / 4.0;
  while (true) {
    PointCloud kept = one_a_voxel(points, size, most);
    if (!kept.empty()) return kept;
    size *= 1.1;
  }
}

}  // namespace vantage::report
