// Regions of the cells that are nearest to seeds.
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nanoflann.hpp>
#include <optional>
#include <utility>

#include "vantage/kit/numbers.hpp"
#include "vantage/kit/raster_partition.hpp"

namespace vantage {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kMaxCells = 100'000'000;
constexpr std::size_t kRunsBeforeJoining = 4'000'000;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Cells first <= i < last of row j.
struct Run {
  std::int32_t j;
  std::int64_t first, last;
  friend auto operator<=>(const Run&, const Run&) = default;
};

double squared_distance(const Seed& seed, const Vector2d& p) noexcept {
  const Vector2d along = seed.to - seed.from, to = p - seed.from;
  const double t = along.dot(to), length = along.squaredNorm();
  // Ends are used exactly as given: seeds that share an end are exactly equally near to everything
  // beyond it.
  if (t <= 0.0) return to.squaredNorm();
  if (t >= length) return (p - seed.to).squaredNorm();
  return (to - (t / length) * along).squaredNorm();
}

/// Finds the region of the nearest seed by means of the midpoints of the seeds.
class NearestSeed {
 public:
  explicit NearestSeed(std::vector<Seed> seeds)
      : midpoints_{std::move(seeds)}, tree_(2, midpoints_) {
    fallback_ = midpoints_.seeds.front().region;
    for (const Seed& seed : midpoints_.seeds) {
      reach_ = std::max(reach_, 0.5 * (seed.to - seed.from).norm());
      fallback_ = std::min(fallback_, seed.region);
    }
  }
  NearestSeed(const NearestSeed&) = delete;  // the tree refers to the midpoints
  NearestSeed& operator=(const NearestSeed&) = delete;
  ~NearestSeed() = default;

  [[nodiscard]] std::uint32_t region(const Vector2d& p) const {
    Search search{midpoints_.seeds, p, reach_, fallback_};
    tree_.findNeighbors(search, p.data(), {});
    return search.region;
  }

 private:
  // NOLINTBEGIN(readability-identifier-naming): the names are nanoflann's.
  struct Midpoints {
    std::vector<Seed> seeds;

    [[nodiscard]] std::size_t kdtree_get_point_count() const { return seeds.size(); }
    [[nodiscard]] double kdtree_get_pt(std::size_t k, std::size_t axis) const {
      const auto a = static_cast<Eigen::Index>(axis);
      return seeds[k].from[a] + 0.5 * (seeds[k].to[a] - seeds[k].from[a]);
    }
    template <class Box>
    bool kdtree_get_bbox(Box& /*unused*/) const {
      return false;
    }
  };

  /// A seed at distance d has its midpoint within d + reach.
  struct Search {
    using DistanceType = double;
    std::span<const Seed> seeds;
    const Vector2d& p;
    double reach;
    std::uint32_t region;
    double best = kInfinity;   // squared
    double worst = kInfinity;  // squared, of midpoints that have not been looked at

    [[nodiscard]] bool full() const { return true; }
    [[nodiscard]] double worstDist() const { return worst; }
    void sort() {}  // asked for since nanoflann 1.5
    bool addPoint(double /*unused*/, std::uint32_t k) {
      const double d = squared_distance(seeds[k], p);
      if (d > best || (d == best && seeds[k].region >= region)) return true;
      best = d;
      region = seeds[k].region;
      const double radius = (std::sqrt(best) + reach) * (1.0 + 1e-9);  // beyond all rounding
      worst = radius * radius + std::numeric_limits<double>::min();
      return true;
    }
  };
  // NOLINTEND(readability-identifier-naming)

  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Midpoints>,
                                                   Midpoints, 2, std::uint32_t>;
  Midpoints midpoints_;
  Tree tree_;
  double reach_ = 0.0;
  std::uint32_t fallback_ = 0;  // for places so far away that their distance is infinite
};

std::vector<std::uint32_t> nearest_regions(const std::vector<PlanCell>& cells,
                                           const PlanRaster& raster, const NearestSeed& seeds) {
  std::vector<std::uint32_t> regions(cells.size());
  tbb::parallel_for(std::size_t{0}, cells.size(),
                    [&](std::size_t k) { regions[k] = seeds.region(raster.centre(cells[k])); });
  return regions;
}

/// Where the horizontal line at y crosses the area within `radius` of a seed.
std::pair<double, double> crossing(const Seed& seed, double radius, double y) noexcept {
  std::pair<double, double> x{kInfinity, -kInfinity};
  const auto extend = [&](double at) {
    x.first = std::min(x.first, at);
    x.second = std::max(x.second, at);
  };
  for (const Vector2d* end : {&seed.from, &seed.to}) {
    const double dy = y - end->y();
    if (std::abs(dy) > radius) continue;
    const double half = std::sqrt((radius - dy) * (radius + dy));
    extend(end->x() - half);
    extend(end->x() + half);
  }
  const Vector2d along = seed.to - seed.from;
  if (along.y() == 0.0) return x;
  const Vector2d side = radius * Vector2d(-along.y(), along.x()).normalized();
  for (const Vector2d& offset : {side, Vector2d(-side)}) {
    const double t = (y - seed.from.y() - offset.y()) / along.y();
    if (t >= 0.0 && t <= 1.0) extend(seed.from.x() + offset.x() + t * along.x());
  }
  return x;
}

/// Sorts runs, joins those that overlap or touch, and counts their cells.
std::size_t join(std::vector<Run>& runs) {
  std::sort(runs.begin(), runs.end());
  std::size_t kept = 0;
  for (const Run& run : runs) {
    if (kept > 0 && runs[kept - 1].j == run.j && run.first <= runs[kept - 1].last) {
      runs[kept - 1].last = std::max(runs[kept - 1].last, run.last);
    } else {
      runs[kept++] = run;
    }
  }
  runs.resize(kept);
  std::size_t cells = 0;
  for (const Run& run : runs) cells += static_cast<std::size_t>(run.last - run.first);
  return cells;
}

/// The cells of the map's box whose centre lies within a radius of a seed; nothing if there are
/// more than kMaxCells.
std::optional<std::vector<PlanCell>> cells_near(std::span<const Seed> seeds, double radius,
                                                const Bounds3& bounds, const PlanRaster& raster) {
  const PlanCell low = raster.cell_of(bounds.min.head<2>());
  const PlanCell high = raster.cell_of(bounds.max.head<2>());
  // The indices low <= k <= high with from <= centre <= to.
  const auto range = [&](double from, double to, std::int32_t lowest, std::int32_t highest) {
    const double first = std::ceil(from / raster.cell_size() - 0.5);
    const double last = std::floor(to / raster.cell_size() - 0.5);
    return std::pair{static_cast<std::int64_t>(std::clamp(first, 1.0 * lowest, 1.0 * highest + 1)),
                     static_cast<std::int64_t>(std::clamp(last, 1.0 * lowest - 1, 1.0 * highest))};
  };
  std::vector<Run> runs;
  std::size_t limit = kRunsBeforeJoining;
  for (const Seed& seed : seeds) {
    const auto [bottom, top] = range(std::min(seed.from.y(), seed.to.y()) - radius,
                                     std::max(seed.from.y(), seed.to.y()) + radius, low.j, high.j);
    for (std::int64_t j = bottom; j <= top; ++j) {
      const auto row = static_cast<std::int32_t>(j);
      const auto [from, to] = crossing(seed, radius, raster.centre({row, 0}).y());
      if (!(from <= to)) continue;
      const auto [first, last] = range(from, to, low.i, high.i);
      if (first <= last) runs.push_back({row, first, last + 1});
      if (runs.size() < limit) continue;
      if (join(runs) > kMaxCells) return std::nullopt;
      limit = std::max(kRunsBeforeJoining, 2 * runs.size());
    }
  }
  const std::size_t count = join(runs);
  if (count > kMaxCells) return std::nullopt;
  std::vector<PlanCell> cells;
  cells.reserve(count);
  for (const Run& run : runs) {
    for (std::int64_t i = run.first; i < run.last; ++i) {
      cells.push_back({run.j, static_cast<std::int32_t>(i)});
    }
  }
  return cells;
}

Result<void> check_seeds(std::span<const Seed> seeds, std::size_t regions) {
  if (seeds.empty()) return fail(ErrorCode::invalid_input, "there is no seed to grow regions from");
  for (const Seed& seed : seeds) {
    if (!seed.from.allFinite() || !seed.to.allFinite()) {
      return fail(ErrorCode::invalid_input,
                  "a seed of region " + std::to_string(seed.region) + " is not finite");
    }
    if (seed.region >= regions) {
      return fail(ErrorCode::invalid_input, "a seed names region " + std::to_string(seed.region) +
                                                ", but there are " + std::to_string(regions));
    }
  }
  return {};
}

tl::unexpected<Error> too_many_cells(const NearestParams& params) {
  return fail(ErrorCode::invalid_input, "cell_size = " + shortest(params.cell_size) +
                                            " m and fill_radius = " + shortest(params.fill_radius) +
                                            " m make more than " + std::to_string(kMaxCells) +
                                            " cells");
}

}  // namespace

Result<Partition> partition_by_nearest(const MapPasses& map, std::span<const Seed> seeds,
                                       std::span<const std::string> labels,
                                       const NearestParams& params) {
  if (map.points() == 0) return fail(ErrorCode::invalid_input, "the map has no points");
  VANTAGE_CHECK(check_seeds(seeds, labels.size()));
  const Bounds3 bounds = map.bounds();
  VANTAGE_TRY(const PlanRaster raster, PlanRaster::over(bounds, params.cell_size));
  VANTAGE_TRY(const std::vector<PlanCell> occupied, occupied_cells(map, raster));
  const NearestSeed all({seeds.begin(), seeds.end()});
  const std::vector<std::uint32_t> owners = nearest_regions(occupied, raster, all);

  constexpr std::uint32_t kNone = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number_of(labels.size(), kNone);  // index among the regions that stay
  for (const std::uint32_t owner : owners) number_of[owner] = 0;
  std::vector<std::string> names;
  for (std::size_t r = 0; r < labels.size(); ++r) {
    if (number_of[r] == kNone) continue;
    number_of[r] = static_cast<std::uint32_t>(names.size());
    names.push_back(labels[r]);
  }
  std::vector<OwnedCell> cells;
  for (std::size_t k = 0; k < occupied.size(); ++k) {
    cells.push_back({occupied[k], number_of[owners[k]]});
  }

  const auto near = cells_near(seeds, params.fill_radius, bounds, raster);
  if (!near || near->size() + cells.size() > kMaxCells) return too_many_cells(params);
  std::vector<PlanCell> empty;
  std::set_difference(near->begin(), near->end(), occupied.begin(), occupied.end(),
                      std::back_inserter(empty));
  std::vector<Seed> staying;
  for (const Seed& seed : seeds) {
    if (number_of[seed.region] != kNone)
      staying.push_back({seed.from, seed.to, number_of[seed.region]});
  }
  const std::vector<std::uint32_t> fill =
      nearest_regions(empty, raster, NearestSeed(std::move(staying)));
  for (std::size_t k = 0; k < empty.size(); ++k) cells.push_back({empty[k], fill[k]});
  return partition_of_cells(raster, std::move(cells), names);
}

}  // namespace vantage
