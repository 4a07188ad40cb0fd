// What icp and gicp both promise, through the loaded plugins.
#include <doctest/doctest.h>
#include <tbb/global_control.h>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "matchers.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

using test::aligned, test::prepared_by;

constexpr std::array kMatchers{"icp", "gicp"};

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

double metres_off(const Alignment& alignment, const Pose& pose) {
  return (alignment.T_map_scan.translation - pose.translation).norm();
}
double degrees_off(const Alignment& alignment, const Pose& pose) {
  return test::degrees(rotation_between(alignment.T_map_scan, pose));
}

}  // namespace

TEST_CASE("a scan of the map itself stays where it is") {
  const PointCloud scan = test::seen_from(scene().map, kTruth, 18.0, 1000000, 1);
  for (const std::string matcher : kMatchers) {
    for (const std::string toml : {"", "map_voxel = 0.0"}) {
      CAPTURE(matcher);
      CAPTURE(toml);
      const Alignment alignment = aligned(*prepared_by(matcher, scene().map, toml), scan, kTruth);
      CHECK(metres_off(alignment, kTruth) < 0.003);
      CHECK(degrees_off(alignment, kTruth) < 0.02);
      CHECK(alignment.score.coverage > 0.99);
      CHECK(is_valid(alignment.T_map_scan));
    }
  }
}

TEST_CASE("offsets are recovered with every loss and distance") {
  for (const std::string matcher : kMatchers) {
    for (const std::string toml : {"", "kernel = \"huber\"", "kernel = \"none\"",
                                   "final_distance = 0.2", "map_voxel = 0.0"}) {
      CAPTURE(matcher);
      CAPTURE(toml);
      std::mt19937 random(1);
      const auto target = prepared_by(matcher, scene().map, toml);
      // The scan's poles stand elsewhere than the map's, which without a robust loss tells.
      const double accuracy = toml == "kernel = \"none\"" ? 0.05 : 0.01;
      for (int i = 0; i < 10; ++i) {
        const Pose guess = test::disturbed(kTruth, 0.5, 3.0, random);
        const Alignment alignment = aligned(*target, scene().scan, guess);
        CHECK(metres_off(alignment, kTruth) < accuracy);
        CHECK(degrees_off(alignment, kTruth) < 0.1);
        CHECK(alignment.termination == Termination::converged);
      }
    }
  }
}

TEST_CASE("an alignment says what it ended with") {
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto target = prepared_by(matcher, scene().map);
    std::mt19937 random(2);
    const Pose guess = test::disturbed(kTruth, 0.4, 2.0, random);
    const Alignment alignment = aligned(*target, scene().scan, guess);
    CHECK(alignment.termination == Termination::converged);
    CHECK(alignment.iterations > 1);
    const auto score = target->score(scene().scan, alignment.T_map_scan);
    REQUIRE(score);
    CHECK(alignment.score.fitness == doctest::Approx(score->fitness).epsilon(1e-9));
    CHECK(alignment.score.nvtl == doctest::Approx(score->nvtl).epsilon(1e-9));
    CHECK(alignment.score.coverage == score->coverage);

    CHECK(alignment.hessian == alignment.hessian.transpose());
    const Eigen::Matrix<double, 6, 6> hessian = alignment.hessian;
    CHECK(Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(hessian).eigenvalues()[0] >
          0.0);

    const auto limited = prepared_by(matcher, scene().map, "max_iterations = 1");
    const Alignment cut_short = aligned(*limited, scene().scan, guess);
    CHECK(cut_short.termination == Termination::max_iterations);
    CHECK(cut_short.iterations == 1);

    // A step is never longer than its limits.
    const auto slow =
        prepared_by(matcher, scene().map,
                    "max_iterations = 1\nmax_step_translation = 0.01\nmax_step_rotation = 0.001");
    const Alignment first = aligned(*slow, scene().scan, guess);
    const double metres = metres_off(first, guess);
    const double radians = rotation_between(first.T_map_scan, guess);
    CHECK(metres <= 0.01 + 1e-12);
    CHECK(radians <= 0.001 + 1e-12);
    CHECK(std::max(metres / 0.01, radians / 0.001) > 0.99);

    // A distance that shrinks has reached its end before an alignment has.
    const auto shrinking =
        prepared_by(matcher, scene().map, "max_distance = 3.2\nfinal_distance = 0.1");
    CHECK(aligned(*shrinking, scene().scan, alignment.T_map_scan).iterations >= 6);
    CHECK(aligned(*target, scene().scan, alignment.T_map_scan).iterations <= 2);
  }
}

TEST_CASE("the Hessian grows with the precision that sigma states") {
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto hessian = [&](const std::string& sigma) {
      // Without a loss that turns at a number of sigmas the pose is the same.
      return aligned(*prepared_by(matcher, scene().map, "kernel = \"none\"\nsigma = " + sigma),
                     scene().scan, kTruth)
          .hessian;
    };
    const Alignment::Hessian coarse = hessian("0.1"), fine = hessian("0.05");
    CHECK((fine - 4.0 * coarse).norm() < 1e-6 * fine.norm());
  }
}

TEST_CASE("a robust loss keeps what has moved from pulling the pose") {
  PointCloud map = scene().map;
  for (Point& p : map) {
    if (p.y() > 11.5 && p.z() > 1.0 && p.x() < -4.0) p.y() += 0.4;  // a part of a wall
  }
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto error = [&](const std::string& toml) {
      return metres_off(aligned(*prepared_by(matcher, map, toml), scene().scan, kTruth), kTruth);
    };
    const double plain = error("kernel = \"none\"");
    CHECK(plain > 0.05);
    CHECK(error("kernel = \"huber\"\nkernel_scale = 1.0") < 0.8 * plain);
    CHECK(error("") < 0.25 * plain);
  }
}

TEST_CASE("two clouds matched both ways give inverse poses") {
  const PointCloud a = test::seen_from(scene().map, kTruth, 18.0, 1000000, 1);
  const Pose other = pose_from_xyz_rpy({-0.8, 0.6, 1.2}, {-0.01, 0.02, 0.9});
  const PointCloud b = test::seen_from(test::yard(43), other, 18.0, 1000000, 1);
  const Pose T_a_b = kTruth.inverse() * other;
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    std::mt19937 random(3);
    const Alignment forth =
        aligned(*prepared_by(matcher, a), b, test::disturbed(T_a_b, 0.2, 1.0, random));
    const Alignment back =
        aligned(*prepared_by(matcher, b), a, test::disturbed(T_a_b.inverse(), 0.2, 1.0, random));
    const Pose loop = forth.T_map_scan * back.T_map_scan;
    CHECK(loop.translation.norm() < 0.01);
    CHECK(test::degrees(rotation_between(loop, Pose{})) < 0.1);
  }
}

TEST_CASE("the score is best at the truth and tells a bad pose as the localizer does") {
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    std::mt19937 random(4);
    const auto target = prepared_by(matcher, scene().map);
    const auto best = target->score(scene().scan, kTruth);
    REQUIRE(best);
    CHECK(best->nvtl > 1.0);
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
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    std::mt19937 random(5);
    const Pose guess = test::disturbed(kTruth, 0.3, 2.0, random);
    const Alignment near = aligned(*prepared_by(matcher, scene().map), scene().scan, guess);
    for (const Eigen::Vector3d& by :
         {Eigen::Vector3d(1e6, 0.0, 0.0), Eigen::Vector3d(-4e5, 5e6, 2000.0)}) {
      const auto target = prepared_by(matcher, test::shifted(scene().map, by));
      Pose shifted_guess = guess;
      shifted_guess.translation += by;
      const Alignment far = aligned(*target, scene().scan, shifted_guess);
      CHECK((far.T_map_scan.translation - by - near.T_map_scan.translation).norm() < 1e-6);
      CHECK(rotation_between(far.T_map_scan, near.T_map_scan) < 1e-7);
      CHECK(far.score.fitness == doctest::Approx(near.score.fitness).epsilon(1e-6));
      CHECK(far.iterations == near.iterations);
    }
  }
}

TEST_CASE("neither the number of threads nor the order of the map changes a bit") {
  const PointCloud scan = test::seen_from(test::yard(42), kTruth, 18.0, 12000, 1);
  for (const std::string matcher : kMatchers) {
    for (const std::string toml : {"", "map_voxel = 0.0"}) {
      CAPTURE(matcher);
      CAPTURE(toml);
      std::mt19937 random(6);
      const auto target = prepared_by(matcher, scene().map, toml);
      const Pose guess = test::disturbed(kTruth, 0.5, 3.0, random);
      const Alignment plain = aligned(*target, scan, guess);
      for (const std::size_t threads : {1, 3}) {
        CAPTURE(threads);
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        CHECK(same_bits(aligned(*target, scan, guess), plain));
        // Also of a map made ready on so many threads.
        CHECK(same_bits(aligned(*prepared_by(matcher, scene().map, toml), scan, guess), plain));
      }
      PointCloud shuffled = scene().map;
      std::shuffle(shuffled.begin(), shuffled.end(), random);
      CHECK(same_bits(aligned(*prepared_by(matcher, shuffled, toml), scan, guess), plain));
    }
  }
}

TEST_CASE("concurrent alignments agree with serial ones bit for bit") {
  std::mt19937 random(7);
  std::vector<Pose> guesses;
  for (int i = 0; i < 16; ++i) guesses.push_back(test::disturbed(kTruth, 0.4, 2.0, random));
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto target = prepared_by(matcher, scene().map);
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
  }
}

TEST_CASE("scans that cannot be matched are errors, never poses") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double inf = std::numeric_limits<double>::infinity();
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto target = prepared_by(matcher, scene().map);
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
    CHECK(alignment.error().message.find(" of 4000 scan points") != std::string::npos);
    CHECK(prepared_by(matcher, scene().map, "min_coverage = 0.01")->align(scan, kTruth));
    CHECK(code_of(PointsView(scan).first(10), kTruth) == ErrorCode::too_few_matches);
  }
}

TEST_CASE("a few far-away points do no harm") {
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto target = prepared_by(matcher, scene().map);
    const Alignment clean = aligned(*target, scene().scan, kTruth);
    PointCloud scan = scene().scan;
    scan.emplace_back(1e300, -1e300, 1e300);
    scan.emplace_back(1e7, 0.0, 0.0);
    const Alignment alignment = aligned(*target, scan, kTruth);
    CHECK(metres_off(alignment, clean.T_map_scan) < 1e-9);
  }
}

TEST_CASE("maps that cannot be matched against are errors") {
  for (const std::string name : kMatchers) {
    CAPTURE(name);
    const auto matcher = test::plugin<ScanMatcher>(name);
    const auto code_of = [&](PointsView map) {
      const auto target = matcher->prepare(map);
      REQUIRE(!target);
      return target.error().code;
    };
    CHECK(code_of({}) == ErrorCode::invalid_input);
    PointCloud map = scene().map;
    map[5].x() = std::numeric_limits<double>::quiet_NaN();
    CHECK(code_of(map) == ErrorCode::invalid_input);
    CHECK(code_of(PointCloud{{0.0, 0.0, 0.0}, {1e7, 0.0, 0.0}}) == ErrorCode::invalid_input);
  }
  const auto icp = test::plugin<ScanMatcher>("icp");
  PointCloud line;
  for (int i = 0; i < 500; ++i) line.emplace_back(0.1 * i, 0.2 * i, 0.0);
  for (const PointCloud& map : {line, PointCloud(100, Point(1.0, 1.0, 1.0))}) {
    const auto target = icp->prepare(map);
    REQUIRE(!target);
    CHECK(target.error().code == ErrorCode::too_few_matches);
    CHECK(target.error().message.find("no surface") != std::string::npos);
  }
}

TEST_CASE("degenerate worlds end with a valid pose or an error") {
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(-10.0, 10.0);
  PointCloud plane, line;
  for (int i = 0; i < 20000; ++i) {
    plane.emplace_back(unit(random), unit(random), 0.5);
    line.emplace_back(unit(random), 0.3, 0.5);
  }
  const Pose guess = pose_from_xyz_rpy({0.1, 0.2, 0.1}, {0.01, -0.01, 0.05});
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const Alignment on_plane = aligned(*prepared_by(matcher, plane), plane, guess);
    // What the plane tells is found, what it does not stays near the guess.
    CHECK(std::abs((on_plane.T_map_scan * Point(0.0, 0.3, 0.5)).z() - 0.5) < 0.01);
    CHECK(metres_off(on_plane, guess) < 1.0);
  }
  const Alignment on_line = aligned(*prepared_by("gicp", line), line, guess);
  CHECK(is_valid(on_line.T_map_scan));
  const Point middle = on_line.T_map_scan * Point(0.0, 0.3, 0.5);
  CHECK((middle.tail<2>() - Eigen::Vector2d(0.3, 0.5)).norm() < 0.01);
  const auto on_dot = prepared_by("gicp", PointCloud(100, Point(0.3, 0.3, 0.5)))
                          ->align(PointCloud(100, Point(0.3, 0.3, 0.6)), Pose{});
  REQUIRE(on_dot);
  CHECK(is_valid(on_dot->T_map_scan));
}

TEST_CASE("a target says what it holds") {
  const auto thinned = test::thinned(scene().map, 0.25).size();
  for (const std::string matcher : kMatchers) {
    CAPTURE(matcher);
    const auto coarse = prepared_by(matcher, scene().map);
    const auto fine = prepared_by(matcher, scene().map, "map_voxel = 0.0");
    CHECK(coarse->elements() == thinned);
    CHECK(fine->elements() == scene().map.size());
    for (const auto* target : {coarse.get(), fine.get()}) {
      CHECK(target->bytes() > 48 * target->elements());
      CHECK(target->bytes() < 100 * target->elements());
    }
  }
}

TEST_CASE("bad parameters are refused") {
  for (const std::string matcher : kMatchers) {
    for (const char* toml :
         {"map_voxel = -0.1", "neighbours = 2", "neighbours = 65", "sigma = 0.0",
          "max_distance = 0.0", "final_distance = 0.0", "final_distance = 1.5",
          "max_distance = 0.5\nfinal_distance = 0.6", "kernel = \"cauchy\"", "kernel_scale = 0.0",
          "max_iterations = 0", "translation_epsilon = 0.0", "rotation_epsilon = 0.0",
          "max_step_translation = 0.0", "max_step_rotation = 0.0", "min_coverage = 1.5",
          "min_matches = 0", "sigmaa = 1.0"}) {
      CAPTURE(matcher);
      CAPTURE(toml);
      const auto loaded = test::built_plugins().load<ScanMatcher>(
          {.plugin = matcher, .library = {}, .params = test::table(toml), .where = {}});
      REQUIRE(!loaded);
      CHECK(loaded.error().code == ErrorCode::invalid_config);
    }
  }
}

}  // namespace vantage
