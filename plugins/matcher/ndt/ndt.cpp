#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/answer.hpp"
#include "common/element_numbers.hpp"
#include "common/step_params.hpp"
#include "excerpt.hpp"
#include "newton.hpp"
#include "objective.hpp"
#include "pulls.hpp"
#include "pyramid.hpp"
#include "vantage/kit/plugin_of.hpp"

namespace vantage::ndt {
namespace {

// A scan of at least twice as many points is first aligned with about this many of them, until the
// steps are smaller than a multiple of the epsilons.
constexpr std::size_t kCoarsePoints = 1024;
constexpr double kCoarseEpsilon = 10.0;
// What a guess leads to straight is believed if it lies at most this share of a voxel's edge and
// this angle [rad] away, and if NVTL is at least this share of the largest possible one, |d1|,
// there. On kitti_street, starts of up to 3 m and 10 degrees end in 2267 wrong places, of which 3
// would be believed; 9 of 104 guesses of a drive would not.
constexpr double kNear = 0.5;
constexpr double kNearAngle = 0.04;
constexpr double kFits = 0.42;

// Larger voxels lead astray: a whole house has one distribution [m].
constexpr double kCoarsest = 8.0;

struct Scratch {
  Workspace finest;
  Pyramid::Workspace coarse;
};
using Scratches = matching::WorkspacePool<Scratch>;

/// Normal distributions transform, point to distribution (Magnusson 2009).
struct Params : matching::StepParams {
  Params() { max_iterations = 35; }

  double resolution = 1.0;
  std::uint32_t levels = 4;
  Neighbours neighbours = Neighbours::direct7;
  Optimizer optimizer = Optimizer::newton;
  double outlier_ratio = 0.55;
  std::uint32_t min_points_per_voxel = 6;
  double eigenvalue_floor = 0.01;
  std::optional<double> d1, d2, d3;
  /// Of all targets together: a region's map would keep its own until it is dropped.
  std::shared_ptr<Scratches> scratches = std::make_shared<Scratches>();

  static constexpr auto schema() {
    constexpr Source kCoefficients{"Eq. 12", "Magnusson 2009, Eqs. 6.8-6.9"};
    constexpr std::tuple map_and_search{
        optional("resolution", &Params::resolution, "m", "edge of a voxel", positive,
                 Source{{}, "Magnusson 2009, ch. 6"}),
        optional(
            "levels", &Params::levels, "",
            "voxel maps of 1, 2, 4, ... times the resolution, at most 8 m; a guess that is far "
            "off goes through them from the coarsest to the finest",
            between(1, 6)),
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

  /// Of the voxels of each level, the finest first.
  [[nodiscard]] Result<std::vector<NdtCoefficients>> coefficients() const {
    std::vector<NdtCoefficients> all;
    const auto wanted = [&](double edge) {
      return all.empty() || (all.size() < levels && edge <= kCoarsest);
    };
    for (double edge = resolution; wanted(edge); edge *= 2.0) {
      if (d1 && d2 && d3) {
        all.push_back({*d1, *d2, *d3});
      } else {
        VANTAGE_TRY(all.emplace_back(), NdtCoefficients::derive(outlier_ratio, edge));
      }
    }
    return all;
  }

  [[nodiscard]] Result<void> validate() const {
    if (d1.has_value() != d2.has_value() || d1.has_value() != d3.has_value()) {
      return fail_at({"d1", "d2", "d3"}, "d1, d2 and d3 belong together: give all three or none");
    }
    if (d1 && *d1 == 0.0) return fail_at({"d1"}, "d1 must not be 0");
    const auto usable = [](const NdtCoefficients& d) {
      return std::abs(d.d1) > 0.0 && d.d2 > 0.0 && std::isfinite(d.d1) && std::isfinite(d.d2) &&
             std::isfinite(d.d3);
    };
    if (const auto all = coefficients(); !all || !std::ranges::all_of(*all, usable)) {
      return fail_at({"d1", "resolution", "outlier_ratio"},
                     "resolution " + std::to_string(resolution) + " m and outlier ratio " +
                         std::to_string(outlier_ratio) + " give no usable d1, d2, d3");
    }
    return {};
  }

  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(PointsView map) const;
  /// The points of a voxel decide about its element.
  [[nodiscard]] double reach() const { return 2.0 * resolution; }
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> restore(
      std::span<const std::byte> prepared) const;

 private:
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> target_of(VoxelMap map) const;
};

class NdtTarget final : public MatchTarget {
 public:
  /// @param coefficients  of each level, the finest first
  NdtTarget(VoxelMap map, const Params& params, const std::vector<NdtCoefficients>& coefficients)
      : objective_(std::move(map), params.neighbours, coefficients.front()),
        pyramid_({coefficients.begin() + 1, coefficients.end()}),
        d1_(coefficients.front().d1),
        params_(params) {}

  [[nodiscard]] Result<Alignment> align(PointsView scan,
                                        const Pose& T_map_scan_guess) const noexcept override {
    const auto align_with = [&](Scratch& scratch) -> Result<Alignment> {
      Workspace& workspace = scratch.finest;
      objective_.begin(scan, workspace);
      const Rough rough = nearer(scan, objective_.to_local(T_map_scan_guess), scratch);
      const Start& start = rough.start;
      NewtonOptions options = params_.newton();
      options.max_iterations -= start.iterations;
      const Derivatives at_start =
          rough.stride == 1
              ? rough.at
              : objective_.derivatives(start.T_local_scan, workspace, extent_of(options));
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
    return matching::answer_with<Alignment>(*params_.scratches, scan, T_map_scan_guess, align_with);
  }

  [[nodiscard]] Result<ScanScore> score(PointsView scan,
                                        const Pose& T_map_scan) const noexcept override {
    return matching::answer_with<ScanScore>(
        *params_.scratches, scan, T_map_scan, [&](Scratch& scratch) {
          objective_.begin(scan, scratch.finest);
          return objective_.score(objective_.to_local(T_map_scan), scratch.finest);
        });
  }

  [[nodiscard]] std::size_t bytes() const noexcept override {
    return sizeof(*this) + objective_.map().bytes() + pyramid_.bytes();
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

  [[nodiscard]] Result<std::vector<MapElement>> elements_at(
      PointsView seen) const noexcept override {
    return guarded([&]() -> Result<std::vector<MapElement>> {
      if (!seen.empty()) VANTAGE_CHECK(check_points(seen, "what is seen"));
      std::vector<MapElement> elements;
      const VoxelMap& map = objective_.map();
      for (const std::uint32_t i : gaussians_at(map, seen)) {
        elements.push_back(
            {.number = i, .middle = map.mean_of(i), .points = map.cells()[i].points});
      }
      return elements;
    });
  }

  [[nodiscard]] Result<std::vector<Pull>> pulls(PointsView scan,
                                                const Pose& T_map_scan) const noexcept override {
    return guarded([&]() -> Result<std::vector<Pull>> {
      VANTAGE_CHECK(check_points(scan, "the scan"));
      return pulls_on(objective_, scan, T_map_scan);
    });
  }

  [[nodiscard]] Result<PreparedMap> excerpt_of(
      std::span<const std::uint32_t> seen,
      std::span<const std::uint32_t> kept) const noexcept override {
    return guarded([&]() -> Result<PreparedMap> {
      VANTAGE_CHECK(matching::check_numbers(seen, kept, elements()));
      return PreparedMap{.bytes = encode_some(objective_.map(), seen, kept),
                         .elements = kept.size()};
    });
  }

 private:
  /// A pose that was found with a part of the points.
  struct Rough {
    Start start;
    Derivatives at;      // of that part, at that pose
    std::size_t stride;  // one point in so many
  };

  /// Goes most of the way straight from the guess. If that leads far away or to a place where the
  /// scan does not fit, goes through the coarse levels too, and takes the better of both ways.
  [[nodiscard]] Rough nearer(PointsView scan, const Pose& guess, Scratch& scratch) const {
    Rough straight = closer(scan, {guess}, scratch);
    if (pyramid_.empty() || !overlaps(straight, scan) || is_believed(straight, guess)) {
      return straight;
    }
    const Start coarse =
        pyramid_.nearer(objective_.map(), scan, guess, params_.newton(), scratch.coarse);
    const Rough around = closer(scan, coarse, scratch);
    return around.at.value < straight.at.value ? around : straight;
  }

  [[nodiscard]] bool is_believed(const Rough& found, const Pose& guess) const {
    const Pose& pose = found.start.T_local_scan;
    return (pose.translation - guess.translation).norm() <= kNear * params_.resolution &&
           pose.rotation.angularDistance(guess.rotation) <= kNearAngle &&
           found.at.score.nvtl >= kFits * std::abs(d1_);
  }

  [[nodiscard]] bool overlaps(const Rough& rough, PointsView scan) const {
    return rough.at.matched * rough.stride >= params_.least_overlap().of(scan.size());
  }

  /// Aligns a scan roughly; a large one with a part of its points. Without overlap, it stays where
  /// it is.
  [[nodiscard]] Rough closer(PointsView scan, const Start& start, Scratch& scratch) const {
    NewtonOptions options = params_.newton();
    options.max_iterations -= start.iterations;
    options.stride = std::max<std::size_t>(1, scan.size() / kCoarsePoints);
    options.translation_epsilon *= kCoarseEpsilon;
    options.rotation_epsilon *= kCoarseEpsilon;
    Rough here{start,
               objective_.derivatives(start.T_local_scan, scratch.finest, extent_of(options)),
               options.stride};
    if (!overlaps(here, scan)) return here;
    const Minimum minimum =
        minimize(objective_, start.T_local_scan, here.at, options, scratch.finest);
    return {
        {minimum.T_local_scan, start.iterations + minimum.iterations}, minimum.at, options.stride};
  }

  [[nodiscard]] Result<void> check_overlap(std::size_t matched, std::size_t points,
                                           const char* where) const {
    return params_.least_overlap().check(matched, points, "a map voxel", where);
  }

  Objective objective_;
  Pyramid pyramid_;
  double d1_;
  Params params_;
};

Result<std::unique_ptr<MatchTarget>> Params::target_of(VoxelMap map) const {
  VANTAGE_TRY(const std::vector<NdtCoefficients> derived, coefficients());
  return std::make_unique<NdtTarget>(std::move(map), *this, derived);
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
