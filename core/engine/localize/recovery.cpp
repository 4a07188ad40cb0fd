#include "localize/recovery.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

#include "localize/search_area.hpp"
#include "localize/weighing.hpp"

namespace vantage {

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
  return search_area(prior, predicted, map, doubtful_scans_, surprised_, params_);
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
