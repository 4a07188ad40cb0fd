#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <utility>

#include "vantage/engine/bundle.hpp"
#include "vantage/engine/plugin_loader.hpp"
#include "vantage/ground_filter.hpp"
#include "vantage/kit/directory_of.hpp"
#include "vantage/kit/max_views_of.hpp"
#include "vantage/kit/scene_by_viewpoint.hpp"
#include "vantage/map_store.hpp"
#include "vantage/partitioner.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/visibility.hpp"

/// Plugins so simple that a test can tell by hand what core must make of them.
namespace vantage::test {

template <class Fake, class Interface, class... Args>
PluginPtr<Interface> in_process(Args&&... args) {
  return PluginPtr<Interface>(new Fake(std::forward<Args>(args)...), {});
}

/// Strips of width 10 along x, from 0 to 10 * count.
class Strips final : public Partitioner {
 public:
  explicit Strips(int count) : count_(count) {}
  [[nodiscard]] Result<Partition> partition(const MapPasses&, PointsView,
                                            const MapSurvey&) const noexcept override {
    std::vector<Region> regions;
    for (int i = 0; i < count_; ++i) {
      regions.push_back({"strip" + std::to_string(i),
                         HalfOpenBox{{10.0 * i, -100.0}, {10.0 * (i + 1), 100.0}},
                         {}});
    }
    return Partition::from(std::move(regions));
  }

 private:
  int count_;
};

/// Ground is what lies at z < 0.1; `shift` breaks the promise about indices.
class FlatGround final : public GroundFilter {
 public:
  explicit FlatGround(std::uint32_t shift = 0) : shift_(shift) {}
  [[nodiscard]] Result<IndexList> ground(PointsView cloud) const noexcept override {
    IndexList indices;
    for (std::uint32_t i = 0; i < cloud.size(); ++i) {
      if (cloud[i].z() < 0.1) indices.push_back(i + shift_);
    }
    return indices;
  }

 private:
  std::uint32_t shift_;
};

/// Sees everything within max_range; refuses viewpoints beyond x = `limit`.
class SeesNear final : public VisibilityOperator {
 public:
  explicit SeesNear(double limit = 1e9) : limit_(limit) {}
  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept override {
    class Scene final : public SceneByViewpoint {
     public:
      Scene(PointsView map, double range, double limit)
          : SceneByViewpoint(map.size()), map_(map), range_(range), limit_(limit) {}
      [[nodiscard]] Result<IndexList> visible(const Point& viewpoint) const noexcept override {
        if (viewpoint.x() > limit_) return fail(ErrorCode::invalid_input, "too far east");
        IndexList indices;
        for (std::uint32_t i = 0; i < map_.size(); ++i) {
          if ((map_[i] - viewpoint).norm() <= range_) indices.push_back(i);
        }
        return indices;
      }

     private:
      PointsView map_;
      double range_, limit_;
    };
    return std::make_unique<Scene>(map, limits.max_range, limit_);
  }

 private:
  double limit_;
};

/// What a MemoryStore keeps; the test holds on to it.
struct Memory {
  MapIndex index;
  std::map<std::uint32_t, RegionMap> maps;
  std::set<std::uint32_t> unreadable;
  bool begun = false, committed = false;
  std::atomic<int> gets = 0;
};

class MemoryWriter final : public MapWriter {
 public:
  explicit MemoryWriter(std::shared_ptr<Memory> memory) : memory_(std::move(memory)) {}
  [[nodiscard]] Result<void> put(RegionId region, const RegionMap& map) noexcept override {
    memory_->maps[region.value] = map;
    return {};
  }
  [[nodiscard]] Result<void> commit() && noexcept override {
    for (std::uint32_t r = 0; r < memory_->index.partition.size(); ++r) {
      memory_->index.regions.push_back({.points = memory_->maps[r].points.size(),
                                        .viewpoints = memory_->maps[r].viewpoints.size(),
                                        .elements = memory_->maps[r].prepared.elements,
                                        .bytes = 0,
                                        .max_views = max_views_of(memory_->maps[r]).value()});
    }
    memory_->committed = true;
    return {};
  }

 private:
  std::shared_ptr<Memory> memory_;
};

class MemoryReader final : public MapReader {
 public:
  explicit MemoryReader(std::shared_ptr<Memory> memory) : memory_(std::move(memory)) {}
  [[nodiscard]] Result<MapIndex> index() const noexcept override { return memory_->index; }
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept override {
    return directory_of(memory_->index);
  }
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override {
    ++memory_->gets;
    if (memory_->unreadable.contains(region.value)) {
      return fail(ErrorCode::corrupt_data, "the file has 7 bytes, expected 12");
    }
    return memory_->maps.at(region.value);
  }

 private:
  std::shared_ptr<Memory> memory_;
};

class MemoryStore final : public MapStore {
 public:
  explicit MemoryStore(std::shared_ptr<Memory> memory) : memory_(std::move(memory)) {}
  [[nodiscard]] Result<std::unique_ptr<MapWriter>> begin(
      const MapIndex& index) const noexcept override {
    memory_->index = index;
    memory_->begun = true;
    return std::make_unique<MemoryWriter>(memory_);
  }
  [[nodiscard]] Result<std::unique_ptr<const MapReader>> open() const noexcept override {
    return std::make_unique<const MemoryReader>(memory_);
  }

 private:
  std::shared_ptr<Memory> memory_;
};

/// The bundle that a memory holds.
inline Result<Bundle> bundle_in(std::shared_ptr<Memory> memory) {
  return Bundle::of(in_process<MemoryReader, const MapReader>(std::move(memory)), "memory");
}

/// The truth that a TruthMatcher knows; the test moves it.
struct Truth {
  Pose T_map_scan;
  double coverage = 1.0;
  bool overlap = true;
  double reach = std::numeric_limits<double>::infinity();  ///< [m]; a tenth of it [rad]
  bool restorable = false;                                 ///< whether there are prepared maps
  PointCloud scan;  ///< what is prepared from its points is the scan itself, not a map
};

/// Always finds the truth, unless the scan is empty or nothing overlaps; with a reach, only from
/// guesses that near. A scan fits well only within a metre of the truth, and best at it. The truth
/// of a scan that is matched to itself is that it did not move.
class TruthMatcher final : public ScanMatcher {
 public:
  explicit TruthMatcher(std::shared_ptr<Truth> truth) : truth_(std::move(truth)) {}
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept override {
    class Target final : public MatchTarget {
     public:
      explicit Target(std::shared_ptr<Truth> truth) : truth_(std::move(truth)) {}
      [[nodiscard]] Result<Alignment> align(PointsView scan,
                                            const Pose& guess) const noexcept override {
        if (scan.empty() || !truth_->overlap) {
          return fail(ErrorCode::too_few_matches, "nothing overlaps");
        }
        Alignment alignment;
        alignment.T_map_scan = near(guess) ? truth_->T_map_scan : guess;
        alignment.termination = Termination::converged;
        alignment.score = score_at(alignment.T_map_scan);
        alignment.hessian = 1e6 * Alignment::Hessian::Identity();  // a millimetre
        return alignment;
      }
      [[nodiscard]] Result<ScanScore> score(PointsView, const Pose& pose) const noexcept override {
        return score_at(pose);
      }
      [[nodiscard]] std::size_t bytes() const noexcept override { return sizeof(*this); }
      [[nodiscard]] std::size_t elements() const noexcept override { return 1; }

     private:
      [[nodiscard]] bool near(const Pose& pose) const {
        return (pose.translation - truth_->T_map_scan.translation).norm() <= truth_->reach &&
               rotation_between(pose, truth_->T_map_scan) <= truth_->reach / 10.0;
      }
      [[nodiscard]] ScanScore score_at(const Pose& pose) const {
        const double off = (pose.translation - truth_->T_map_scan.translation).norm();
        if (near(pose) && off < 1.0) {
          const double turned = rotation_between(pose, truth_->T_map_scan);
          return {.fitness = 2.0,
                  .nvtl = 3.0 * std::exp(-std::max(off, 10.0 * turned)),
                  .coverage = truth_->coverage};
        }
        return {.fitness = 0.1, .nvtl = 1.0, .coverage = 0.1};
      }
      std::shared_ptr<Truth> truth_;
    };
    const bool itself = std::ranges::equal(map, truth_->scan);
    return std::make_unique<Target>(itself ? std::make_shared<Truth>() : truth_);
  }
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> restore(
      std::span<const std::byte> prepared) const noexcept override {
    if (!truth_->restorable) return ScanMatcher::restore(prepared);
    return prepare({});
  }

 private:
  std::shared_ptr<Truth> truth_;
};

}  // namespace vantage::test
