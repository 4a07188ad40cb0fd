#include <memory>
#include <tuple>
#include <utility>

#include "common/surfel_target.hpp"
#include "vantage/plugin.hpp"

namespace vantage::icp {
namespace {

using namespace matching;

struct Params : MatchingParams {
  static constexpr auto schema() { return fields<Params>(); }
};

/// The distance of a scan point from the plane through the map point nearest to it.
class PointToPlane {
 public:
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
class Icp final : public ScanMatcher {
 public:
  using Params = icp::Params;

  [[nodiscard]] static Result<std::unique_ptr<ScanMatcher>> create(const Params& params) {
    VANTAGE_TRY(const NdtCoefficients coefficients, score_coefficients());
    return std::make_unique<Icp>(params, coefficients);
  }
  Icp(const Params& params, const NdtCoefficients& coefficients)
      : params_(params), coefficients_(coefficients) {}

  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<MatchTarget>> {
      VANTAGE_TRY(SurfelMap surfels, SurfelMap::build(map, {.voxel = params_.map_voxel,
                                                            .neighbours = params_.neighbours,
                                                            .planes_only = true}));
      return std::make_unique<SurfelTarget<PointToPlane>>(std::move(surfels), params_,
                                                          coefficients_, PointToPlane(params_));
    });
  }

 private:
  Params params_;
  NdtCoefficients coefficients_;
};

}  // namespace
}  // namespace vantage::icp

VANTAGE_PLUGIN(vantage::ScanMatcher, vantage::icp::Icp, "icp",
               "iterative closest points, point to plane (Chen and Medioni 1992)");
