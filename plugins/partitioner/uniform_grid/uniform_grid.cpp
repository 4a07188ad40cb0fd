#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <unordered_set>
#include <vector>

#include "vantage/plugin.hpp"

namespace {

using vantage::ErrorCode, vantage::fail, vantage::PointsView, vantage::Result;

constexpr double kMaxIndex = 0x1p31;
constexpr std::size_t kMaxRegions = 1'000'000;

/// The i and j of G_ij. Sorted by rows: first j (y), then i (x).
struct Cell {
  std::int64_t j, i;
  friend auto operator<=>(const Cell&, const Cell&) = default;
};

struct CellHash {
  std::size_t operator()(const Cell& cell) const noexcept {
    const std::uint64_t key =
        (static_cast<std::uint64_t>(cell.j) << 33U) ^ static_cast<std::uint64_t>(cell.i);
    const std::uint64_t h = (key ^ (key >> 31U)) * 0x9e3779b97f4a7c15U;
    return h ^ (h >> 32U);
  }
};

/// One axis of the grid. A cell's upper edge and its neighbour's lower edge are the same number.
class Axis {
 public:
  Axis(double origin, double width) noexcept : origin_(origin), width_(width) {}

  /// Where cell i begins. Rounded only once, so no compiler flag changes it.
  [[nodiscard]] double edge(std::int64_t i) const noexcept {
    return std::fma(static_cast<double>(i), width_, origin_);
  }
  /// The floor of Eq. 11, as a number that may be too large for an index.
  [[nodiscard]] double quotient(double x) const noexcept {
    return std::floor((x - origin_) / width_);
  }
  /// The i with edge(i) <= x < edge(i + 1). The quotient is rounded, so the edges decide.
  [[nodiscard]] std::int64_t cell_of(double x) const noexcept {
    auto i = static_cast<std::int64_t>(quotient(x));
    while (x < edge(i)) --i;
    while (x >= edge(i + 1)) ++i;
    return i;
  }

 private:
  double origin_, width_;
};

std::string number(double x) {
  char text[32];
  return std::string(text, std::to_chars(text, text + sizeof text, x).ptr);
}

std::string padded(std::int64_t index, std::size_t digits) {
  const std::string magnitude = std::to_string(index < 0 ? -index : index);
  return (index < 0 ? "-" : "+") + std::string(digits - std::min(digits, magnitude.size()), '0') +
         magnitude;
}

/// Square cells of one width; those that hold a point become regions (Eqs. 2-3).
class UniformGrid final : public vantage::Partitioner {
 public:
  struct Params {
    double cell_width{};                    // L of Eq. 2
    std::optional<Eigen::Vector2d> origin;  // lower left corner of cell (0, 0)

    static constexpr auto schema() {
      constexpr vantage::Source kSource{"Eq. 2", "Yagi et al. 2026, Sec. 2.1"};
      return std::tuple{
          vantage::required("cell_width", &Params::cell_width, "m", "grid width L",
                            vantage::positive, kSource),
          vantage::optional("origin", &Params::origin, "m",
                            "[x, y] of the corner between cells; the map's minimum if left out",
                            kSource),
      };
    }
  };

  static Result<std::unique_ptr<vantage::Partitioner>> create(const Params& params) {
    return std::make_unique<UniformGrid>(params);
  }
  explicit UniformGrid(const Params& params) : params_(params) {}

  [[nodiscard]] Result<vantage::Partition> partition(
      PointsView map, PointsView, const vantage::MapSurvey&) const noexcept override {
    return vantage::guarded([&] { return cells_of(map); });
  }

 private:
  [[nodiscard]] Result<vantage::Partition> cells_of(PointsView map) const {
    VANTAGE_CHECK(vantage::check_points(map, "the map"));
    const double width = params_.cell_width;
    const vantage::Bounds3 bounds = vantage::bounds_of(map);
    const Eigen::Vector2d origin = params_.origin.value_or(bounds.min.head<2>());
    const Axis x(origin.x(), width), y(origin.y(), width);

    const double farthest =
        std::max({std::abs(x.quotient(bounds.min.x())), std::abs(x.quotient(bounds.max.x())),
                  std::abs(y.quotient(bounds.min.y())), std::abs(y.quotient(bounds.max.y()))});
    const double largest =
        std::max({bounds.min.head<2>().cwiseAbs().maxCoeff(),
                  bounds.max.head<2>().cwiseAbs().maxCoeff(), origin.cwiseAbs().maxCoeff()});
    const double resolution = largest * std::numeric_limits<double>::epsilon();
    if (!(farthest < kMaxIndex) || !(width > 8.0 * resolution)) {
      return fail(ErrorCode::invalid_input,
                  "cell_width = " + number(width) + " m is too small for a map from (" +
                      number(bounds.min.x()) + ", " + number(bounds.min.y()) + ") to (" +
                      number(bounds.max.x()) + ", " + number(bounds.max.y()) +
                      ") m with the grid's origin at (" + number(origin.x()) + ", " +
                      number(origin.y()) + ") m: cell indices must stay below 2^31 and a cell " +
                      "must be wider than the rounding of coordinates");
    }

    std::unordered_set<Cell, CellHash> occupied;
    std::optional<Cell> last;  // neighbours in the file are mostly neighbours in the map
    for (const vantage::Point& p : map) {
      const Cell cell{y.cell_of(p.y()), x.cell_of(p.x())};
      if (last == cell) continue;
      last = cell;
      occupied.insert(cell);
      if (occupied.size() > kMaxRegions) {
        return fail(ErrorCode::invalid_input, "cell_width = " + number(width) +
                                                  " m cuts the map into more than " +
                                                  std::to_string(kMaxRegions) + " regions");
      }
    }
    std::vector<Cell> cells(occupied.begin(), occupied.end());
    std::sort(cells.begin(), cells.end());

    std::size_t digits = 3;
    for (const Cell& cell : cells) {
      digits = std::max({digits, std::to_string(std::abs(cell.i)).size(),
                         std::to_string(std::abs(cell.j)).size()});
    }
    std::vector<vantage::Region> regions;
    regions.reserve(cells.size());
    for (const Cell& cell : cells) {
      regions.push_back(
          {.label = "x" + padded(cell.i, digits) + "_y" + padded(cell.j, digits),
           .footprint = vantage::HalfOpenBox{{x.edge(cell.i), y.edge(cell.j)},
                                             {x.edge(cell.i + 1), y.edge(cell.j + 1)}},
           .height = {}});
    }
    return vantage::Partition::from(std::move(regions));
  }

  Params params_;
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, UniformGrid, "uniform_grid",
               "square cells of one width (Eqs. 2-3)");
