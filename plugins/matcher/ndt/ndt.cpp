#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/guards.hpp"
#include "common/workspace_pool.hpp"
#include "excerpt.hpp"
#include "newton.hpp"
#include "objective.hpp"
#include "vantage/plugin.hpp"

namespace vantage::ndt {
namespace {

// A scan of at least twice as many points is first aligned with about this many of them, until the
// steps are smaller than a multiple of the epsilons.
constexpr std::size_t kCoarsePoints = 1024;
constexpr double kCoarseEpsilon = 10.0;

struct Params {
  double resolution = 1.0;
  Neighbours neighbours = Neighbours::direct7;
  Optimizer optimizer = Optimizer::newton;
  double outlier_ratio = 0.55;
  std::uint32_t min_points_per_voxel = 6;
  double eigenvalue_floor = 0.01;
  std::uint32_t max_iterations = 35;
  double translation_epsilon = 1e-3;
  double rotation_epsilon = 1e-4;
  double max_step_translation = 0.5;
  double max_step_rotation = 0.1;
  std::uint32_t min_matches = 20;
  double min_coverage = 0.05;
  std::optional<double> d1, d2, d3;

  static constexpr auto schema() {
    constexpr Source kCoefficients{"Eq. 12", "Magnusson 2009, Eqs. 6.8-6.9"};
    return std::tuple{
        optional("resolution", &Params::resolution, "m", "edge of a voxel", positive,
                 Source{{}, "Magnusson 2009, ch. 6"}),
        optional("neighbours", &Params::neighbours, "",
                 "which voxels a scan point is compared with", Source{{}, "K. Koide's ndt_omp"}),
        optional("optimizer", &Params::optimizer, "", "what steps are made of"),
        optional("outlier_ratio", &Params::outlier_ratio, "",
                 "share of outliers from which d1, d2, d3 are derived", strictly_between(0.0, 1.0),
                 kCoefficients),
        optional("min_points_per_voxel", &Params::min_points_per_voxel, "points",
                 "a voxel with fewer has no distribution", at_least(3)),
        optional("eigenvalue_floor", &Params::eigenvalue_floor, "",
                 "covariance eigenvalues are at least this share of the largest",
                 Range{.min = 0.0, .max = 1.0, .min_open = true}),
        optional("max_iterations", &Params::max_iterations, "", "limit of Newton steps",
                 at_least(1)),
        optional("translation_epsilon", &Params::translation_epsilon, "m",
                 "a step shorter than this, and than rotation_epsilon, is the last", positive),
        optional("rotation_epsilon", &Params::rotation_epsilon, "rad",
                 "a step shorter than this, and than translation_epsilon, is the last", positive),
        optional("max_step_translation", &Params::max_step_translation, "m",
                 "longer steps are shortened to this", positive),
        optional("max_step_rotation", &Params::max_step_rotation, "rad",
                 "longer steps are shortened to this", positive),
        optional("min_matches", &Params::min_matches, "points",
                 "with fewer scan points that have a voxel there is no answer", at_least(1)),
        optional("min_coverage", &Params::min_coverage, "",
                 "with a smaller share of scan points that have a voxel there is no answer",
                 between(0.0, 1.0)),
        optional("d1", &Params::d1, "",
                 "coefficient of S_fitness, given with d2 and d3; derived if left out",
                 kCoefficients),
        optional("d2", &Params::d2, "",
                 "coefficient of S_fitness, given with d1 and d3; derived if left out", positive,
                 kCoefficients),
        optional("d3", &Params::d3, "",
                 "coefficient of S_fitness, given with d1 and d2; derived if left out",
                 kCoefficients)};
  }

  [[nodiscard]] VoxelOptions voxels() const {
    return {.resolution = resolution,
            .min_points = min_points_per_voxel,
            .eigenvalue_floor = eigenvalue_floor};
  }

  [[nodiscard]] NewtonOptions newton() const {
    return {.optimizer = optimizer,
            .max_iterations = max_iterations,
            .translation_epsilon = translation_epsilon,
            .rotation_epsilon = rotation_epsilon,
            .max_step_translation = max_step_translation,
            .max_step_rotation = max_step_rotation};
  }

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
};

class NdtTarget final : public MatchTarget {
 public:
  NdtTarget(Objective objective, const Params& params)
      : objective_(std::move(objective)), params_(params) {}

  [[nodiscard]] Result<Alignment> align(PointsView scan,
                                        const Pose& T_map_scan_guess) const noexcept override {
    return guarded([&]() -> Result<Alignment> {
      VANTAGE_CHECK(matching::check_scan(scan, T_map_scan_guess));
      const Lease workspace(workspaces_);
      objective_.begin(scan, *workspace);
      const Pose guess = objective_.to_local(T_map_scan_guess);
      const Start start = nearer(guess, scan.size(), *workspace);
      NewtonOptions options = params_.newton();
      options.max_iterations -= start.iterations;
      const Derivatives at_start =
          objective_.derivatives(start.T_local_scan, *workspace, extent_of(options));
      VANTAGE_CHECK(check_overlap(at_start.matched, scan.size(), "at the guess"));

      Minimum minimum = minimize(objective_, start.T_local_scan, at_start, options, *workspace);
      if (options.optimizer != Optimizer::newton) {
        minimum.at = objective_.derivatives(minimum.T_local_scan, *workspace);
      }
      VANTAGE_CHECK(check_overlap(minimum.at.matched, scan.size(), "at the solution"));
      return Alignment{.T_map_scan = objective_.to_map(minimum.T_local_scan),
                       .termination = minimum.termination,
                       .iterations = start.iterations + minimum.iterations,
                       .score = minimum.at.score,
                       .hessian = minimum.at.hessian};
    });
  }

  [[nodiscard]] Result<ScanScore> score(PointsView scan,
                                        const Pose& T_map_scan) const noexcept override {
    return guarded([&]() -> Result<ScanScore> {
      VANTAGE_CHECK(matching::check_scan(scan, T_map_scan));
      const Lease workspace(workspaces_);
      objective_.begin(scan, *workspace);
      return objective_.score(objective_.to_local(T_map_scan), *workspace);
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
  using Lease = matching::WorkspacePool<Workspace>::Lease;

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
    if (at.matched * options.stride < least().of(points)) return {guess};  // too few: next, use all
    const Minimum coarse = minimize(objective_, guess, at, options, workspace);
    return {coarse.T_local_scan, coarse.iterations};
  }

  [[nodiscard]] matching::LeastOverlap least() const {
    return {params_.min_matches, params_.min_coverage};
  }
  [[nodiscard]] Result<void> check_overlap(std::size_t matched, std::size_t points,
                                           const char* where) const {
    return least().check(matched, points, "a map voxel", where);
  }

  Objective objective_;
  Params params_;
  mutable matching::WorkspacePool<Workspace> workspaces_;
};

/// Normal distributions transform, point to distribution (Magnusson 2009).
class Ndt final : public ScanMatcher {
 public:
  using Params = ndt::Params;

  [[nodiscard]] static Result<std::unique_ptr<ScanMatcher>> create(const Params& params) {
    VANTAGE_TRY(const NdtCoefficients coefficients, params.coefficients());
    return std::make_unique<Ndt>(params, coefficients);
  }
  Ndt(const Params& params, const NdtCoefficients& coefficients)
      : params_(params), coefficients_(coefficients) {}

  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<MatchTarget>> {
      VANTAGE_TRY(VoxelMap voxels, VoxelMap::build(map, params_.voxels()));
      return target_of(std::move(voxels));
    });
  }

  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> restore(
      std::span<const std::byte> prepared) const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<MatchTarget>> {
      VANTAGE_TRY(VoxelMap voxels, decode(prepared, params_.voxels()));
      return target_of(std::move(voxels));
    });
  }

 private:
  [[nodiscard]] std::unique_ptr<MatchTarget> target_of(VoxelMap voxels) const {
    return std::make_unique<NdtTarget>(
        Objective(std::move(voxels), params_.neighbours, coefficients_), params_);
  }

  Params params_;
  NdtCoefficients coefficients_;
};

}  // namespace
}  // namespace vantage::ndt

VANTAGE_PLUGIN(vantage::ScanMatcher, vantage::ndt::Ndt, "ndt",
               "normal distributions transform, point to distribution (Magnusson 2009)");
