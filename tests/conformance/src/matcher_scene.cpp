#include "matcher_scene.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <utility>

#include "clauses.hpp"

namespace vantage::conformance {
namespace {

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }
double degrees(double radians) { return radians * 180.0 / std::numbers::pi; }

/// Adds `density` points per square metre of the parallelogram at `corner`, with a roughness of 1
/// cm.
void add_face(PointCloud& cloud, Random& random, const Point& corner, const Point& u,
              const Point& v, double density = 20.0) {
  const auto n = static_cast<int>(density * u.cross(v).norm());
  const Point rough = Point::Constant(0.01);
  for (int i = 0; i < n; ++i) {
    const double a = random.uniform(0.0, 1.0), b = random.uniform(0.0, 1.0);
    cloud.push_back(corner + a * u + b * v + random.in(-rough, rough));
  }
}

void add_pole(PointCloud& cloud, Random& random, const Point& foot) {
  for (int i = 0; i < 400; ++i) {
    const double angle = random.uniform(0.0, 2.0 * std::numbers::pi);
    cloud.push_back(
        foot + Point(0.15 * std::cos(angle), 0.15 * std::sin(angle), random.uniform(0.0, 4.0)));
  }
}

Eigen::Vector3d direction(Random& random) {
  while (true) {
    const Eigen::Vector3d v = random.in({-1, -1, -1}, {1, 1, 1});
    if (v.norm() > 0.1 && v.norm() < 1.0) return v.normalized();
  }
}

/// A pose moved by this much in a random direction.
Pose off(Random& random, const Pose& pose, double metres, double degrees) {
  const Eigen::Vector3d shift = metres * direction(random);
  const Eigen::Vector3d turn = radians(degrees) * direction(random);
  Pose result = pose;
  result.translation += shift;
  result.rotation = rotation_from_vector(turn) * pose.rotation;
  return result;
}

template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

}  // namespace

PointCloud street(Random& random) {
  PointCloud cloud;
  const Point z5(0, 0, 5);
  add_face(cloud, random, {-18, -7, 0}, {36, 0, 0.7}, {0, 14, 0});           // ground, rising
  add_face(cloud, random, {-18, 7, 0}, {20, 0, 0}, z5);                      // houses on the left
  add_face(cloud, random, {2, 7, 0}, {0, 3, 0}, z5);                         // a gap
  add_face(cloud, random, {5, 7, 0}, {0, 3, 0}, z5);                         //
  add_face(cloud, random, {5, 7, 0}, {13, 0, 0}, z5);                        //
  add_face(cloud, random, {-18, -7, 0}, {36, 0, 0}, z5);                     // and on the right
  add_face(cloud, random, {18, -7, 0.7}, {0, 14, 0}, z5);                    // the end
  add_face(cloud, random, {-6, -5, 0.2}, {4.2, 0, 0}, {0, 0, 1.6}, 60.0);    // a car
  add_face(cloud, random, {-6, -5, 0.2}, {0, 1.8, 0}, {0, 0, 1.6}, 60.0);    //
  add_face(cloud, random, {-6, -3.2, 0.2}, {4.2, 0, 0}, {0, 0, 1.6}, 60.0);  //
  add_face(cloud, random, {7, 2.5, 0.5}, {2, 1, 0}, {0, 0, 2.5}, 60.0);      // a kiosk
  add_face(cloud, random, {7, 2.5, 0.5}, {-1, 2, 0}, {0, 0, 2.5}, 60.0);     //
  for (const double x : {-13.0, -4.0, 4.5, 12.0}) add_pole(cloud, random, {x, 5.5, 0.3});
  const Pose askew = pose_from_xyz_rpy({0.37, -0.21, 0.13}, {0.01, -0.02, 0.35});
  for (Point& p : cloud) p = askew * p;
  return cloud;
}

PointCloud seen_from(PointsView cloud, const Pose& T_map_scan, Random& random, std::size_t most) {
  const Pose T_scan_map = T_map_scan.inverse();
  PointCloud all;
  for (const Point& p : cloud) {
    if (const Point q = T_scan_map * p; q.norm() < 15.0) all.push_back(q);
  }
  PointCloud scan = in_order(all, random.order(all.size()));
  scan.resize(std::min(most, scan.size()));
  return scan;
}

const Pose kTruth = pose_from_xyz_rpy({0.4, -0.3, 1.6}, {0.02, -0.01, 0.7});

Scene some_scene(const Subject& subject) {
  Random random(subject.seed());
  PointCloud map = street(random);
  return {std::move(map), seen_from(street(random), kTruth, random)};
}

Pose off(Random& random, const Pose& pose, const MatcherClaims& claims, double share) {
  return off(random, pose, share * claims.offset, share * claims.rotation);
}

Result<PluginPtr<MatchTarget>> try_prepare(const PluginPtr<ScanMatcher>& matcher, PointsView map) {
  VANTAGE_TRY(auto target, matcher->prepare(map));
  if (!target) FAIL("prepare gives no target and no error");
  return in_library_of(matcher, std::move(target));
}

PluginPtr<MatchTarget> prepare(const PluginPtr<ScanMatcher>& matcher, PointsView map) {
  auto target = try_prepare(matcher, map);
  if (!target) FAIL("the map is not made ready: " << to_string(target.error()));
  return *std::move(target);
}

PluginPtr<MatchTarget> prepare(const Subject& subject, PointsView map) {
  return prepare(subject.make<ScanMatcher>(), map);
}

PreparedMap excerpt(const MatchTarget& target, PointsView seen) {
  auto prepared = target.excerpt(seen);
  if (prepared) return *std::move(prepared);
  if (prepared.error().code == ErrorCode::unsupported) {
    does_not_apply("the matcher stores no prepared maps");
  }
  FAIL("no excerpt is made: " << to_string(prepared.error()));
  return {};
}

PluginPtr<MatchTarget> restore(const PluginPtr<ScanMatcher>& matcher,
                               const std::vector<std::byte>& prepared) {
  auto target = matcher->restore(prepared);
  if (!target) FAIL("an excerpt is not restored: " << to_string(target.error()));
  if (!*target) FAIL("restore gives no target and no error");
  return in_library_of(matcher, *std::move(target));
}

Alignment align(const MatchTarget& target, PointsView scan, const Pose& guess) {
  auto alignment = target.align(scan, guess);
  if (!alignment) FAIL("the scan is not aligned: " << to_string(alignment.error()));
  return *std::move(alignment);
}

ScanScore score(const MatchTarget& target, PointsView scan, const Pose& pose) {
  auto score = target.score(scan, pose);
  if (!score) FAIL("the scan has no score: " << to_string(score.error()));
  return *score;
}

void check_close(const Subject& subject, const Pose& a, const Pose& b) {
  const auto& claims = subject.claims<MatcherClaims>();
  const double metres = (a.translation - b.translation).norm();
  const double turn = degrees(rotation_between(a, b));
  CHECK_MESSAGE(metres <= claims.accuracy, "off by " << metres << " m");
  CHECK_MESSAGE(turn <= claims.accuracy_rotation, "off by " << turn << " deg");
}

bool same(const ScanScore& a, const ScanScore& b) {
  return a.fitness == b.fitness && a.nvtl == b.nvtl && a.coverage == b.coverage &&
         a.compared == b.compared;
}

bool same(const Alignment& a, const Alignment& b) {
  return same_bits(a.T_map_scan.translation, b.T_map_scan.translation) &&
         same_bits(a.T_map_scan.rotation.coeffs(), b.T_map_scan.rotation.coeffs()) &&
         same_bits(a.hessian, b.hessian) && same(a.score, b.score) &&
         a.termination == b.termination && a.iterations == b.iterations;
}

}  // namespace vantage::conformance
