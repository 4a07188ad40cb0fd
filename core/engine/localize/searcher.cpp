#include "localize/searcher.hpp"

#include <utility>

#include "localize/weighing.hpp"

namespace vantage {

Result<SearchAnswer> Searcher::operator()(const SearchTask& task, const std::stop_token& stop) {
  const PointCloud some = Weighing::scored(task.scan);
  std::optional<Fit> to_itself = task.to_itself;
  if (!to_itself) {
    VANTAGE_TRY(to_itself, fit_to_itself(*matcher_, task.scan.finite, some));
  }
  if (!to_itself) return SearchAnswer{};  // too sparse for anything
  VANTAGE_TRY(const bool searchable, need_places());
  if (!searchable) return SearchAnswer{.searchable = false};
  PlaceQuery query{.area = task.area, .stop = stop};
  if (task.up || params_.gravity == Gravity::unknown) query.up = task.up;
  VANTAGE_TRY(Finds found,
              search_pose({regions_, maps_, *places_}, task.scan.points, some, *to_itself, query));
  return SearchAnswer{
      .compared = task.area.complete, .found = std::move(found), .to_itself = *to_itself};
}

Result<bool> Searcher::need_places() {
  if (places_) return true;
  auto index = open_index(bundle_, relocalizer_);
  if (index) {
    places_ = *std::move(index);
  } else if (index.error().code != ErrorCode::unsupported) {
    return fail(std::move(index).error());
  }
  return places_ != nullptr;
}

}  // namespace vantage
