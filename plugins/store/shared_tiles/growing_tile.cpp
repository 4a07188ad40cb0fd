#include "growing_tile.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "vantage/kit/canonical_order.hpp"

namespace vantage::shared_tiles {
namespace {

/// A whole number, cut to 0 ... 2^bits - 1.
std::uint64_t cut(double number, unsigned bits) noexcept {
  return static_cast<std::uint64_t>(
      std::clamp(number, 0.0, static_cast<double>((1U << bits) - 1U)));
}

template <class T>
void append_all(std::string& to, const std::vector<T>& values) {
  to.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

/// Puts newcomers before the values that they come before, from the last to the first.
template <class Values, class Newcomers, class Value>
void insert(Values& values, const Newcomers& newcomers, const Value& value_of) {
  std::size_t from = values.size();
  values.resize(values.size() + newcomers.size());
  std::size_t to = values.size();
  for (auto it = newcomers.rbegin(); it != newcomers.rend(); ++it) {
    const std::size_t kept = from - it->before;
    std::move_backward(values.begin() + static_cast<std::ptrdiff_t>(it->before),
                       values.begin() + static_cast<std::ptrdiff_t>(from),
                       values.begin() + static_cast<std::ptrdiff_t>(to));
    from -= kept;
    to -= kept;
    values[--to] = value_of(*it);
  }
}

}  // namespace

GrowingTile::GrowingTile(const Square& square, double width) noexcept
    : first_cell_{canonical_cell(static_cast<double>(square[1]) * width),
                  canonical_cell(static_cast<double>(square[0]) * width)} {}

std::optional<std::vector<std::uint32_t>> GrowingTile::pick(PointsView points, std::uint32_t put) {
  std::vector<std::uint32_t> picks;
  picks.reserve(points.size());
  std::vector<Newcomer> newcomers;
  const auto size = static_cast<std::uint32_t>(points_.size());
  std::uint32_t next = 0;  // of those that were here
  for (const Point& p : points) {
    if (next >= size || points_[next] != p) {
      const std::uint64_t key = key_of(p);
      if (next > 0 && !precedes(next - 1, key, p) && points_[next - 1] != p) return std::nullopt;
      while (next < size && precedes(next, key, p)) ++next;
      if (next >= size || points_[next] != p) {
        if (!newcomers.empty() && canonically_before(p, newcomers.back().point)) {
          return std::nullopt;
        }
        picks.push_back(next + static_cast<std::uint32_t>(newcomers.size()));
        newcomers.push_back({p, key, next});
        continue;
      }
    }
    picks.push_back(next++ + static_cast<std::uint32_t>(newcomers.size()));
  }
  if (!newcomers.empty()) add(newcomers, put);
  return picks;
}

/// The canonical place of a point in few bits: far from the tile, many places have one key.
std::uint64_t GrowingTile::key_of(const Point& p) const noexcept {
  constexpr unsigned kCube = 30, kLayer = 14, kCell = 10;  // [bits]
  const CanonicalPlace place = CanonicalPlace::of(p);
  const std::uint64_t row = cut(place.cell.y() - first_cell_[1], kCell);
  const std::uint64_t column = cut(place.cell.x() - first_cell_[0], kCell);
  const std::uint64_t layer = cut(place.cell.z() + (1U << (kLayer - 1U)), kLayer);
  return (((row << kCell | column) << kLayer) | layer) << kCube | place.in_cube;
}

bool GrowingTile::precedes(std::uint32_t i, std::uint64_t key, const Point& p) const noexcept {
  return keys_[i] != key ? keys_[i] < key : canonically_before(points_[i], p);
}

void GrowingTile::add(std::span<const Newcomer> newcomers, std::uint32_t put) {
  insert(points_, newcomers, [](const Newcomer& n) { return n.point; });
  insert(keys_, newcomers, [](const Newcomer& n) { return n.key; });
  insert(births_, newcomers, [put](const Newcomer&) { return put; });
}

std::string GrowingTile::encode() const {
  std::string bytes;
  bytes.reserve(points_.size() * (sizeof(Point) + sizeof(std::uint64_t) + sizeof(std::uint32_t)));
  append_all(bytes, points_);
  append_all(bytes, keys_);
  append_all(bytes, births_);
  return bytes;
}

void GrowingTile::decode(std::string_view bytes) {
  const std::size_t count =
      bytes.size() / (sizeof(Point) + sizeof(std::uint64_t) + sizeof(std::uint32_t));
  const auto take = [&](auto& values) {
    values.resize(count);
    const std::size_t size = count * sizeof(values[0]);
    std::memcpy(static_cast<void*>(values.data()), bytes.data(), size);
    bytes.remove_prefix(size);
  };
  take(points_);
  take(keys_);
  take(births_);
}

TileHistory::TileHistory(std::vector<std::uint32_t> births) : births_(std::move(births)) {
  for (const std::uint32_t birth : births_) last_ = std::max(last_, birth);
}

std::vector<std::uint32_t> TileHistory::now(std::span<const Run> runs, std::uint32_t put) const {
  std::vector<std::uint32_t> picks;
  std::uint32_t then = 0;  // the number of the next point when the region was put
  auto run = runs.begin();
  for (std::uint32_t i = 0; run != runs.end() && i < births_.size(); ++i) {
    if (births_[i] > put) continue;
    if (then >= run->begin) picks.push_back(i);
    if (++then == run->end) ++run;
  }
  return picks;
}

}  // namespace vantage::shared_tiles
