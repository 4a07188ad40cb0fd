// R: the contract of a Relocalizer.
#include "vantage/relocalizer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "clauses.hpp"
#include "scenes.hpp"

namespace vantage::conformance {
namespace {

using Bytes = std::vector<std::byte>;

double radians(double degrees) { return degrees * std::numbers::pi / 180.0; }
double degrees(double radians) { return radians * 180.0 / std::numbers::pi; }

/// Walls and posts at random on level ground, 120 x 120 m; no two places are alike.
PointCloud town(const Subject& subject, std::uint32_t variant = 0) {
  Random random(subject.seed() + variant);
  PointCloud map;
  for (int i = 0; i < 120; ++i) {
    const Point foot = random.in({-60, -60, 0}, {60, 60, 0});
    const double angle = random.uniform(0.0, std::numbers::pi);
    const double length = random.uniform(0.0, 12.0), height = random.uniform(1.5, 8.0);
    for (double along = 0.0; along <= length; along += 0.4) {
      for (double z = 0.2; z < height; z += 0.4) {
        map.push_back(foot + Point(along * std::cos(angle), along * std::sin(angle), z));
      }
    }
  }
  for (double x = -60.0; x < 60.0; x += 0.7) {
    for (double y = -60.0; y < 60.0; y += 0.7) map.emplace_back(x, y, random.uniform(-0.02, 0.02));
  }
  return map;
}

/// What of the map lies within 40 m of a sensor, in its frame.
PointCloud seen_from(PointsView map, const Pose& T_map_scan) {
  const Pose T_scan_map = T_map_scan.inverse();
  PointCloud scan;
  for (const Point& p : map) {
    if ((p - T_map_scan.translation).norm() < 40.0) scan.push_back(T_scan_map * p);
  }
  return scan;
}

/// Places of the town, 1.5 m above its ground.
std::vector<Pose> some_poses(const Subject& subject, std::size_t n = 4) {
  Random random(subject.seed() + 1000);
  std::vector<Pose> poses;
  for (std::size_t k = 0; k < n; ++k) {
    const Point at = random.in({-30, -30, 1.5}, {30, 30, 1.5});
    poses.push_back(pose_from_xyz_rpy(at, {0.0, 0.0, random.uniform(-3.1, 3.1)}));
  }
  return poses;
}

Bytes index_of(const Relocalizer& relocalizer, PointsView map) {
  auto index = relocalizer.index(Pieces(map));
  if (!index) FAIL("no index is made: " << to_string(index.error()));
  return *std::move(index);
}

Result<PluginPtr<RelocalizerIndex>> try_open(const PluginPtr<Relocalizer>& relocalizer,
                                             const Bytes& bytes) {
  VANTAGE_TRY(auto index, relocalizer->open(bytes));
  if (!index) FAIL("open gives no index and no error");
  return in_library_of(relocalizer, std::move(index));
}

PluginPtr<RelocalizerIndex> open(const PluginPtr<Relocalizer>& relocalizer, const Bytes& bytes) {
  auto index = try_open(relocalizer, bytes);
  if (!index) FAIL("the index is not opened: " << to_string(index.error()));
  return *std::move(index);
}

/// An open index, and what it was opened from.
struct Indexed {
  PluginPtr<Relocalizer> relocalizer;
  Bytes bytes;
  PluginPtr<RelocalizerIndex> index;

  const RelocalizerIndex& operator*() const { return *index; }
  const RelocalizerIndex* operator->() const { return index.get(); }
};

Indexed indexed(const Subject& subject, PointsView map) {
  Indexed all{.relocalizer = subject.make<Relocalizer>(), .bytes = {}, .index = {}};
  all.bytes = index_of(*all.relocalizer, map);
  all.index = open(all.relocalizer, all.bytes);
  return all;
}

PoseCandidates find(const RelocalizerIndex& index, PointsView scan, const PlaceQuery& query = {}) {
  auto found = index.find(scan, query);
  if (!found) FAIL("the scan is not searched for: " << to_string(found.error()));
  return *std::move(found);
}

bool same(const PoseCandidates& a, const PoseCandidates& b) {
  return a.nominal_ms == b.nominal_ms &&
         std::ranges::equal(a.poses, b.poses, [](const auto& x, const auto& y) {
           return x.score == y.score && x.T_map_scan.translation == y.T_map_scan.translation &&
                  x.T_map_scan.rotation.coeffs() == y.T_map_scan.rotation.coeffs();
         });
}

void check_found(const Subject& subject, const PoseCandidates& found, const Pose& truth) {
  const auto& claims = subject.claims<RelocalizerClaims>();
  double nearest = kInfinity;
  const bool is_there = std::ranges::any_of(found.poses, [&](const PoseCandidate& candidate) {
    const double off = (candidate.T_map_scan.translation - truth.translation).norm();
    nearest = std::min(nearest, off);
    return off <= claims.accuracy &&
           degrees(rotation_between(candidate.T_map_scan, truth)) <= claims.accuracy_rotation;
  });
  CHECK_MESSAGE(is_there, "none of " << found.poses.size() << " candidates is the sensor's pose, "
                                     << truth.translation.transpose() << "; the nearest is "
                                     << nearest << " m off");
}

void finds_its_own(const Subject& subject) {
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  for (const Pose& truth : some_poses(subject)) {
    check_found(subject, find(*index, seen_from(map, truth)), truth);
  }
}

void sound_candidates(const Subject& subject) {
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  const PointCloud scan = seen_from(map, some_poses(subject)[0]);
  for (const std::size_t most : {std::size_t{0}, std::size_t{1}, std::size_t{5}, std::size_t{40}}) {
    CAPTURE(most);
    const std::vector<PoseCandidate> poses = find(*index, scan, {.most = most}).poses;
    CHECK(poses.size() <= most);
    for (std::size_t k = 0; k < poses.size(); ++k) {
      CHECK(is_valid(poses[k].T_map_scan));
      CHECK(std::isfinite(poses[k].score));
      if (k > 0) CHECK_MESSAGE(poses[k].score <= poses[k - 1].score, "a better one comes later");
      for (std::size_t j = 0; j < k; ++j) {
        const Pose &a = poses[j].T_map_scan, &b = poses[k].T_map_scan;
        const bool alike =
            (a.translation - b.translation).norm() < 0.1 && rotation_between(a, b) < radians(0.5);
        CHECK_MESSAGE(!alike, "candidates " << j << " and " << k << " are the same pose");
      }
    }
  }
}

void keeps_to_the_area(const Subject& subject) {
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  constexpr double kRadius = 12.0, kSlackMetres = 5.0, kSlackDegrees = 10.0;
  const auto check = [&](const RelocalizerIndex& where, PointsView from, const Pose& truth,
                         const Point& away) {
    const Eigen::Vector3d ahead = truth.rotation * Eigen::Vector3d::UnitX();
    PlaceQuery query;
    query.area.centre = (truth.translation + away).head<2>();
    query.area.radius = kRadius;
    query.area.heading = std::atan2(ahead.y(), ahead.x());
    query.area.heading_within = radians(20.0);
    const PoseCandidates found = find(where, seen_from(from, truth), query);
    for (const auto& [pose, score] : found.poses) {
      const double off = (pose.translation.head<2>() - query.area.centre).norm();
      CHECK_MESSAGE(off <= 1.5 * kRadius + kSlackMetres,
                    "a candidate is " << off << " m from the middle of the area");
      const double turned = degrees(rotation_between(pose, truth));
      CHECK_MESSAGE(turned <= 20.0 + kSlackDegrees, "a heading is " << turned << " deg off");
    }
    if (away.norm() < kRadius) check_found(subject, found, truth);
  };
  for (const Pose& truth : some_poses(subject, 2)) {
    check(*index, map, truth, {5.0, -4.0, 0.0});
    check(*index, map, truth, {45.0, 0.0, 0.0});
    // The sensor stands at the edge of the map, and the area lies off the map.
    PointCloud half = map;
    std::erase_if(half, [&](const Point& p) { return p.x() > truth.translation.x(); });
    const auto index_of_half = indexed(subject, half);
    check(*index_of_half, half, truth, {60.0, 0.0, 0.0});
  }
}

void same_bytes(const Subject& subject) {
  const auto relocalizer = subject.make<Relocalizer>();
  const PointCloud map = town(subject);
  Random random(subject.seed());
  const PointCloud shuffled = in_order(map, random.order(map.size()));
  const Bytes bytes = index_of(*relocalizer, map);
  CHECK_FALSE(bytes.empty());
  for (const auto& [points, size] :
       {std::pair{&map, std::size_t{777}}, std::pair{&shuffled, std::size_t{1}},
        std::pair{&shuffled, map.size()}}) {
    const auto again = subject.make<Relocalizer>()->index(Pieces(*points, size));
    REQUIRE_MESSAGE(again, to_string(again.error()));
    CHECK_MESSAGE((*again == bytes), "the order or the parts of the points matter");
  }
}

void owns_its_data(const Subject& subject) {
  const PointCloud map = town(subject);
  const PointCloud scan = seen_from(map, some_poses(subject)[0]);
  PluginPtr<RelocalizerIndex> index;
  Bytes bytes;  // spoiled, but not freed: the same bytes could come to lie in the same place
  {
    const auto relocalizer = subject.make<Relocalizer>();
    bytes = index_of(*relocalizer, map);
    index = open(relocalizer, bytes);
    std::ranges::fill(bytes, std::byte{0x55});
  }
  CHECK(same(find(*index, scan), find(*indexed(subject, map), scan)));
}

void damaged_bytes(const Subject& subject) {
  const auto relocalizer = subject.make<Relocalizer>();
  const PointCloud map = town(subject);
  const PointCloud scan = seen_from(map, some_poses(subject)[0]);
  const Bytes bytes = index_of(*relocalizer, map);
  const PlaceQuery query{.area = {.radius = 10.0}};
  const PoseCandidates expected = find(*open(relocalizer, bytes), scan, query);
  const auto check = [&](const Bytes& damaged) {
    const auto index = try_open(relocalizer, damaged);
    if (index) {
      CHECK_MESSAGE(same(find(**index, scan, query), expected), "damage gives another map");
    } else {
      CHECK_MESSAGE(index.error().code == ErrorCode::corrupt_data, to_string(index.error()));
    }
  };
  Random random(subject.seed());
  const std::size_t n = bytes.size();
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, n / 2, n - 1, n + 1, n + 4096}) {
    CAPTURE(size);
    Bytes cut = bytes;
    cut.resize(size);
    check(cut);
  }
  for (int i = 0; i < 60; ++i) {
    const std::size_t at = i < 40 ? std::min(n - 1, std::size_t(i)) : random.below(n);
    CAPTURE(at);
    Bytes flipped = bytes;
    flipped[at] ^= static_cast<std::byte>(1U << random.below(8));
    check(flipped);
  }
}

void concurrent(const Subject& subject) {
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  std::vector<PointCloud> scans;
  std::vector<PoseCandidates> expected;
  for (const Pose& pose : some_poses(subject)) {
    scans.push_back(seen_from(map, pose));
    expected.push_back(find(*index, scans.back()));
  }
  std::vector<Result<PoseCandidates>> got(scans.size());
  at_once(scans.size(), [&](std::size_t i) { got[i] = index->find(scans[i], {}); });
  for (std::size_t i = 0; i < scans.size(); ++i) {
    REQUIRE_MESSAGE(got[i], to_string(got[i].error()));
    CHECK(same(*got[i], expected[i]));
  }
}

void repeats_itself(const Subject& subject) {
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  const auto poses = some_poses(subject, 2);
  const PointCloud first = seen_from(map, poses[0]), second = seen_from(map, poses[1]);
  const PoseCandidates of_first = find(*indexed(subject, map), first);
  const PoseCandidates of_second = find(*indexed(subject, map), second);
  for (const bool is_first : {true, true, false, true}) {
    CHECK(same(find(*index, is_first ? first : second), is_first ? of_first : of_second));
  }
}

void far_away(const Subject& subject) {
  const PointCloud map = moved(town(subject), kFarAway);
  const auto index = indexed(subject, map);
  for (Pose truth : some_poses(subject, 2)) {
    truth.translation += kFarAway;
    check_found(subject, find(*index, seen_from(map, truth)), truth);
  }
}

Pose tilted(const Pose& pose, double by) {
  Pose result = pose;
  result.rotation = pose.rotation * rotation_from_vector(radians(by) * Point(0.6, -0.8, 0.0));
  return result;
}

void told_up(const Subject& subject) {
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  for (const Pose& upright : some_poses(subject, 2)) {
    const Pose truth = tilted(upright, 25.0);
    const Eigen::Vector3d up = truth.inverse().rotation * Eigen::Vector3d::UnitZ();
    check_found(subject, find(*index, seen_from(map, truth), {.up = up}), truth);
  }
}

void told_nothing(const Subject& subject) {
  const double tilt = subject.claims<RelocalizerClaims>().tilt;
  if (tilt == 0.0) does_not_apply("it claims no tilt");
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  for (const Pose& upright : some_poses(subject, 2)) {
    for (const double by : {0.0, tilt}) {
      CAPTURE(by);
      const Pose truth = tilted(upright, by);
      check_found(subject, find(*index, seen_from(map, truth), {.up = std::nullopt}), truth);
    }
  }
}

void counts_its_work(const Subject& subject) {
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  const Pose truth = some_poses(subject)[0];
  const PointCloud scan = seen_from(map, truth);
  const double everywhere = find(*index, scan).nominal_ms;
  CHECK(std::isfinite(everywhere));
  CHECK(everywhere > 0.0);
  CHECK(find(*index, scan).nominal_ms == everywhere);
  PlaceQuery near;
  near.area.centre = truth.translation.head<2>();
  near.area.radius = 10.0;
  near.area.heading_within = radians(20.0);
  CHECK_MESSAGE(find(*index, scan, near).nominal_ms <= everywhere,
                "a small area costs more than the whole map");
}

void stops(const Subject& subject) {
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  const PointCloud scan = seen_from(map, some_poses(subject)[0]);
  std::stop_source stop;
  stop.request_stop();
  const double stopped = find(*index, scan, {.stop = stop.get_token()}).nominal_ms;
  const double whole = find(*index, scan).nominal_ms;
  CHECK_MESSAGE(stopped <= 0.5 * whole, "a search that was stopped before it began costs "
                                            << stopped << " of " << whole << " ms");
}

void odd_scans(const Subject& subject) {
  const PointCloud map = town(subject);
  const auto index = indexed(subject, map);
  CHECK(find(*index, {}).poses.empty());
  for (const PointCloud& scan : {PointCloud{{3.0, 1.0, 0.5}}, PointCloud(50, Point(2.0, 2.0, 2.0)),
                                 PointCloud{{9e3, 0.0, 0.0}, {0.0, 0.0, -9e3}}, lattice(0.5, 30)}) {
    for (const auto& [pose, score] : find(*index, scan).poses) {
      CHECK(is_valid(pose));
      CHECK(std::isfinite(score));
    }
  }
  for (const double bad : {kNaN, kInfinity}) {
    check_fails(index->find(PointCloud{{1.0, 2.0, 3.0}, {bad, 0.0, 0.0}}, {}),
                ErrorCode::invalid_input);
  }
}

void odd_maps(const Subject& subject) {
  const auto relocalizer = subject.make<Relocalizer>();
  check_fails(relocalizer->index(Pieces({})), ErrorCode::invalid_input);
  const PointCloud scan = seen_from(town(subject), some_poses(subject)[0]);
  for (const PointCloud& map :
       {PointCloud{{1.0, 2.0, 3.0}}, PointCloud(100, Point(5.0, 5.0, 5.0)), lattice(0.5, 40),
        PointCloud{{0.0, 0.0, 0.0}, {40.0, 0.0, 0.0}, {0.0, 0.0, 90.0}},
        PointCloud{{0.0, 0.0, 0.0}, {1e7, 1e7, 1e4}}}) {
    const auto bytes = relocalizer->index(Pieces(map));
    if (!bytes) {
      CHECK_MESSAGE(bytes.error().code == ErrorCode::unsupported, to_string(bytes.error()));
      continue;
    }
    for (const auto& [pose, score] : find(*open(relocalizer, *bytes), scan).poses) {
      CHECK(is_valid(pose));
      CHECK(std::isfinite(score));
    }
  }
}

void grows(const Subject& subject) {
  PointCloud map;
  std::size_t bytes = 0;
  for (std::uint32_t towns = 1; towns <= 4; ++towns) {
    CAPTURE(towns);
    const PointCloud next = moved(town(subject, towns), {150.0 * towns, 0, 0});
    map.insert(map.end(), next.begin(), next.end());
    const Indexed index = indexed(subject, map);
    CHECK(index->bytes() > bytes);
    bytes = index->bytes();
  }
}

void any_threads(const Subject& subject) {
  const PointCloud map = town(subject);
  const PointCloud scan = seen_from(map, some_poses(subject, 1)[0]);
  const Indexed expected = indexed(subject, map);
  const PoseCandidates found = find(*expected, scan);
  with_threads([&] {
    const Indexed again = indexed(subject, map);
    CHECK(again.bytes == expected.bytes);
    CHECK(same(find(*again, scan), found));
  });
}

constexpr std::array kClauses{
    Clause{"R1", "a scan of the map is found among the candidates, as accurately as claimed",
           &finds_its_own},
    Clause{"R2",
           "no more candidates than were asked for; valid, the best first, no two of them alike",
           &sound_candidates},
    Clause{"R3",
           "candidates keep to the area and its headings, to half a radius and 5 m, and to 10 deg",
           &keeps_to_the_area},
    Clause{"R4", "the index has the same bytes, whatever the order and the parts of the points",
           &same_bytes},
    Clause{"R5", "an open index needs neither the bytes nor the relocalizer any more",
           &owns_its_data},
    Clause{"R6", "damaged bytes are corrupt_data or the same index, never a crash or another map",
           &damaged_bytes},
    Clause{"R7", "concurrent calls on one index agree bit for bit with calls one by one",
           &concurrent},
    Clause{"R8", "an answer depends only on map, scan and query, not on earlier calls",
           &repeats_itself},
    Clause{"R9", "a scan is found in a map millions of metres away, too", &far_away},
    Clause{"R10", "a sensor that is held at a tilt is found if it is told where up is", &told_up},
    Clause{"R11", "a sensor at the claimed tilt is found without being told", &told_nothing},
    Clause{"R12",
           "nominal_ms is positive, the same each time, and not greater for a part of the map",
           &counts_its_work},
    Clause{"R13", "a search that was stopped before it began costs at most half", &stops},
    Clause{"R14",
           "an empty scan has no candidates, one that is not finite is invalid_input, few or equal "
           "points do no harm",
           &odd_scans},
    Clause{"R15",
           "a map without points is invalid_input; few, equal and far points are indexed, or "
           "unsupported",
           &odd_maps},
    Clause{"R16", "1, 2 and 7 threads give the same result", &any_threads},
    Clause{"R17", "the index of a larger map takes more memory", &grows},
};

}  // namespace

template <>
std::span<const Clause> own_clauses<Relocalizer>() {
  return kClauses;
}

}  // namespace vantage::conformance
