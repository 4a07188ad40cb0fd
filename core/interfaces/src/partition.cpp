#include "vantage/partition.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <sstream>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

namespace vantage {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kMaxLabelLength = 200;  // leaves room for an extension in a file name
constexpr std::size_t kMaxParts = std::numeric_limits<std::uint32_t>::max() / 16;

Bounds2 bounds(const HalfOpenBox& box) noexcept { return {box.min, box.max}; }

Bounds2 bounds(const ConvexPolygon& polygon) noexcept {
  Bounds2 all;
  for (const Vector2d& corner : polygon.corners) all.extend(corner);
  return all;
}

Bounds2 bounds(const BoxUnion& shape) noexcept {
  Bounds2 all;
  for (const HalfOpenBox& box : shape.boxes) {
    all.extend(box.min);
    all.extend(box.max);
  }
  return all;
}

double cross(const Vector2d& a, const Vector2d& b) noexcept {
  return a.x() * b.y() - a.y() * b.x();
}

/// Whether p is on the line a -> b or left of it. The ends are taken in a fixed order. Two polygons
/// that share an edge, each in its own direction, therefore round alike and leave no crack.
bool left_of(const Vector2d& a, const Vector2d& b, const Vector2d& p) noexcept {
  const bool forward = a.x() < b.x() || (a.x() == b.x() && a.y() <= b.y());
  return forward ? cross(b - a, p - a) >= 0.0 : cross(a - b, p - b) <= 0.0;
}

bool inside(const HalfOpenBox& box, const Vector2d& p) noexcept {
  return box.min.x() <= p.x() && p.x() < box.max.x() && box.min.y() <= p.y() && p.y() < box.max.y();
}

bool inside(const ConvexPolygon& polygon, const Vector2d& p) noexcept {
  const std::vector<Vector2d>& corners = polygon.corners;
  if (corners.size() < 3 || !bounds(polygon).contains(p)) return false;
  for (std::size_t i = 0, before = corners.size() - 1; i < corners.size(); before = i++) {
    if (!left_of(corners[before], corners[i], p)) return false;
  }
  return true;
}

bool inside(const BoxUnion& shape, const Vector2d& p) noexcept {
  return std::any_of(shape.boxes.begin(), shape.boxes.end(),
                     [&](const HalfOpenBox& box) { return inside(box, p); });
}

double distance_to_border(const HalfOpenBox& box, const Vector2d& p) noexcept {
  const Vector2d outside = (box.min - p).cwiseMax(p - box.max).cwiseMax(0.0);
  return std::hypot(outside.x(), outside.y());
}

double distance_to_border(const ConvexPolygon& polygon, const Vector2d& p) noexcept {
  const std::vector<Vector2d>& corners = polygon.corners;
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0, before = corners.size() - 1; i < corners.size(); before = i++) {
    const Vector2d edge = corners[i] - corners[before], to = p - corners[before];
    const double along = std::clamp(edge.dot(to) / edge.squaredNorm(), 0.0, 1.0);
    nearest = std::min(nearest, (to - along * edge).norm());
  }
  return nearest;
}

double distance_to_border(const BoxUnion& shape, const Vector2d& p) noexcept {
  double nearest = std::numeric_limits<double>::infinity();
  for (const HalfOpenBox& box : shape.boxes) {
    nearest = std::min(nearest, distance_to_border(box, p));
  }
  return nearest;
}

std::string text(const Vector2d& p) {
  std::ostringstream out;
  out << '(' << p.x() << ", " << p.y() << ')';
  return out.str();
}

tl::unexpected<Error> refuse(std::size_t id, const Region& region, const std::string& reason) {
  std::string label = region.label.substr(0, kMaxLabelLength);  // of a file: maybe not of one line
  for (char& c : label) c = c < ' ' || c > '~' ? '?' : c;
  return fail(ErrorCode::invalid_input,
              "region " + std::to_string(id) + " ('" + label + "'): " + reason);
}

bool file_safe(std::string_view label) noexcept {
  const auto allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '+' || c == '.';
  };
  return !label.empty() && label.size() <= kMaxLabelLength && label.front() != '.' &&
         std::all_of(label.begin(), label.end(), allowed);
}

/// What is wrong with a footprint, or "".
std::string defect(const HalfOpenBox& box) {
  if (!box.min.allFinite() || !box.max.allFinite()) return "the box is not finite";
  if (!(box.min.x() < box.max.x() && box.min.y() < box.max.y())) {
    return "the box is empty: min " + text(box.min) + " is not below max " + text(box.max);
  }
  return "";
}

std::string defect(const ConvexPolygon& polygon) {
  const std::vector<Vector2d>& corners = polygon.corners;
  const std::size_t n = corners.size();
  if (n < 3) return "a polygon needs at least 3 corners, not " + std::to_string(n);
  double magnitude = 0.0;
  for (const Vector2d& corner : corners) {
    if (!corner.allFinite()) return "the polygon is not finite";
    magnitude = std::max(magnitude, corner.cwiseAbs().maxCoeff());
  }
  // Corners that a program computed on a straight line are off the line by the rounding of
  // coordinates.
  const double rounding = 4.0 * std::numeric_limits<double>::epsilon() * magnitude;
  double turned = 0.0, area = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d to = corners[(i + 1) % n] - corners[i];
    const Vector2d onward = corners[(i + 2) % n] - corners[(i + 1) % n];
    if (to.isZero(0.0)) return "two corners of the polygon coincide at " + text(corners[i]);
    if (cross(to, onward) < -rounding * (to.norm() + onward.norm())) {
      return "the polygon is not convex and counter-clockwise at corner " +
             text(corners[(i + 1) % n]);
    }
    turned += std::atan2(cross(to, onward), to.dot(onward));
    area += cross(corners[i] - corners[0], corners[(i + 1) % n] - corners[0]);
  }
  if (!(area > 0.0)) return "the polygon has no area";
  if (!(std::abs(turned - 2.0 * std::numbers::pi) < 1e-3)) return "the polygon crosses itself";
  return "";
}

std::string defect(const BoxUnion& shape) {
  if (shape.boxes.empty()) return "the union holds no box";
  for (const HalfOpenBox& box : shape.boxes) {
    if (std::string what = defect(box); !what.empty()) return what;
  }
  return "";
}

/// The convex parts of a footprint, each indexed on its own.
template <class Shape>
std::size_t parts(const Shape&) noexcept {
  return 1;
}
std::size_t parts(const BoxUnion& shape) noexcept { return shape.boxes.size(); }

template <class Shape>
const Shape& part(const Shape& shape, std::size_t) noexcept {
  return shape;
}
const HalfOpenBox& part(const BoxUnion& shape, std::size_t k) noexcept { return shape.boxes[k]; }

/// The least power of two that is not below x; the largest power of two for any larger x.
double power_of_two_above(double x) noexcept {
  int exponent = 0;
  const double mantissa = std::frexp(std::min(x, std::numeric_limits<double>::max()), &exponent);
  return std::ldexp(1.0, std::min(mantissa == 0.5 ? exponent - 1 : exponent, 1023));
}

}  // namespace

Bounds2 bounds_of(const Footprint& footprint) noexcept {
  return std::visit([](const auto& shape) { return bounds(shape); }, footprint);
}

bool contains(const Footprint& footprint, const Vector2d& xy) noexcept {
  return std::visit([&](const auto& shape) { return inside(shape, xy); }, footprint);
}

double distance(const Footprint& footprint, const Vector2d& xy) noexcept {
  if (!xy.allFinite()) return std::numeric_limits<double>::infinity();
  if (contains(footprint, xy)) return 0.0;
  // On the open border of a box, the distance is positive too: it is 0 only inside.
  return std::visit(
      [&](const auto& shape) {
        return std::max(distance_to_border(shape, xy), std::numeric_limits<double>::min());
      },
      footprint);
}

std::string defect_of(const Region& region) {
  if (!file_safe(region.label)) {
    return "a label is 1 to " + std::to_string(kMaxLabelLength) +
           " letters, digits, '_', '-', '+' or '.', and does not begin with '.'";
  }
  std::string what = std::visit([](const auto& shape) { return defect(shape); }, region.footprint);
  const bool is_high = region.height.min < region.height.max;
  return what.empty() && !is_high ? "the height interval is empty or not a number" : what;
}

/// One hashed grid per size class of convex parts. Buckets are at least as wide as the boxes of
/// their class, so a part is in at most four of them, whatever the extent of the map. Buckets are
/// at most twice as wide, so disjoint parts do not crowd a bucket. The widths are powers of two:
/// division by them is exact, and a place far from the origin falls into the right bucket.
struct Partition::Grid {
  struct Entry {
    Bounds2 box;
    std::uint32_t id, part;
  };
  struct Bucket {
    std::int64_t x, y;
    friend auto operator<=>(const Bucket&, const Bucket&) = default;
  };
  struct Hash {
    std::size_t operator()(const Bucket& bucket) const noexcept {
      std::uint64_t h = static_cast<std::uint64_t>(bucket.x) * 0x9e3779b97f4a7c15U;
      h ^= static_cast<std::uint64_t>(bucket.y) + 0x632be59bd9b4e019U + (h << 6U) + (h >> 2U);
      h = (h ^ (h >> 31U)) * 0xbf58476d1ce4e5b9U;
      return h ^ (h >> 29U);
    }
  };
  struct Level {
    Vector2d width;
    Bounds2 extent;
    std::unordered_map<Bucket, std::pair<std::uint32_t, std::uint32_t>, Hash> buckets;
  };

  explicit Grid(const std::vector<Region>& regions);

  [[nodiscard]] static Bucket bucket_of(const Vector2d& p, const Vector2d& width) noexcept {
    return {static_cast<std::int64_t>(std::floor(p.x() / width.x())),
            static_cast<std::int64_t>(std::floor(p.y() / width.y()))};
  }
  /// The parts of one level whose boxes may contain a place, by region.
  [[nodiscard]] std::span<const Entry> candidates(const Level& level,
                                                  const Vector2d& p) const noexcept {
    if (!level.extent.contains(p)) return {};
    const auto found = level.buckets.find(bucket_of(p, level.width));
    if (found == level.buckets.end()) return {};
    const auto [begin, end] = found->second;
    return std::span(entries).subspan(begin, end - begin);
  }

  std::vector<Entry> entries;
  std::vector<Level> levels;
};

Partition::Grid::Grid(const std::vector<Region>& regions) {
  struct Placed {
    Vector2d width;
    Bucket bucket;
    Entry entry;
    [[nodiscard]] auto key() const noexcept {
      return std::tuple(width.x(), width.y(), bucket, entry.id, entry.part);
    }
  };
  std::vector<Placed> placed;
  placed.reserve(4 * regions.size());
  const auto place = [&](const Bounds2& box, std::uint32_t id, std::uint32_t part) {
    const Vector2d width = (box.max - box.min).unaryExpr(&power_of_two_above);
    const Bucket first = bucket_of(box.min, width), last = bucket_of(box.max, width);
    for (std::int64_t y = first.y; y <= last.y; ++y) {
      for (std::int64_t x = first.x; x <= last.x; ++x) {
        placed.push_back({width, {x, y}, {box, id, part}});
      }
    }
  };
  for (std::uint32_t id = 0; id < regions.size(); ++id) {
    std::visit(
        [&](const auto& shape) {
          for (std::uint32_t k = 0; k < parts(shape); ++k) {
            place(bounds(part(shape, k)), id, k);
          }
        },
        regions[id].footprint);
  }
  std::sort(placed.begin(), placed.end(),
            [](const Placed& a, const Placed& b) { return a.key() < b.key(); });

  entries.reserve(placed.size());
  for (const Placed& one : placed) {
    if (levels.empty() || levels.back().width != one.width) {
      levels.push_back({one.width, one.entry.box, {}});
    }
    Level& level = levels.back();
    level.extent.extend(one.entry.box.min);
    level.extent.extend(one.entry.box.max);
    const auto here = static_cast<std::uint32_t>(entries.size());
    level.buckets.try_emplace(one.bucket, here, here).first->second.second = here + 1;
    entries.push_back(one.entry);
  }
}

Result<Partition> Partition::from(std::vector<Region> regions) {
  if (regions.empty()) return fail(ErrorCode::invalid_input, "a partition needs a region");
  std::unordered_set<std::string_view> labels;
  std::size_t all_parts = 0;
  for (std::size_t id = 0; id < regions.size(); ++id) {
    const Region& region = regions[id];
    if (const std::string what = defect_of(region); !what.empty()) return refuse(id, region, what);
    if (!labels.insert(region.label).second) return refuse(id, region, "the same label as another");
    all_parts += std::visit([](const auto& shape) { return parts(shape); }, region.footprint);
    if (all_parts > kMaxParts) {
      return refuse(
          id, region,
          "the regions consist of more than " + std::to_string(kMaxParts) + " boxes and polygons");
    }
  }

  Partition partition;
  partition.grid_ = std::make_shared<const Grid>(regions);
  partition.regions_ = std::move(regions);
  return partition;
}

template <class Accept>
std::optional<RegionId> Partition::locate_if(const Vector2d& xy,
                                             const Accept& accept) const noexcept {
  if (regions_.empty() || !xy.allFinite()) return std::nullopt;
  std::optional<RegionId> owner;
  for (const Grid::Level& level : grid_->levels) {
    for (const Grid::Entry& entry : grid_->candidates(level, xy)) {
      if (owner && owner->value <= entry.id) break;
      const Region& region = regions_[entry.id];
      if (entry.box.contains(xy) && accept(region) &&
          std::visit([&](const auto& shape) { return inside(part(shape, entry.part), xy); },
                     region.footprint)) {
        owner = RegionId{entry.id};
        break;
      }
    }
  }
  return owner;
}

std::optional<RegionId> Partition::locate(const Point& p) const noexcept {
  if (!std::isfinite(p.z())) return std::nullopt;
  return locate_if(p.head<2>(),
                   [&](const Region& region) { return region.height.contains(p.z()); });
}

std::optional<RegionId> Partition::locate(const Vector2d& xy) const noexcept {
  return locate_if(xy, [](const Region&) { return true; });
}

}  // namespace vantage
