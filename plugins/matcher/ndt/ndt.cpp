#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/answer.hpp"
#include "common/step_params.hpp"
#include "excerpt.hpp"
#include "newton.hpp"
#include "objective.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace vantage::ndt {
namespace {

// A scan of at least twice as many points is first aligned with about this many of them, until the
// steps are smaller than a multiple of the epsilons.
constexpr std::size_t kCoarsePoints = 1024;
constexpr double kCoarseEpsilon = 10.0;

/// Normal distributions transform, point to distribution (Magnusson 2009).
struct Params : matching::StepParams {
  Params() { max_iterations = 35; }

  double resolution = 1.0;
  Neighbours neighbours = Neighbours::direct7;
  Optimizer optimizer = Optimizer::newton;
  double outlier_ratio = 0.55;
  std::uint32_t min_points_per_voxel = 6;
  double eigenvalue_floor = 0.01;
  std::optional<double> d1, d2, d3;

  static constexpr auto schema() {
    constexpr Source kCoefficients{"Eq. 12", "Magnusson 2009, Eqs. 6.8-6.9"};
    constexpr std::tuple map_and_search{
        optional("resolution", &Params::resolution, "m", "edge of a voxel", positive,
                 Source{{}, "Magnusson 2009, ch. 6"}),
        optional("neighbours", &Params::neighbours, "",
                 "which voxels a scan point is compared with", Source{{}, "K. Koide's ndt_omp"}),
        optional("optimizer", &Params::optimizer, "", "how steps are computed"),
        optional("outlier_ratio", &Params::outlier_ratio, "",
                 "share of outliers from which d1, d2, d3 are derived", strictly_between(0.0, 1.0),
                 kCoefficients),
        optional("min_points_per_voxel", &Params::min_points_per_voxel, "points",
                 "a voxel with fewer points has no distribution", at_least(3)),
        optional("eigenvalue_floor", &Params::eigenvalue_floor, "",
                 "covariance eigenvalues are at least this share of the largest",
                 Range{.min = 0.0, .max = 1.0, .min_open = true})};
    constexpr std::tuple scoring{
        optional("d1", &Params::d1, "",
                 "coefficient of S_fitness, given with d2 and d3; derived if left out",
                 kCoefficients),
        optional("d2", &Params::d2, "",
                 "coefficient of S_fitness, given with d1 and d3; derived if left out", positive,
                 kCoefficients),
        optional("d3", &Params::d3, "",
                 "coefficient of S_fitness, given with d1 and d2; derived if left out",
                 kCoefficients)};
    return std::tuple_cat(
        map_and_search,
        step_fields<Params>(
            {.max_iterations = "limit of Newton steps",
             .min_matches =
                 "minimum number of scan points with a voxel; with fewer, matching fails",
             .min_coverage =
                 "minimum share of scan points with a voxel; with less, matching fails"}),
        scoring);
  }

  [[nodiscard]] VoxelOptions voxels() const {
    return {.resolution = resolution,
            .min_points = min_points_per_voxel,
            .eigenvalue_floor = eigenvalue_floor};
  }

  [[nodiscard]] NewtonOptions newton() const { return {steps(), optimizer}; }

  [[nodiscard]] Result<NdtCoefficients> coefficients() const {
    if (d1 && d2 && d3) return NdtCoefficients{*d1, *d2, *d3};
    return NdtCoefficients::derive(outlier_ratio, resolution);
  }

  [[nodiscard]] Result<void> validate() const {
    if (d1.has_value() != d2.has_value() || d1.has_value() != d3.has_value()) {
      return fail_at({"d1", "d2", "d3"}, "d1, d2 and d3 belong together: give all three or none");
    }
    if (d1 && *d1 == 0.0) return fail_at({"d1"}, "d1 must not be 0");
    const auto derived = coefficients();
    if (!derived || !(std::abs(derived->d1) > 0.0) || !(derived->d2 > 0.0) ||
        !std::isfinite(derived->d1) || !std::isfinite(derived->d2) || !std::isfinite(derived->d3)) {
      return fail_at({"d1", "resolution", "outlier_ratio"},
                     "resolution " + std::to_string(resolution) + " m and outlier ratio " +
                         std::to_string(outlier_ratio) + " give no usable d1, d2, d3");
    }
    return {};
  }

  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(PointsView map) const;
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> restore(
      std::span<const std::byte> prepared) const;

 private:
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> target_of(VoxelMap map) const;
};

class NdtTarget final : public MatchTarget {
 public:
  NdtTarget(Objective objective, const Params& params)
      : objective_(std::move(objective)), params_(params) {}

  [[nodiscard]] Result<Alignment> align(PointsView scan,
                                        const Pose& T_map_scan_guess) const noexcept override {
    const auto align_with = [&](Workspace& workspace) -> Result<Alignment> {
      objective_.begin(scan, workspace);
      const Pose guess = objective_.to_local(T_map_scan_guess);
      const Start start = nearer(guess, scan.size(), workspace);
      NewtonOptions options = params_.newton();
      options.max_iterations -= start.iterations;
      const Derivatives at_start =
          objective_.derivatives(start.T_local_scan, workspace, extent_of(options));
      VANTAGE_CHECK(check_overlap(at_start.matched, scan.size(), "at the guess"));

      Minimum minimum = minimize(objective_, start.T_local_scan, at_start, options, workspace);
      if (options.optimizer != Optimizer::newton) {
        minimum.at = objective_.derivatives(minimum.T_local_scan, workspace);
      }
      VANTAGE_CHECK(check_overlap(minimum.at.matched, scan.size(), "at the solution"));
      return Alignment{.T_map_scan = objective_.to_map(minimum.T_local_scan),
                       .termination = minimum.termination,
                       .iterations = start.iterations + minimum.iterations,
                       .score = minimum.at.score,
                       .hessian = minimum.at.hessian};
    };
    return matching::answer_with<Alignment>(workspaces_, scan, T_map_scan_guess, align_with);
  }

  [[nodiscard]] Result<ScanScore> score(PointsView scan,
                                        const Pose& T_map_scan) const noexcept override {
    return matching::answer_with<ScanScore>(
        workspaces_, scan, T_map_scan, [&](Workspace& workspace) {
          objective_.begin(scan, workspace);
          return objective_.score(objective_.to_local(T_map_scan), workspace);
        });
  }

  [[nodiscard]] std::size_t bytes() const noexcept override {
    return sizeof(*this) + objective_.map().bytes();
  }
  [[nodiscard]] std::size_t elements() const noexcept override {
    return objective_.map().cells().size();
  }

  [[nodiscard]] Result<PreparedMap> excerpt(PointsView seen) const noexcept override {
    return guarded([&]() -> Result<PreparedMap> {
      if (!seen.empty()) VANTAGE_CHECK(check_points(seen, "what is seen"));
      const std::vector<std::uint32_t> which = gaussians_at(objective_.map(), seen);
      return PreparedMap{.bytes = encode(objective_.map(), which), .elements = which.size()};
    });
  }

 private:
  struct Start {
    Pose T_local_scan;
    std::uint32_t iterations = 0;  // spent on this start
  };
  /// Goes most of the way with a part of a large scan's points.
  [[nodiscard]] Start nearer(const Pose& guess, std::size_t points, Workspace& workspace) const {
    NewtonOptions options = params_.newton();
    options.stride = points / kCoarsePoints;
    if (options.stride < 2) return {guess};
    options.translation_epsilon *= kCoarseEpsilon;
    options.rotation_epsilon *= kCoarseEpsilon;
    const Derivatives at = objective_.derivatives(guess, workspace, extent_of(options));
    if (at.matched * options.stride < params_.least_overlap().of(points))
      return {guess};  // all are asked next
    const Minimum coarse = minimize(objective_, guess, at, options, workspace);
    return {coarse.T_local_scan, coarse.iterations};
  }

  [[nodiscard]] Result<void> check_overlap(std::size_t matched, std::size_t points,
                                           const char* where) const {
    return params_.least_overlap().check(matched, points, "a map voxel", where);
  }

  Objective objective_;
  Params params_;
  mutable matching::WorkspacePool<Workspace> workspaces_;
};

Result<std::unique_ptr<MatchTarget>> Params::target_of(VoxelMap map) const {
  VANTAGE_TRY(const NdtCoefficients derived, coefficients());
  return std::make_unique<NdtTarget>(Objective(std::move(map), neighbours, derived), *this);
}

Result<std::unique_ptr<MatchTarget>> Params::prepare(PointsView map) const {
  VANTAGE_TRY(VoxelMap built, VoxelMap::build(map, voxels()));
  return target_of(std::move(built));
}

Result<std::unique_ptr<MatchTarget>> Params::restore(std::span<const std::byte> prepared) const {
  VANTAGE_TRY(VoxelMap stored, decode(prepared, voxels()));
  return target_of(std::move(stored));
}

}  // namespace
}  // namespace vantage::ndt

VANTAGE_PLUGIN(vantage::ScanMatcher, vantage::ScanMatcherOf<vantage::ndt::Params>, "ndt",
               "normal distributions transform, point to distribution (Magnusson 2009)");
