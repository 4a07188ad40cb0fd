#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/segmentation/approximate_progressive_morphological_filter.h>
#include <pcl/segmentation/progressive_morphological_filter.h>

#include "ground_peers.hpp"

namespace vantage::benchmarks {
namespace {

/// Both filters have the same setters, and no common base with them.
template <class Filter>
IndexList ground_of(Filter& filter, const pcl::PointCloud<pcl::PointXYZ>::ConstPtr& cloud) {
  filter.setInputCloud(cloud);
  filter.setCellSize(1.0F);
  filter.setMaxWindowSize(33);
  filter.setExponential(true);
  filter.setBase(2.0F);
  filter.setSlope(0.3F);
  filter.setInitialDistance(0.3F);
  filter.setMaxDistance(2.5F);
  pcl::Indices indices;
  filter.extract(indices);
  return {indices.begin(), indices.end()};
}

}  // namespace

struct PclGround::Cloud {
  pcl::PointCloud<pcl::PointXYZ>::Ptr points = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
};

PclGround::PclGround(PointsView cloud) : cloud_(std::make_unique<Cloud>()) {
  cloud_->points->reserve(cloud.size());
  for (const Point& p : cloud) {
    const Eigen::Vector3f f = p.cast<float>();
    cloud_->points->emplace_back(f.x(), f.y(), f.z());
  }
}
PclGround::~PclGround() = default;

IndexList PclGround::progressive() const {
  pcl::ProgressiveMorphologicalFilter<pcl::PointXYZ> filter;
  return ground_of(filter, cloud_->points);
}

IndexList PclGround::approximate() const {
  pcl::ApproximateProgressiveMorphologicalFilter<pcl::PointXYZ> filter;
  filter.setNumberOfThreads(1);  // more race for the cells of its raster
  return ground_of(filter, cloud_->points);
}

}  // namespace vantage::benchmarks
