#include "recall.hpp"

#include <algorithm>

#include "common/point_tree.hpp"

namespace vantage::benchmarks {
namespace {

constexpr double kBehindPlane = 0.07, kBehindAlongRay = 3.0;  // [m]

double ratio(std::size_t part, std::size_t whole) {
  return whole == 0 ? 0.0 : static_cast<double>(part) / static_cast<double>(whole);
}

std::size_t number_in_both(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) {
  std::size_t both = 0;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end();) {
    if (*i == *j) ++both;
    const bool advance_j = *j <= *i;
    if (*i <= *j) ++i;
    if (advance_j) ++j;
  }
  return both;
}

}  // namespace

Score& Score::operator+=(const Score& more) noexcept {
  map += more.map;
  selected += more.selected;
  seen += more.seen;
  hits += more.hits;
  return *this;
}
double Score::share() const noexcept { return ratio(selected, map); }
double Score::recall() const noexcept { return ratio(hits, seen); }
double Score::precision() const noexcept { return ratio(hits, selected); }

Score score_of(std::span<const std::uint32_t> selected, std::span<const std::uint32_t> seen,
               std::size_t map_size) {
  return {.map = map_size,
          .selected = selected.size(),
          .seen = seen.size(),
          .hits = number_in_both(selected, seen)};
}

std::optional<double> share_at(double recall, std::vector<RecallMark> marks) {
  std::ranges::stable_sort(marks, {}, &RecallMark::share);
  RecallMark from{.share = 0.0, .recall = 0.0};
  for (const RecallMark& to : marks) {
    if (to.recall >= recall) {
      if (to.recall <= from.recall) return from.share;
      const double along = (recall - from.recall) / (to.recall - from.recall);
      return from.share + along * (to.share - from.share);
    }
    from = to;
  }
  return std::nullopt;
}

std::vector<std::pair<int, int>> recalls_with_less(const std::vector<RecallMark>& a,
                                                   const std::vector<RecallMark>& b) {
  std::vector<std::pair<int, int>> runs;
  for (int percent = 1; percent <= 100; ++percent) {
    const auto of_a = share_at(percent / 100.0, a), of_b = share_at(percent / 100.0, b);
    if (!of_a || (of_b && *of_a >= *of_b)) continue;
    if (!runs.empty() && runs.back().second == percent - 1) {
      runs.back().second = percent;
    } else {
      runs.emplace_back(percent, percent);
    }
  }
  return runs;
}

IndexList points_near(PointsView map, PointsView scan, double radius) {
  if (scan.empty()) return {};
  const matching::PointTree tree(scan);
  IndexList near;
  for (std::uint32_t i = 0; i < map.size(); ++i) {
    if (tree.nearest(map[i], radius).index != matching::kNone) near.push_back(i);
  }
  return near;
}

bool is_on_first_surface(double distance, double hit_range, double cos_incidence) noexcept {
  const double behind = distance - hit_range;
  return behind <= kBehindAlongRay && behind * cos_incidence <= kBehindPlane;
}

}  // namespace vantage::benchmarks
