#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "newton.hpp"
#include "objective.hpp"
#include "vantage/plugin.hpp"

namespace vantage::ndt {
namespace {

struct Params {
  double resolution = 1.0;
  Neighbours neighbours = Neighbours::direct7;
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

/// Lends each alignment in flight a workspace of its own and keeps it for the next.
class WorkspacePool {
 public:
  class Lease {
   public:
    explicit Lease(WorkspacePool& pool) : pool_(pool), workspace_(pool.take()) {}
    ~Lease() { pool_.give_back(std::move(workspace_)); }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    [[nodiscard]] Workspace& operator*() const noexcept { return *workspace_; }

   private:
    WorkspacePool& pool_;
    std::unique_ptr<Workspace> workspace_;
  };

 private:
  [[nodiscard]] std::unique_ptr<Workspace> take() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) {
      free_.reserve(++made_);  // giving back needs no memory
      return std::make_unique<Workspace>();
    }
    auto workspace = std::move(free_.back());
    free_.pop_back();
    return workspace;
  }
  void give_back(std::unique_ptr<Workspace> workspace) noexcept {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(workspace));
  }

  std::mutex mutex_;
  std::vector<std::unique_ptr<Workspace>> free_;
  std::size_t made_ = 0;
};

class NdtTarget final : public MatchTarget {
 public:
  NdtTarget(Objective objective, const Params& params)
      : objective_(std::move(objective)), params_(params) {}

  [[nodiscard]] Result<Alignment> align(PointsView scan,
                                        const Pose& T_map_scan_guess) const noexcept override {
    return guarded([&]() -> Result<Alignment> {
      VANTAGE_CHECK(check(scan, T_map_scan_guess));
      const WorkspacePool::Lease workspace(workspaces_);
      objective_.begin(scan, *workspace);
      const Pose start = objective_.to_local(T_map_scan_guess);
      const Derivatives at_start = objective_.derivatives(scan, start, *workspace);
      VANTAGE_CHECK(check_overlap(at_start.matched, scan.size(), "at the guess"));

      const NewtonOptions options{.max_iterations = params_.max_iterations,
                                  .translation_epsilon = params_.translation_epsilon,
                                  .rotation_epsilon = params_.rotation_epsilon,
                                  .max_step_translation = params_.max_step_translation,
                                  .max_step_rotation = params_.max_step_rotation};
      const Minimum minimum = minimize(objective_, scan, start, at_start, options, *workspace);
      VANTAGE_CHECK(check_overlap(minimum.at.matched, scan.size(), "at the solution"));
      return Alignment{.T_map_scan = objective_.to_map(minimum.T_local_scan),
                       .termination = minimum.termination,
                       .iterations = minimum.iterations,
                       .score = objective_.score(scan, minimum.T_local_scan, *workspace).mean(),
                       .hessian = minimum.at.hessian};
    });
  }

  [[nodiscard]] Result<ScanScore> score(PointsView scan,
                                        const Pose& T_map_scan) const noexcept override {
    return guarded([&]() -> Result<ScanScore> {
      VANTAGE_CHECK(check(scan, T_map_scan));
      const WorkspacePool::Lease workspace(workspaces_);
      objective_.begin(scan, *workspace);
      return objective_.score(scan, objective_.to_local(T_map_scan), *workspace).mean();
    });
  }

  [[nodiscard]] std::size_t bytes() const noexcept override {
    return sizeof(*this) + objective_.map().bytes();
  }
  [[nodiscard]] std::size_t elements() const noexcept override {
    return objective_.map().gaussians().size();
  }

 private:
  [[nodiscard]] static Result<void> check(PointsView scan, const Pose& T_map_scan) {
    if (scan.empty()) return fail(ErrorCode::too_few_matches, "the scan has no points");
    VANTAGE_CHECK(check_points(scan, "the scan"));
    if (!is_valid(T_map_scan)) {
      return fail(ErrorCode::invalid_input,
                  "the scan's pose is not finite or its rotation is not of unit length");
    }
    return {};
  }

  [[nodiscard]] Result<void> check_overlap(std::size_t matched, std::size_t points,
                                           const char* where) const {
    const double needed = std::max(static_cast<double>(params_.min_matches),
                                   std::ceil(params_.min_coverage * static_cast<double>(points)));
    if (static_cast<double>(matched) >= needed) return {};
    return fail(ErrorCode::too_few_matches,
                std::to_string(matched) + " of " + std::to_string(points) +
                    " scan points have a map voxel " + where + "; at least " +
                    std::to_string(static_cast<std::size_t>(needed)) + " are needed");
  }

  Objective objective_;
  Params params_;
  mutable WorkspacePool workspaces_;
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
      VANTAGE_TRY(VoxelMap voxels,
                  VoxelMap::build(map, {.resolution = params_.resolution,
                                        .min_points = params_.min_points_per_voxel,
                                        .eigenvalue_floor = params_.eigenvalue_floor}));
      return std::make_unique<NdtTarget>(
          Objective(std::move(voxels), params_.neighbours, coefficients_), params_);
    });
  }

 private:
  Params params_;
  NdtCoefficients coefficients_;
};

}  // namespace
}  // namespace vantage::ndt

VANTAGE_PLUGIN(vantage::ScanMatcher, vantage::ndt::Ndt, "ndt",
               "normal distributions transform, point to distribution (Magnusson 2009)");
