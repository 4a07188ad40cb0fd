#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "vantage/api.hpp"
#include "vantage/engine/bundle.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// What 95 % of scans at a place are expected to keep, even with a third of their view covered: the
/// distance of their positions from the truth [m]. Infinite if the elements do not hold the pose.
struct PredictedError {
  Point place = Point::Zero();  ///< of the sensor, map frame [m]
  float error = 0.0F;           ///< with the elements that are kept
  float whole = 0.0F;           ///< with all elements of the region

  friend bool operator==(const PredictedError&, const PredictedError&) = default;
};

/// What a build expects of the maps whose elements a selector chose: the bias and the spread of the
/// position, at places that judge the choice. The choice was made with others, where there are any.
struct VANTAGE_API PredictedErrors {
  /// The name of their bytes in a bundle.
  static constexpr const char* kAttachment = "predicted_errors";

  /// A region keeps a target if so many of its places do.
  static constexpr double kShare = 0.95;

  std::vector<std::vector<PredictedError>> regions;  ///< by their numbers

  /// Those of a bundle; none if no selector chose its elements.
  /// Errors: those of MapReader::attachment; `corrupt_data` for bytes that `encode` does not make.
  [[nodiscard]] static Result<std::optional<PredictedErrors>> of_bundle(const Bundle& bundle);

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
