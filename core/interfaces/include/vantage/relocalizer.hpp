#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <stop_token>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/map_passes.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/pose.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// An area in which a sensor may be.
struct PlaceArea {
  Eigen::Matrix<double, 2, 1, Eigen::DontAlign> centre{0.0, 0.0};  ///< map frame [m]
  double radius = std::numeric_limits<double>::infinity();         ///< in plan view [m]
  double heading = 0.0;                                            ///< of the sensor's x axis [rad]
  double heading_within = std::numbers::pi;  ///< to either side of `heading` [rad]
  bool complete = true;                      ///< whether the sensor cannot be outside the area
};

/// What a relocalizer is asked about a scan.
struct PlaceQuery {
  PlaceArea area = {};
  /// Up in the sensor frame, to a few degrees. None: the sensor may be held at a tilt.
  std::optional<Eigen::Vector3d> up = Eigen::Vector3d::UnitZ();
  std::size_t most = 16;      ///< this many poses at most
  std::stop_token stop = {};  ///< ends the search early; the answer is then worthless
};

/// A pose from which a scan may have been taken, near enough that a matcher can align the scan.
struct PoseCandidate {
  Pose T_map_scan;
  /// How much better the scan fits here than by chance. Only ratios count: the engine leaves out
  /// the candidates with less than 0.4 of the best one's score.
  double score = 0.0;
};

struct PoseCandidates {
  std::vector<PoseCandidate> poses = {};  ///< no two of them alike, the greatest score first
  /// What the search costs on one core, by its work: the same on any machine, under any load. The
  /// engine compares it with LocalizerParams::search_budget.
  double nominal_ms = 0.0;
};

/// An index that is open for searching. It owns all its data.
/// Thread safety: `find` may run on one object from many threads at once. An answer depends neither
/// on the number of threads nor on earlier calls.
class VANTAGE_API RelocalizerIndex {
 public:
  virtual ~RelocalizerIndex();

  /// @param scan  N points, sensor frame [m]; finite, evenly thinned; may be empty
  [[nodiscard]] virtual Result<PoseCandidates> find(PointsView scan,
                                                    const PlaceQuery& query) const noexcept = 0;
  /// Memory that the index holds, and that a `find` takes beside it [bytes]. It counts in the
  /// engine's limit on the memory of maps.
  [[nodiscard]] virtual std::size_t bytes() const noexcept = 0;
};

/// Finds where in a wide-area map a scan may have been taken. The engine decides when it asks, and
/// aligns and weighs the answers.
/// Thread safety: const methods may run on one object from many threads at once.
class VANTAGE_API Relocalizer {
 public:
  virtual ~Relocalizer();

  /// What a search needs to know of a map; a bundle keeps it. It depends on the points alone, and
  /// neither on their order nor on the parts in which they come.
  /// Errors: `invalid_input` for a map without points; `unsupported` for one that cannot be
  /// indexed, as it is too large: the bundle then has no index, and no sensor is searched for.
  [[nodiscard]] virtual Result<std::vector<std::byte>> index(
      const MapPasses& map) const noexcept = 0;

  /// Errors: `corrupt_data` for bytes that no `index` makes; `invalid_input` for an index that was
  /// made with parameters that contradict those of this relocalizer.
  [[nodiscard]] virtual Result<std::unique_ptr<RelocalizerIndex>> open(
      std::span<const std::byte> index) const noexcept = 0;
};

}  // namespace vantage
