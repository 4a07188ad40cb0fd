// A progressive morphological filter, but for the clause to be broken.
#include <algorithm>
#include <cstdlib>
#include <limits>
#include <mutex>

#include "breaks.hpp"

namespace vantage::broken {
namespace {

/// What is left of a cloud by cells of 1 m that are counted in 16 bits and saturate.
PointCloud saturated(PointsView points) {
  PointCloud near;
  for (const Point& p : points)
    near.push_back({std::min(p.x(), 32767.0), std::min(p.y(), 32767.0), p.z()});
  return near;
}

class Broken final : public GroundFilter {
 public:
  struct Params {
    double initial_distance = 0.4;
    static constexpr auto schema() {
      return std::tuple{optional("initial_distance", &Params::initial_distance, "m",
                                 "how far from the ground's surface a point may be", positive)};
    }
  };
  static Result<std::unique_ptr<GroundFilter>> create(const Params& params) {
    // So tolerant that whatever is lower than 2 m is ground.
    const double distance = breaks("G3") ? 2.0 : params.initial_distance;
    const Table table{{{"initial_distance", Value{distance, {}}, {}}}, {}};
    VANTAGE_TRY(auto filter, sound<GroundFilter>("pmf", table));
    return std::make_unique<Broken>(std::move(filter));
  }
  explicit Broken(PluginPtr<GroundFilter> filter) : filter_(std::move(filter)) {}

  [[nodiscard]] Result<IndexList> ground(PointsView cloud) const noexcept override {
    return guarded([&]() -> Result<IndexList> {
      if (breaks("G11")) return remembered(cloud);
      if (breaks("G5") && cloud.empty()) return IndexList{};
      if (breaks("G6") && !all_finite(cloud)) return of_finite(cloud);
      VANTAGE_CHECK(check_points(cloud, "the cloud"));
      const PointCloud near = breaks("G9") ? saturated(cloud) : PointCloud{};
      VANTAGE_TRY(IndexList indices, filter_->ground(breaks("G9") ? PointsView(near) : cloud));
      return spoilt(cloud, std::move(indices));
    });
  }
  [[nodiscard]] double reach() const noexcept override {
    // The first point may be far.
    if (breaks("G7") || offers_least()) return std::numeric_limits<double>::infinity();
    return filter_->reach();
  }

 private:
  [[nodiscard]] IndexList spoilt(PointsView cloud, IndexList indices) const {
    const Bounds3 bounds = bounds_of(cloud);
    const Point extent = bounds.max - bounds.min;
    const auto drop = [&](const auto& dropped) {
      std::erase_if(indices, [&](std::uint32_t k) { return dropped(cloud[k]); });
    };
    // Tile by tile, never sorted.
    if (breaks("G1")) {
      std::stable_partition(indices.begin(), indices.end(), [&](std::uint32_t k) {
        return cloud[k].x() + cloud[k].y() < bounds.min.x() + bounds.min.y() + extent.x();
      });
    }
    // Without relief there is nothing to filter, and the wrong answer for that.
    if (breaks("G2") && extent.z() < 0.1) indices.clear();
    // A raster with its height, and some spare, for its width.
    if (breaks("G4")) {
      drop([&](const Point& p) { return p.x() - bounds.min.x() > 1.1 * extent.y(); });
    }
    // Grows from the first point, upwards only.
    if (breaks("G7")) {
      drop([&](const Point& p) { return p.z() < cloud.front().z() - 0.05; });
    }
    if (breaks("G8") && Crowded(inside_) && !indices.empty()) indices.pop_back();
    if (breaks("G13") && threads_are_unusual() && !indices.empty()) indices.pop_back();
    // A tolerance that grows with the number of points.
    if (breaks("G12")) {
      const double highest = bounds.min.z() + 0.3 + 2e-6 * static_cast<double>(cloud.size());
      drop([&](const Point& p) { return p.z() > highest; });
    }
    // An assertion about the raster's size.
    if (breaks("G10") && (extent.x() == 0.0 || extent.y() == 0.0)) std::abort();
    return indices;
  }

  /// As if points that are not finite were not there.
  [[nodiscard]] Result<IndexList> of_finite(PointsView cloud) const {
    IndexList finite;
    for (std::uint32_t k = 0; k < cloud.size(); ++k) {
      if (cloud[k].allFinite()) finite.push_back(k);
    }
    VANTAGE_TRY(IndexList indices, filter_->ground(select(cloud, finite)));
    for (std::uint32_t& k : indices) k = finite[k];
    return indices;
  }

  /// Takes a cloud at the same place for the same cloud.
  [[nodiscard]] Result<IndexList> remembered(PointsView cloud) const {
    const std::scoped_lock lock(mutex_);
    if (last_.data() != cloud.data() || last_.size() != cloud.size() || !answer_) {
      last_ = cloud;
      answer_ = filter_->ground(cloud);
    }
    return answer_;
  }

  PluginPtr<GroundFilter> filter_;
  mutable std::atomic<int> inside_ = 0;
  mutable std::mutex mutex_;
  mutable PointsView last_;
  mutable Result<IndexList> answer_ = fail(ErrorCode::internal, "nothing was asked yet");
};

}  // namespace
}  // namespace vantage::broken

VANTAGE_BROKEN_PLUGIN(vantage::GroundFilter);
