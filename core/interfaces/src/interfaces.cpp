// Home of every interface's vtable and type_info, so that each exists once.
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vantage/ground_filter.hpp"
#include "vantage/map_passes.hpp"
#include "vantage/map_store.hpp"
#include "vantage/map_survey.hpp"
#include "vantage/partitioner.hpp"
#include "vantage/region_directory.hpp"
#include "vantage/relocalizer.hpp"
#include "vantage/scan_matcher.hpp"
#include "vantage/selector.hpp"
#include "vantage/visibility.hpp"

namespace vantage {

MapSurvey::~MapSurvey() = default;
MapVisitor::~MapVisitor() = default;
MapPasses::~MapPasses() = default;
Partitioner::~Partitioner() = default;
GroundFilter::~GroundFilter() = default;
VisibilityOperator::~VisibilityOperator() = default;
VisibilityProgress::~VisibilityProgress() = default;
VisibilityScene::~VisibilityScene() = default;
MapWriter::~MapWriter() = default;
MapReader::~MapReader() = default;
MapStore::~MapStore() = default;
RegionDirectory::~RegionDirectory() = default;
ScanMatcher::~ScanMatcher() = default;
MatchTarget::~MatchTarget() = default;
Selector::~Selector() = default;
Relocalizer::~Relocalizer() = default;
RelocalizerIndex::~RelocalizerIndex() = default;

const char* to_string(Termination termination) noexcept {
  switch (termination) {
    case Termination::converged: return "converged";
    case Termination::max_iterations: return "max_iterations";
    case Termination::no_progress: return "no_progress";
  }
  return "unknown";
}

Result<void> MapPasses::pass_over(const Bounds2& /*area*/, MapVisitor& visitor) const noexcept {
  return pass(visitor);
}

Result<PointsView> MapPasses::in_memory() const noexcept {
  return fail(ErrorCode::unsupported, "only a part of the map is in memory at a time");
}

double GroundFilter::reach() const noexcept { return std::numeric_limits<double>::infinity(); }

double VisibilityOperator::reach(const VisibilityLimits& /*limits*/) const noexcept {
  return std::numeric_limits<double>::infinity();
}

double ScanMatcher::reach() const noexcept { return std::numeric_limits<double>::infinity(); }

Result<void> MapWriter::attach(std::string_view /*name*/,
                               std::span<const std::byte> /*bytes*/) noexcept {
  return fail(ErrorCode::unsupported, "the store keeps regions only");
}

Result<void> MapReader::attach(std::string_view /*name*/,
                               std::span<const std::byte> /*bytes*/) const noexcept {
  return fail(ErrorCode::unsupported, "the store keeps regions only");
}

Result<std::vector<std::byte>> MapReader::attachment(std::string_view name) const noexcept {
  return fail(ErrorCode::not_found, "the bundle holds no '" + std::string(name) + "'");
}

Result<PreparedMap> MatchTarget::excerpt(PointsView /*seen*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher cannot store a prepared map");
}

Result<std::vector<MapElement>> MatchTarget::elements_at(PointsView /*seen*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher does not tell its elements");
}

Result<std::vector<Pull>> MatchTarget::pulls(PointsView /*scan*/,
                                             const Pose& /*T_map_scan*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher does not tell what its elements do");
}

Result<PreparedMap> MatchTarget::excerpt_of(
    std::span<const std::uint32_t> /*seen*/,
    std::span<const std::uint32_t> /*kept*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher cannot store some of its elements");
}

Result<std::unique_ptr<MatchTarget>> ScanMatcher::restore(
    std::span<const std::byte> /*prepared*/) const noexcept {
  return fail(ErrorCode::unsupported, "the matcher cannot read a prepared map");
}

}  // namespace vantage
