// What must not pass for a tracked pose: maps that hold everything twice, poses that are off after
// matching, scans in other axes; and priors that are wrong, which must not cost a tracked pose.
#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <functional>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "integrity_worlds.hpp"
#include "support/plugins.hpp"
#include "support/real_data.hpp"
#include "vantage/build/bundle_build.hpp"
#include "vantage/engine/localizer.hpp"
#include "world_bundles.hpp"

namespace vantage::test {
namespace {

using benchmarks::NamedMap;
using benchmarks::SimulatedDrive;

constexpr double kAlertMetres = 0.5, kAlertRadians = 3.0 * std::numbers::pi / 180.0;
constexpr std::uint64_t kSeed = 311;

/// A simulated campus and a drive over it.
struct Campus {
  PointCloud map;
  SimulatedDrive drive;

  static const Campus& get() {
    static const Campus campus = [] {
      const auto world = benchmarks::all_worlds().front();
      const auto params = benchmarks::params_of(world, kSeed, 0).value();
      return Campus{benchmarks::simulated_map(params).value(),
                    benchmarks::simulated_drive(params, 60, params.seed).value()};
    }();
    return campus;
  }
};

/// The region maps of a cloud, in a temporary folder.
class RegionsOf {
 public:
  explicit RegionsOf(const PointCloud& map) {
    const NamedMap named{.name = "points",
                         .partitioner = benchmarks::kRegionsOf20m,
                         .visibility = "plugin = \"keep_all\"\nmax_range = 60.0"};
    config_ = benchmarks::config_of(named, "ndt", "scan_min_range = 1.0", folder_.path() / "maps")
                  .value();
    BundleBuild build = BundleBuild::prepare(config_, built_plugins()).value();
    REQUIRE(build.run(map, {}));
  }

  [[nodiscard]] Localizer localizer() const {
    return Localizer::open(config_, built_plugins()).value();
  }
  [[nodiscard]] Localizer localizer(PluginPtr<ScanMatcher> matcher) const {
    return Localizer::open(Bundle::open(config_, built_plugins(), "the test").value(),
                           std::move(matcher), plugin<Relocalizer>("voxel_search"),
                           config_.localizer.value())
        .value();
  }

 private:
  TemporaryFolder folder_;
  Config config_;
};

bool is_off(const Pose& a, const Pose& b) {
  return (a.translation - b.translation).norm() > kAlertMetres ||
         rotation_between(a, b) > kAlertRadians;
}

struct Counts {
  std::size_t scans = 0, tracked = 0, wrong = 0, risky = 0;
};

/// @param change  of each scan before it is localized
Counts follow(Localizer localizer, const SimulatedDrive& drive, bool odometry,
              const std::function<void(std::size_t, Scan&)>& change = {}) {
  REQUIRE(localizer.start(drive.reference.front().pose));
  Counts counts;
  for (std::size_t i = 0; i < drive.scans.size(); ++i) {
    Scan scan = drive.scan(i);
    if (odometry) REQUIRE(localizer.add(OdometrySample{scan.stamp, drive.odometry[i].pose}));
    if (change) change(i, scan);
    const auto report = localizer.localize(scan);
    REQUIRE_MESSAGE(report, to_string(report.error()));
    const bool tracked = report->tracking == Tracking::tracked;
    ++counts.scans;
    counts.tracked += tracked ? 1 : 0;
    counts.wrong += tracked && is_off(report->T_map_scan, drive.reference[i].pose) ? 1 : 0;
    counts.risky += report->risk >= 0.5 ? 1 : 0;
  }
  return counts;
}

/// `ndt`, whose answers are moved.
class Moved final : public ScanMatcher {
 public:
  explicit Moved(Pose by) : by_(std::move(by)) {}
  [[nodiscard]] Result<std::unique_ptr<MatchTarget>> prepare(
      PointsView map) const noexcept override {
    class Target final : public MatchTarget {
     public:
      Target(std::unique_ptr<MatchTarget> inner, Pose by)
          : inner_(std::move(inner)), by_(std::move(by)) {}
      [[nodiscard]] Result<Alignment> align(PointsView scan,
                                            const Pose& guess) const noexcept override {
        auto alignment = inner_->align(scan, guess);
        if (alignment) alignment->T_map_scan = alignment->T_map_scan * by_;
        return alignment;
      }
      [[nodiscard]] Result<ScanScore> score(PointsView scan,
                                            const Pose& pose) const noexcept override {
        return inner_->score(scan, pose);
      }
      [[nodiscard]] std::size_t bytes() const noexcept override { return inner_->bytes(); }
      [[nodiscard]] std::size_t elements() const noexcept override { return inner_->elements(); }

     private:
      std::unique_ptr<MatchTarget> inner_;
      Pose by_;
    };
    VANTAGE_TRY(auto inner, inner_->prepare(map));
    return std::make_unique<Target>(std::move(inner), by_);
  }

 private:
  PluginPtr<ScanMatcher> inner_ = plugin<ScanMatcher>("ndt");
  Pose by_;
};

}  // namespace

TEST_CASE("a map that holds everything twice: no pose in the wrong copy is tracked") {
  const Campus& campus = Campus::get();
  PointCloud doubled = campus.map;
  for (const Point& p : campus.map) doubled.push_back(p + Point(0.5, 0.5, 0.0));
  const RegionsOf regions(doubled);
  for (const bool odometry : {true, false}) {
    const Counts counts = follow(regions.localizer(), campus.drive, odometry);
    MESSAGE("tracked ", counts.tracked, " of ", counts.scans, ", wrong ", counts.wrong);
    CHECK(counts.wrong == 0);
  }
}

TEST_CASE("poses that are off after matching are not believed") {
  const Campus& campus = Campus::get();
  const RegionsOf regions(campus.map);
  Counts all;
  for (const Eigen::Index axis : {0, 1, 2}) {
    for (const double side : {-1.0, 1.0}) {
      Pose moved, turned;
      moved.translation = 0.7 * side * Point::Unit(axis);
      turned.rotation =
          rotation_from_vector(side * 5.0 * std::numbers::pi / 180.0 * Point::Unit(axis));
      for (const Pose& by : {moved, turned}) {
        const Counts counts = follow(regions.localizer(PluginPtr<ScanMatcher>(new Moved(by), {})),
                                     campus.drive, true);
        MESSAGE("axis ", axis, ", side ", side, ": tracked ", counts.tracked, ", risk of half ",
                counts.risky, " of ", counts.scans);
        all.scans += counts.scans;
        all.risky += counts.risky;
        all.wrong += counts.wrong;
      }
    }
  }
  CHECK(100 * all.risky >= 99 * all.scans);
  CHECK(100 * all.wrong <= all.scans);
}

TEST_CASE("scans in other axes are not tracked") {
  const Campus& campus = Campus::get();
  const RegionsOf regions(campus.map);
  SimulatedDrive drive = campus.drive;
  const auto changed = [&](const std::function<Point(const Point&)>& change) {
    for (std::size_t i = 0; i < drive.scans.size(); ++i) {
      drive.scans[i].clear();
      for (const Point& p : campus.drive.scans[i]) drive.scans[i].push_back(change(p));
    }
    return follow(regions.localizer(), drive, true);
  };
  CHECK(changed([](const Point& p) { return Point(p.y(), p.x(), p.z()); }).tracked == 0);
  CHECK(changed([](const Point& p) { return Point(-p.x(), p.y(), p.z()); }).tracked == 0);
  CHECK(changed([](const Point& p) { return Point(p.x(), -p.y(), p.z()); }).tracked == 0);
  CHECK(changed([](const Point& p) { return Point(p.x(), -p.y(), -p.z()); }).tracked == 0);
}

TEST_CASE("a prior that is wrong costs no tracked pose") {
  const Campus& campus = Campus::get();
  const RegionsOf regions(campus.map);
  const std::size_t usual = follow(regions.localizer(), campus.drive, true).tracked;
  CHECK(usual + 3 >= campus.drive.scans.size());
  const auto with = [&](const Point& off, const Eigen::Vector3d& sigma,
                        const std::function<bool(std::size_t)>& when) {
    return follow(regions.localizer(), campus.drive, true, [&](std::size_t i, Scan& scan) {
      PosePrior prior{.T_map_sensor = campus.drive.reference[i].pose, .sigma_translation = sigma};
      if (when(i)) prior.T_map_sensor.translation += off;
      scan.prior = prior;
    });
  };
  const auto always = [](std::size_t) { return true; };
  const Eigen::Vector3d five = Eigen::Vector3d::Constant(5.0);
  // The first scan has nothing but a start and such a prior.
  CHECK(with({25.0, 0.0, 0.0}, five, always).tracked + 1 >= usual);
  CHECK(with({0.0, 1.0, 0.0}, Eigen::Vector3d::Constant(0.1), always).tracked + 1 >= usual);
  CHECK(with({0.0, 0.0, 6.0}, Eigen::Vector3d::Constant(1.0), always).tracked + 1 >= usual);
  const Counts jump = with({30.0, 0.0, 0.0}, Eigen::Vector3d::Constant(2.0),
                           [](std::size_t i) { return i >= 20 && i < 40; });
  CHECK(jump.tracked >= usual);
  CHECK(jump.wrong == 0);
}

}  // namespace vantage::test
