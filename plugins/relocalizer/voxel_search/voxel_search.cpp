#include <Eigen/Geometry>
#include <cmath>
#include <cstddef>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "level.hpp"
#include "place_index.hpp"
#include "place_search.hpp"
#include "upright.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace vantage::voxel_search {
namespace {

Pose level_of(PointsView scan, const std::optional<Eigen::Vector3d>& up) {
  if (!up) return level_by_ground(scan);
  Pose T_level_sensor;
  T_level_sensor.rotation = Eigen::Quaterniond::FromTwoVectors(*up, Eigen::Vector3d::UnitZ());
  return T_level_sensor;
}

/// The area with the heading of the levelled frame's x axis in place of the sensor's.
PlaceArea levelled(PlaceArea area, const Pose& T_level_sensor) {
  // If the given up direction is a few degrees off, the heading of a steeper axis is arbitrary.
  constexpr double kSteep = 0.2;  // length in plan view
  const Eigen::Vector3d x_axis = T_level_sensor.rotation * Eigen::Vector3d::UnitX();
  if (x_axis.head<2>().norm() < kSteep) {
    area.heading_within = std::numbers::pi;
  } else {
    area.heading -= std::atan2(x_axis.y(), x_axis.x());
  }
  return area;
}

class Index final : public RelocalizerIndex {
 public:
  explicit Index(PlaceIndex places) : places_(std::move(places)) {}

  [[nodiscard]] Result<PoseCandidates> find(PointsView scan,
                                            const PlaceQuery& query) const noexcept override {
    return guarded([&]() -> Result<PoseCandidates> {
      constexpr double kWordsPerMs = 400e3;
      if (!all_finite(scan)) {
        return fail(ErrorCode::invalid_input, "a point of the scan is not finite");
      }
      const Pose T_level_sensor = level_of(scan, query.up);
      PointCloud level;
      level.reserve(scan.size());
      for (const Point& p : scan) level.push_back(T_level_sensor * p);
      PlacesFound found = find_places(places_, upright_part(level),
                                      levelled(query.area, T_level_sensor), query.most, query.stop);
      for (PoseCandidate& place : found.places)
        place.T_map_scan = place.T_map_scan * T_level_sensor;
      return PoseCandidates{.poses = std::move(found.places),
                            .nominal_ms = static_cast<double>(found.words) / kWordsPerMs};
    });
  }
  [[nodiscard]] std::size_t bytes() const noexcept override {
    return places_.bytes() + kBytesToFind;
  }

 private:
  PlaceIndex places_;
};

/// Compares bits of voxels at all translations and headings.
struct VoxelSearch {
  static constexpr auto schema() { return std::tuple{}; }

  [[nodiscard]] Result<std::vector<std::byte>> index(const MapPasses& map) const {
    class Visitor final : public MapVisitor {
     public:
      explicit Visitor(PlaceIndex::Builder& builder) : builder_(builder) {}
      [[nodiscard]] Result<void> see(PointsView points) noexcept override {
        return guarded([&]() -> Result<void> {
          builder_.add(points);
          return {};
        });
      }

     private:
      PlaceIndex::Builder& builder_;
    };
    VANTAGE_TRY(PlaceIndex::Builder builder, PlaceIndex::Builder::over(map.bounds()));
    Visitor visitor(builder);
    VANTAGE_CHECK(map.pass(visitor));
    VANTAGE_TRY(const PlaceIndex places, std::move(builder).finish());
    return places.encode();
  }

  [[nodiscard]] Result<std::unique_ptr<RelocalizerIndex>> open(
      std::span<const std::byte> index) const {
    VANTAGE_TRY(PlaceIndex places, PlaceIndex::decode(index));
    return std::make_unique<Index>(std::move(places));
  }
};

}  // namespace
}  // namespace vantage::voxel_search

VANTAGE_PLUGIN(vantage::Relocalizer, vantage::RelocalizerOf<vantage::voxel_search::VoxelSearch>,
               "voxel_search", "occupied voxels at all places and headings, blocks of eight first");
