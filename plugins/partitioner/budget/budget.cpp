#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vantage/plugin.hpp"

namespace {

using Eigen::Vector2d;
using vantage::ErrorCode, vantage::fail, vantage::HalfOpenBox, vantage::PointsView, vantage::Result;

constexpr std::size_t kMaxRegions = 1'000'000;
constexpr std::size_t kMaxLabel = 200;  // of a Region; a longer path of cuts ends in a corner
constexpr auto kExact = std::numeric_limits<std::uint64_t>::max();

/// A part of the plan and its points. The order of the points has no meaning.
struct Cell {
  HalfOpenBox box;
  std::span<std::uint32_t> points;
  std::string label;

  [[nodiscard]] vantage::Region region() const { return {label, box, {}}; }
};

struct Pieces {
  Cell below, above;
};

/// Both ends included.
struct TightBox {
  Vector2d min, max;
};

/// The map in plan view. -0 becomes 0: both are the same place, so a cut there must be one number.
class Plan {
 public:
  explicit Plan(PointsView map) noexcept : map_(map) {}
  [[nodiscard]] Vector2d operator[](std::uint32_t k) const noexcept {
    return {map_[k].x() + 0.0, map_[k].y() + 0.0};
  }
  [[nodiscard]] double along(Eigen::Index axis, std::uint32_t k) const noexcept {
    return map_[k][axis] + 0.0;
  }

  [[nodiscard]] TightBox tight_box_of(std::span<const std::uint32_t> points) const {
    TightBox box{(*this)[points.front()], (*this)[points.front()]};
    for (const std::uint32_t k : points) {
      const Vector2d p = (*this)[k];
      box.min = box.min.cwiseMin(p);
      box.max = box.max.cwiseMax(p);
    }
    return box;
  }

 private:
  PointsView map_;
};

/// The box of the whole map. It is half-open, so it ends one step beyond the greatest point.
HalfOpenBox box_of(const TightBox& tight) {
  return {tight.min, tight.max.unaryExpr([](double x) {
            return std::nextafter(x, std::numeric_limits<double>::infinity());
          })};
}

/// The coordinate of a cut between `min` and `max` > `min`. It is above `min`, so that neither side
/// is empty.
double middle_of(double min, double max) {
  const double middle = 0.5 * min + 0.5 * max;
  return min < middle && middle <= max ? middle : max;
}

std::string metres(double x) {
  char text[400];  // the longest double has 309 digits before the point
  std::snprintf(text, sizeof text, "%.2f", x);
  return text;
}
std::string place(const Vector2d& p) { return "(" + metres(p.x()) + ", " + metres(p.y()) + ")"; }

/// Cuts regions in half until the observable points of each are within the budget.
class Budget final : public vantage::Partitioner {
 public:
  struct Params {
    std::uint64_t max_points{};
    double min_width = 2.0;

    static constexpr auto schema() {
      return std::tuple{
          vantage::required(
              "max_points", &Params::max_points, "",
              "points that the observable map of a region may hold (|V_ij| of Eq. 10)",
              vantage::at_least(1)),
          vantage::optional("min_width", &Params::min_width, "m",
                            "no region is cut into pieces narrower than this",
                            vantage::non_negative)};
    }
  };

  static Result<std::unique_ptr<vantage::Partitioner>> create(const Params& params) {
    return std::make_unique<Budget>(params);
  }
  explicit Budget(const Params& params) : params_(params) {}

  [[nodiscard]] Result<vantage::Partition> partition(
      PointsView map, PointsView, const vantage::MapSurvey& survey) const noexcept override {
    return vantage::guarded([&] { return regions_of(map, survey); });
  }

 private:
  [[nodiscard]] Result<vantage::Partition> regions_of(PointsView map,
                                                      const vantage::MapSurvey& survey) const {
    VANTAGE_CHECK(vantage::check_points(map, "the map"));
    const Plan plan(map);
    std::vector<std::uint32_t> points(map.size());
    std::iota(points.begin(), points.end(), 0U);
    std::vector<Cell> open{{box_of(plan.tight_box_of(points)), points, "cell"}};  // the next last
    std::vector<vantage::Region> regions;
    while (!open.empty()) {
      const Cell cell = std::move(open.back());
      open.pop_back();
      VANTAGE_TRY(const auto seen, survey.observable_points(cell.region(), params_.max_points));
      if (seen > params_.max_points) {
        auto pieces = cut(plan, cell);
        if (!pieces) return over_budget(cell, survey);
        open.push_back(std::move(pieces->above));
        open.push_back(std::move(pieces->below));
        continue;
      }
      if (regions.size() == kMaxRegions) {
        return fail(ErrorCode::invalid_input, "max_points = " + std::to_string(params_.max_points) +
                                                  " cuts the map into more than " +
                                                  std::to_string(kMaxRegions) + " regions");
      }
      regions.push_back(cell.region());
    }
    return vantage::Partition::from(std::move(regions));
  }

  /// Cuts in the middle of the points' longer side, or of the other side if that is impossible.
  [[nodiscard]] std::optional<Pieces> cut(const Plan& plan, const Cell& cell) const {
    const TightBox tight = plan.tight_box_of(cell.points);
    const Vector2d size = tight.max - tight.min;
    const Eigen::Index longer = size.x() >= size.y() ? 0 : 1;
    auto pieces = cut_across(plan, cell, tight, longer);
    return pieces ? std::move(pieces) : cut_across(plan, cell, tight, 1 - longer);
  }

  [[nodiscard]] std::optional<Pieces> cut_across(const Plan& plan, const Cell& cell,
                                                 const TightBox& tight, Eigen::Index axis) const {
    const double first = cell.box.min[axis] + params_.min_width;
    const double last = cell.box.max[axis] - params_.min_width;
    if (first > last || tight.min[axis] == tight.max[axis]) return std::nullopt;
    const double at = std::clamp(middle_of(tight.min[axis], tight.max[axis]), first, last);
    if (at <= tight.min[axis] || at > tight.max[axis]) return std::nullopt;

    const auto above = std::partition(cell.points.begin(), cell.points.end(),
                                      [&](std::uint32_t k) { return plan.along(axis, k) < at; });
    const auto count = static_cast<std::size_t>(above - cell.points.begin());
    const std::string path = cell.label == "cell" ? "cell_" : cell.label;
    if (path.size() >= kMaxLabel) return std::nullopt;
    Pieces pieces{{cell.box, cell.points.first(count), path + "0"},
                  {cell.box, cell.points.subspan(count), path + "1"}};
    pieces.below.box.max[axis] = at;
    pieces.above.box.min[axis] = at;
    return pieces;
  }

  [[nodiscard]] tl::unexpected<vantage::Error> over_budget(const Cell& cell,
                                                           const vantage::MapSurvey& survey) const {
    auto seen = survey.observable_points(cell.region(), kExact);
    if (!seen) return fail(std::move(seen).error());
    return fail(ErrorCode::invalid_input,
                "the region from " + place(cell.box.min) + " to " + place(cell.box.max) +
                    " m shows " + std::to_string(*seen) +
                    " points, more than max_points = " + std::to_string(params_.max_points) +
                    ", and cannot be cut into two that hold points and are min_width = " +
                    metres(params_.min_width) +
                    " m wide: raise max_points or lower visibility.max_range");
  }

  Params params_;
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, Budget, "budget",
               "regions whose observable maps hold at most so many points");
