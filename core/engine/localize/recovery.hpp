#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "localize/hypothesis.hpp"
#include "localize/pose_search.hpp"
#include "localize/search_job.hpp"
#include "vantage/engine/localizer_params.hpp"
#include "vantage/track/pose_prior.hpp"

namespace vantage {

/// Decides when other poses than the followed ones are searched for, and what the searches are
/// worth as evidence.
class Recovery {
 public:
  /// @param params  must outlive the object. `recovery_radius` becomes 0 if the bundle holds
  ///                nothing that can be searched
  Recovery(Searcher searcher, LocalizerParams& params);

  /// Forgets everything. A search that is under way is dropped.
  void forget();

  /// Whether the followed poses were compared with all other places.
  [[nodiscard]] bool compared() const noexcept { return compared_; }
  [[nodiscard]] bool under_way() const { return job_.under_way(); }
  /// Whether the place where contradicted priors say that the sensor is was searched.
  [[nodiscard]] bool prior_searched() const noexcept { return prior_searched_; }

  /// Whether no other poses need to be looked for.
  [[nodiscard]] bool is_sure(const std::vector<Hypothesis>& hypotheses) const;
  /// Whether to look where a prior says that the sensor is, although there is no other doubt: less
  /// and less often while priors contradict the scans.
  [[nodiscard]] bool is_contradicted(const std::vector<Hypothesis>& hypotheses,
                                     const std::optional<PosePrior>& prior);

  /// The sensor is lost or was carried away, so what was compared has become worthless.
  /// @param surprise  it was carried away, maybe
  void lose(bool surprise);
  /// Counts the scans in a row with doubt.
  void count(bool sure) { doubtful_scans_ = sure ? 0 : doubtful_scans_ + 1; }
  /// How the sensor moved since the scan before.
  void move(const Pose& T_before_now);

  /// Where to search with this scan, whose pose is in doubt: around its absolute prior if there is
  /// one, and twice as far after every 16 scans, because priors may be wrong. If the prior says
  /// that the sensor is elsewhere, nothing was found there, and the pose was not compared with the
  /// rest of the map yet, every other search is made as without the prior. Otherwise around the
  /// prediction, in a circle that grows from scan to scan; the widest at once after a surprise, or
  /// if the map lies beyond the circle. Without a prediction either, everywhere.
  /// @param predicted  prediction of the best hypothesis; none if the sensor may be anywhere
  /// @param map        bounds of the map
  /// @return           nothing if this scan is not searched with
  [[nodiscard]] std::optional<PlaceArea> area(const std::optional<PosePrior>& prior,
                                              const std::optional<Pose>& predicted,
                                              const Bounds3& map) const;
  /// Precondition: no search is under way.
  void begin(double stamp, SearchTask task);
  /// The answer of the search, once it is known.
  [[nodiscard]] std::optional<SearchJob::Known> answer(double stamp) { return job_.answer(stamp); }
  /// Takes an answer in. @return  the odds that the sensor is at none of its finds, because the
  /// search missed its place or because it is nowhere in the map. Searches at other places that no
  /// tracked scan followed are evidence for the latter.
  [[nodiscard]] double learn(const SearchAnswer& answer, bool with_prior);
  /// A scan was tracked: earlier searches tell nothing more.
  void succeed() { failed_searches_ = 0.0; }

 private:
  LocalizerParams& params_;
  Searcher searcher_;
  bool compared_ = false;
  std::uint32_t doubtful_scans_ = 0;      // in a row
  std::uint32_t contradicted_scans_ = 0;  // by their priors, in a row
  bool prior_searched_ = false;
  double failed_searches_ = 0.0;  // of all places, until a scan was tracked; by their news
  double way_ = kBasin;           // since the last one [m]
  bool startled_ = false;         // the sensor was carried away, maybe, since the search began
  bool surprised_ = false;        // by a scan, since a search began last
  SearchJob job_;                 // last: may be running
};

}  // namespace vantage
