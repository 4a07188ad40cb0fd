#include "localize/searcher.hpp"

#include <utility>

#include "localize/level.hpp"
#include "localize/weighing.hpp"

namespace vantage {
namespace {

// A search finds the place, if it is in the area.
constexpr double kRecall = 0.9, kInArea = 0.5;
// In a narrow area [m], it hardly misses it.
constexpr double kNarrow = 50.0, kRecallNarrow = 0.97;

double recall_in(const PlaceArea& area) {
  if (!area.complete) return kRecall * kInArea;
  return area.radius <= kNarrow ? kRecallNarrow : kRecall;
}

}  // namespace

Result<SearchAnswer> Searcher::operator()(const SearchTask& task, const std::stop_token& stop) {
  const PointCloud some = Weighing::scored(task.scan);
  std::optional<Fit> to_itself = task.to_itself;
  if (!to_itself) {
    VANTAGE_TRY(to_itself, fit_to_itself(*matcher_, task.scan.finite, some));
  }
  if (!to_itself) return SearchAnswer{};  // too sparse for anything
  VANTAGE_TRY(const bool searchable, need_places());
  if (!searchable) return SearchAnswer{.searchable = false};
  Pose T_level_sensor;
  if (task.up) {
    T_level_sensor.rotation =
        Eigen::Quaterniond::FromTwoVectors(*task.up, Eigen::Vector3d::UnitZ());
  } else if (params_.gravity == Gravity::unknown) {
    T_level_sensor = level_by_ground(task.scan.points);
  }
  VANTAGE_TRY(Finds found,
              search_pose({regions_, maps_, *places_}, task.scan.points, some, *to_itself,
                          AlertLimit::of(params_), task.area, T_level_sensor, stop));
  return SearchAnswer{.compared = task.area.complete,
                      .recall = recall_in(task.area),
                      .found = std::move(found),
                      .to_itself = *to_itself};
}

Result<bool> Searcher::need_places() {
  if (places_) return true;
  auto made = PlaceIndex::of_bundle(directory_, *store_);
  if (made) {
    places_ = *std::move(made);
  } else if (made.error().code != ErrorCode::unsupported) {
    return fail(std::move(made).error());
  }
  return places_.has_value();
}

}  // namespace vantage
