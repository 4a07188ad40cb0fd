#include <Eigen/LU>
#include <algorithm>
#include <tuple>

#include "common/surfel_target.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace vantage::gicp {
namespace {

using namespace matching;

struct Params : MatchingParams {
  double epsilon = 1e-3;

  static constexpr auto schema() {
    return std::tuple_cat(
        std::tuple{optional("epsilon", &Params::epsilon, "",
                            "variance across a surface, as a share of that along it",
                            Range{.min = 0.0, .max = 1.0, .min_open = true},
                            Source{{}, "Segal et al. 2009, Sec. III-B"})},
        fields<Params>());
  }
};

/// The distance between two points, each on a plane. The position across the plane is known better
/// than along it: C = sigma^2 / epsilon (I - (1 - epsilon) n n^T) for each point, with n = 0 if
/// there is no plane.
class PlaneToPlane {
 public:
  static constexpr bool kPlanesOnly = false;
  static constexpr double kInformation = 5.0;  // chosen on the recorded street

  explicit PlaneToPlane(const Params& params)
      : precision_(params.epsilon / (params.sigma * params.sigma)),
        flatness_(1.0 - params.epsilon),
        neighbours_(params.neighbours) {}

  void begin(PointsView scan, Workspace& workspace) const {
    if (std::ranges::equal(scan, workspace.scan)) return;
    workspace.scan.clear();  // an exception must not leave the normals of another scan
    workspace.scan_normals.resize(scan.size());
    compute_normals(PointTree(scan), scan, neighbours_, workspace.scan_normals);
    workspace.scan.assign(scan.begin(), scan.end());
  }

  /// (C_q + R C_p R^T)^-1.
  [[nodiscard]] Eigen::Matrix3d information(std::size_t scan_point, const Eigen::Matrix3d& R,
                                            const Eigen::Vector3d& map_normal,
                                            const Workspace& workspace) const noexcept {
    const Eigen::Vector3d n = R * workspace.scan_normals[scan_point];
    const Eigen::Matrix3d sum =
        2.0 * Eigen::Matrix3d::Identity() -
        flatness_ * (map_normal * map_normal.transpose() + n * n.transpose());
    return precision_ * sum.inverse();
  }

  /// (C_q^-1 + R C_p^-1 R^T) / 4, which equals the above if the two normals agree. If they do not,
  /// the above is strict in no direction and gives the worst matches good scores.
  [[nodiscard]] Eigen::Matrix3d scored_information(std::size_t scan_point, const Eigen::Matrix3d& R,
                                                   const Eigen::Vector3d& map_normal,
                                                   const Workspace& workspace) const noexcept {
    const Eigen::Vector3d n = R * workspace.scan_normals[scan_point];
    // C^-1 = precision (I + flatness / epsilon n n^T).
    return 0.25 * precision_ *
           (2.0 * Eigen::Matrix3d::Identity() +
            flatness_ / (1.0 - flatness_) *
                (map_normal * map_normal.transpose() + n * n.transpose()));
  }

 private:
  double precision_, flatness_;
  std::uint32_t neighbours_;
};

/// Generalized ICP, plane to plane (Segal et al. 2009).
using Gicp = ScanMatcherOf<SurfelMatching<Params, PlaneToPlane>>;

}  // namespace
}  // namespace vantage::gicp

VANTAGE_PLUGIN(vantage::ScanMatcher, vantage::gicp::Gicp, "gicp",
               "generalized ICP, plane to plane (Segal et al. 2009)");
