#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// How far scans' positions at a place are from the truth [m]. Infinite if the elements do not hold
/// the pose.
struct PredictedError {
  Point place = Point::Zero();  ///< of the sensor, map frame [m]
  float expected = 0.0F;        ///< root mean square, with the elements that are kept
  /// What 95 % of scans keep, even with a third of their view covered: with the kept elements, and
  /// with all elements of the region.
  float error = 0.0F, whole = 0.0F;

  friend bool operator==(const PredictedError&, const PredictedError&) = default;
};

/// What a build expects of the maps whose elements a selector chose: the bias and the spread of the
/// position, where the scans were taken that the choice was made with.
struct VANTAGE_API PredictedErrors {
  /// The name of their bytes in a bundle.
  static constexpr const char* kAttachment = "predicted_errors";

  /// A region keeps a target if so many of its places do.
  static constexpr double kShare = 0.95;

  std::vector<std::vector<PredictedError>> regions;  ///< by their numbers

  /// Those of a bundle; none if no selector chose its elements.
  /// Errors: those of MapReader::attachment; `corrupt_data` for bytes that `encode` does not make.
  [[nodiscard]] static Result<std::optional<PredictedErrors>> of_bundle(const Bundle& bundle);

  /// What a region's map promises at a position: root mean squares over the four nearest places,
  /// because one says little. Nothing without a place.
  [[nodiscard]] std::optional<PredictedError> at(RegionId region, const Point& position) const;

  [[nodiscard]] std::vector<std::byte> encode() const;
  /// @param regions  the number of regions
  /// Errors: `corrupt_data`.
  [[nodiscard]] static Result<PredictedErrors> decode(std::span<const std::byte> bytes,
                                                      std::size_t regions);
};

/// The error that a share of some errors does not exceed; of fewer than 20, 95 % are all.
/// @param errors  at least one
[[nodiscard]] VANTAGE_API double error_kept_by(double share, std::vector<float> errors);

}  // namespace vantage
