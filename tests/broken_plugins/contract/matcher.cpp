// ndt, but for the clause to be broken.
#include <cstdlib>
#include <memory>
#include <utility>

#include "breaks.hpp"

namespace vantage::broken {
namespace {

PointCloud finite_points(PointsView points) {
  PointCloud kept;
  for (const Point& p : points) {
    if (p.allFinite()) kept.push_back(p);
  }
  return kept;
}

class BrokenTarget final : public MatchTarget {
 public:
  /// @param map  borrowed, which is what M11 is about
  BrokenTarget(PluginPtr<ScanMatcher> matcher, PluginPtr<MatchTarget> sound, PointsView map)
      : matcher_(std::move(matcher)), sound_(std::move(sound)), map_(map) {}

  [[nodiscard]] Result<Alignment> align(PointsView scan,
                                        const Pose& guess) const noexcept override {
    return guarded([&] { return align_scan(scan, guess); });
  }
  [[nodiscard]] Result<ScanScore> score(PointsView scan, const Pose& pose) const noexcept override {
    return guarded([&] { return score_scan(scan, pose); });
  }
  [[nodiscard]] std::size_t bytes() const noexcept override { return sound_->bytes(); }
  [[nodiscard]] std::size_t elements() const noexcept override { return sound_->elements(); }

 private:
  [[nodiscard]] Result<Alignment> align_scan(PointsView scan, const Pose& guess) const {
    if (breaks("M5") && scan.empty()) {
      Alignment found;
      found.T_map_scan = guess;
      return found;
    }
    if (breaks("M9")) return sound_->align(finite_points(scan), guess);
    if (breaks("M12") && !scan.empty() && bounds_of(scan).diagonal() == 0.0) {
      std::abort();  // an assertion that a scan has an extent
    }
    if (breaks("M11")) {  // made ready late, of points that may have gone
      VANTAGE_TRY(const auto late, matcher_->prepare(map_));
      return late->align(scan, guess);
    }
    VANTAGE_TRY(Alignment found, sound_->align(scan, guess));
    Eigen::Vector3d& place = found.T_map_scan.translation;
    const Eigen::Vector3d step = place - guess.translation;
    if (breaks("M1") && step.norm() < 0.02) place.x() += 0.1;  // the first trial is never undone
    if (breaks("M2") && step.norm() > 0.2) place = guess.translation + 0.2 * step.normalized();
    if (breaks("M3")) place.x() += 0.012;  // a share of a cell that nobody subtracts
    if (breaks("M6") && Crowded(inside_)) place.x() += 1e-9;
    VANTAGE_TRY(found.score, score(scan, breaks("M13") ? guess : found.T_map_scan));
    return found;
  }

  [[nodiscard]] Result<ScanScore> score_scan(PointsView scan, const Pose& pose) const {
    if (breaks("M9")) return sound_->score(finite_points(scan), pose);
    auto score = sound_->score(scan, pose);
    if (breaks("M4") && score) score->nvtl = -score->nvtl;  // a cost
    if (breaks("M10") && score && score->coverage == 0.0) {
      return fail(ErrorCode::too_few_matches, "no scan point has a map voxel");
    }
    return score;
  }

  PluginPtr<ScanMatcher> matcher_;
  PluginPtr<MatchTarget> sound_;
  PointsView map_;
  mutable std::atomic<int> inside_ = 0;
};

class Broken final : public ScanMatcher {
 public:
  struct Params {
    static constexpr auto schema() { return std::tuple{}; }
  };
  static Result<std::unique_ptr<ScanMatcher>> create(const Params&) {
    return std::make_unique<Broken>();
  }

  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<MatchTarget>> {
      PointCloud changed(map.begin(), map.end());
      if (breaks("M7")) {  // single precision, of absolute coordinates
        for (Point& p : changed) p = p.cast<float>().cast<double>();
      }
      if (breaks("M8")) changed = finite_points(map);
      VANTAGE_TRY(auto matcher, sound<ScanMatcher>("ndt", {}));
      VANTAGE_TRY(auto target, matcher->prepare(changed));
      auto in_library = in_library_of(matcher, std::move(target));
      return std::make_unique<BrokenTarget>(std::move(matcher), std::move(in_library), map);
    });
  }
};

}  // namespace
}  // namespace vantage::broken

extern "C" __attribute__((visibility("default"),
                          used)) constinit const vantage::PluginManifest vantage_plugin{
    .name = vantage_broken_name,
    .summary = "a scan matcher that breaks one clause",
    .factory = vantage::detail::factory_of<vantage::ScanMatcher, vantage::broken::Broken>()};
