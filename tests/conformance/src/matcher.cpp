// M: the contract of a ScanMatcher.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "clauses.hpp"
#include "matcher_scene.hpp"

namespace vantage::conformance {
namespace {

bool is_finite(const ScanScore& s) {
  return std::isfinite(s.fitness) && std::isfinite(s.nvtl) && s.coverage >= 0.0 &&
         s.coverage <= 1.0;
}

void identity(const Subject& subject) {
  Random random(subject.seed());
  const PointCloud map = street(random);
  const auto target = prepare(subject, map);
  for (const Pose& truth : {kTruth, pose_from_xyz_rpy({-5.2, 1.3, 1.5}, {0, 0, -2.5}),
                            pose_from_xyz_rpy({6.1, 0.7, 1.8}, {-0.02, 0.03, 0.1})}) {
    const PointCloud scan = seen_from(map, truth, random);
    check_close(subject, align(*target, scan, truth).T_map_scan, truth);
  }
}

void recovers(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto target = prepare(subject, scene.map);
  Random random(subject.seed() + 1);
  for (int i = 0; i < 10; ++i) {
    CAPTURE(i);
    const Pose guess = off(random, kTruth, subject.claims<MatcherClaims>());
    check_close(subject, align(*target, scene.scan, guess).T_map_scan, kTruth);
  }
}

void inverse(const Subject& subject) {
  Random random(subject.seed());
  constexpr std::size_t kAll = 1'000'000;
  const Pose other = pose_from_xyz_rpy({-0.8, 0.6, 1.9}, {-0.01, 0.02, 0.9});
  const PointCloud a = seen_from(street(random), kTruth, random, kAll);
  const PointCloud b = seen_from(street(random), other, random, kAll);
  const auto target_a = prepare(subject, a), target_b = prepare(subject, b);
  const Pose T_a_b = kTruth.inverse() * other;
  for (int i = 0; i < 3; ++i) {
    CAPTURE(i);
    const auto& claims = subject.claims<MatcherClaims>();
    const Pose forth = align(*target_a, b, off(random, T_a_b, claims, 0.5)).T_map_scan;
    const Pose back = align(*target_b, a, off(random, T_a_b.inverse(), claims, 0.5)).T_map_scan;
    check_close(subject, forth * back, Pose{});
  }
}

/// Compares nvtl, the mean over the points that are near something in the map. Fitness counts the
/// other points as 0 and bad matches as negative, so it may rise when a scan leaves the map.
void best_at_truth(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto target = prepare(subject, scene.map);
  const ScanScore best = score(*target, scene.scan, kTruth);
  CHECK(is_finite(best));
  CHECK(best.coverage > 0.9);
  Random random(subject.seed() + 1);
  for (int i = 0; i < 20; ++i) {
    const Pose pose = off(random, kTruth, subject.claims<MatcherClaims>());
    const ScanScore other = score(*target, scene.scan, pose);
    CHECK(is_finite(other));
    CHECK(other.nvtl < best.nvtl);
  }
}

void nothing_to_match(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto target = prepare(subject, scene.map);
  check_fails(target->align({}, kTruth), ErrorCode::too_few_matches);
  check_fails(target->score({}, kTruth), ErrorCode::too_few_matches);
  for (const Point& by : {Point(200, 0, 0), Point(0, 0, -100), Point(-3e6, 5e6, 0)}) {
    Pose guess = kTruth;
    guess.translation += by;
    check_fails(target->align(scene.scan, guess), ErrorCode::too_few_matches);
    check_fails(target->align(moved(scene.scan, by), kTruth), ErrorCode::too_few_matches);
  }
}

void concurrent(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto matcher = subject.make<ScanMatcher>();
  const auto target = prepare(matcher, scene.map);
  constexpr std::size_t kThreads = 4;
  Random random(subject.seed() + 1);
  struct Call {
    PointsView scan;
    Pose pose;
    Alignment alignment;
    ScanScore score;
  };
  std::vector<Call> calls;
  for (std::size_t i = 0; i < kThreads; ++i) {
    // Different sizes, so that shared scratch memory is detected.
    const PointsView scan = PointsView(scene.scan).first(scene.scan.size() - 400 * i);
    const Pose pose = off(random, kTruth, subject.claims<MatcherClaims>(), 0.5);
    calls.push_back({scan, pose, align(*target, scan, pose), score(*target, scan, pose)});
  }
  // A matcher that stores no prepared maps says so to every thread.
  const auto seen = [&](std::size_t i) {
    return PointsView(scene.map).first(scene.map.size() / (i + 1));
  };
  std::vector<Result<PreparedMap>> expected;
  for (std::size_t i = 0; i < kThreads; ++i) expected.push_back(target->excerpt(seen(i)));
  for (int round = 0; round < 3; ++round) {
    std::vector<Result<Alignment>> alignments(kThreads);
    std::vector<Result<ScanScore>> scores(kThreads);
    std::vector<Result<PreparedMap>> excerpts(kThreads);
    at_once(kThreads, [&](std::size_t i) {
      excerpts[i] = target->excerpt(seen(i));
      alignments[i] = target->align(calls[i].scan, calls[i].pose);
      scores[i] = target->score(calls[i].scan, calls[i].pose);
    });
    for (std::size_t i = 0; i < kThreads; ++i) {
      REQUIRE_MESSAGE(alignments[i], to_string(alignments[i].error()));
      REQUIRE_MESSAGE(scores[i], to_string(scores[i].error()));
      CHECK(same(*alignments[i], calls[i].alignment));
      CHECK(same(*scores[i], calls[i].score));
      REQUIRE(excerpts[i].has_value() == expected[i].has_value());
      if (excerpts[i]) CHECK_MESSAGE(*excerpts[i] == *expected[i], "an excerpt differs");
    }
  }
  // Maps that are prepared at the same time; each must give the same result as the one above.
  std::vector<Result<std::unique_ptr<MatchTarget>>> made(kThreads);
  at_once(kThreads, [&](std::size_t i) { made[i] = matcher->prepare(scene.map); });
  for (std::size_t i = 0; i < kThreads; ++i) {
    REQUIRE_MESSAGE(made[i], to_string(made[i].error()));
    CHECK(same(align(**made[i], calls[i].scan, calls[i].pose), calls[i].alignment));
  }
}

void far_away(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto near = prepare(subject, scene.map);
  Random random(subject.seed() + 1);
  const Pose guess = off(random, kTruth, subject.claims<MatcherClaims>(), 0.5);
  const Alignment expected = align(*near, scene.scan, guess);
  for (const Point& by : kFarByCells) {
    const PointCloud map = moved(scene.map, by);
    const auto target = prepare(subject, map);
    Alignment got = align(*target, scene.scan, moved(guess, by));
    got.T_map_scan.translation -= by;
    check_close(subject, got.T_map_scan, expected.T_map_scan);
    check_close(subject, got.T_map_scan, kTruth);
    // The shipped matchers differ by 1e-8 at most.
    CHECK(got.score.nvtl == doctest::Approx(expected.score.nvtl).epsilon(1e-3));
    CHECK(got.score.coverage == doctest::Approx(expected.score.coverage).epsilon(1e-3));
  }
}

void bad_map(const Subject& subject) {
  const auto matcher = subject.make<ScanMatcher>();
  check_fails(matcher->prepare({}), ErrorCode::invalid_input);
  const Scene scene = some_scene(subject);
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    for (const Eigen::Index axis : {0, 1, 2}) {
      PointCloud map = scene.map;
      map[map.size() / 2][axis] = bad;
      check_fails(matcher->prepare(map), ErrorCode::invalid_input);
    }
  }
  const auto target = prepare(matcher, scene.map);
  const bool stores = target->excerpt(scene.map).has_value();
  for (const Eigen::Index axis : {0, 1, 2}) {
    PointCloud seen = scene.map;
    seen[seen.size() / 2][axis] = kNaN;
    check_fails(target->excerpt(seen), stores ? ErrorCode::invalid_input : ErrorCode::unsupported);
  }
}

void bad_scan(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto target = prepare(subject, scene.map);
  const auto refused = [&](PointsView scan, const Pose& pose) {
    check_fails(target->align(scan, pose), ErrorCode::invalid_input);
    check_fails(target->score(scan, pose), ErrorCode::invalid_input);
  };
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    CAPTURE(bad);
    for (const Eigen::Index axis : {0, 1, 2}) {
      PointCloud scan = scene.scan;
      scan[scan.size() / 2][axis] = bad;
      refused(scan, kTruth);
      Pose pose = kTruth;
      pose.translation[axis] = bad;
      refused(scene.scan, pose);
      pose = kTruth;
      pose.rotation.coeffs()[axis] = bad;
      refused(scene.scan, pose);
    }
  }
  for (const double length : {0.0, 0.5, 2.0}) {
    CAPTURE(length);
    Pose pose = kTruth;
    pose.rotation.coeffs() *= length;
    refused(scene.scan, pose);
  }
}

void score_without_overlap(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto target = prepare(subject, scene.map);
  for (const Point& by : {Point(200, 0, 0), Point(0, 0, -100), Point(-3e6, 5e6, 0)}) {
    Pose pose = kTruth;
    pose.translation += by;
    const ScanScore none = score(*target, scene.scan, pose);
    CHECK(none.fitness == 0.0);
    CHECK(none.coverage == 0.0);
    CHECK(std::isfinite(none.nvtl));
  }
}

void owns_its_map(const Subject& subject) {
  const Scene scene = some_scene(subject);
  Random random(subject.seed() + 1);
  const Pose guess = off(random, kTruth, subject.claims<MatcherClaims>(), 0.5);
  const auto kept = prepare(subject, scene.map);
  const Alignment expected = align(*kept, scene.scan, guess);

  PointCloud map = scene.map;
  auto matcher = subject.make<ScanMatcher>();
  const auto target = prepare(matcher, map);
  matcher.reset();
  // Puts other points into the same memory, so that a plugin that still reads it finds another map.
  for (Point& p : map) p += Point(0.4, 0.3, 0.2);
  const Alignment got = align(*target, scene.scan, guess);
  CHECK(same(got, expected));
  CHECK(same(score(*target, scene.scan, kTruth), score(*kept, scene.scan, kTruth)));
}

void degenerate(const Subject& subject) {
  const auto matcher = subject.make<ScanMatcher>();
  Random random(subject.seed());
  const Point p(0.3, 0.4, 0.5);
  const std::array<PointCloud, 6> clouds{
      PointCloud{p},
      PointCloud{p, p + Point(3, 0, 0)},
      PointCloud(200, p),
      random_cloud(random, 2000, {-8, 0.4, 0.5}, {8, 0.4, 0.5}),  // a line
      random_cloud(random, 8000, {-8, -8, 0.5}, {8, 8, 0.5}),     // a plane
      random_cloud(random, 2000, {0.3, 0.3, 0.3}, {0.4, 0.4, 0.4})};
  const std::array<Pose, 2> guesses{Pose{},
                                    pose_from_xyz_rpy({0.1, 0.2, 0.1}, {0.01, -0.01, 0.05})};
  const auto try_scans = [&](const MatchTarget& target) {
    for (std::size_t s = 0; s < clouds.size(); ++s) {
      CAPTURE(s);
      for (const Pose& guess : guesses) {
        if (const auto alignment = target.align(clouds[s], guess)) {
          CHECK(is_valid(alignment->T_map_scan));
          CHECK(alignment->hessian.allFinite());
          CHECK(is_finite(alignment->score));
        }
        if (const auto score = target.score(clouds[s], guess)) CHECK(is_finite(*score));
      }
    }
  };
  for (std::size_t m = 0; m < clouds.size(); ++m) {
    CAPTURE(m);
    if (const auto target = try_prepare(matcher, clouds[m])) try_scans(**target);
  }
  const PointCloud map = street(random);
  try_scans(*prepare(matcher, map));
}

void score_of_the_answer(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto target = prepare(subject, scene.map);
  Random random(subject.seed() + 1);
  for (int i = 0; i < 3; ++i) {
    const Pose guess = off(random, kTruth, subject.claims<MatcherClaims>());
    const Alignment got = align(*target, scene.scan, guess);
    CHECK(is_valid(got.T_map_scan));
    CHECK(got.hessian.allFinite());
    CHECK(got.hessian == got.hessian.transpose());
    const ScanScore expected = score(*target, scene.scan, got.T_map_scan);
    CHECK(got.score.fitness == doctest::Approx(expected.fitness).epsilon(1e-6));
    CHECK(got.score.nvtl == doctest::Approx(expected.nvtl).epsilon(1e-6));
    CHECK(got.score.coverage == doctest::Approx(expected.coverage).epsilon(1e-3));
  }
}

/// The points of a cloud with x < `end` in the frame of a pose.
PointCloud behind(PointsView cloud, const Pose& T_map_frame, double end) {
  const Pose T_frame_map = T_map_frame.inverse();
  PointCloud kept;
  for (const Point& p : cloud) {
    if ((T_frame_map * p).x() < end) kept.push_back(p);
  }
  return kept;
}

void restores(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto matcher = subject.make<ScanMatcher>();
  const auto target = prepare(matcher, scene.map);
  const PreparedMap whole = excerpt(*target, scene.map);
  CHECK(whole.elements == target->elements());
  CHECK_MESSAGE(target->excerpt(scene.map) == whole, "the second excerpt differs");

  Random random(subject.seed() + 1);
  const auto aligns_alike = [&](const MatchTarget& restored, PointsView scan) {
    for (int i = 0; i < 3; ++i) {
      CAPTURE(i);
      const Pose guess = off(random, kTruth, subject.claims<MatcherClaims>());
      check_close(subject, align(restored, scan, guess).T_map_scan,
                  align(*target, scan, guess).T_map_scan);
    }
  };
  const auto another = subject.make<ScanMatcher>();
  for (const auto* reader : {&matcher, &another}) {
    std::vector<std::byte> bytes = whole.bytes;
    const auto restored = restore(*reader, bytes);
    std::fill(bytes.begin(), bytes.end(), std::byte{0xff});  // the bytes are borrowed for the call
                                                             // only
    CHECK(restored->elements() == target->elements());
    aligns_alike(*restored, scene.scan);
  }

  // Nothing of the scan is within 2 m of where the excerpt ends.
  const PreparedMap half = excerpt(*target, behind(scene.map, kTruth, 4.0));
  CHECK(half.elements > 0);
  CHECK(half.elements < whole.elements);
  const auto restored = restore(matcher, half.bytes);
  CHECK(restored->elements() == half.elements);
  aligns_alike(*restored, behind(scene.scan, Pose{}, 2.0));

  const PreparedMap nothing = excerpt(*target, {});
  CHECK(nothing.elements == 0);
  check_fails(matcher->restore(nothing.bytes), ErrorCode::too_few_matches);
}

/// How bytes are damaged: cut or extended to a size, and bits of one of them flipped.
struct Damage {
  std::size_t size, byte = 0;
  unsigned flipped = 0;  // a mask

  [[nodiscard]] std::vector<std::byte> done_to(std::vector<std::byte> bytes) const {
    bytes.resize(size);
    if (flipped != 0) bytes[byte] ^= static_cast<std::byte>(flipped);
    return bytes;
  }
};

std::vector<Damage> damages(Random& random, std::size_t size) {
  std::vector<Damage> all{{0}, {1}, {size / 2}, {size - 1}, {size + 1}};
  for (int i = 0; i < 5; ++i) all.push_back({random.below(size)});
  const auto flip = [&](std::size_t byte) { all.push_back({size, byte, 1U << random.below(8)}); };
  // The sizes of the remaining data usually come first or last.
  constexpr std::size_t kHead = 128, kTail = 16;
  for (std::size_t byte = 0; byte < std::min(size, kHead); ++byte) flip(byte);
  for (std::size_t back = 1; back <= std::min(size, kTail); ++back) flip(size - back);
  for (int i = 0; i < 60; ++i) flip(random.below(size));
  return all;
}

void damaged_bytes(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto matcher = subject.make<ScanMatcher>();
  const auto prepared = prepare(matcher, scene.map);
  if (!prepared->excerpt(scene.map)) check_fails(matcher->restore({}), ErrorCode::unsupported);
  const PreparedMap whole = excerpt(*prepared, scene.map);
  REQUIRE_FALSE(whole.bytes.empty());
  Random random(subject.seed() + 1);
  const Pose guess = off(random, kTruth, subject.claims<MatcherClaims>(), 0.5);
  const Alignment expected = align(*restore(matcher, whole.bytes), scene.scan, guess);
  for (const Damage& damage : damages(random, whole.bytes.size())) {
    CAPTURE(damage.size);
    CAPTURE(damage.byte);
    CAPTURE(damage.flipped);
    auto target = matcher->restore(damage.done_to(whole.bytes));
    if (target) {
      REQUIRE_MESSAGE(*target, "restore gives no target and no error");
      const auto restored = in_library_of(matcher, *std::move(target));
      CHECK_MESSAGE(restored->elements() == whole.elements, "another map is restored");
      const auto got = restored->align(scene.scan, guess);
      REQUIRE_MESSAGE(got, to_string(got.error()));
      REQUIRE_MESSAGE(same(*got, expected), "another map is restored");
      continue;
    }
    const ErrorCode code = target.error().code;
    const bool expected_error = code == ErrorCode::corrupt_data ||
                                code == ErrorCode::invalid_input ||
                                code == ErrorCode::too_few_matches;
    CHECK_MESSAGE(expected_error, to_string(target.error()));
  }
}

void grows(const Subject& subject) {
  Random random(subject.seed());
  const auto matcher = subject.make<ScanMatcher>();
  PointCloud map;
  std::size_t bytes = 0, elements = 0;
  for (int streets = 1; streets <= 4; ++streets) {
    CAPTURE(streets);
    const PointCloud next = moved(street(random), {60.0 * streets, 0, 0});
    map.insert(map.end(), next.begin(), next.end());
    const auto target = prepare(matcher, map);
    CHECK(target->bytes() > bytes);
    CHECK(target->elements() > elements);
    bytes = target->bytes();
    elements = target->elements();
  }
}

void decided_within_reach(const Subject& subject) {
  const Scene scene = some_scene(subject);
  const auto matcher = subject.make<ScanMatcher>();
  const double reach = matcher->reach();
  if (!std::isfinite(reach)) does_not_apply("its reach is infinite");
  const Bounds3 bounds = bounds_of(scene.map);
  const double border = 0.5 * (bounds.min.x() + bounds.max.x());
  PointCloud seen, part;
  for (const Point& p : scene.map) {
    if (p.x() < border - 4.0) seen.push_back(p);
    if (p.x() <= border - 4.0 + reach) part.push_back(p);
  }
  const PreparedMap of_whole = excerpt(*prepare(matcher, scene.map), seen);
  const PreparedMap of_part = excerpt(*prepare(matcher, part), seen);
  CHECK(of_whole.elements > 0);
  CHECK_MESSAGE(of_whole == of_part, "the excerpts of the map and of its part differ");
}

void any_threads(const Subject& subject) {
  const Scene scene = some_scene(subject);
  Random random(subject.seed() + 1);
  const Pose guess = off(random, kTruth, subject.claims<MatcherClaims>(), 0.5);
  struct Answers {
    Alignment alignment;
    ScanScore score;
    Result<PreparedMap> excerpt;
  };
  const auto answers = [&] {
    const auto matcher = subject.make<ScanMatcher>();
    const auto target = prepare(matcher, scene.map);
    return Answers{align(*target, scene.scan, guess), score(*target, scene.scan, guess),
                   target->excerpt(scene.map)};
  };
  const Answers expected = answers();
  with_threads([&] {
    const Answers got = answers();
    CHECK(same(got.alignment, expected.alignment));
    CHECK(same(got.score, expected.score));
    REQUIRE(got.excerpt.has_value() == expected.excerpt.has_value());
    if (got.excerpt) CHECK_MESSAGE(*got.excerpt == *expected.excerpt, "the excerpt differs");
  });
}

constexpr std::array kClauses{
    Clause{"M1", "a scan that was cut from the map stays at its place", &identity},
    Clause{"M2", "a guess as far off as claimed is corrected, as accurately as claimed", &recovers},
    Clause{"M3", "two clouds matched both ways give inverse poses", &inverse},
    Clause{"M4", "at the true pose the scan is covered, and nvtl is better than at poses near it",
           &best_at_truth},
    Clause{"M5", "an empty scan and one that does not overlap the map are too_few_matches",
           &nothing_to_match},
    Clause{"M6", "concurrent calls on one object agree bit for bit with calls one by one",
           &concurrent},
    Clause{"M7", "a map millions of metres away gives the same pose and score as at the origin",
           &far_away},
    Clause{"M8", "an empty map and a map point that is not finite are invalid_input", &bad_map},
    Clause{"M9", "a scan point that is not finite and a pose that is not valid are invalid_input",
           &bad_scan},
    Clause{"M10", "without overlap the score has fitness 0 and coverage 0, and there is no error",
           &score_without_overlap},
    Clause{"M11", "a prepared target needs neither the map's points nor the matcher any more",
           &owns_its_map},
    Clause{"M12", "degenerate maps and scans are errors or give a valid pose", &degenerate},
    Clause{"M13", "an alignment comes with the score of its pose and a symmetric Hessian",
           &score_of_the_answer},
    Clause{"M14", "a target restored from an excerpt aligns like the original target", &restores},
    Clause{"M15",
           "damaged prepared bytes are an error or the same map, never a crash or another map",
           &damaged_bytes},
    Clause{"M16", "bytes and elements are not 0 and grow with the map", &grows},
    Clause{"M17", "map points out of reach do not matter to an excerpt", &decided_within_reach},
    Clause{"M18", "1, 2 and 7 threads give the same result", &any_threads},
    Clause{"M19", "the Hessian of an alignment that converged is positive definite",
           &hessian_is_positive},
    Clause{"M20", "the Hessian moves and turns along with map and scan, as its rows say",
           &hessian_moves_along},
};

}  // namespace

template <>
std::span<const Clause> own_clauses<ScanMatcher>() {
  return kClauses;
}

}  // namespace vantage::conformance
