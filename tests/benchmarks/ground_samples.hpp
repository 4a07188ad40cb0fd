#pragma once

#include <array>
#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "vantage/point_cloud.hpp"

namespace vantage::benchmarks {

/// The samples of the ISPRS filter test in the recorded data: isprs_ground/samp<name>.pcd.
inline const std::array<std::string, 8> kGroundSamples{"11", "21", "23", "31",
                                                       "42", "52", "53", "61"};

inline constexpr std::size_t kMany = 500'000;  ///< points of a map of some size

struct LabelledCloud {
  PointCloud points;
  std::vector<bool> is_ground;  ///< by point; false where the file has no labels
};

/// Reads a binary PCD with float x y z and perhaps a 32-bit label, where 1 is ground.
/// Throws `std::runtime_error` for any other file.
[[nodiscard]] LabelledCloud read_labelled(const std::filesystem::path& file);

/// In the order of kGroundSamples.
[[nodiscard]] std::vector<LabelledCloud> ground_samples(const std::filesystem::path& folder);

/// What is told wrongly of a labelled cloud (Sithole and Vosselman 2004) [%].
struct GroundErrors {
  double type_1;  ///< of the ground: taken for objects
  double type_2;  ///< of the objects: taken for ground
  double total;   ///< of all points
  double kappa;   ///< agreement beyond chance (Cohen 1960)
};
[[nodiscard]] GroundErrors errors_of(const LabelledCloud& cloud, const IndexList& ground);

/// The clouds side by side along x, each beginning at a whole metre, with 40 m without points
/// between them, more than windows span. Each point is there as often as it takes for at least
/// `least` points in all, the copies within 0.25 m of it in the plan: the same terrain seen by a
/// denser scan.
[[nodiscard]] LabelledCloud side_by_side(std::span<const LabelledCloud> clouds, std::size_t least);

}  // namespace vantage::benchmarks
