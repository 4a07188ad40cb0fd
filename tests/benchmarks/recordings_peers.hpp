#pragma once

#include <cstddef>
#include <filesystem>

#include "vantage/point_cloud.hpp"

// PCL's readers and a writer, in a file of their own, so that its headers are in no other.
namespace vantage::benchmarks {

/// The points that PCL reads from a PCD or PLY file, by its suffix.
[[nodiscard]] std::size_t read_by_pcl(const std::filesystem::path& path);

/// Writes a PCD file, binary_compressed, float32.
void write_compressed_pcd(const std::filesystem::path& path, PointsView points);

}  // namespace vantage::benchmarks
