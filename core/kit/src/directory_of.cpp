#include "vantage/kit/directory_of.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "vantage/plugin.hpp"

namespace vantage {
namespace {

bool meet(const Bounds2& a, const Bounds2& b) noexcept {
  return (a.min.array() <= b.max.array()).all() && (b.min.array() <= a.max.array()).all();
}

class DirectoryInMemory final : public RegionDirectory {
 public:
  explicit DirectoryInMemory(MapIndex index) : index_(std::move(index)) {
    summary_ = {.regions = index_.partition.size(),
                .empty_regions = 0,
                .without_points = 0,
                .extent = {},
                .map_bounds = index_.map_bounds,
                .map_points = index_.map_points,
                .least_points = 0,
                .most_points = 0,
                .sum = {},
                .config = index_.config};
    boxes_.reserve(index_.partition.size());
    for (const Region& region : index_.partition.regions()) {
      boxes_.push_back(bounds_of(region.footprint));
      add(boxes_.back(), index_.regions[boxes_.size() - 1]);
    }
  }

  [[nodiscard]] const BundleSummary& summary() const noexcept override { return summary_; }
  [[nodiscard]] Result<DirectoryEntry> entry(RegionId region) const noexcept override {
    return guarded([&]() -> Result<DirectoryEntry> {
      if (region.value >= boxes_.size()) {
        return fail(ErrorCode::not_found,
                    "the bundle has no region " + std::to_string(region.value));
      }
      return DirectoryEntry{index_.partition[region], index_.regions[region.value]};
    });
  }
  [[nodiscard]] Result<std::vector<RegionId>> meeting(const Bounds2& area) const noexcept override {
    return guarded([&]() -> Result<std::vector<RegionId>> {
      std::vector<RegionId> found;
      for (std::uint32_t r = 0; r < boxes_.size(); ++r) {
        if (meet(boxes_[r], area)) found.push_back(RegionId{r});
      }
      return found;
    });
  }
  [[nodiscard]] Result<std::optional<RegionId>> find(
      std::string_view label) const noexcept override {
    const auto& regions = index_.partition.regions();
    const auto found = std::ranges::find(regions, label, &Region::label);
    if (found == regions.end()) return std::nullopt;
    return RegionId{static_cast<std::uint32_t>(found - regions.begin())};
  }

 private:
  void add(const Bounds2& box, const RegionSummary& one) {
    summary_.extent.extend(box.min);
    summary_.extent.extend(box.max);
    const bool is_first = boxes_.size() == 1;
    summary_.least_points = is_first ? one.points : std::min(summary_.least_points, one.points);
    summary_.most_points = std::max(summary_.most_points, one.points);
    if (one.empty()) ++summary_.empty_regions;
    if (one.points == 0) ++summary_.without_points;
    RegionSummary& sum = summary_.sum;
    sum.points += one.points;
    sum.viewpoints += one.viewpoints;
    sum.elements += one.elements;
    sum.bytes += one.bytes;
    sum.max_views = std::max(sum.max_views, one.max_views);
  }

  MapIndex index_;
  BundleSummary summary_;
  std::vector<Bounds2> boxes_;
};

}  // namespace

Result<std::unique_ptr<const RegionDirectory>> directory_of(MapIndex index) {
  if (index.partition.size() == 0) {
    return fail(ErrorCode::corrupt_data, "the bundle's index has no region");
  }
  if (index.regions.size() != index.partition.size()) {
    return fail(ErrorCode::corrupt_data,
                "the bundle's index has " + std::to_string(index.regions.size()) +
                    " summaries for " + std::to_string(index.partition.size()) + " regions");
  }
  return std::make_unique<const DirectoryInMemory>(std::move(index));
}

}  // namespace vantage
