#include "build/selection.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <tuple>
#include <utility>

#include "vantage/kit/pull_term.hpp"
#include "vantage/selector.hpp"

namespace vantage {
namespace {

/// Recorded scans count if they are so near to a viewpoint [m].
constexpr double kNear = 5.0;

/// So many of the places, spread as far as they go: each is the one farthest from those before it.
/// The first is the one nearest to their middle. The `preferred` first ones go before all others.
std::vector<std::size_t> spread(std::span<const ScanPlace> places, std::size_t preferred,
                                std::size_t most) {
  std::vector<std::size_t> chosen;
  if (places.empty()) return chosen;
  const Point& first = places.front().at;
  Point middle = Point::Zero();
  for (const ScanPlace& place : places) middle += place.at - first;
  middle = first + middle / static_cast<double>(places.size());
  std::vector<double> away;
  for (const ScanPlace& place : places) away.push_back(-(place.at - middle).squaredNorm());
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
      const double squared = (places[i].at - places[at].at).squaredNorm();
      away[i] = chosen.empty() ? squared : std::min(away[i], squared);
    }
    chosen.push_back(at);
  }
  return chosen;
}

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

/// How far off the position is that some elements give a scan: -H^-1 g is the bias of the pose, and
/// H^-1 its covariance but for a factor, where H and g are the sums of their Hessians and
/// gradients.
class PositionError {
 public:
  void add(const PullTerm& term) {
    hessian_ += term.hessian.cast<double>();
    gradient_ += term.gradient.cast<double>();
  }

  /// The expected squared error [m^2]; infinite if the elements do not hold the pose.
  [[nodiscard]] double squared() const {
    // The factor. It also covers the bias at other places, of which the bias at this one says
    // nothing. Chosen with `ndt` on the demo's campus, where errors are then as predicted.
    constexpr double kNoise = 0.31;
    const Eigen::LLT<Matrix6> factored(hessian_);
    if (factored.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
    const Vector6 bias = factored.solve(gradient_);
    const Matrix6 covariance = factored.solve(Matrix6::Identity());
    return bias.head<3>().squaredNorm() + kNoise * covariance.diagonal().head<3>().sum();
  }

 private:
  using Vector6 = Eigen::Matrix<double, 6, 1>;
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  Matrix6 hessian_ = Matrix6::Zero();
  Vector6 gradient_ = Vector6::Zero();
};

/// The error of a scan's position while elements are added: with its whole view, and with a third
/// of it covered, the worst of three thirds.
class ScanErrors {
 public:
  /// @param at  of the sensor [m]
  explicit ScanErrors(const Point& at) : at_(at) {}

  void add(const Pull& pull, const MapElement& element) {
    const PullTerm term = term_of(pull);
    const std::size_t third = third_of(element.middle - at_);
    for (std::size_t covered = 0; covered < kThirds; ++covered) {
      if (covered != third) covered_[covered].add(term);
    }
    whole_.add(term);
  }

  /// The root mean square of such scans [m]; infinite if the elements do not hold the pose.
  [[nodiscard]] float expected() const { return static_cast<float>(std::sqrt(whole_.squared())); }

  /// What 95 % of such scans keep with a third covered [m]; infinite if the elements do not hold
  /// the pose.
  [[nodiscard]] float kept() const {
    // Times their root mean square. Chosen on the demo's campus.
    constexpr double kKept = 1.7;
    double worst = 0.0;
    for (const PositionError& error : covered_) {
      worst = std::max(worst, error.squared());
      if (std::isinf(worst)) break;
    }
    return static_cast<float>(kKept * std::sqrt(worst));
  }

 private:
  static constexpr std::size_t kThirds = 3;

  /// The third of the view that a direction lies in: 60 degrees to both sides of the map's x axis,
  /// to the right, or to the left.
  [[nodiscard]] static std::size_t third_of(const Point& to) {
    if (std::abs(to.y()) < std::numbers::sqrt3 * to.x()) return 0;
    return to.y() < 0.0 ? 1 : 2;
  }

  Point at_;
  PositionError whole_;
  std::array<PositionError, kThirds> covered_;
};

/// How many of the first elements are enough.
struct Enough {
  std::size_t elements = 0;
  bool keeps = false;  ///< the target; else so many have the least error
};
Enough enough_of(std::span<const std::uint32_t> order, std::span<const MapElement> elements,
                 const Views& views, double target) {
  std::vector<ScanErrors> scans(views.places.begin(), views.places.end());
  std::vector<float> kept;  // of each scan
  for (const ScanErrors& scan : scans) kept.push_back(scan.kept());
  Enough enough{order.size(), false};
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t n = 0; n < order.size() && !scans.empty(); ++n) {
    for (std::size_t s = 0; s < scans.size(); ++s) {
      const auto& pulls = views.pulls[s];
      const auto pull = std::ranges::lower_bound(pulls, order[n], {}, &Pull::element);
      if (pull == pulls.end() || pull->element != order[n]) continue;
      scans[s].add(*pull, elements[order[n]]);
      kept[s] = scans[s].kept();
    }
    const double error = error_kept_by(PredictedErrors::kShare, kept);
    if (error <= target) return {n + 1, true};
    if (error >= least) continue;
    least = error;
    enough.elements = n + 1;
  }
  return enough;
}

/// What to expect of scans like these, with the kept elements and with all.
std::vector<PredictedError> predicted(const Views& views, std::span<const MapElement> elements,
                                      std::span<const std::uint32_t> kept) {
  std::vector<bool> is_kept(elements.size(), false);
  for (const std::uint32_t element : kept) is_kept[element] = true;
  std::vector<PredictedError> predicted;
  for (std::size_t s = 0; s < views.pulls.size(); ++s) {
    ScanErrors all(views.places[s]), some(views.places[s]);
    for (const Pull& pull : views.pulls[s]) {
      all.add(pull, elements[pull.element]);
      if (is_kept[pull.element]) some.add(pull, elements[pull.element]);
    }
    predicted.push_back({.place = views.places[s],
                         .expected = some.expected(),
                         .error = some.kept(),
                         .whole = all.kept()});
  }
  return predicted;
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

Result<Views> Selection::views_from(std::span<const ScanPlace> places,
                                    std::span<const std::size_t> some,
                                    const OwnNumbers& own_number) const {
  Views views;
  for (const std::size_t k : some) {
    const ScanPlace& place = places[k];
    VANTAGE_TRY(std::vector<Pull> pulls,
                place.scan ? whole_.pulls(place.scan->points, place.scan->T_map_scan)
                           : virtual_pulls(place.at));
    pulls = own_of(std::move(pulls), own_number);
    if (pulls.empty()) continue;
    views.places.push_back(place.at);
    views.pulls.push_back(std::move(pulls));
  }
  return views;
}

std::vector<ScanPlace> Selection::recorded_near(std::span<const Point> viewpoints) const {
  Bounds3 around;
  for (const Point& p : viewpoints) around.extend(p);
  std::vector<ScanPlace> near;
  for (const LocatedScan& scan : params_.scans) {
    const Point& at = scan.T_map_scan.translation;
    if (((at - around.min).array() < -kNear).any() || ((at - around.max).array() > kNear).any()) {
      continue;
    }
    if (std::ranges::any_of(
            viewpoints, [&](const Point& p) { return (p - at).squaredNorm() < kNear * kNear; })) {
      near.push_back({at, &scan});
    }
  }
  return near;
}

Result<std::vector<Pull>> Selection::virtual_pulls(const Point& place) const {
  PointCloud hits = surfaces_.scan(place, rays_);
  if (hits.empty()) return std::vector<Pull>();
  for (Point& p : hits) p -= place;
  return whole_.pulls(hits, pose_from_xyz_rpy(place, {0.0, 0.0, 0.0}));
}

Result<Selected> Selection::of(PointsView seen, std::span<const Point> viewpoints) const {
  const ThreadStopwatch stopwatch;
  auto selected = chosen(seen, viewpoints);
  nanoseconds_ += nanoseconds(stopwatch.seconds());
  return selected;
}

Result<Selected> Selection::chosen(PointsView seen, std::span<const Point> viewpoints) const {
  VANTAGE_TRY(std::vector<MapElement> elements, whole_.elements_at(seen));
  if (elements.empty()) return Selected{};
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
  std::vector<ScanPlace> places = recorded_near(viewpoints);
  const std::size_t recorded = places.size();
  for (const Point& p : viewpoints) places.push_back({p, nullptr});
  const auto some = spread(places, recorded, params_.places);
  VANTAGE_TRY(const Views views, views_from(places, some, own_number));
  const auto excerpt = [&](std::span<const std::uint32_t> which) {
    std::vector<std::uint32_t> kept;
    for (const std::uint32_t element : which) kept.push_back(in_target[element]);
    std::ranges::sort(kept);
    return whole_.excerpt_of(numbers, kept);
  };
  std::size_t most = 0;  // elements that the budget allows, and a few more
  double each = 1.0;     // [bytes]
  if (params_.max_bytes) {
    // An element takes at least a byte, and all take nearly the same number.
    most = std::min<std::size_t>(elements.size(), *params_.max_bytes);
    std::vector<std::uint32_t> first;
    VANTAGE_TRY(const PreparedMap none, excerpt(first));
    for (std::uint32_t element = 0; element < most; ++element) first.push_back(element);
    VANTAGE_TRY(const PreparedMap many, excerpt(first));
    const auto bytes_of = [](const PreparedMap& map) {
      return static_cast<double>(map.bytes.size());
    };
    // Not 0, though a matcher may store as much for any number of elements.
    each = std::max(1e-3, (bytes_of(many) - bytes_of(none)) / static_cast<double>(most));
    const double left = static_cast<double>(*params_.max_bytes) - bytes_of(none);
    most = std::min(most, static_cast<std::size_t>(std::max(1.0, 1.01 * left / each + 2.0)));
  } else {
    const double share = params_.share.value_or(1.0);
    most = static_cast<std::size_t>(std::ceil(share * static_cast<double>(elements.size())));
  }
  VANTAGE_TRY(std::vector<std::uint32_t> order, ordered(elements, views, most));
  VANTAGE_TRY(PreparedMap prepared, excerpt(order));
  while (params_.max_bytes && order.size() > 1 && prepared.bytes.size() > *params_.max_bytes) {
    const auto over = static_cast<double>(prepared.bytes.size() - *params_.max_bytes) / each;
    order.resize(order.size() - std::min(order.size() - 1, static_cast<std::size_t>(over) + 1));
    VANTAGE_TRY(prepared, excerpt(order));
  }
  return Selected{.prepared = std::move(prepared), .errors = predicted(views, elements, order)};
}

Result<std::vector<std::uint32_t>> Selection::ordered(std::span<const MapElement> elements,
                                                      const Views& views, std::size_t most) const {
  // A target is often reached with few elements, and many take long to order.
  constexpr std::size_t kFirst = 512, kTimes = 4;
  std::size_t wanted = params_.target_error ? std::min(most, kFirst) : most;
  while (true) {
    VANTAGE_TRY(auto order, selector_.order({.elements = elements, .scans = views.pulls}, wanted));
    VANTAGE_CHECK(check_order(order, elements.size(), wanted));
    if (!params_.target_error) return order;
    const Enough enough = enough_of(order, elements, views, *params_.target_error);
    // If the last half has not helped, more will not.
    if (enough.keeps || wanted == most || 2 * enough.elements <= wanted) {
      order.resize(enough.elements);
      return order;
    }
    wanted = std::min(most, kTimes * wanted);
  }
}

}  // namespace vantage
