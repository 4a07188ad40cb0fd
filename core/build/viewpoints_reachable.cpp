#include <tbb/parallel_sort.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <numeric>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "vantage/build/viewpoints.hpp"
#include "vantage/kit/hash.hpp"

namespace vantage {
namespace {

/// A square metre in plan view.
struct Column {
  std::int64_t y, x;
  friend auto operator<=>(const Column&, const Column&) = default;
};

struct ColumnHash {
  std::size_t operator()(const Column& column) const noexcept {
    return CellHash{}(std::array{column.y, column.x});
  }
};

Result<Column> column_of(const Point& p) {
  if (!p.allFinite() || p.cwiseAbs().maxCoeff() >= 0x1p50) {
    return fail(ErrorCode::invalid_input,
                "a point is not finite or too far from the origin to tell what is reachable");
  }
  return Column{static_cast<std::int64_t>(std::floor(p.y())),
                static_cast<std::int64_t>(std::floor(p.x()))};
}

struct GroundPoint {
  Column column;
  double z;
  std::uint32_t index;
  friend auto operator<=>(const GroundPoint&, const GroundPoint&) = default;
};

/// Ground of one column without a gap in height.
struct Level {
  Column column;
  std::size_t begin, end;  // in the sorted ground points
  double height;           // mean
};

struct LevelRange {
  std::size_t begin, end;
};

/// The levels of all ground, sorted by column and then from below, and which of them are connected.
class Levels {
 public:
  /// @param points  sorted
  Levels(const std::vector<GroundPoint>& points, double max_step) : max_step_(max_step) {
    for (std::size_t k = 0; k < points.size();) {
      const GroundPoint& lowest = points[k];
      Level level{lowest.column, k, k + 1, 0.0};
      double sum = 0.0;  // of heights above the lowest
      for (; level.end < points.size() && points[level.end].column == lowest.column &&
             points[level.end].z - points[level.end - 1].z <= max_step;
           ++level.end) {
        sum += points[level.end].z - lowest.z;
      }
      level.height = lowest.z + sum / static_cast<double>(level.end - level.begin);
      k = level.end;
      LevelRange& column =
          columns_.try_emplace(level.column, LevelRange{all_.size(), 0}).first->second;
      all_.push_back(level);
      column.end = all_.size();
    }
    parent_.resize(all_.size());
    std::iota(parent_.begin(), parent_.end(), std::size_t{0});
    for (std::size_t level = 0; level < all_.size(); ++level) connect(level);
  }

  [[nodiscard]] const std::vector<Level>& all() const noexcept { return all_; }

  /// One level that stands for all levels connected to it: the first of them.
  [[nodiscard]] std::size_t component(std::size_t level) {
    while (parent_[level] != level) level = parent_[level] = parent_[parent_[level]];
    return level;
  }

  /// The highest level of a column that is at most one step above z; none if all are higher.
  [[nodiscard]] std::optional<std::size_t> below(const Column& column, double z) const {
    const auto [begin, end] = in(column);
    for (std::size_t level = end; level-- > begin;) {
      if (all_[level].height <= z + max_step_) return level;
    }
    return std::nullopt;
  }

 private:
  [[nodiscard]] LevelRange in(const Column& column) const {
    const auto found = columns_.find(column);
    return found == columns_.end() ? LevelRange{0, 0} : found->second;
  }

  /// Connects a level with the levels around it that come later; earlier ones connect themselves.
  void connect(std::size_t level) {
    const Column here = all_[level].column;
    for (std::int64_t dy = 0; dy <= 2; ++dy) {
      for (std::int64_t dx = -2; dx <= 2; ++dx) {
        if (dy == 0 && dx <= 0) continue;
        const auto [begin, end] = in({here.y + dy, here.x + dx});
        if (begin == end || !is_hole_between(here, dy, dx)) continue;
        for (std::size_t other = begin; other < end; ++other) {
          if (std::abs(all_[other].height - all_[level].height) <= max_step_) join(level, other);
        }
      }
    }
  }

  /// Whether the columns between two columns hold no ground; neighbours have no column between
  /// them.
  [[nodiscard]] bool is_hole_between(const Column& here, std::int64_t dy, std::int64_t dx) const {
    const auto empty = [&](std::int64_t y, std::int64_t x) {
      return !columns_.contains({here.y + y, here.x + x});
    };
    if (std::abs(dy) < 2 && std::abs(dx) < 2) return true;
    // Half of an odd distance is rounded to both sides: the middle is one column or two.
    const auto half = [](std::int64_t d) {
      return std::array{(d - (d < 0)) / 2, (d + (d > 0)) / 2};
    };
    return empty(half(dy)[0], half(dx)[0]) && empty(half(dy)[1], half(dx)[1]);
  }

  void join(std::size_t a, std::size_t b) {
    a = component(a);
    b = component(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

  double max_step_;
  std::vector<Level> all_;
  std::unordered_map<Column, LevelRange, ColumnHash> columns_;
  std::vector<std::size_t> parent_;
};

/// By the first level of each component.
using Chosen = std::vector<bool>;

Chosen largest(Levels& levels) {
  std::vector<std::size_t> size(levels.all().size());
  for (std::size_t level = 0; level < size.size(); ++level) ++size[levels.component(level)];
  Chosen chosen(size.size());
  chosen[static_cast<std::size_t>(std::max_element(size.begin(), size.end()) - size.begin())] =
      true;
  return chosen;
}

Result<Chosen> below(Levels& levels, PointsView trajectory) {
  Chosen chosen(levels.all().size());
  bool any = false;
  for (const Point& p : trajectory) {
    VANTAGE_TRY(const Column column, column_of(p));
    if (const auto level = levels.below(column, p.z())) {
      chosen[levels.component(*level)] = any = true;
    }
  }
  if (any) return chosen;
  return fail(ErrorCode::invalid_input,
              "no ground was found below the trajectory, so no ground is known to be reachable: is "
              "the trajectory in the frame of the map?");
}

}  // namespace

Result<IndexList> reachable_ground(PointsView map, std::span<const std::uint32_t> ground,
                                   PointsView trajectory, double max_step) {
  if (ground.empty()) return IndexList{};
  std::vector<GroundPoint> points;
  points.reserve(ground.size());
  for (const std::uint32_t k : ground) {
    VANTAGE_TRY(const Column column, column_of(map[k]));
    points.push_back({column, map[k].z(), k});
  }
  tbb::parallel_sort(points.begin(), points.end(),
                     [](const GroundPoint& a, const GroundPoint& b) { return (a <=> b) < 0; });
  Levels levels(points, max_step);
  Chosen chosen;
  if (trajectory.empty()) {
    chosen = largest(levels);
  } else {
    VANTAGE_TRY(chosen, below(levels, trajectory));
  }
  IndexList reachable;
  for (std::size_t level = 0; level < levels.all().size(); ++level) {
    if (!chosen[levels.component(level)]) continue;
    const auto [column, begin, end, height] = levels.all()[level];
    for (std::size_t k = begin; k < end; ++k) reachable.push_back(points[k].index);
  }
  std::sort(reachable.begin(), reachable.end());
  return reachable;
}

}  // namespace vantage
