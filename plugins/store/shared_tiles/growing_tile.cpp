#include "growing_tile.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

#include "bytes.hpp"
#include "vantage/kit/canonical_order.hpp"

namespace vantage::shared_tiles {
namespace {

/// Numbers in few bits, one after another, the first in the highest. Keys compare as the lists of
/// their numbers do, or are equal. Behind a number that its bits cannot tell from others, a key
/// says nothing: whatever follows would be compared with what follows another number.
class KeyWriter {
 public:
  /// @param number  whole
  KeyWriter& append(double number, unsigned bits) noexcept {
    const double most = static_cast<double>((1U << bits) - 1U);
    // 0 and `most` stand for all that is below and above.
    const double code = is_open_ ? std::clamp(number + 1.0, 0.0, most) : 0.0;
    key_ = key_ << bits | static_cast<std::uint64_t>(code);
    is_open_ = is_open_ && code > 0.0 && code < most;
    return *this;
  }
  /// The last number, of which the bits hold all.
  [[nodiscard]] std::uint64_t ending(std::uint32_t number, unsigned bits) const noexcept {
    return key_ << bits | (is_open_ ? number : 0U);
  }

 private:
  std::uint64_t key_ = 0;
  bool is_open_ = true;  // the bits told all numbers so far from others
};

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
  if (points_.empty() && !points.empty()) middle_layer_ = canonical_cell(points.front().z());
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

/// The canonical place of a point in few bits: far from the tile's first point, many places have
/// one key.
std::uint64_t GrowingTile::key_of(const Point& p) const noexcept {
  constexpr unsigned kCube = 30, kLayer = 14, kCell = 10;  // [bits]
  const CanonicalPlace place = CanonicalPlace::of(p);
  return KeyWriter()
      .append(place.cell.y() - first_cell_[1], kCell)
      .append(place.cell.x() - first_cell_[0], kCell)
      .append(place.cell.z() - middle_layer_ + (1U << (kLayer - 1U)), kLayer)
      .ending(place.in_cube, kCube);
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
  bytes.reserve(sizeof middle_layer_ +
                points_.size() * (sizeof(Point) + sizeof(std::uint64_t) + sizeof(std::uint32_t)));
  append(bytes, middle_layer_);
  append_all(bytes, points_);
  append_all(bytes, keys_);
  append_all(bytes, births_);
  return bytes;
}

void GrowingTile::decode(std::string_view bytes) {
  std::memcpy(&middle_layer_, bytes.data(), sizeof middle_layer_);
  bytes.remove_prefix(sizeof middle_layer_);
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
