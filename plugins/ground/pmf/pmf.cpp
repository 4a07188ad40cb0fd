#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include <tbb/parallel_for.h>

#include "opening.hpp"
#include "vantage/plugin.hpp"

namespace vantage::pmf {
namespace {

constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();
constexpr int kNeighbourhood = 2;  // cells to each side that support a height or give its slope
constexpr int kMostSupport = (2 * kNeighbourhood + 1) * (2 * kNeighbourhood + 1);
constexpr int kOutlierPasses = 4;  // what hides below an outlier is seen in the next pass
constexpr std::size_t kMaxWindows = 10'000;
constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();
constexpr double kMaxIndex = 0x1p52;
constexpr double kMaxCells = 0x1p27;       // of one raster, with the border that windows need
constexpr std::int64_t kTileWidth = 1024;  // [cells]

enum class Schedule : std::uint8_t { linear, exponential };
constexpr auto enum_names(Schedule) {
  return std::array{std::pair{std::string_view("linear"), Schedule::linear},
                    std::pair{std::string_view("exponential"), Schedule::exponential}};
}

struct Window {
  std::size_t radius;  ///< [cells]
  double threshold;    ///< dh of Zhang et al., Eq. 5 [m]
};

struct Params {
  double cell_size = 1.0;
  double max_window = 33.0;
  Schedule schedule = Schedule::linear;
  double base = 2.0;
  double slope = 0.3;
  double initial_distance = 0.4;
  double max_distance = 2.5;
  double outlier_ratio = 3.0;

  static constexpr auto schema() {
    constexpr Source kFilter{{}, "Zhang et al. 2003"};
    constexpr Source kWindows{{}, "Zhang et al. 2003, Eqs. 4-5"};
    return std::tuple{
        optional("cell_size", &Params::cell_size, "m", "width of a cell of the raster of minima",
                 positive, kFilter),
        optional("max_window", &Params::max_window, "m",
                 "width of the largest window: wider than the widest object, narrower than hills",
                 positive, kWindows),
        optional("schedule", &Params::schedule, "",
                 "windows of 2 k base + 1 (linear) or 2 base^(k-1) + 1 cells (exponential)",
                 kWindows),
        optional("base", &Params::base, "cells", "how fast the windows grow", at_least(1.0),
                 kWindows),
        optional("slope", &Params::slope, "", "steepest terrain, rise over run", non_negative,
                 kFilter),
        optional("initial_distance", &Params::initial_distance, "m",
                 "how far from the ground's surface a point may be", non_negative, kFilter),
        optional("max_distance", &Params::max_distance, "m",
                 "a larger drop between two windows is never terrain", non_negative, kFilter),
        optional("outlier_ratio", &Params::outlier_ratio, "",
                 "a low cell is an outlier if a higher one nearby has so many times its support",
                 at_least(1.0)),
    };
  }

  [[nodiscard]] Result<void> validate() const {
    if (max_window < 3.0 * cell_size) {
      return fail_at({"max_window", "cell_size"},
                     "'max_window' must be at least three times 'cell_size'");
    }
    if (max_distance < initial_distance) {
      return fail_at({"max_distance", "initial_distance"},
                     "'max_distance' must not be smaller than 'initial_distance'");
    }
    if (schedule == Schedule::exponential && base < 1.1) {
      return fail_at({"base"}, "'base' must be at least 1.1 for the exponential schedule");
    }
    if (max_window / (2.0 * cell_size * base) > static_cast<double>(kMaxWindows) &&
        schedule == Schedule::linear) {
      return fail_at({"max_window", "base", "cell_size"},
                     "'max_window' takes more than " + std::to_string(kMaxWindows) +
                         " windows; choose a larger 'base' or 'cell_size'");
    }
    return {};
  }

  /// Eqs. 4-5 of Zhang et al.
  [[nodiscard]] std::vector<Window> windows() const {
    std::vector<Window> all;
    const double widest = std::floor((max_window / cell_size - 1.0) / 2.0 + 1e-9);
    for (double k = 1.0; all.size() <= kMaxWindows; k += 1.0) {
      const double radius =
          std::round(schedule == Schedule::linear ? k * base : std::pow(base, k - 1.0));
      if (radius > widest) break;
      const double before = all.empty() ? 0.0 : static_cast<double>(all.back().radius);
      if (radius <= before) continue;
      const double growth = all.empty() ? 0.0 : 2.0 * (radius - before) * cell_size;
      all.push_back({static_cast<std::size_t>(radius),
                     std::min(slope * growth + initial_distance, max_distance)});
    }
    // The first step is already too wide: the largest window is the only one.
    if (all.empty()) all.push_back({static_cast<std::size_t>(widest), initial_distance});
    return all;
  }
};

/// Stands for no point in a cell.
const Point kNoPoint = Point::Constant(kNothing);
bool is_point(const Point& p) noexcept { return p.z() != kNothing; }

/// How far from a cell the ground that it is compared with may be [cells].
std::int64_t reach_of_ground(const std::vector<Window>& windows) {
  return 2 * static_cast<std::int64_t>(windows.back().radius) + 1;
}

/// How far from a point something may be that decides about it [cells]: the nearest ground, the
/// neighbours that give its slope, the squares over them, and what decides about outliers there.
std::int64_t reach_of_filter(const std::vector<Window>& windows) {
  return reach_of_ground(windows) + kNeighbourhood +
         2 * static_cast<std::int64_t>(windows.back().radius) +
         std::int64_t{kOutlierPasses} * 2 * kNeighbourhood;
}

/// Of the lattice of multiples of the cell size.
struct Cell {
  std::int64_t x, y;
  friend bool operator==(const Cell&, const Cell&) = default;
};

Cell cell_of(const Point& p, double size) noexcept {
  return {static_cast<std::int64_t>(std::floor(p.x() / size)),
          static_cast<std::int64_t>(std::floor(p.y() / size))};
}

/// The raster of minima, and from it the ground.
class Raster {
 public:
  /// @param members  the points that the raster is made of; not empty
  /// Errors: `invalid_input` for a raster that is too large.
  [[nodiscard]] static Result<Raster> over(PointsView cloud, IndexList members,
                                           const Params& params) {
    Cell min = cell_of(cloud[members.front()], params.cell_size), max = min;
    for (const std::uint32_t k : members) {
      const Cell cell = cell_of(cloud[k], params.cell_size);
      min = {std::min(min.x, cell.x), std::min(min.y, cell.y)};
      max = {std::max(max.x, cell.x), std::max(max.y, cell.y)};
    }
    const auto width = static_cast<std::size_t>(max.x - min.x + 1);
    const auto height = static_cast<std::size_t>(max.y - min.y + 1);
    std::vector<Window> windows;
    for (Window window : params.windows()) {  // beyond the whole raster all windows see the same
      const bool all = window.radius >= std::max(width, height);
      window.radius = std::min(window.radius, std::max(width, height));
      windows.push_back(window);
      if (all) break;
    }
    const auto border = 2.0 * static_cast<double>(windows.back().radius);
    if ((static_cast<double>(width) + border) * (static_cast<double>(height) + border) >
        kMaxCells) {
      return fail(ErrorCode::invalid_input,
                  "windows of " + std::to_string(params.max_window) +
                      " m need too large a raster with cells of " +
                      std::to_string(params.cell_size) +
                      " m; choose a larger cell_size or a smaller max_window");
    }
    return Raster(cloud, std::move(members), params, std::move(windows), min, width, height);
  }

  /// Calls found(point) for the members that lie on the ground.
  template <class Found>
  void for_ground(const Found& found) {
    remove_low_outliers();
    const std::vector<std::uint8_t> is_ground = ground_cells();
    const std::vector<std::uint32_t> nearest_row = nearest_in_column(is_ground);
    std::vector<Plane> planes(lowest_.size());
    std::vector<std::uint8_t> known(lowest_.size(), 0);
    for (std::size_t i = 0; i < members_.size(); ++i) {
      const std::size_t cell = cell_of_member_[i];
      if (known[cell] == 0) {
        const auto from = is_ground[cell] != 0 ? cell : nearest(nearest_row, cell);
        if (from != kNowhere) planes[cell] = plane_of(from, is_ground);
        known[cell] = 1;
      }
      const Plane& plane = planes[cell];
      if (!is_point(plane.through)) continue;
      const Point offset = cloud_[members_[i]] - plane.through;
      const double above = offset.z() - plane.gradient.dot(offset.head<2>());
      if (std::abs(above) <= params_.initial_distance) found(members_[i]);
    }
  }

 private:
  struct Plane {
    Point through = kNoPoint;
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  };

  Raster(PointsView cloud, IndexList members, const Params& params, std::vector<Window> windows,
         const Cell& min, std::size_t width, std::size_t height)
      : cloud_(cloud),
        members_(std::move(members)),
        params_(params),
        windows_(std::move(windows)),
        ground_reach_(static_cast<double>(reach_of_ground(params.windows()))),
        width_(width),
        height_(height),
        cell_of_member_(members_.size()),
        lowest_(width * height, kNoPoint) {
    for (std::size_t i = 0; i < members_.size(); ++i) {
      const Cell cell = cell_of(cloud_[members_[i]], params_.cell_size);
      cell_of_member_[i] =
          static_cast<std::uint32_t>(static_cast<std::size_t>(cell.y - min.y) * width_ +
                                     static_cast<std::size_t>(cell.x - min.x));
      take_if_lower(i);
    }
  }

  void take_if_lower(std::size_t i) noexcept {
    Point& lowest = lowest_[cell_of_member_[i]];
    const Point& p = cloud_[members_[i]];
    // A total order of places, so that the order of the points does not matter.
    if (std::tuple(p.z(), p.x(), p.y()) < std::tuple(lowest.z(), lowest.x(), lowest.y())) {
      lowest = p;
    }
  }

  /// Calls visit(neighbour, distance [m]) for the cells around one that have a lowest point.
  template <class Visit>
  void for_neighbours(std::size_t cell, const Visit& visit) const {
    const auto x0 = static_cast<std::int64_t>(cell % width_);
    const auto y0 = static_cast<std::int64_t>(cell / width_);
    for (int dy = -kNeighbourhood; dy <= kNeighbourhood; ++dy) {
      const std::int64_t y = y0 + dy;
      if (y < 0 || y >= static_cast<std::int64_t>(height_)) continue;
      for (int dx = -kNeighbourhood; dx <= kNeighbourhood; ++dx) {
        const std::int64_t x = x0 + dx;
        if (x < 0 || x >= static_cast<std::int64_t>(width_)) continue;
        const std::size_t neighbour =
            static_cast<std::size_t>(y) * width_ + static_cast<std::size_t>(x);
        if (is_point(lowest_[neighbour])) visit(neighbour, params_.cell_size * std::hypot(dx, dy));
      }
    }
  }
  /// Reflections put points below the ground, and a minimum takes them all. The support of a cell
  /// is the number of cells around it at its height; a cell is an outlier if it lies below the
  /// surface, sloping as terrain may, of a cell nearby that has many times its support. Its lowest
  /// point is then the lowest one that is not below that surface, or none.
  void remove_low_outliers() {
    for (int pass = 0; pass < kOutlierPasses; ++pass) {
      const std::vector<std::uint8_t> support = supports();
      std::vector<std::pair<std::size_t, double>> outliers;  // cell, the surface above it [m]
      for (std::size_t cell = 0; cell < lowest_.size(); ++cell) {
        const double enough = params_.outlier_ratio * support[cell];
        if (support[cell] == 0 || enough >= kMostSupport) continue;
        std::uint8_t most = 0;
        double surface = 0.0;
        for_neighbours(cell, [&](std::size_t other, double distance) {
          const double least =
              lowest_[other].z() - params_.initial_distance - params_.slope * distance;
          if (least <= lowest_[cell].z()) return;
          if (support[other] > most || (support[other] == most && least < surface)) {
            most = support[other];
            surface = least;
          }
        });
        if (most > enough) outliers.emplace_back(cell, surface);
      }
      if (outliers.empty()) return;
      std::vector<double> floor(lowest_.size(), kNothing);
      for (const auto& [cell, surface] : outliers) {
        lowest_[cell] = kNoPoint;
        floor[cell] = surface;
      }
      for (std::size_t i = 0; i < members_.size(); ++i) {
        if (cloud_[members_[i]].z() >= floor[cell_of_member_[i]]) take_if_lower(i);
      }
    }
  }

  /// Cell by cell how many of the cells around it, itself included, are at its height; 0 for no
  /// cell.
  [[nodiscard]] std::vector<std::uint8_t> supports() const {
    const Heights heights = surface_of_minima();
    std::vector<std::uint8_t> support(lowest_.size(), 0);
    const auto step = [](std::size_t i, int d) {
      return static_cast<std::size_t>(static_cast<std::int64_t>(i) + d);
    };
    for (std::size_t y = 0; y < height_; ++y) {
      for (int dy = -kNeighbourhood; dy <= kNeighbourhood; ++dy) {
        if (step(y, dy) >= height_) continue;
        for (int dx = -kNeighbourhood; dx <= kNeighbourhood; ++dx) {
          const std::size_t begin = dx < 0 ? static_cast<std::size_t>(-dx) : 0;
          const std::size_t beyond = dx > 0 ? static_cast<std::size_t>(dx) : 0;
          for (std::size_t x = begin; x + beyond < width_; ++x) {
            const double here = heights.z[y * width_ + x];
            const double there = heights.z[step(y, dy) * width_ + step(x, dx)];
            const bool equal = std::abs(there - here) <= params_.initial_distance;
            support[y * width_ + x] = static_cast<std::uint8_t>(support[y * width_ + x] + equal);
          }
        }
      }
    }
    return support;
  }

  /// +infinity for no point.
  [[nodiscard]] Heights surface_of_minima() const {
    Heights heights{width_, height_, std::vector<double>(lowest_.size())};
    for (std::size_t cell = 0; cell < lowest_.size(); ++cell) {
      heights.z[cell] = lowest_[cell].z();
    }
    return heights;
  }

  /// The progressive filter: a cell that a window lowers by more than its threshold is an object.
  [[nodiscard]] std::vector<std::uint8_t> ground_cells() const {
    std::vector<std::uint8_t> is_ground(lowest_.size());
    Heights surface = surface_of_minima();
    for (std::size_t cell = 0; cell < lowest_.size(); ++cell) {
      is_ground[cell] = is_point(lowest_[cell]);
    }
    for (const Window& window : windows_) {
      Heights opened = opening(surface, window.radius);
      for (std::size_t cell = 0; cell < lowest_.size(); ++cell) {
        if (is_ground[cell] != 0 && surface.z[cell] - opened.z[cell] > window.threshold) {
          is_ground[cell] = 0;
        }
      }
      surface = std::move(opened);
    }
    return is_ground;
  }

  /// The row of the nearest ground cell of the same column (the lower one of two), or kNobody.
  [[nodiscard]] std::vector<std::uint32_t> nearest_in_column(
      const std::vector<std::uint8_t>& is_ground) const {
    std::vector<std::uint32_t> row(lowest_.size(), kNobody);
    for (std::size_t y = 0; y < height_; ++y) {
      for (std::size_t x = 0; x < width_; ++x) {
        const std::size_t cell = y * width_ + x;
        if (is_ground[cell] != 0) {
          row[cell] = static_cast<std::uint32_t>(y);
        } else if (y > 0) {
          row[cell] = row[cell - width_];
        }
      }
    }
    for (std::size_t y = height_ - 1; y-- > 0;) {
      for (std::size_t x = 0; x < width_; ++x) {
        const std::size_t cell = y * width_ + x;
        const std::uint32_t above = row[cell + width_], here = row[cell];
        if (above == kNobody || above <= y) continue;
        if (here == kNobody || above - y < y - here) row[cell] = above;
      }
    }
    return row;
  }

  /// The nearest ground cell in the plan, not farther than the reach of the largest window; else
  /// kNowhere.
  [[nodiscard]] std::size_t nearest(const std::vector<std::uint32_t>& nearest_row,
                                    std::size_t cell) const {
    const std::size_t x0 = cell % width_, y0 = cell / width_;
    double least = std::nextafter(ground_reach_ * ground_reach_, kNothing);
    std::size_t best = kNowhere;
    const auto consider = [&](std::size_t x, std::size_t step) {
      const std::uint32_t y = nearest_row[y0 * width_ + x];
      if (y == kNobody) return;
      const double dx = static_cast<double>(step);
      const double dy = static_cast<double>(y) - static_cast<double>(y0);
      const double distance = dx * dx + dy * dy;
      if (distance < least) {
        least = distance;
        best = y * width_ + x;
      }
    };
    for (std::size_t step = 0; step < width_; ++step) {
      if (static_cast<double>(step) * static_cast<double>(step) > least) break;
      if (step <= x0) consider(x0 - step, step);
      if (step > 0 && x0 + step < width_) consider(x0 + step, step);
    }
    return best;
  }

  /// Least squares through the lowest points of the ground cells around one, and exactly through
  /// its own; no steeper than terrain may be.
  [[nodiscard]] Plane plane_of(std::size_t cell, const std::vector<std::uint8_t>& is_ground) const {
    Plane plane{.through = lowest_[cell]};
    // A weak pull towards level ground where the points lie on a line.
    Eigen::Matrix2d a =
        Eigen::Matrix2d::Identity() * (1e-3 * params_.cell_size * params_.cell_size);
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for_neighbours(cell, [&](std::size_t other, double) {
      if (is_ground[other] == 0) return;
      const Point offset = lowest_[other] - plane.through;
      a += offset.head<2>() * offset.head<2>().transpose();
      b += offset.head<2>() * offset.z();
    });
    plane.gradient = a.inverse() * b;
    const double steepness = plane.gradient.norm();
    if (steepness > params_.slope) plane.gradient *= params_.slope / steepness;
    return plane;
  }

  PointsView cloud_;
  IndexList members_;
  Params params_;
  std::vector<Window> windows_;
  double ground_reach_;  // [cells]
  std::size_t width_, height_;
  std::vector<std::uint32_t> cell_of_member_;
  std::vector<Point> lowest_;  // by cell: its lowest point that is no outlier, or kNoPoint
};

/// The points by square tiles. Everything the filter does has a finite reach, so a tile and what is
/// around it give the same answer as the whole map, in memory that the map's extent does not matter
/// to.
class Tiles {
 public:
  Tiles(PointsView cloud, const Params& params)
      : cloud_(cloud), cell_size_(params.cell_size), reach_(reach_of_filter(params.windows())) {
    width_ = std::max(kTileWidth, 4 * reach_);
    const Bounds3 bounds = bounds_of(cloud);
    origin_ = cell_of(bounds.min, cell_size_);
    std::vector<std::size_t> sizes;
    for (const Point& p : cloud_) {
      const Cell tile = tile_of(cell_of(p, cell_size_));
      const auto [at, is_new] = number_.try_emplace(tile, tiles_.size());
      if (is_new) {
        tiles_.push_back(tile);
        sizes.push_back(0);
      }
      ++sizes[at->second];
    }
    points_.resize(tiles_.size());
    for (std::size_t tile = 0; tile < tiles_.size(); ++tile) points_[tile].reserve(sizes[tile]);
    for (std::uint32_t k = 0; k < cloud_.size(); ++k) {
      points_[number_.at(tile_of(cell_of(cloud_[k], cell_size_)))].push_back(k);
    }
  }

  [[nodiscard]] std::size_t size() const noexcept { return tiles_.size(); }
  [[nodiscard]] bool holds(std::size_t tile, std::uint32_t point) const noexcept {
    return tile_of(cell_of(cloud_[point], cell_size_)) == tiles_[tile];
  }
  /// The points of a tile, and those within reach of it.
  [[nodiscard]] IndexList with_surroundings(std::size_t tile) const {
    const Cell& t = tiles_[tile];
    const Cell min{origin_.x + t.x * width_ - reach_, origin_.y + t.y * width_ - reach_};
    const std::int64_t extent = width_ + 2 * reach_;
    IndexList members;
    members.reserve(points_[tile].size());
    for (std::int64_t y = t.y - 1; y <= t.y + 1; ++y) {
      for (std::int64_t x = t.x - 1; x <= t.x + 1; ++x) {
        const auto found = number_.find({x, y});
        if (found == number_.end()) continue;
        for (const std::uint32_t k : points_[found->second]) {
          const Cell cell = cell_of(cloud_[k], cell_size_);
          if (cell.x >= min.x && cell.x < min.x + extent && cell.y >= min.y &&
              cell.y < min.y + extent) {
            members.push_back(k);
          }
        }
      }
    }
    return members;
  }

 private:
  struct Hash {
    std::size_t operator()(const Cell& cell) const noexcept {
      const std::uint64_t key =
          (static_cast<std::uint64_t>(cell.y) << 32U) ^ static_cast<std::uint64_t>(cell.x);
      const std::uint64_t h = (key ^ (key >> 31U)) * 0x9e3779b97f4a7c15U;
      return h ^ (h >> 32U);
    }
  };
  [[nodiscard]] Cell tile_of(const Cell& cell) const noexcept {
    return {(cell.x - origin_.x) / width_, (cell.y - origin_.y) / width_};
  }

  PointsView cloud_;
  double cell_size_;
  std::int64_t reach_, width_;  // [cells]
  Cell origin_;                 // no point is in a lower one
  std::vector<Cell> tiles_;
  std::vector<IndexList> points_;  // by tile
  std::unordered_map<Cell, std::size_t, Hash> number_;
};

/// Progressive morphological filter (Zhang et al. 2003) on a raster of minima.
class Pmf final : public GroundFilter {
 public:
  using Params = pmf::Params;

  static Result<std::unique_ptr<GroundFilter>> create(const Params& params) {
    return std::make_unique<Pmf>(params);
  }
  explicit Pmf(const Params& params) : params_(params) {}

  [[nodiscard]] Result<IndexList> ground(PointsView cloud) const noexcept override {
    return guarded([&]() -> Result<IndexList> {
      VANTAGE_CHECK(check_points(cloud, "the cloud"));
      const Bounds3 bounds = bounds_of(cloud);
      const double farthest = std::max(bounds.min.head<2>().cwiseAbs().maxCoeff(),
                                       bounds.max.head<2>().cwiseAbs().maxCoeff());
      if (!(farthest / params_.cell_size < kMaxIndex)) {
        return fail(ErrorCode::invalid_input, "a coordinate of " + std::to_string(farthest) +
                                                  " m is too far from the origin for cells of " +
                                                  std::to_string(params_.cell_size) + " m");
      }
      const Tiles tiles(cloud, params_);
      std::vector<std::uint8_t> is_ground(cloud.size(), 0);
      std::vector<std::optional<Error>> errors(tiles.size());
      tbb::parallel_for(std::size_t{0}, tiles.size(), [&](std::size_t tile) {
        auto raster = Raster::over(cloud, tiles.with_surroundings(tile), params_);
        if (!raster) {
          errors[tile] = std::move(raster).error();
          return;
        }
        raster->for_ground([&](std::uint32_t k) {
          if (tiles.holds(tile, k)) is_ground[k] = 1;
        });
      });
      for (std::optional<Error>& error : errors) {
        if (error) return fail(*std::move(error));
      }
      IndexList indices;
      indices.reserve(static_cast<std::size_t>(std::count(is_ground.begin(), is_ground.end(), 1)));
      for (std::uint32_t k = 0; k < cloud.size(); ++k) {
        if (is_ground[k] != 0) indices.push_back(k);
      }
      return indices;
    });
  }

 private:
  Params params_;
};

}  // namespace
}  // namespace vantage::pmf

VANTAGE_PLUGIN(vantage::GroundFilter, vantage::pmf::Pmf, "pmf",
               "progressive morphological filter (Zhang et al. 2003)");
