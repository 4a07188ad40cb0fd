#include <pcl/io/pcd_io.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <stdexcept>

#include "recordings_peers.hpp"

namespace vantage::benchmarks {

std::size_t read_by_pcl(const std::filesystem::path& path) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  const int status = path.extension() == ".ply" ? pcl::io::loadPLYFile(path.string(), cloud)
                                                : pcl::io::loadPCDFile(path.string(), cloud);
  if (status < 0) throw std::runtime_error("PCL cannot read " + path.string());
  return cloud.size();
}

void write_compressed_pcd(const std::filesystem::path& path, PointsView points) {
  pcl::PointCloud<pcl::PointXYZ> cloud;
  for (const Point& point : points) {
    const Eigen::Vector3f p = point.cast<float>();
    cloud.emplace_back(p.x(), p.y(), p.z());
  }
  pcl::io::savePCDFileBinaryCompressed(path.string(), cloud);
}

}  // namespace vantage::benchmarks
