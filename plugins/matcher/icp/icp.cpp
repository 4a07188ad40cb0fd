#include "common/surfel_target.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace vantage::icp {
namespace {

using namespace matching;

struct Params : MatchingParams {
  static constexpr auto schema() { return fields<Params>(); }
};

/// The distance of a scan point from the plane through the map point nearest to it.
class PointToPlane {
 public:
  static constexpr bool kPlanesOnly = true;
  static constexpr double kInformation = 0.55;  // chosen on the recorded street

  explicit PointToPlane(const Params& params) : precision_(1.0 / (params.sigma * params.sigma)) {}

  void begin(PointsView /*scan*/, Workspace& /*workspace*/) const {}
  [[nodiscard]] Eigen::Matrix3d information(std::size_t /*scan_point*/,
                                            const Eigen::Matrix3d& /*R*/,
                                            const Eigen::Vector3d& map_normal,
                                            const Workspace& /*workspace*/) const noexcept {
    return precision_ * map_normal * map_normal.transpose();
  }
  [[nodiscard]] Eigen::Matrix3d scored_information(std::size_t scan_point, const Eigen::Matrix3d& R,
                                                   const Eigen::Vector3d& map_normal,
                                                   const Workspace& workspace) const noexcept {
    return information(scan_point, R, map_normal, workspace);
  }

 private:
  double precision_;
};

/// Point-to-plane ICP (Chen and Medioni 1992).
using Icp = ScanMatcherOf<SurfelMatching<Params, PointToPlane>>;

}  // namespace
}  // namespace vantage::icp

VANTAGE_PLUGIN(vantage::ScanMatcher, vantage::icp::Icp, "icp",
               "iterative closest points, point to plane (Chen and Medioni 1992)");
