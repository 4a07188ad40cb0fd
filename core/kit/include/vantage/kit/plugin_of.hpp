#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "vantage/kit/map_in_memory.hpp"
#include "vantage/plugin.hpp"

/// Templates for plugins that consist of parameters and one function. They make the class that
/// VANTAGE_PLUGIN takes: it keeps the parameters and lets no exception out. A larger plugin
/// implements its interface directly.
namespace vantage {

/// The common part of the templates.
template <class Derived, class Interface, class P>
class MadeOf : public Interface {
 public:
  using Params = P;
  explicit MadeOf(const Params& params) : params_(params) {}
  [[nodiscard]] static Result<std::unique_ptr<Interface>> create(const Params& params) {
    return std::make_unique<Derived>(params);
  }

 protected:
  Params params_;
};

/// @tparam P  parameters with
///     Result<Partition> partition(const MapPasses& map, PointsView trajectory,
///                                 const MapSurvey& survey) const;
/// or, if it needs the whole map at once,
///     Result<Partition> partition(PointsView map, PointsView trajectory,
///                                 const MapSurvey& survey) const;
/// The function gets only maps with points, which check_points accepts.
template <class P>
class PartitionerOf final : public MadeOf<PartitionerOf<P>, Partitioner, P> {
 public:
  using MadeOf<PartitionerOf<P>, Partitioner, P>::MadeOf;
  [[nodiscard]] Result<Partition> partition(const MapPasses& map, PointsView trajectory,
                                            const MapSurvey& survey) const noexcept override {
    return guarded([&]() -> Result<Partition> {
      const Result<PointsView> points = map.in_memory();
      if (points) VANTAGE_CHECK(check_points(*points, "the map"));
      if (map.points() == 0) return fail(ErrorCode::invalid_input, "the map has no points");
      if constexpr (requires(const P& params) { params.partition(map, trajectory, survey); }) {
        return this->params_.partition(map, trajectory, survey);
      } else {
        if (!points) return fail(points.error());
        return this->params_.partition(*points, trajectory, survey);
      }
    });
  }
};

/// @tparam P  parameters with
///     Result<IndexList> ground(PointsView cloud) const;
/// and, if it does not need the whole map at once,
///     double reach() const;
template <class P>
class GroundFilterOf final : public MadeOf<GroundFilterOf<P>, GroundFilter, P> {
 public:
  using MadeOf<GroundFilterOf<P>, GroundFilter, P>::MadeOf;
  [[nodiscard]] Result<IndexList> ground(PointsView cloud) const noexcept override {
    return guarded([&]() -> Result<IndexList> { return this->params_.ground(cloud); });
  }
  [[nodiscard]] double reach() const noexcept override {
    if constexpr (requires(const P& params) { params.reach(); }) {
      return this->params_.reach();
    } else {
      return GroundFilter::reach();
    }
  }
};

/// @tparam P  parameters with
///     Result<std::unique_ptr<VisibilityScene>> prepare(PointsView map,
///                                                      const VisibilityLimits& limits) const;
/// and, if it does not need the whole map at once,
///     double reach(const VisibilityLimits& limits) const;
template <class P>
class VisibilityOperatorOf final : public MadeOf<VisibilityOperatorOf<P>, VisibilityOperator, P> {
 public:
  using MadeOf<VisibilityOperatorOf<P>, VisibilityOperator, P>::MadeOf;
  [[nodiscard]] Result<std::unique_ptr<VisibilityScene>> prepare(
      PointsView map, const VisibilityLimits& limits) const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<VisibilityScene>> {
      return this->params_.prepare(map, limits);
    });
  }
  [[nodiscard]] double reach(const VisibilityLimits& limits) const noexcept override {
    if constexpr (requires(const P& params) { params.reach(limits); }) {
      return this->params_.reach(limits);
    } else {
      return VisibilityOperator::reach(limits);
    }
  }
};

/// @tparam P  parameters with
///     Result<std::unique_ptr<MatchTarget>> prepare(PointsView map) const;
/// and, if the matcher can read what it has stored,
///     Result<std::unique_ptr<MatchTarget>> restore(std::span<const std::byte> prepared) const;
/// and, if `prepare` does not need the whole map at once for that,
///     double reach() const;
template <class P>
class ScanMatcherOf final : public MadeOf<ScanMatcherOf<P>, ScanMatcher, P> {
  using Target = std::unique_ptr<MatchTarget>;

 public:
  using MadeOf<ScanMatcherOf<P>, ScanMatcher, P>::MadeOf;
  [[nodiscard]] Result<Target> prepare(PointsView map) const noexcept override {
    return guarded([&]() -> Result<Target> { return this->params_.prepare(map); });
  }
  [[nodiscard]] Result<Target> restore(
      std::span<const std::byte> prepared) const noexcept override {
    if constexpr (requires(const P& params) { params.restore(prepared); }) {
      return guarded([&]() -> Result<Target> { return this->params_.restore(prepared); });
    } else {
      return ScanMatcher::restore(prepared);
    }
  }
  [[nodiscard]] double reach() const noexcept override {
    if constexpr (requires(const P& params) { params.reach(); }) {
      return this->params_.reach();
    } else {
      return ScanMatcher::reach();
    }
  }
};

/// @tparam P  parameters with
///     Result<std::vector<std::uint32_t>> order(const RegionElements& region,
///                                              std::size_t most) const;
template <class P>
class SelectorOf final : public MadeOf<SelectorOf<P>, Selector, P> {
 public:
  using MadeOf<SelectorOf<P>, Selector, P>::MadeOf;
  [[nodiscard]] Result<std::vector<std::uint32_t>> order(const RegionElements& region,
                                                         std::size_t most) const noexcept override {
    return guarded(
        [&]() -> Result<std::vector<std::uint32_t>> { return this->params_.order(region, most); });
  }
};

/// @tparam P  parameters with
///     Result<std::vector<std::byte>> index(const MapPasses& map) const;
/// or, if it needs the whole map at once, which takes 24 bytes a point,
///     Result<std::vector<std::byte>> index(PointsView map) const;
/// and
///     Result<std::unique_ptr<RelocalizerIndex>> open(std::span<const std::byte> index) const;
/// The functions get only maps with points.
template <class P>
class RelocalizerOf final : public MadeOf<RelocalizerOf<P>, Relocalizer, P> {
  using Index = std::unique_ptr<RelocalizerIndex>;

 public:
  using MadeOf<RelocalizerOf<P>, Relocalizer, P>::MadeOf;
  [[nodiscard]] Result<std::vector<std::byte>> index(const MapPasses& map) const noexcept override {
    return guarded([&]() -> Result<std::vector<std::byte>> {
      if (map.points() == 0) return fail(ErrorCode::invalid_input, "the map has no points");
      if constexpr (requires(const P& params) { params.index(map); }) {
        return this->params_.index(map);
      } else if (const Result<PointsView> all = map.in_memory()) {
        return this->params_.index(*all);
      } else {
        VANTAGE_TRY(const PointCloud points, points_of(map));
        return this->params_.index(points);
      }
    });
  }
  [[nodiscard]] Result<Index> open(std::span<const std::byte> index) const noexcept override {
    return guarded([&]() -> Result<Index> { return this->params_.open(index); });
  }
};

}  // namespace vantage
