#include "build/selection.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include "vantage/engine/prepared_scan.hpp"
#include "vantage/selector.hpp"

namespace vantage {
namespace {

/// So many of the viewpoints, spread as far as they go: each is the one farthest from those before
/// it. The first is the one nearest to their middle.
std::vector<Point> spread(std::span<const Point> viewpoints, std::size_t most) {
  std::vector<Point> chosen;
  if (viewpoints.empty()) return chosen;
  Point middle = Point::Zero();
  for (const Point& p : viewpoints) middle += (p - viewpoints.front());
  middle = viewpoints.front() + middle / static_cast<double>(viewpoints.size());
  const auto farther = [](double a, double b) { return a < b; };
  std::vector<double> away;
  for (const Point& p : viewpoints) away.push_back(-(p - middle).squaredNorm());
  while (chosen.size() < std::min(most, viewpoints.size())) {
    const auto at =
        static_cast<std::size_t>(std::ranges::max_element(away, farther) - away.begin());
    if (!chosen.empty() && away[at] <= 0.0) break;  // all others stand where one stands already
    const Point& next = viewpoints[at];
    for (std::size_t i = 0; i < away.size(); ++i) {
      const double squared = (viewpoints[i] - next).squaredNorm();
      away[i] = chosen.empty() ? squared : std::min(away[i], squared);
    }
    chosen.push_back(next);
  }
  return chosen;
}

/// The numbers of a region's elements in the target, and in the region.
using OwnNumbers = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

/// Numbered within the region; elements of other regions are left out.
std::vector<Pull> own_of(std::vector<Pull> pulls, const OwnNumbers& own_number) {
  auto element = own_number.begin();
  std::erase_if(pulls, [&](Pull& pull) {
    while (element != own_number.end() && element->first < pull.element) ++element;
    if (element == own_number.end() || element->first != pull.element) return true;
    pull.element = element->second;
    return false;
  });
  std::ranges::sort(pulls, {}, &Pull::element);
  return pulls;
}

/// Virtual scans at some of the viewpoints, and what the region's elements do to their poses.
Result<std::vector<std::vector<Pull>>> pulls_at(const MatchTarget& whole,
                                                const OwnNumbers& own_number,
                                                std::span<const Point> places,
                                                const SelectionBudget& sensor,
                                                const HitsAt& hits_at) {
  constexpr double kDegrees = 180.0 / std::numbers::pi;
  std::vector<std::vector<Pull>> scans;
  for (const Point& place : places) {
    // Without noise: what is looked for is where the surfaces themselves pull the pose.
    VANTAGE_TRY(PointCloud scan, hits_at(place, VirtualLidar::Aim::middle));
    for (Point& p : scan) p -= place;
    std::erase_if(scan, [&](const Point& p) {
      const double elevation = kDegrees * std::atan2(p.z(), p.head<2>().norm());
      return elevation < sensor.lowest || elevation > sensor.highest;
    });
    if (scan.empty()) continue;
    const Pose pose = pose_from_xyz_rpy(place, {0.0, 0.0, 0.0});
    VANTAGE_TRY(const PreparedScan prepared,
                prepare_scan({.points = scan}, nullptr, LocalizerParams{}));
    if (prepared.points.empty()) continue;
    VANTAGE_TRY(std::vector<Pull> pulls, whole.pulls(prepared.points, pose));
    scans.push_back(own_of(std::move(pulls), own_number));
  }
  return scans;
}

Result<void> check_order(std::span<const std::uint32_t> order, std::size_t elements,
                         std::size_t wanted) {
  std::vector<bool> seen(elements, false);
  for (const std::uint32_t i : order) {
    if (i >= elements || seen[i]) {
      return fail(ErrorCode::internal, "the selector names element " + std::to_string(i) + " of " +
                                           std::to_string(elements) +
                                           (i < elements ? " twice" : ""));
    }
    seen[i] = true;
  }
  if (order.size() == wanted) return {};
  return fail(ErrorCode::internal, "the selector orders " + std::to_string(order.size()) +
                                       " elements, not " + std::to_string(wanted));
}

}  // namespace

Result<PreparedMap> select_elements(const MatchTarget& whole, const Selector& selector,
                                    const SelectionBudget& budget, PointsView seen,
                                    std::span<const Point> viewpoints, const HitsAt& hits_at) {
  VANTAGE_TRY(std::vector<MapElement> elements, whole.elements_at(seen));
  if (elements.empty()) return PreparedMap{};
  std::vector<std::uint32_t> numbers;  // in the target
  for (const MapElement& element : elements) numbers.push_back(element.number);
  // By place: the order of numbers depends on how far the map extends.
  std::ranges::sort(elements, {}, [](const MapElement& element) {
    const Point& at = element.middle;
    return std::tuple(at.x(), at.y(), at.z(), element.number);
  });
  std::vector<std::uint32_t> in_target;
  OwnNumbers own_number;
  for (std::uint32_t i = 0; i < elements.size(); ++i) {
    in_target.push_back(elements[i].number);
    own_number.emplace_back(elements[i].number, i);
    elements[i].number = i;
  }
  std::ranges::sort(own_number);
  const auto with = [&](std::span<const std::uint32_t> some) {
    std::vector<std::uint32_t> kept;
    for (const std::uint32_t i : some) kept.push_back(in_target[i]);
    std::ranges::sort(kept);
    return whole.excerpt_of(numbers, kept);
  };
  std::size_t most = elements.size();
  if (budget.share) {
    most =
        static_cast<std::size_t>(std::ceil(*budget.share * static_cast<double>(elements.size())));
  } else {
    // An element takes at least a byte.
    most = std::min<std::size_t>(most, *budget.max_bytes);
  }
  VANTAGE_TRY(const auto scans,
              pulls_at(whole, own_number, spread(viewpoints, budget.scans), budget, hits_at));
  if (!budget.share) {
    // The bytes of an element are nearly the same for all.
    std::vector<std::uint32_t> some;
    VANTAGE_TRY(const PreparedMap none, with(some));
    for (std::uint32_t i = 0; i < most; ++i) some.push_back(i);
    VANTAGE_TRY(const PreparedMap many, with(some));
    const double each = static_cast<double>(many.bytes.size() - none.bytes.size()) /
                        static_cast<double>(some.size());
    const double room =
        static_cast<double>(*budget.max_bytes) - static_cast<double>(none.bytes.size());
    most = std::min(most, static_cast<std::size_t>(std::max(1.0, 1.02 * room / each + 8.0)));
  }
  VANTAGE_TRY(const auto order, selector.order({.elements = elements, .scans = scans}, most));
  VANTAGE_CHECK(check_order(order, elements.size(), most));
  VANTAGE_TRY(PreparedMap prepared, with(order));
  if (budget.share) return prepared;
  std::size_t size = order.size();
  while (size > 1 && prepared.bytes.size() > *budget.max_bytes) {
    size -= std::max<std::size_t>(1, size / 128);
    VANTAGE_TRY(prepared, with(std::span(order).first(size)));
  }
  return prepared;
}

}  // namespace vantage
