#include "vantage/kit/plan_cuts.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "vantage/kit/regions.hpp"
#include "vantage/plugin.hpp"

namespace vantage {
namespace plan_cuts {

using Eigen::Vector2d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::size_t kBins = std::size_t{1} << 16U;

/// A point in plan. -0 becomes 0: they are one place, so a cut there must be one number.
Vector2d plan_of(const Point& p) { return {p.x() + 0.0, p.y() + 0.0}; }

/// Calls a function for each point in a box.
template <class See>
class InBox final : public MapVisitor {
 public:
  InBox(const HalfOpenBox& box, const See& see) : box_(box), see_(see) {}
  [[nodiscard]] Result<void> see(PointsView points) noexcept override {
    return guarded([&]() -> Result<void> {
      for (const Point& p : points) {
        const Vector2d xy = plan_of(p);
        const bool inside = box_.min.x() <= xy.x() && xy.x() < box_.max.x() &&
                            box_.min.y() <= xy.y() && xy.y() < box_.max.y();
        if (inside) see_(xy);
      }
      return {};
    });
  }

 private:
  const HalfOpenBox& box_;
  const See& see_;
};

/// Coordinates in [min, max], and what lies beside them.
struct Coordinates {
  double min = 0.0, max = 0.0;
  std::uint64_t count = 0;
  std::uint64_t below = 0;  ///< how many are less than `min`
  double next = kInfinity;  ///< the least that is greater than `max`
};

/// Counts coordinates in bins of equal widths.
class Histogram {
 public:
  explicit Histogram(const Coordinates& all)
      : min_(all.min),
        scale_(std::isinf(all.max - all.min) ? 0.5 : 1.0),
        width_(scale_ * all.max - scale_ * all.min),
        bins_(kBins) {}

  void add(double x) {
    // Rises with x; the least coordinate comes to the first bin, the greatest to the last.
    const double at = (scale_ * x - scale_ * min_) / width_ * static_cast<double>(kBins);
    Bin& bin = bins_[std::min(static_cast<std::size_t>(at), kBins - 1)];
    ++bin.count;
    bin.min = std::min(bin.min, x);
    bin.max = std::max(bin.max, x);
  }

  /// Those in the bin with the coordinate of a rank, counted from 0 over `all`.
  [[nodiscard]] Coordinates around(std::uint64_t rank, const Coordinates& all) const {
    Coordinates found{.below = all.below, .next = all.next};
    std::size_t b = 0;
    for (; found.below + bins_[b].count <= rank; ++b) found.below += bins_[b].count;
    found.min = bins_[b].min;
    found.max = bins_[b].max;
    found.count = bins_[b].count;
    while (++b < kBins) {
      if (bins_[b].count == 0) continue;
      found.next = bins_[b].min;
      break;
    }
    return found;
  }

 private:
  struct Bin {
    std::uint64_t count = 0;
    double min = kInfinity, max = -kInfinity;
  };
  double min_, scale_, width_;
  std::vector<Bin> bins_;
};

/// The coordinates less than the one in the middle, those up to it, and the next greater one.
struct Middle {
  double median = 0.0;
  std::uint64_t below = 0, up_to = 0;
  double next = kInfinity;
};

Middle middle_of(std::span<double> some, std::uint64_t rank, const Coordinates& around) {
  const auto middle = some.begin() + static_cast<std::ptrdiff_t>(rank - around.below);
  std::nth_element(some.begin(), middle, some.end());
  Middle found{.median = *middle, .below = around.below, .up_to = rank, .next = around.next};
  found.below += static_cast<std::uint64_t>(
      std::count_if(some.begin(), middle, [&](double x) { return x < found.median; }));
  for (auto x = middle; x != some.end(); ++x) {
    if (*x > found.median) {
      found.next = std::min(found.next, *x);
    } else {
      ++found.up_to;
    }
  }
  return found;
}

/// Equal coordinates stay together, so a cut is at the median or at the next greater coordinate.
std::optional<double> most_even(const Middle& middle, std::uint64_t points) {
  const bool at_median = middle.below > 0, at_next = middle.next < kInfinity;
  if (!at_median && !at_next) return std::nullopt;
  if (!at_median) return middle.next;
  if (!at_next) return middle.median;
  return points - 2 * middle.below <= 2 * middle.up_to - points ? middle.median : middle.next;
}

void add(PlanPart& part, const Vector2d& xy) {
  ++part.points;
  part.tight.extend(xy);
}

}  // namespace plan_cuts

// Of a Region; a path of cuts so long has run into a corner.
constexpr std::size_t kMaxPlanLabel = 200;

bool has_room(const PlanPart& part, Eigen::Index axis, double min_width) noexcept {
  return part.box.min[axis] + min_width <= part.box.max[axis] - min_width;
}

std::optional<PlanCut> cut_near(const PlanPart& part, Eigen::Index axis, double wanted,
                                double min_width) {
  if (!has_room(part, axis, min_width) || part.label.size() >= kMaxPlanLabel) return std::nullopt;
  const double at =
      std::clamp(wanted, part.box.min[axis] + min_width, part.box.max[axis] - min_width);
  if (!(part.tight.min[axis] < at && at <= part.tight.max[axis])) return std::nullopt;
  return PlanCut{axis, at};
}

std::array<Eigen::Index, 2> longer_first(const Eigen::Vector2d& size) noexcept {
  if (size.x() >= size.y()) return {0, 1};
  return {1, 0};
}

/// The map and its parts. The one that was taken last is the present one.
class PlanCutter::Points {
 public:
  Points(const MapPasses& map, std::uint64_t gather)
      : map_(map), gather_(map.in_memory() ? map.points() : gather) {
    const Bounds3 bounds = map.bounds();
    PlanPart whole;
    whole.points = map.points();
    whole.tight = {plan_cuts::plan_of(bounds.min), plan_cuts::plan_of(bounds.max)};
    whole.box = box_owning(whole.tight.min, whole.tight.max);
    open_.push_back({std::move(whole), {}});
  }

  /// Takes the next part, whose points are gathered if they are few enough. False if none is left.
  [[nodiscard]] Result<bool> take() {
    if (open_.empty()) return false;
    present_ = std::move(open_.back());
    open_.pop_back();
    if (present_.gathered.empty() && present_.part.points <= gather_) {
      // Parts are taken depth first, so no open part needs the points in the buffer any more.
      buffer_.clear();
      buffer_.reserve(present_.part.points);
      VANTAGE_CHECK(see_present([&](const Eigen::Vector2d& xy) { buffer_.push_back(xy); }));
      if (buffer_.size() != present_.part.points) {
        return fail(ErrorCode::internal, "two passes over the map gave different points");
      }
      present_.gathered = buffer_;
    }
    return true;
  }

  [[nodiscard]] PlanPart& part() noexcept { return present_.part; }

  /// Opens the two sides of the present part; the one below is the next to be taken.
  [[nodiscard]] Result<void> divide(const PlanCut& cut) {
    const PlanPart& part = present_.part;
    const std::string path = part.label == "cell" ? "cell_" : part.label;
    Item below, above;
    below.part.label = path + "0";
    above.part.label = path + "1";
    below.part.box = above.part.box = part.box;
    below.part.box.max[cut.axis] = cut.at;
    above.part.box.min[cut.axis] = cut.at;
    const auto is_below = [&](const Eigen::Vector2d& xy) { return xy[cut.axis] < cut.at; };
    if (const std::span<Eigen::Vector2d> all = present_.gathered; !all.empty()) {
      const auto count =
          static_cast<std::size_t>(std::partition(all.begin(), all.end(), is_below) - all.begin());
      below.gathered = all.first(count);
      above.gathered = all.subspan(count);
    }
    VANTAGE_CHECK(see_present([&](const Eigen::Vector2d& xy) {
      plan_cuts::add(is_below(xy) ? below.part : above.part, xy);
    }));
    open_.push_back(std::move(above));
    open_.push_back(std::move(below));
    return {};
  }

  [[nodiscard]] Result<std::optional<double>> median_cut(Eigen::Index axis) const {
    const PlanPart& part = present_.part;
    const std::uint64_t middle = part.points / 2;
    plan_cuts::Coordinates around{part.tight.min[axis], part.tight.max[axis], part.points};
    while (around.count > gather_ && around.min < around.max) {
      plan_cuts::Histogram histogram(around);
      VANTAGE_CHECK(see_between(axis, around, [&](double x) { histogram.add(x); }));
      around = histogram.around(middle, around);
    }
    if (around.min == around.max) {
      return plan_cuts::most_even(
          {around.min, around.below, around.below + around.count, around.next}, part.points);
    }
    std::vector<double> some;
    some.reserve(around.count);
    VANTAGE_CHECK(see_between(axis, around, [&](double x) { some.push_back(x); }));
    return plan_cuts::most_even(plan_cuts::middle_of(some, middle, around), part.points);
  }

 private:
  struct Item {
    PlanPart part;
    std::span<Eigen::Vector2d> gathered;  // in the buffer; empty if they are not
  };

  template <class See>
  [[nodiscard]] Result<void> see_present(const See& see) const {
    for (const Eigen::Vector2d& xy : present_.gathered) see(xy);
    if (!present_.gathered.empty()) return {};
    plan_cuts::InBox<See> visitor(present_.part.box, see);
    return map_.pass_over(present_.part.tight, visitor);
  }

  template <class See>
  [[nodiscard]] Result<void> see_between(Eigen::Index axis, const plan_cuts::Coordinates& range,
                                         const See& see) const {
    return see_present([&](const Eigen::Vector2d& xy) {
      if (range.min <= xy[axis] && xy[axis] <= range.max) see(xy[axis]);
    });
  }

  const MapPasses& map_;
  std::uint64_t gather_;
  std::vector<Item> open_;  // the next part is the last
  Item present_;
  std::vector<Eigen::Vector2d> buffer_;
};

PlanCutter::PlanCutter(const MapPasses& map, std::uint64_t gather)
    : points_(std::make_unique<Points>(map, gather)) {}
PlanCutter::~PlanCutter() = default;

Result<Partition> PlanCutter::cut_up(const Where& where, const std::string& cause) {
  std::vector<Region> regions;
  for (;;) {
    VANTAGE_TRY(const bool taken, points_->take());
    if (!taken) return Partition::from(std::move(regions));
    VANTAGE_TRY(const auto cut, where(points_->part()));
    if (cut) {
      VANTAGE_CHECK(points_->divide(*cut));
      continue;
    }
    if (regions.size() == kMaxRegions) return too_many_regions(cause);
    PlanPart& part = points_->part();
    regions.push_back({.label = std::move(part.label), .footprint = part.box, .height = {}});
  }
}

Result<std::optional<double>> PlanCutter::median_cut(Eigen::Index axis) const {
  return points_->median_cut(axis);
}

}  // namespace vantage
