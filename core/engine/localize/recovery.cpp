#include "localize/recovery.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>

#include "localize/weighing.hpp"

namespace vantage {
namespace {

// A search this far [m] takes a fraction of a second.
constexpr double kQuick = 400.0;

/// Where a prior says that the sensor is; nothing if it says nothing of the place. Twice as far
/// after so many scans in a row that did not find the sensor: the prior may be wrong.
std::optional<PlaceArea> around(const PosePrior& prior, std::uint32_t scans) {
  constexpr double kSigmas = 3.0, kSlack = 2.0;  // [m]
  constexpr std::uint32_t kPatience = 16;
  const double sigma = prior.sigma_translation.head<2>().maxCoeff();
  if (!std::isfinite(sigma)) return {};
  PlaceArea area;
  area.centre = prior.T_map_sensor.translation.head<2>();
  area.radius = std::ldexp(kSlack + kSigmas * sigma, static_cast<int>(scans / kPatience));
  area.heading = heading_of(prior.T_map_sensor);
  area.heading_within = scans < kPatience
                            ? std::min(std::numbers::pi, kSigmas * prior.sigma_heading)
                            : std::numbers::pi;
  return area;
}

}  // namespace

Recovery::Recovery(Searcher searcher, LocalizerParams& params)
    : params_(params),
      searcher_(std::move(searcher)),
      job_(std::ref(searcher_), {params.live, params.search_budget}) {}

void Recovery::forget() {
  job_.drop();
  compared_ = params_.recovery_radius == 0.0;  // nothing to compare with
  startled_ = surprised_ = false;
  doubtful_scans_ = contradicted_scans_ = 0;
  failed_searches_ = 0.0;
  way_ = kBasin;
  prior_searched_ = false;
}

bool Recovery::is_sure(const std::vector<Hypothesis>& hypotheses) const {
  constexpr double kSure = 0.8;  // belief in the best
  return !hypotheses.empty() && compared_ && hypotheses.front().fits() &&
         hypotheses.front().belief >= kSure;
}

bool Recovery::is_contradicted(const std::vector<Hypothesis>& hypotheses,
                               const std::optional<PosePrior>& prior) {
  if (!prior || hypotheses.empty()) return false;
  const bool agrees = agreement(hypotheses.front().pose(), *prior, false) >= 0.0;
  contradicted_scans_ = agrees ? 0 : contradicted_scans_ + 1;
  prior_searched_ = prior_searched_ && !agrees;
  return std::has_single_bit(contradicted_scans_);
}

void Recovery::lose(bool surprise) {
  startled_ = startled_ || compared_ || surprise;
  surprised_ = surprised_ || surprise;
  compared_ = params_.recovery_radius == 0.0;
}

void Recovery::move(const Pose& T_before_now) {
  way_ += T_before_now.translation.norm();
  job_.move(T_before_now);
}

std::optional<PlaceArea> Recovery::area(const std::optional<PosePrior>& prior,
                                        const std::optional<Pose>& predicted,
                                        const Bounds3& map) const {
  // A search that takes long is begun only now and then.
  const bool rests = doubtful_scans_ % params_.search_pause != 0;
  // A wrong prior must not hide the rest of the map, and the next prior may be right.
  const bool refuted = prior_searched_ && !compared_ && doubtful_scans_ % 2 == 0;
  if (auto near = prior && !refuted ? around(*prior, doubtful_scans_) : std::nullopt) {
    // Other places than the prior's are searched without it.
    near->complete =
        !predicted || (predicted->translation.head<2>() - near->centre).norm() <= near->radius;
    return rests && near->radius > kQuick ? std::nullopt : near;
  }
  const bool rests_anywhere = rests && doubtful_scans_ > 2;
  if (!predicted) return rests_anywhere ? std::nullopt : std::optional(PlaceArea());
  PlaceArea area;
  area.centre = predicted->translation.head<2>();
  const Eigen::Vector2d least = map.min.head<2>(), most = map.max.head<2>();
  // The distance to the farthest place of the map, and to the nearest one.
  const double farthest =
      (area.centre - least).cwiseAbs().cwiseMax((area.centre - most).cwiseAbs()).norm();
  const double nearest = distance(HalfOpenBox{least, most}, area.centre);
  const double widest = std::min(farthest, params_.recovery_radius.value_or(farthest));
  area.radius = widest;
  if (!surprised_) {
    // Twice as far at each scan.
    const double first = widest <= kQuick ? widest : params_.search_first_radius;
    const int doublings = static_cast<int>(std::min(doubtful_scans_, 60U)) - 1;
    const double grown = std::ldexp(first, doublings);
    if (rests_anywhere && grown >= 2.0 * widest) return {};
    // A circle off the map holds no place.
    if (grown >= nearest) area.radius = std::min(grown, widest);
  }
  if (area.radius <= 0.0) return {};
  area.complete = area.radius >= widest;
  return area;
}

void Recovery::begin(double stamp, SearchTask task) {
  startled_ = surprised_ = false;
  job_.begin(stamp, std::move(task));
}

double Recovery::learn(const SearchAnswer& answer, bool with_prior) {
  if (!answer.searchable) params_.recovery_radius = 0.0;
  compared_ = compared_ || !answer.searchable || (answer.compared && !startled_);
  prior_searched_ = prior_searched_ || contradicted_scans_ > 0;
  const double failed = with_prior ? 0.0 : failed_searches_;
  const double missed = 1.0 - kRecall + kNowhere * std::pow(1.0 - kRecall, -failed);
  if (answer.compared && !with_prior) {
    failed_searches_ += std::min(1.0, way_ / kBasin);
    way_ = 0.0;
  }
  return missed;
}

}  // namespace vantage
