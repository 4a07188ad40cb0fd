#include <doctest/doctest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <Eigen/Eigenvalues>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "scenes.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

constexpr std::array kModes{"direct7", "direct1", "direct26", "kdtree"};

std::string mode_toml(const std::string& mode) { return "neighbours = \"" + mode + "\""; }

Alignment aligned(const MatchTarget& target, PointsView scan, const Pose& guess) {
  auto alignment = target.align(scan, guess);
  if (!alignment) throw std::runtime_error(to_string(alignment.error()));
  return *std::move(alignment);
}

/// Bit for bit, -0 and 0 apart.
bool same_bits(const Alignment& a, const Alignment& b) {
  return std::memcmp(a.T_map_scan.translation.data(), b.T_map_scan.translation.data(), 24) == 0 &&
         std::memcmp(a.T_map_scan.rotation.coeffs().data(), b.T_map_scan.rotation.coeffs().data(),
                     32) == 0 &&
         std::memcmp(a.hessian.data(), b.hessian.data(), sizeof(double) * 36) == 0 &&
         std::memcmp(&a.score, &b.score, sizeof(ScanScore)) == 0 &&
         a.termination == b.termination && a.iterations == b.iterations;
}

const Pose kTruth = pose_from_xyz_rpy({0.4, -0.3, 1.0}, {0.02, -0.01, 0.7});

struct Scene {
  PointCloud map = test::yard(41);
  PointCloud scan = test::seen_from(test::yard(42), kTruth, 18.0, 4000, 1);
};
const Scene& scene() {
  static const Scene made;
  return made;
}

}  // namespace

TEST_CASE("a scan of the map itself stays where it is") {
  const PointCloud scan = test::seen_from(scene().map, kTruth, 18.0, 1000000, 1);
  for (const std::string mode : kModes) {
    CAPTURE(mode);
    const auto target = test::prepared(scene().map, mode_toml(mode));
    const Alignment alignment = aligned(*target, scan, kTruth);
    CHECK((alignment.T_map_scan.translation - kTruth.translation).norm() < 0.005);
    CHECK(test::degrees(rotation_between(alignment.T_map_scan, kTruth)) < 0.02);
    CHECK(alignment.score.coverage > 0.95);
    CHECK(is_valid(alignment.T_map_scan));
  }
}

TEST_CASE("offsets are recovered") {
  std::mt19937 random(1);
  for (const std::string mode : kModes) {
    CAPTURE(mode);
    const auto target = test::prepared(scene().map, mode_toml(mode));
    for (int i = 0; i < 20; ++i) {
      const Pose guess = test::disturbed(kTruth, 0.5, 3.0, random);
      const Alignment alignment = aligned(*target, scene().scan, guess);
      CHECK((alignment.T_map_scan.translation - kTruth.translation).norm() < 0.01);
      CHECK(test::degrees(rotation_between(alignment.T_map_scan, kTruth)) < 0.1);
      CHECK(alignment.termination != Termination::max_iterations);
    }
  }
}

TEST_CASE("an alignment says what it ended with") {
  const auto target = test::prepared(scene().map, mode_toml("direct26"));
  std::mt19937 random(2);
  const Pose guess = test::disturbed(kTruth, 0.4, 2.0, random);
  const Alignment alignment = aligned(*target, scene().scan, guess);
  CHECK(alignment.termination == Termination::converged);
  CHECK(alignment.iterations > 1);
  const auto score = target->score(scene().scan, alignment.T_map_scan);
  REQUIRE(score);
  CHECK(alignment.score.fitness == doctest::Approx(score->fitness).epsilon(1e-6));
  CHECK(alignment.score.nvtl == doctest::Approx(score->nvtl).epsilon(1e-6));
  CHECK(alignment.score.coverage == score->coverage);

  // At a minimum the Hessian is symmetric and positive definite.
  CHECK(alignment.hessian == alignment.hessian.transpose());
  const Eigen::Matrix<double, 6, 6> hessian = alignment.hessian;
  CHECK(Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(hessian).eigenvalues()[0] > 0.0);

  const auto limited = test::prepared(scene().map, "max_iterations = 1");
  const Alignment cut_short = aligned(*limited, scene().scan, guess);
  CHECK(cut_short.termination == Termination::max_iterations);
  CHECK(cut_short.iterations == 1);

  // A step is never longer than its limits.
  const auto slow = test::prepared(
      scene().map, "max_iterations = 1\nmax_step_translation = 0.01\nmax_step_rotation = 0.001");
  const Alignment first = aligned(*slow, scene().scan, guess);
  const double metres = (first.T_map_scan.translation - guess.translation).norm();
  const double radians = rotation_between(first.T_map_scan, guess);
  CHECK(metres <= 0.01 + 1e-12);
  CHECK(radians <= 0.001 + 1e-12);
  CHECK(std::max(metres / 0.01, radians / 0.001) > 0.01);
}

TEST_CASE("aligning again from the answer changes nothing to speak of") {
  const auto target = test::prepared(scene().map);
  const Alignment once = aligned(*target, scene().scan, kTruth);
  const Alignment twice = aligned(*target, scene().scan, once.T_map_scan);
  CHECK((once.T_map_scan.translation - twice.T_map_scan.translation).norm() < 1e-3);
  CHECK(rotation_between(once.T_map_scan, twice.T_map_scan) < 1e-4);
}

TEST_CASE("two clouds matched both ways give inverse poses") {
  const PointCloud a = test::seen_from(scene().map, kTruth, 18.0, 1000000, 1);
  const Pose other = pose_from_xyz_rpy({-0.8, 0.6, 1.2}, {-0.01, 0.02, 0.9});
  const PointCloud b = test::seen_from(test::yard(43), other, 18.0, 1000000, 1);
  const Pose T_a_b = kTruth.inverse() * other;
  std::mt19937 random(3);
  const Alignment forth = aligned(*test::prepared(a), b, test::disturbed(T_a_b, 0.2, 1.0, random));
  const Alignment back =
      aligned(*test::prepared(b), a, test::disturbed(T_a_b.inverse(), 0.2, 1.0, random));
  const Pose loop = forth.T_map_scan * back.T_map_scan;
  CHECK(loop.translation.norm() < 0.01);
  CHECK(test::degrees(rotation_between(loop, Pose{})) < 0.1);
}

TEST_CASE("the score is best at the truth") {
  std::mt19937 random(4);
  for (const std::string mode : kModes) {
    CAPTURE(mode);
    const auto target = test::prepared(scene().map, mode_toml(mode));
    const auto best = target->score(scene().scan, kTruth);
    REQUIRE(best);
    for (int i = 0; i < 20; ++i) {
      Pose off = test::disturbed(kTruth, 0.3, 2.0, random);
      off.translation.z() += 0.1;
      const auto score = target->score(scene().scan, off);
      REQUIRE(score);
      CHECK(score->fitness < best->fitness);
      CHECK(score->nvtl < best->nvtl);
    }
  }
}

TEST_CASE("a map at UTM coordinates gives the answer of the same map at zero") {
  std::mt19937 random(5);
  const Pose guess = test::disturbed(kTruth, 0.3, 2.0, random);
  for (const std::string mode : kModes) {
    CAPTURE(mode);
    const Alignment near =
        aligned(*test::prepared(scene().map, mode_toml(mode)), scene().scan, guess);
    for (const Eigen::Vector3d& by :
         {Eigen::Vector3d(1e6, 0.0, 0.0), Eigen::Vector3d(-4e5, 5e6, 2000.0)}) {
      const auto target = test::prepared(test::shifted(scene().map, by), mode_toml(mode));
      Pose shifted_guess = guess;
      shifted_guess.translation += by;
      const Alignment far = aligned(*target, scene().scan, shifted_guess);
      CHECK((far.T_map_scan.translation - by - near.T_map_scan.translation).norm() < 1e-6);
      CHECK(rotation_between(far.T_map_scan, near.T_map_scan) < 1e-7);
      CHECK(far.score.fitness == doctest::Approx(near.score.fitness).epsilon(1e-7));
      CHECK(far.iterations == near.iterations);
    }
  }
}

TEST_CASE("the number of threads changes no bit") {
  std::mt19937 random(6);
  const PointCloud scan = test::seen_from(test::yard(42), kTruth, 18.0, 20000, 1);
  for (const std::string mode : kModes) {
    CAPTURE(mode);
    const auto target = test::prepared(scene().map, mode_toml(mode));
    const Pose guess = test::disturbed(kTruth, 0.5, 3.0, random);
    const Alignment plain = aligned(*target, scan, guess);
    for (const std::size_t threads : {1, 2, 3}) {
      CAPTURE(threads);
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      CHECK(same_bits(aligned(*target, scan, guess), plain));
      // Also of a map made ready on so many threads.
      CHECK(same_bits(aligned(*test::prepared(scene().map, mode_toml(mode)), scan, guess), plain));
    }
  }
}

TEST_CASE("concurrent alignments agree with serial ones bit for bit") {
  std::mt19937 random(7);
  std::vector<Pose> guesses;
  for (int i = 0; i < 24; ++i) guesses.push_back(test::disturbed(kTruth, 0.4, 2.0, random));
  for (const std::string mode : kModes) {
    CAPTURE(mode);
    const auto target = test::prepared(scene().map, mode_toml(mode));
    // Scans of different sizes, so that workspaces are reused by others.
    const auto scan_of = [&](std::size_t i) {
      return PointsView(scene().scan).first(2000 + 80 * i);
    };
    std::vector<Alignment> serial, concurrent(guesses.size());
    for (std::size_t i = 0; i < guesses.size(); ++i) {
      serial.push_back(aligned(*target, scan_of(i), guesses[i]));
    }
    std::vector<std::thread> threads;
    for (std::size_t thread = 0; thread < 4; ++thread) {
      threads.emplace_back([&, thread] {
        for (std::size_t i = thread; i < guesses.size(); i += 4) {
          concurrent[i] = aligned(*target, scan_of(i), guesses[i]);
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    for (std::size_t i = 0; i < guesses.size(); ++i) CHECK(same_bits(serial[i], concurrent[i]));

    tbb::parallel_for(std::size_t{0}, guesses.size(), [&](std::size_t i) {
      concurrent[i] = aligned(*target, scan_of(i), guesses[i]);
    });
    for (std::size_t i = 0; i < guesses.size(); ++i) CHECK(same_bits(serial[i], concurrent[i]));
  }
}

TEST_CASE("scans that cannot be matched are errors, never poses") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (const std::string mode : kModes) {
    CAPTURE(mode);
    const auto target = test::prepared(scene().map, mode_toml(mode));
    const auto code_of = [&](PointsView scan, const Pose& guess) {
      const auto alignment = target->align(scan, guess);
      REQUIRE(!alignment);
      return alignment.error().code;
    };
    CHECK(code_of({}, kTruth) == ErrorCode::too_few_matches);
    CHECK(target->score({}, kTruth).error().code == ErrorCode::too_few_matches);

    for (const double bad : {nan, inf, -inf}) {
      CAPTURE(bad);
      PointCloud scan = scene().scan;
      scan[17].z() = bad;
      CHECK(code_of(scan, kTruth) == ErrorCode::invalid_input);
      CHECK(target->score(scan, kTruth).error().code == ErrorCode::invalid_input);
      Pose guess = kTruth;
      guess.translation.y() = bad;
      CHECK(code_of(scene().scan, guess) == ErrorCode::invalid_input);
      guess = kTruth;
      guess.rotation.w() = bad;
      CHECK(code_of(scene().scan, guess) == ErrorCode::invalid_input);
    }
    Pose stretched = kTruth;
    stretched.rotation.coeffs() *= 2.0;
    CHECK(code_of(scene().scan, stretched) == ErrorCode::invalid_input);

    for (const double far : {100.0, 3e6, 1e12, 1e200, -1e308}) {
      CAPTURE(far);
      Pose guess = kTruth;
      guess.translation.x() = far;
      CHECK(code_of(scene().scan, guess) == ErrorCode::too_few_matches);
      const auto score = target->score(scene().scan, guess);
      REQUIRE(score);
      CHECK(score->fitness == 0.0);
      CHECK(score->coverage == 0.0);
      CHECK(code_of(PointCloud(100, Point(0.0, far, far)), kTruth) == ErrorCode::too_few_matches);
    }

    PointCloud scan = scene().scan;
    for (std::size_t i = 150; i < scan.size(); ++i) scan[i].z() += 500.0;  // 3.75 % are left
    const auto alignment = target->align(scan, kTruth);
    REQUIRE(!alignment);
    CHECK(alignment.error().code == ErrorCode::too_few_matches);
    CHECK(alignment.error().message.find("of 4000 scan points") != std::string::npos);
    CHECK(test::prepared(scene().map, mode_toml(mode) + "\nmin_coverage = 0.01")
              ->align(scan, kTruth));
    CHECK(code_of(PointsView(scan).first(10), kTruth) == ErrorCode::too_few_matches);
  }
}

TEST_CASE("a few far-away points do no harm") {
  const auto target = test::prepared(scene().map);
  const Alignment clean = aligned(*target, scene().scan, kTruth);
  PointCloud scan = scene().scan;
  scan.emplace_back(1e300, -1e300, 1e300);
  scan.emplace_back(1e7, 0.0, 0.0);
  const Alignment alignment = aligned(*target, scan, kTruth);
  CHECK((alignment.T_map_scan.translation - clean.T_map_scan.translation).norm() < 1e-9);
}

TEST_CASE("maps that cannot be matched against are errors") {
  const auto matcher = test::plugin<ScanMatcher>("ndt");
  const auto code_of = [&](PointsView map) {
    const auto target = matcher->prepare(map);
    REQUIRE(!target);
    return target.error().code;
  };
  CHECK(code_of({}) == ErrorCode::invalid_input);
  PointCloud map = scene().map;
  map[5].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(code_of(map) == ErrorCode::invalid_input);
  CHECK(code_of(PointCloud{{0.0, 0.0, 0.0}, {5.0, 0.0, 0.0}}) == ErrorCode::too_few_matches);
  CHECK(code_of(PointCloud(100, Point(1.0, 1.0, 1.0))) == ErrorCode::too_few_matches);
}

TEST_CASE("degenerate worlds end with a valid pose or an error") {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-10.0, 10.0);
  const auto cloud = [&](bool x, bool y) {
    PointCloud points;
    for (int i = 0; i < 20000; ++i) {
      points.emplace_back(x ? unit(random) : 0.3, y ? unit(random) : 0.3, 0.5);
    }
    return points;
  };
  const Pose guess = pose_from_xyz_rpy({0.1, 0.2, 0.1}, {0.01, -0.01, 0.05});
  for (const std::string mode : kModes) {
    CAPTURE(mode);
    for (const bool plane : {true, false}) {
      CAPTURE(plane);
      const PointCloud scan = cloud(true, plane);
      const auto alignment =
          test::prepared(cloud(true, plane), mode_toml(mode))->align(scan, guess);
      REQUIRE(alignment);
      CHECK(is_valid(alignment->T_map_scan));
      CHECK(alignment->hessian.allFinite());
      CHECK(std::isfinite(alignment->score.fitness));
      // What the plane or line tells is found, what it does not stays near the guess.
      CHECK(std::abs((alignment->T_map_scan * Point(0.0, 0.3, 0.5)).z() - 0.5) < 0.01);
      CHECK((alignment->T_map_scan.translation - guess.translation).norm() < 1.0);
    }
    PointCloud dot;
    for (int i = 0; i < 100; ++i) dot.emplace_back(0.3 + 1e-4 * unit(random), 0.3, 0.5);
    const auto alignment =
        test::prepared(dot, mode_toml(mode))->align(PointCloud(100, Point(0.3, 0.3, 0.5)), Pose{});
    REQUIRE(alignment);
    CHECK(is_valid(alignment->T_map_scan));
  }
}

TEST_CASE("coefficients are derived or given") {
  const auto fitness = [&](const std::string& toml) {
    return test::prepared(scene().map, toml)->score(scene().scan, kTruth).value().fitness;
  };
  const auto d = NdtCoefficients::derive(0.3, 1.0).value();
  const auto given = [](double d1, double d2, double d3) {
    return "d1 = " + std::to_string(d1) + "\nd2 = " + std::to_string(d2) +
           "\nd3 = " + std::to_string(d3);
  };
  CHECK(fitness("outlier_ratio = 0.3") ==
        doctest::Approx(fitness(given(d.d1, d.d2, d.d3))).epsilon(1e-5));
  CHECK(fitness("outlier_ratio = 0.3") != doctest::Approx(fitness("")));
  // d1, d2, d3 as the paper prints them bound the score of matched points.
  const double printed = fitness(given(0.00354, 0.432, -2.74));
  CHECK(printed > 2.7365 * 0.8);
  CHECK(printed < 2.74);

  // d1 scales the objective, and its sign does not turn it round.
  std::mt19937 random(9);
  const Pose guess = test::disturbed(kTruth, 0.2, 1.0, random);
  for (const double d1 : {0.00354, -5.0}) {
    const auto target = test::prepared(scene().map, given(d1, 0.432, -2.74));
    const Alignment alignment = aligned(*target, scene().scan, guess);
    CHECK((alignment.T_map_scan.translation - kTruth.translation).norm() < 0.01);
  }
}

TEST_CASE("bad parameters are refused") {
  for (const char* toml : {"resolution = 0.0",
                           "resolution = -1.0",
                           "outlier_ratio = 1.0",
                           "outlier_ratio = 0.0",
                           "neighbours = \"direct8\"",
                           "min_points_per_voxel = 2",
                           "eigenvalue_floor = 0.0",
                           "eigenvalue_floor = 1.5",
                           "max_iterations = 0",
                           "translation_epsilon = 0.0",
                           "d1 = -2.0",
                           "d1 = -2.0\nd2 = 0.4",
                           "d2 = 0.4\nd3 = 0.5",
                           "d1 = 0.0\nd2 = 0.4\nd3 = 0.5",
                           "d1 = -2.0\nd2 = -0.4\nd3 = 0.5",
                           "resolution = 1e-200",
                           "resolution = 1e200",
                           "min_coverage = 1.5",
                           "min_matches = 0",
                           "resolutoin = 1.0"}) {
    CAPTURE(toml);
    const auto loaded = test::built_plugins().load<ScanMatcher>(
        {.plugin = "ndt", .library = {}, .params = test::table(toml), .where = {}});
    REQUIRE(!loaded);
    CHECK(loaded.error().code == ErrorCode::invalid_config);
  }
}

}  // namespace vantage
