#pragma once

#include <memory>

#include "vantage/point_cloud.hpp"

namespace vantage::benchmarks {

/// A cloud in PCL's own form, and PCL's ground filters on it: cells of 1 m, windows up to 33 m
/// (exponential, base 2), slope 0.3, distances of 0.3 to 2.5 m, one thread.
class PclGround {
 public:
  explicit PclGround(PointsView cloud);
  ~PclGround();
  PclGround(const PclGround&) = delete;
  PclGround& operator=(const PclGround&) = delete;

  /// pcl::ProgressiveMorphologicalFilter. @return  the indices of the ground
  [[nodiscard]] IndexList progressive() const;
  /// pcl::ApproximateProgressiveMorphologicalFilter.
  [[nodiscard]] IndexList approximate() const;

 private:
  struct Cloud;
  std::unique_ptr<Cloud> cloud_;
};

}  // namespace vantage::benchmarks
