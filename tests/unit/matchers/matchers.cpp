#include "matchers.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <stdexcept>

#include "support/plugins.hpp"

namespace vantage::test {

PluginPtr<MatchTarget> prepared_by(const std::string& plugin_name, PointsView map,
                                   const std::string& toml) {
  const auto matcher = plugin<ScanMatcher>(plugin_name, toml);
  auto target = matcher->prepare(map);
  if (!target) throw std::runtime_error(to_string(target.error()));
  return in_library_of(matcher, *std::move(target));
}

Alignment aligned(const MatchTarget& target, PointsView scan, const Pose& guess) {
  auto alignment = target.align(scan, guess);
  if (!alignment) throw std::runtime_error(to_string(alignment.error()));
  return *std::move(alignment);
}

Error refusal_of_map(const std::string& plugin_name, PointsView map) {
  const auto matcher = plugin<ScanMatcher>(plugin_name);
  const auto target = matcher->prepare(map);
  if (target) throw std::runtime_error(plugin_name + " takes a map that it cannot match against");
  return target.error();
}

double metres_off(const Alignment& alignment, const Pose& pose) {
  return (alignment.T_map_scan.translation - pose.translation).norm();
}

double degrees_off(const Alignment& alignment, const Pose& pose) {
  return degrees(rotation_between(alignment.T_map_scan, pose));
}

std::vector<Surfel> surfels_of(PointsView cloud, std::size_t k) {
  std::vector<Surfel> surfels;
  for (const Point& p : cloud) {
    PointCloud near(cloud.begin(), cloud.end());
    const std::size_t n = std::min(k, near.size());
    std::ranges::partial_sort(near, near.begin() + static_cast<std::ptrdiff_t>(n), {},
                              [&](const Point& q) { return (q - p).squaredNorm(); });
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < n; ++i) mean += near[i] / static_cast<double>(n);
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < n; ++i) {
      covariance += (near[i] - mean) * (near[i] - mean).transpose() / static_cast<double>(n);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(covariance);
    const bool plane = n >= 3 && solver.eigenvalues()[1] > 1e-6 * solver.eigenvalues()[2];
    surfels.push_back(
        {p, plane ? Eigen::Vector3d(solver.eigenvectors().col(0)) : Eigen::Vector3d::Zero()});
  }
  return surfels;
}

std::size_t nearest(const std::vector<Surfel>& surfels, const Point& x) {
  const auto found = std::ranges::min_element(
      surfels, {}, [&](const Surfel& s) { return (s.point - x).squaredNorm(); });
  return static_cast<std::size_t>(found - surfels.begin());
}

}  // namespace vantage::test
