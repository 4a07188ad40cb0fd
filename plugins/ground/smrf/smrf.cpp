#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/fields.hpp"
#include "common/minimum_raster.hpp"
#include "common/tiles.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace vantage::smrf {
namespace {

using terrain::Heights;
using terrain::MinimumRaster;

constexpr double kNothing = std::numeric_limits<double>::infinity();
constexpr double kMaxRadius = 10'000;  // [cells]

/// Simple morphological filter (Pingel et al. 2013).
struct Params {
  double cell_size = 1.0;
  double max_radius = 18.0;
  double slope = 0.2;
  double elevation_threshold = 0.4;
  double elevation_scale = 1.25;
  double outlier_ratio = 3.0;

  static constexpr auto schema() {
    constexpr Source kFilter{{}, "Pingel et al. 2013"};
    return std::tuple{
        terrain::cell_size_field(&Params::cell_size, kFilter),
        optional("max_radius", &Params::max_radius, "m",
                 "half the width of the largest window: wider than the widest object", positive,
                 kFilter),
        terrain::slope_field(&Params::slope, kFilter),
        optional("elevation_threshold", &Params::elevation_threshold, "m",
                 "how far from level ground a point may be", non_negative, kFilter),
        optional("elevation_scale", &Params::elevation_scale, "m",
                 "additional distance on sloping ground: this times its rise over run",
                 non_negative, kFilter),
        terrain::outlier_ratio_field(&Params::outlier_ratio),
    };
  }

  [[nodiscard]] Result<void> validate() const {
    if (max_radius < cell_size) {
      return fail_at({"max_radius", "cell_size"},
                     "'max_radius' must not be smaller than 'cell_size'");
    }
    if (max_radius > kMaxRadius * cell_size) {
      return fail_at({"max_radius", "cell_size"},
                     "'max_radius' takes more than 10000 windows; choose a larger 'cell_size'");
    }
    return {};
  }

  /// The radius of the largest window [cells].
  [[nodiscard]] std::size_t radius() const {
    return static_cast<std::size_t>(std::ceil(max_radius / cell_size - 1e-9));
  }

  [[nodiscard]] Result<IndexList> ground(PointsView cloud) const;
  [[nodiscard]] double reach() const;
};

/// How far ground may be from the cell that it fills [cells]: the largest window is wider than any
/// object that it removes.
std::size_t reach_of_filling(std::size_t radius) { return 2 * radius + 1; }

/// Everything that decides about a point is at most this far away [cells]: the ground that fills
/// the cells that give its slope, the squares over it, and what decides about outliers there.
std::int64_t reach_of_filter(std::size_t radius) {
  return 1 + static_cast<std::int64_t>(reach_of_filling(radius) + 2 * radius) +
         std::int64_t{MinimumRaster::kOutlierReach};
}

/// The progressive filter: a cell is an object if a window lowers it by more than terrain can drop
/// over the window's radius.
/// @return  the heights of the cells that are not objects; +infinity elsewhere
Heights without_objects(const MinimumRaster& raster, const Params& params) {
  Heights ground = raster.heights();
  Heights surface = raster.heights();
  const std::size_t whole = std::max(raster.width(), raster.height());
  for (std::size_t radius = 1; radius <= std::min(params.radius(), whole); ++radius) {
    Heights opened = terrain::opening(surface, radius);
    const double threshold = params.slope * params.cell_size * static_cast<double>(radius);
    for (std::size_t cell = 0; cell < ground.z.size(); ++cell) {
      if (ground.z[cell] != kNothing && surface.z[cell] - opened.z[cell] > threshold) {
        ground.z[cell] = kNothing;
      }
    }
    surface = std::move(opened);
  }
  return ground;
}

struct WeightedSum {
  double of_heights = 0.0, of_weights = 0.0;
};

/// Adds the nearest height against the direction (dx, dy) to each cell without a height, weighted
/// by inverse distance, if there is one within `reach` cells.
void add_nearest(const Heights& ground, int dx, int dy, std::size_t reach,
                 std::vector<WeightedSum>& sums) {
  struct Nearest {
    double z = kNothing;
    std::size_t steps = 0;
  };
  const double step = std::hypot(dx, dy);
  // One cell of margin on both sides, so that every cell has a cell before it.
  std::array<std::vector<Nearest>, 2> rows;
  for (std::vector<Nearest>& row : rows) row.resize(ground.width + 2);
  for (std::size_t j = 0; j < ground.height; ++j) {
    const std::size_t y = dy < 0 ? ground.height - 1 - j : j;
    std::vector<Nearest>& here = rows[j % 2];
    const std::vector<Nearest>& from = dy == 0 ? here : rows[(j + 1) % 2];
    std::ranges::fill(here, Nearest{});
    for (std::size_t i = 0; i < ground.width; ++i) {
      const std::size_t x = dx < 0 ? ground.width - 1 - i : i, cell = y * ground.width + x;
      if (ground.z[cell] != kNothing) {
        here[x + 1] = {ground.z[cell], 0};
        continue;
      }
      const Nearest last = from[static_cast<std::size_t>(static_cast<std::int64_t>(x + 1) - dx)];
      if (last.z == kNothing || last.steps == reach) continue;
      here[x + 1] = {last.z, last.steps + 1};
      const double weight = 1.0 / (step * static_cast<double>(last.steps + 1));
      sums[cell].of_heights += weight * last.z;
      sums[cell].of_weights += weight;
    }
  }
}

/// Gives a cell without a height the mean of the nearest heights along the eight directions of the
/// raster, weighted by inverse distance. The cell stays empty if there is none within `reach`
/// cells.
void fill(Heights& ground, std::size_t reach) {
  std::vector<WeightedSum> sums(ground.z.size());
  for (const int dy : {-1, 0, 1}) {
    for (const int dx : {-1, 0, 1}) {
      if (dx != 0 || dy != 0) add_nearest(ground, dx, dy, reach, sums);
    }
  }
  for (std::size_t cell = 0; cell < sums.size(); ++cell) {
    const WeightedSum& sum = sums[cell];
    if (sum.of_weights > 0.0) ground.z[cell] = sum.of_heights / sum.of_weights;
  }
}

/// Rise over run along an axis, from the cells on both sides, or from the only one that has a
/// height.
double slope_between(double before, double here, double after, double cell_size) {
  if (before != kNothing && after != kNothing) return (after - before) / (2.0 * cell_size);
  if (after != kNothing) return (after - here) / cell_size;
  if (before != kNothing) return (here - before) / cell_size;
  return 0.0;
}

Eigen::Vector2d gradient_at(const Heights& surface, std::size_t cell, double cell_size) {
  const std::size_t x = cell % surface.width, y = cell / surface.width;
  const auto z = [&](bool inside, std::size_t other) {
    return inside ? surface.z[other] : kNothing;
  };
  const double here = surface.z[cell];
  return {slope_between(z(x > 0, cell - 1), here, z(x + 1 < surface.width, cell + 1), cell_size),
          slope_between(z(y > 0, cell - surface.width), here,
                        z(y + 1 < surface.height, cell + surface.width), cell_size)};
}

/// A point is ground if it is near the plane of its cell. The plane passes through the cell's
/// lowest point, or through the cell's centre if the cell was filled.
void find_ground(MinimumRaster& raster, const Params& params, const terrain::Found& found) {
  raster.remove_low_outliers(
      {.height = params.elevation_threshold, .slope = params.slope, .ratio = params.outlier_ratio});
  const Heights ground = without_objects(raster, params);
  Heights surface = ground;
  fill(surface, reach_of_filling(params.radius()));
  raster.for_members([&](const Point& p, std::uint32_t k, std::size_t cell) {
    if (surface.z[cell] == kNothing) return;
    const Eigen::Vector2d gradient = gradient_at(surface, cell, params.cell_size);
    const bool is_filled = ground.z[cell] == kNothing;
    const Eigen::Vector2d through =
        is_filled ? raster.centre(cell) : Eigen::Vector2d(raster.lowest(cell).head<2>());
    const double above = p.z() - surface.z[cell] - gradient.dot(p.head<2>() - through);
    if (std::abs(above) <= params.elevation_threshold + params.elevation_scale * gradient.norm()) {
      found(k);
    }
  });
}

double Params::reach() const { return terrain::metres_of(reach_of_filter(radius()), cell_size); }

Result<IndexList> Params::ground(PointsView cloud) const {
  return terrain::ground_by_tiles(cloud,
                                  {.cell_size = cell_size,
                                   .window = {.radius = radius(), .key = "max_radius"},
                                   .reach = reach_of_filter(radius())},
                                  [&](MinimumRaster& raster, const terrain::Found& found) {
                                    find_ground(raster, *this, found);
                                  });
}

}  // namespace
}  // namespace vantage::smrf

VANTAGE_PLUGIN(vantage::GroundFilter, vantage::GroundFilterOf<vantage::smrf::Params>, "smrf",
               "simple morphological filter (Pingel et al. 2013)");
