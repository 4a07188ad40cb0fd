// ndt, but for the clause to be broken. It stores the points of its voxels, whatever ndt stores.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "breaks.hpp"
#include "vantage/kit/checksum.hpp"

namespace vantage::broken {
namespace {

PointCloud finite_points(PointsView points) {
  PointCloud kept;
  for (const Point& p : points) {
    if (p.allFinite()) kept.push_back(p);
  }
  return kept;
}

using Voxel = std::array<std::int64_t, 3>;

Voxel voxel_of(const Point& p) {
  const auto index = [](double x) { return static_cast<std::int64_t>(std::floor(x)); };
  return {index(p.x()), index(p.y()), index(p.z())};  // of 1 m, as ndt has them by default
}

/// The points that share a voxel with one that is seen.
PointCloud around(PointsView points, PointsView seen) {
  std::set<Voxel> voxels;
  for (const Point& p : seen) voxels.insert(voxel_of(p));
  PointCloud kept;
  for (const Point& p : points) {
    if (voxels.contains(voxel_of(p))) kept.push_back(p);
  }
  return kept;
}

constexpr std::size_t kPoint = 3 * sizeof(double), kHead = sizeof(std::uint64_t);

/// A checksum and the points.
std::vector<std::byte> to_bytes(PointsView points) {
  std::vector<std::byte> bytes(kHead + points.size() * kPoint);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(bytes.data() + kHead + i * kPoint, points[i].data(), kPoint);
  }
  const std::uint64_t sum = checksum_of(std::span(bytes).subspan(kHead));
  std::memcpy(bytes.data(), &sum, sizeof sum);
  return bytes;
}

Result<PointCloud> from_bytes(std::span<const std::byte> bytes) {
  std::uint64_t sum = 0;
  if (bytes.size() < kHead || (bytes.size() - kHead) % kPoint != 0) {
    return fail(ErrorCode::corrupt_data, "these are not the bytes of points");
  }
  std::memcpy(&sum, bytes.data(), sizeof sum);
  bytes = bytes.subspan(kHead);
  if (!breaks("M15") && sum != checksum_of(bytes)) {
    return fail(ErrorCode::corrupt_data, "the checksum is not that of the points");
  }
  PointCloud points(bytes.size() / kPoint);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::memcpy(points[i].data(), bytes.data() + i * kPoint, kPoint);
    if (breaks("M14")) points[i].x() += 0.05;  // an origin that is rounded
  }
  return points;
}

class BrokenTarget final : public MatchTarget {
 public:
  /// @param points  that the sound target was made of
  /// @param map     borrowed, which is what M11 is about
  BrokenTarget(PluginPtr<ScanMatcher> matcher, PluginPtr<MatchTarget> sound, PointCloud points,
               PointsView map)
      : matcher_(std::move(matcher)),
        sound_(std::move(sound)),
        points_(std::move(points)),
        map_(map) {}

  [[nodiscard]] Result<Alignment> align(PointsView scan,
                                        const Pose& guess) const noexcept override {
    return guarded([&] { return align_scan(scan, guess); });
  }
  [[nodiscard]] Result<ScanScore> score(PointsView scan, const Pose& pose) const noexcept override {
    return guarded([&] { return score_scan(scan, pose); });
  }
  [[nodiscard]] std::size_t bytes() const noexcept override {
    return breaks("M16") ? sizeof(*this) : sound_->bytes();  // without what it points to
  }
  [[nodiscard]] std::size_t elements() const noexcept override { return sound_->elements(); }
  [[nodiscard]] Result<PreparedMap> excerpt(PointsView seen) const noexcept override {
    return guarded([&]() -> Result<PreparedMap> {
      if (offers_least()) return MatchTarget::excerpt(seen);
      if (!all_finite(seen)) return fail(ErrorCode::invalid_input, "a point is not finite");
      PointCloud wanted(seen.begin(), seen.end());
      if (breaks("M17")) {  // and what is 3 m beside it
        for (const Point& p : seen) wanted.push_back(p + Point(3.0, 0.0, 0.0));
      }
      PointCloud kept = around(points_, wanted);
      std::size_t elements = 0;
      if (const auto target = matcher_->prepare(kept)) elements = (*target)->elements();
      if (elements == 0) kept.clear();
      return PreparedMap{to_bytes(kept), elements};
    });
  }

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
      VANTAGE_TRY(const auto late, matcher_->prepare(map_.empty() ? points_ : map_));
      return late->align(scan, guess);
    }
    VANTAGE_TRY(Alignment found, sound_->align(scan, guess));
    Eigen::Vector3d& place = found.T_map_scan.translation;
    const Eigen::Vector3d step = place - guess.translation;
    if (breaks("M1") && step.norm() < 0.02) place.x() += 0.1;  // the first trial is never undone
    if (breaks("M2") && step.norm() > 0.2) place = guess.translation + 0.2 * step.normalized();
    if (breaks("M3")) place.x() += 0.012;  // a share of a cell that nobody subtracts
    if (breaks("M18") && threads_are_unusual()) place.x() += 1e-9;
    if (breaks("M6") && Crowded(inside_)) place.x() += 1e-9;
    if (breaks("M7")) place *= 1.0 + 1e-8;  // lengths of the ground and of the grid
    found.hessian = spoilt(found);
    VANTAGE_TRY(found.score, score(scan, breaks("M13") ? guess : found.T_map_scan));
    return found;
  }

  [[nodiscard]] static Alignment::Hessian spoilt(const Alignment& found) {
    using Matrix6 = Eigen::Matrix<double, 6, 6>;
    const Matrix6 H = found.hessian;
    if (breaks("M19")) return -H;  // of the likelihood, not of the cost
    Matrix6 step = Matrix6::Identity();
    if (breaks("M20")) {  // rotation first
      step << Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Identity(),
          Eigen::Matrix3d::Zero();
    }
    if (breaks("M20_axes")) {  // of the sensor
      const Eigen::Matrix3d R = found.T_map_scan.rotation.toRotationMatrix();
      step << R, Eigen::Matrix3d::Zero(), Eigen::Matrix3d::Zero(), R;
    }
    if (breaks("M20_origin")) {  // rotation about the map's origin
      for (Eigen::Index k = 0; k < 3; ++k) {
        const Eigen::Vector3d shift = Eigen::Vector3d::Unit(k).cross(found.T_map_scan.translation);
        step.block<3, 1>(0, 3 + k) = shift;
      }
    }
    const Matrix6 spoilt = step.transpose() * H * step;
    return 0.5 * (spoilt + spoilt.transpose());
  }

  [[nodiscard]] Result<ScanScore> score_scan(PointsView scan, Pose pose) const {
    if (breaks("M9")) return sound_->score(finite_points(scan), pose);
    if (breaks("M7_score")) pose.translation *= 1.0 + 4e-8;  // the same, for scores only
    auto score = sound_->score(scan, pose);
    if (breaks("M4") && score) score->nvtl = -score->nvtl;  // a cost
    if (breaks("M10") && score && score->coverage == 0.0) {
      return fail(ErrorCode::too_few_matches, "no scan point has a map voxel");
    }
    return score;
  }

  PluginPtr<ScanMatcher> matcher_;
  PluginPtr<MatchTarget> sound_;
  PointCloud points_;
  PointsView map_;
  mutable std::atomic<int> inside_ = 0;
};

class Broken final : public ScanMatcher {
 public:
  using Params = OneParam;
  static Result<std::unique_ptr<ScanMatcher>> create(const Params&) {
    return std::make_unique<Broken>();
  }

  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<MatchTarget>> {
      PointCloud changed(map.begin(), map.end());
      if (breaks("M8")) changed = finite_points(map);
      return target_of(std::move(changed), map);
    });
  }

  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> restore(
      std::span<const std::byte> prepared) const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<MatchTarget>> {
      if (offers_least()) return ScanMatcher::restore(prepared);
      VANTAGE_TRY(PointCloud points, from_bytes(prepared));
      if (points.empty()) return fail(ErrorCode::too_few_matches, "the excerpt is empty");
      return target_of(std::move(points), {});
    });
  }
  [[nodiscard]] double reach() const noexcept override {
    return offers_least() ? ScanMatcher::reach() : 2.5;
  }

 private:
  [[nodiscard]] static Result<std::unique_ptr<MatchTarget>> target_of(PointCloud points,
                                                                      PointsView map) {
    VANTAGE_TRY(auto matcher, sound<ScanMatcher>("ndt", {}));
    VANTAGE_TRY(auto target, matcher->prepare(points));
    auto in_library = in_library_of(matcher, std::move(target));
    return std::make_unique<BrokenTarget>(std::move(matcher), std::move(in_library),
                                          std::move(points), map);
  }
};

}  // namespace
}  // namespace vantage::broken

VANTAGE_BROKEN_PLUGIN(vantage::ScanMatcher);
