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

/// So many of the places, spread as far as they go: each is the one farthest from those before it.
/// The first is the one nearest to their middle. The `preferred` first ones go before all others.
std::vector<std::size_t> spread(std::span<const Point> places, std::size_t preferred,
                                std::size_t most) {
  std::vector<std::size_t> chosen;
  if (places.empty()) return chosen;
  Point middle = Point::Zero();
  for (const Point& p : places) middle += (p - places.front());
  middle = places.front() + middle / static_cast<double>(places.size());
  std::vector<double> away;
  for (const Point& p : places) away.push_back(-(p - middle).squaredNorm());
  while (chosen.size() < std::min(most, places.size())) {
    const bool among_preferred = chosen.size() < preferred;
    const auto end =
        among_preferred ? away.begin() + static_cast<std::ptrdiff_t>(preferred) : away.end();
    const auto at = static_cast<std::size_t>(std::max_element(away.begin(), end) - away.begin());
    if (!chosen.empty() && away[at] <= 0.0) {  // all others stand where one stands already
      if (!among_preferred) break;
      preferred = chosen.size();
      continue;
    }
    for (std::size_t i = 0; i < away.size(); ++i) {
      const double squared = (places[i] - places[at]).squaredNorm();
      away[i] = chosen.empty() ? squared : std::min(away[i], squared);
    }
    chosen.push_back(at);
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

std::int64_t nanoseconds(double seconds) { return static_cast<std::int64_t>(1e9 * seconds); }

}  // namespace

Selection::Selection(const MatchTarget& whole, const Selector& selector,
                     const SelectionParams& params, double max_range, PointsView map)
    : whole_(whole),
      selector_(selector),
      params_(params),
      rays_{.lowest = params.lowest, .highest = params.highest, .max_range = max_range},
      surfaces_(map),
      nanoseconds_(nanoseconds(preparing_.seconds())) {}

double Selection::reach(const BuildParams& params) {
  return std::min(params.max_range, Surfaces::kFarthestReturn) + Surfaces::kMargin;
}

Result<std::vector<LocatedScan>> Selection::scans_at(std::span<const Point> viewpoints) const {
  constexpr double kNear = 5.0;  // [m]
  Bounds3 around;
  for (const Point& p : viewpoints) around.extend(p);
  std::vector<Point> places;
  std::vector<const LocatedScan*> known;
  for (const LocatedScan& scan : params_.scans) {
    const Point& at = scan.T_map_scan.translation;
    if (((at - around.min).array() < -kNear).any() || ((at - around.max).array() > kNear).any()) {
      continue;
    }
    if (std::ranges::none_of(
            viewpoints, [&](const Point& p) { return (p - at).squaredNorm() < kNear * kNear; })) {
      continue;
    }
    places.push_back(at);
    known.push_back(&scan);
  }
  places.insert(places.end(), viewpoints.begin(), viewpoints.end());
  std::vector<LocatedScan> scans;
  for (const std::size_t k : spread(places, known.size(), params_.places)) {
    if (k < known.size()) {
      scans.push_back(*known[k]);
      continue;
    }
    const Point& place = places[k];
    PointCloud hits = surfaces_.scan(place, rays_);
    if (hits.empty()) continue;
    for (Point& p : hits) p -= place;
    // Without noise: what is looked for is where the surfaces themselves pull the pose.
    VANTAGE_TRY(PreparedScan prepared, prepare_scan({.points = hits}, nullptr, LocalizerParams{}));
    if (prepared.points.empty()) continue;
    scans.push_back({.points = std::move(prepared.points),
                     .T_map_scan = pose_from_xyz_rpy(place, {0.0, 0.0, 0.0})});
  }
  return scans;
}

Result<PreparedMap> Selection::of(PointsView seen, std::span<const Point> viewpoints) const {
  const ThreadStopwatch stopwatch;
  auto prepared = chosen(seen, viewpoints);
  nanoseconds_ += nanoseconds(stopwatch.seconds());
  return prepared;
}

Result<PreparedMap> Selection::chosen(PointsView seen, std::span<const Point> viewpoints) const {
  VANTAGE_TRY(std::vector<MapElement> elements, whole_.elements_at(seen));
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
  std::vector<std::vector<Pull>> pulls;
  {
    VANTAGE_TRY(const std::vector<LocatedScan> scans, scans_at(viewpoints));
    for (const LocatedScan& scan : scans) {
      VANTAGE_TRY(std::vector<Pull> some, whole_.pulls(scan.points, scan.T_map_scan));
      pulls.push_back(own_of(std::move(some), own_number));
    }
  }
  const auto with = [&](std::span<const std::uint32_t> some) {
    std::vector<std::uint32_t> kept;
    for (const std::uint32_t i : some) kept.push_back(in_target[i]);
    std::ranges::sort(kept);
    return whole_.excerpt_of(numbers, kept);
  };
  std::size_t most = elements.size();
  double each = 1.0;  // bytes
  if (params_.share) {
    most =
        static_cast<std::size_t>(std::ceil(*params_.share * static_cast<double>(elements.size())));
  } else {
    // An element takes at least a byte, and all take nearly the same number.
    most = std::min<std::size_t>(most, *params_.max_bytes);
    std::vector<std::uint32_t> some;
    VANTAGE_TRY(const PreparedMap none, with(some));
    for (std::uint32_t i = 0; i < most; ++i) some.push_back(i);
    VANTAGE_TRY(const PreparedMap many, with(some));
    each = static_cast<double>(many.bytes.size() - none.bytes.size()) /
           static_cast<double>(some.size());
    const double room =
        static_cast<double>(*params_.max_bytes) - static_cast<double>(none.bytes.size());
    most = std::min(most, static_cast<std::size_t>(std::max(1.0, 1.01 * room / each + 2.0)));
  }
  VANTAGE_TRY(const auto order, selector_.order({.elements = elements, .scans = pulls}, most));
  VANTAGE_CHECK(check_order(order, elements.size(), most));
  VANTAGE_TRY(PreparedMap prepared, with(order));
  if (params_.share) return prepared;
  for (std::size_t size = order.size(); size > 1 && prepared.bytes.size() > *params_.max_bytes;) {
    const double over = static_cast<double>(prepared.bytes.size() - *params_.max_bytes) / each;
    size -= std::min(size - 1, static_cast<std::size_t>(over) + 1);
    VANTAGE_TRY(prepared, with(std::span(order).first(size)));
  }
  return prepared;
}

}  // namespace vantage
