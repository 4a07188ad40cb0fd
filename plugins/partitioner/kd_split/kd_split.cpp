#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/plugin.hpp"

namespace {

using Eigen::Vector2d;
using vantage::ErrorCode, vantage::fail, vantage::HalfOpenBox, vantage::PointsView, vantage::Result;

constexpr std::size_t kMaxRegions = 1'000'000;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A part of the plan and its points. The order of the points has no meaning.
struct Cell {
  HalfOpenBox box;
  std::span<Vector2d> points;
  std::string label;
};

struct Pieces {
  Cell below, above;
};

/// The points in plan view. -0 becomes 0: both are the same place, so a cut there must be one
/// number.
std::vector<Vector2d> plan_of(PointsView map) {
  std::vector<Vector2d> plan;
  plan.reserve(map.size());
  for (const vantage::Point& p : map) plan.emplace_back(p.x() + 0.0, p.y() + 0.0);
  return plan;
}

/// The tightest box that owns all points. It is half-open, so it ends one step beyond the greatest.
HalfOpenBox box_of(std::span<const Vector2d> points) {
  HalfOpenBox box{points.front(), points.front()};
  for (const Vector2d& p : points) {
    box.min = box.min.cwiseMin(p);
    box.max = box.max.cwiseMax(p);
  }
  box.max = box.max.unaryExpr([](double x) { return std::nextafter(x, kInfinity); });
  return box;
}

/// The coordinate of a point that has points below it and divides the points most evenly; none if
/// all coordinates are equal. Reorders the points.
std::optional<double> median_cut(std::span<Vector2d> points, Eigen::Index axis) {
  const auto middle = points.begin() + static_cast<std::ptrdiff_t>(points.size() / 2);
  std::nth_element(points.begin(), middle, points.end(),
                   [&](const Vector2d& a, const Vector2d& b) { return a[axis] < b[axis]; });
  const double median = (*middle)[axis];
  // Equal coordinates stay together, so the cut is at the median or at the next greater coordinate.
  const auto below = static_cast<std::size_t>(
      std::count_if(points.begin(), middle, [&](const Vector2d& p) { return p[axis] < median; }));
  double next = kInfinity;
  std::size_t below_next = points.size() / 2;
  for (auto p = middle; p != points.end(); ++p) {
    if ((*p)[axis] > median) {
      next = std::min(next, (*p)[axis]);
    } else {
      ++below_next;
    }
  }
  const bool at_median = below > 0, at_next = next < kInfinity;
  if (!at_median && !at_next) return std::nullopt;
  if (!at_median) return next;
  if (!at_next) return median;
  return points.size() - 2 * below <= 2 * below_next - points.size() ? median : next;
}

/// Median cuts until no cell holds more points than allowed.
class KdSplit final : public vantage::Partitioner {
 public:
  struct Params {
    std::uint64_t max_points{};
    double min_width = 0.0;

    static constexpr auto schema() {
      return std::tuple{
          vantage::required("max_points", &Params::max_points, "",
                            "a cell with more points of the map is cut", vantage::at_least(1)),
          vantage::optional("min_width", &Params::min_width, "m",
                            "no cell is cut into pieces narrower than this",
                            vantage::non_negative)};
    }
  };

  static Result<std::unique_ptr<vantage::Partitioner>> create(const Params& params) {
    return std::make_unique<KdSplit>(params);
  }
  explicit KdSplit(const Params& params) : params_(params) {}

  [[nodiscard]] Result<vantage::Partition> partition(
      PointsView map, PointsView, const vantage::MapSurvey&) const noexcept override {
    return vantage::guarded([&] { return cells_of(map); });
  }

 private:
  [[nodiscard]] Result<vantage::Partition> cells_of(PointsView map) const {
    VANTAGE_CHECK(vantage::check_points(map, "the map"));
    std::vector<Vector2d> plan = plan_of(map);
    std::vector<Cell> open{{box_of(plan), plan, "cell"}};  // the next one is last
    std::vector<vantage::Region> regions;
    while (!open.empty()) {
      Cell cell = std::move(open.back());
      open.pop_back();
      if (auto pieces = cut(cell)) {
        open.push_back(std::move(pieces->above));
        open.push_back(std::move(pieces->below));
        continue;
      }
      if (regions.size() == kMaxRegions) {
        return fail(ErrorCode::invalid_input, "max_points = " + std::to_string(params_.max_points) +
                                                  " cuts the map into more than " +
                                                  std::to_string(kMaxRegions) + " regions");
      }
      regions.push_back(
          {.label = std::move(cell.label), .footprint = std::move(cell.box), .height = {}});
    }
    return vantage::Partition::from(std::move(regions));
  }

  /// No cut if the cell is small enough or cannot be cut.
  [[nodiscard]] std::optional<Pieces> cut(const Cell& cell) const {
    if (cell.points.size() <= params_.max_points) return std::nullopt;
    const Vector2d size = cell.box.max - cell.box.min;
    const Eigen::Index longer = size.x() >= size.y() ? 0 : 1;
    auto pieces = cut_across(cell, longer);
    return pieces ? std::move(pieces) : cut_across(cell, 1 - longer);
  }

  [[nodiscard]] std::optional<Pieces> cut_across(const Cell& cell, Eigen::Index axis) const {
    const double first = cell.box.min[axis] + params_.min_width;
    const double last = cell.box.max[axis] - params_.min_width;
    if (first > last) return std::nullopt;
    const std::optional<double> median = median_cut(cell.points, axis);
    if (!median) return std::nullopt;
    const double at = std::clamp(*median, first, last);
    const auto above = std::partition(cell.points.begin(), cell.points.end(),
                                      [&](const Vector2d& p) { return p[axis] < at; });
    const auto count = static_cast<std::size_t>(above - cell.points.begin());
    if (count == 0 || count == cell.points.size()) return std::nullopt;
    const std::string path = cell.label == "cell" ? "cell_" : cell.label;
    Pieces pieces{{cell.box, cell.points.first(count), path + "0"},
                  {cell.box, cell.points.subspan(count), path + "1"}};
    pieces.below.box.max[axis] = at;
    pieces.above.box.min[axis] = at;
    return pieces;
  }

  Params params_;
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, KdSplit, "kd_split",
               "median cuts until a cell holds few enough points");
