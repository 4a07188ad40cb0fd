#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/fields.hpp"
#include "common/minimum_raster.hpp"
#include "common/tiles.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace vantage::pmf {
namespace {

using terrain::Heights;
using terrain::is_point;
using terrain::kNoPoint;
using terrain::MinimumRaster;

constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr std::uint32_t kNobody = std::numeric_limits<std::uint32_t>::max();
constexpr int kMaxRadius = 10'000;  // [cells]
constexpr std::size_t kNowhere = std::numeric_limits<std::size_t>::max();

enum class Schedule : std::uint8_t { linear, exponential };
constexpr auto enum_names(Schedule) {
  return std::array{std::pair{std::string_view("linear"), Schedule::linear},
                    std::pair{std::string_view("exponential"), Schedule::exponential}};
}

struct Window {
  std::size_t radius;  ///< [cells]
  double threshold;    ///< dh of Zhang et al., Eq. 5 [m]
};

/// Progressive morphological filter (Zhang et al. 2003) on a raster of minima.
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
        terrain::cell_size_field(&Params::cell_size, kFilter),
        optional("max_window", &Params::max_window, "m",
                 "width of the largest window: wider than the widest object, narrower than hills",
                 positive, kWindows),
        optional("schedule", &Params::schedule, "",
                 "windows of 2 k base + 1 (linear) or 2 base^(k-1) + 1 cells (exponential)",
                 kWindows),
        optional("base", &Params::base, "cells", "how fast the windows grow", at_least(1.0),
                 kWindows),
        terrain::slope_field(&Params::slope, kFilter),
        optional("initial_distance", &Params::initial_distance, "m",
                 "how far from the ground's surface a point may be", non_negative, kFilter),
        optional("max_distance", &Params::max_distance, "m",
                 "a larger drop between two windows is never terrain", non_negative, kFilter),
        terrain::outlier_ratio_field(&Params::outlier_ratio),
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
    constexpr int kMostCells = 2 * kMaxRadius + 1;
    if (max_window > kMostCells * cell_size) {
      return fail_at({"max_window", "cell_size"}, "'max_window' is wider than " +
                                                      std::to_string(kMostCells) +
                                                      " cells; choose a larger 'cell_size'");
    }
    return {};
  }

  /// The windows and thresholds of Eqs. 4-5 of Zhang et al.
  [[nodiscard]] std::vector<Window> windows() const {
    std::vector<Window> all;
    const double widest = std::floor((max_window / cell_size - 1.0) / 2.0 + 1e-9);
    for (double k = 1.0;; k += 1.0) {
      const double radius =
          std::round(schedule == Schedule::linear ? k * base : std::pow(base, k - 1.0));
      if (radius > widest) break;
      const double before = all.empty() ? 0.0 : static_cast<double>(all.back().radius);
      if (radius <= before) continue;
      const double growth = all.empty() ? 0.0 : 2.0 * (radius - before) * cell_size;
      all.push_back({static_cast<std::size_t>(radius),
                     std::min(slope * growth + initial_distance, max_distance)});
    }
    // The first step is already too wide, so the largest window is the only one.
    if (all.empty()) all.push_back({static_cast<std::size_t>(widest), initial_distance});
    return all;
  }

  [[nodiscard]] Result<IndexList> ground(PointsView cloud) const;
  [[nodiscard]] double reach() const;
};

/// How far the ground that a cell is compared with may be from the cell [cells].
std::int64_t reach_of_ground(const std::vector<Window>& windows) {
  return 2 * static_cast<std::int64_t>(windows.back().radius) + 1;
}

/// Everything that decides about a point is at most this far away [cells]: the nearest ground, the
/// neighbours that give its slope, the squares over them, and what decides about outliers there.
std::int64_t reach_of_filter(const std::vector<Window>& windows) {
  return reach_of_ground(windows) + MinimumRaster::kNeighbourhood +
         2 * static_cast<std::int64_t>(windows.back().radius) +
         std::int64_t{MinimumRaster::kOutlierReach};
}

/// The ground of one raster.
class Filter {
 public:
  Filter(MinimumRaster& raster, const Params& params)
      : raster_(raster),
        params_(params),
        ground_reach_(static_cast<double>(reach_of_ground(params.windows()))),
        width_(raster.width()),
        height_(raster.height()) {}

  void run(const terrain::Found& found) {
    raster_.remove_low_outliers({.height = params_.initial_distance,
                                 .slope = params_.slope,
                                 .ratio = params_.outlier_ratio});
    const std::vector<std::uint8_t> is_ground = ground_cells();
    const std::vector<std::uint32_t> nearest_row = nearest_in_column(is_ground);
    std::vector<std::uint8_t> is_wanted(raster_.size(), 0);
    raster_.for_members(
        [&](const Point&, std::uint32_t, std::size_t cell) { is_wanted[cell] = 1; });
    std::vector<Plane> planes(raster_.size());
    for (std::size_t cell = 0; cell < planes.size(); ++cell) {
      if (is_wanted[cell] == 0) continue;
      const auto from = is_ground[cell] != 0 ? cell : nearest(nearest_row, cell);
      if (from != kNowhere) planes[cell] = plane_of(from, is_ground);
    }
    raster_.for_members([&](const Point& p, std::uint32_t k, std::size_t cell) {
      const Plane& plane = planes[cell];
      if (!is_point(plane.through)) return;
      const Point offset = p - plane.through;
      const double above = offset.z() - plane.gradient.dot(offset.head<2>());
      if (std::abs(above) <= params_.initial_distance) found(k);
    });
  }

 private:
  struct Plane {
    Point through = kNoPoint;
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
  };

  /// Removes cells that were lowered by more than a threshold.
  static void remove_objects(std::span<const double> before, std::span<const double> after,
                             double threshold, std::span<std::uint8_t> is_ground) {
    for (std::size_t cell = 0; cell < is_ground.size(); ++cell) {
      const bool is_object = before[cell] - after[cell] > threshold;
      is_ground[cell] = static_cast<std::uint8_t>(is_ground[cell] & (is_object ? 0U : 1U));
    }
  }

  /// The progressive filter: a cell that a window lowers by more than the window's threshold is an
  /// object.
  [[nodiscard]] std::vector<std::uint8_t> ground_cells() const {
    std::vector<std::uint8_t> is_ground(raster_.size());
    Heights surface = raster_.heights();
    for (std::size_t cell = 0; cell < raster_.size(); ++cell) {
      is_ground[cell] = is_point(raster_.lowest(cell));
    }
    const std::size_t whole = std::max(width_, height_);
    for (const Window& window : params_.windows()) {
      Heights opened = terrain::opening(surface, std::min(window.radius, whole));
      remove_objects(surface.z, opened.z, window.threshold, is_ground);
      if (window.radius >= whole) break;  // all larger windows see the same
      surface = std::move(opened);
    }
    return is_ground;
  }

  /// The row of the nearest ground cell in the same column (the lower one of two equally near), or
  /// kNobody.
  [[nodiscard]] std::vector<std::uint32_t> nearest_in_column(
      const std::vector<std::uint8_t>& is_ground) const {
    std::vector<std::uint32_t> row(raster_.size(), kNobody);
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

  /// The nearest ground cell in plan view, within the reach of the largest window; otherwise
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

  /// A least-squares plane through the lowest points of the ground cells around a cell, and exactly
  /// through the cell's own point; no steeper than terrain may be.
  [[nodiscard]] Plane plane_of(std::size_t cell, const std::vector<std::uint8_t>& is_ground) const {
    Plane plane{.through = raster_.lowest(cell)};
    // A weak pull towards level ground, for points that lie on a line.
    Eigen::Matrix2d a =
        Eigen::Matrix2d::Identity() * (1e-3 * params_.cell_size * params_.cell_size);
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    raster_.for_neighbours(cell, [&](std::size_t other, double) {
      if (is_ground[other] == 0) return;
      const Point offset = raster_.lowest(other) - plane.through;
      a += offset.head<2>() * offset.head<2>().transpose();
      b += offset.head<2>() * offset.z();
    });
    plane.gradient = a.inverse() * b;
    const double steepness = plane.gradient.norm();
    if (steepness > params_.slope) plane.gradient *= params_.slope / steepness;
    return plane;
  }

  MinimumRaster& raster_;
  const Params& params_;
  double ground_reach_;  // [cells]
  std::size_t width_, height_;
};

double Params::reach() const { return terrain::metres_of(reach_of_filter(windows()), cell_size); }

Result<IndexList> Params::ground(PointsView cloud) const {
  const std::vector<Window> all = windows();
  return terrain::ground_by_tiles(cloud,
                                  {.cell_size = cell_size,
                                   .window = {.radius = all.back().radius, .key = "max_window"},
                                   .reach = reach_of_filter(all)},
                                  [&](MinimumRaster& raster, const terrain::Found& found) {
                                    Filter(raster, *this).run(found);
                                  });
}

}  // namespace
}  // namespace vantage::pmf

VANTAGE_PLUGIN(vantage::GroundFilter, vantage::GroundFilterOf<vantage::pmf::Params>, "pmf",
               "progressive morphological filter (Zhang et al. 2003)");
