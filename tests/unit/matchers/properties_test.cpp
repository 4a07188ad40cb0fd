// What every matcher promises, through the loaded plugins.
#include <doctest/doctest.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "matchers.hpp"
#include "support/plugins.hpp"

namespace vantage {
namespace {

using test::aligned, test::degrees_off, test::kYardPose, test::metres_off, test::prepared_by,
    test::yard_scene;

/// A matcher and what it is held to.
struct Matcher {
  std::string plugin;
  std::vector<std::string> modes;   ///< its ways to match, as TOML
  std::vector<std::string> maps;    ///< its further ways to keep the map
  std::vector<std::string> losses;  ///< its further ways to weigh what does not fit
  std::string smooth;               ///< the mode in which a pose changes the matches the least
  std::vector<std::string> refused_params;

  // Unless the row says otherwise:
  double own_metres = 0.003, own_coverage = 0.99;  ///< a scan of the map itself
  int offsets = 10;                                ///< guesses to come back from, in each mode
  bool always_converges = true;
  double score_epsilon = 1e-9;  ///< relative, between an alignment's score and one of its pose
  double least_of_step = 0.99;  ///< part of the limit that a limited step takes
  double least_nvtl = 1.0;      ///< of the true pose
  double utm_epsilon = 1e-6;    ///< relative, of the fitness
  std::size_t points = 12000, guesses = 16;  ///< of a scan for many threads; alignments at once
  bool any_order = true;                     ///< the order of the map changes no bit
  bool go_on = false;  ///< the random poses of a mode follow those of the mode before
};

/// What icp and gicp share.
Matcher of_surfels(const std::string& plugin) {
  return {.plugin = plugin,
          .modes = {""},
          .maps = {"map_voxel = 0.0"},
          .losses = {"kernel = \"huber\"", "kernel = \"none\"", "final_distance = 0.2"},
          .smooth = "",
          .refused_params = {"map_voxel = -0.1", "neighbours = 2", "neighbours = 65", "sigma = 0.0",
                             "max_distance = 0.0", "final_distance = 0.0", "final_distance = 1.5",
                             "max_distance = 0.5\nfinal_distance = 0.6", "kernel = \"cauchy\"",
                             "kernel_scale = 0.0", "max_iterations = 0",
                             "translation_epsilon = 0.0", "rotation_epsilon = 0.0",
                             "max_step_translation = 0.0", "max_step_rotation = 0.0",
                             "min_coverage = 1.5", "min_matches = 0", "sigmaa = 1.0"}};
}

const std::vector<Matcher>& matchers() {
  static const std::vector<Matcher> all{
      of_surfels("icp"),
      of_surfels("gicp"),
      {.plugin = "ndt",
       .modes = {"neighbours = \"direct7\"", "neighbours = \"direct1\"",
                 "neighbours = \"direct26\"", "neighbours = \"kdtree\""},
       .maps = {},
       .losses = {},
       .smooth = "neighbours = \"direct26\"",
       .refused_params = {"resolution = 0.0",
                          "resolution = -1.0",
                          "levels = 0",
                          "levels = 7",
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
                          "resolutoin = 1.0"},
       .own_metres = 0.005,
       .own_coverage = 0.95,
       .offsets = 20,
       .always_converges = false,
       .score_epsilon = 1e-6,
       .least_of_step = 0.01,
       .least_nvtl = 0.0,
       .utm_epsilon = 1e-7,
       .points = 20000,
       .guesses = 24,
       .any_order = false,
       .go_on = true}};
  return all;
}

/// `check(matcher, toml)` for every matcher and each of these ways of it.
template <class Check>
void for_each(std::initializer_list<std::vector<std::string> Matcher::*> ways, Check check) {
  for (const Matcher& matcher : matchers()) {
    for (const auto way : ways) {
      for (const std::string& toml : matcher.*way) {
        CAPTURE(matcher.plugin);
        CAPTURE(toml);
        check(matcher, toml);
      }
    }
  }
}

/// The random numbers of each mode.
class Random {
 public:
  explicit Random(std::uint32_t seed) : seed_(seed) {}
  std::mt19937& of(const Matcher& matcher) {
    if (last_ != matcher.plugin || !matcher.go_on) engine_.seed(seed_);
    last_ = matcher.plugin;
    return engine_;
  }

 private:
  std::uint32_t seed_;
  std::mt19937 engine_;
  std::string last_;
};

/// Bit for bit, -0 and 0 apart.
bool same_bits(const Alignment& a, const Alignment& b) {
  return std::memcmp(a.T_map_scan.translation.data(), b.T_map_scan.translation.data(), 24) == 0 &&
         std::memcmp(a.T_map_scan.rotation.coeffs().data(), b.T_map_scan.rotation.coeffs().data(),
                     32) == 0 &&
         std::memcmp(a.hessian.data(), b.hessian.data(), sizeof(double) * 36) == 0 &&
         std::memcmp(&a.score, &b.score, sizeof(ScanScore)) == 0 &&
         a.termination == b.termination && a.iterations == b.iterations;
}

}  // namespace

TEST_CASE("a scan of the map itself stays where it is") {
  const PointCloud scan = test::seen_from(yard_scene().map, kYardPose, 18.0, 1000000, 1);
  for_each({&Matcher::modes, &Matcher::maps}, [&](const Matcher& matcher, const auto& toml) {
    const auto target = prepared_by(matcher.plugin, yard_scene().map, toml);
    const Alignment alignment = aligned(*target, scan, kYardPose);
    CHECK(metres_off(alignment, kYardPose) < matcher.own_metres);
    CHECK(degrees_off(alignment, kYardPose) < 0.02);
    CHECK(alignment.score.coverage > matcher.own_coverage);
    CHECK(is_valid(alignment.T_map_scan));
  });
}

TEST_CASE("offsets are recovered in every mode, with every loss and distance") {
  const auto ways = {&Matcher::modes, &Matcher::maps, &Matcher::losses};
  Random numbers(1);
  for_each(ways, [&](const Matcher& matcher, const auto& toml) {
    std::mt19937& random = numbers.of(matcher);
    const auto target = prepared_by(matcher.plugin, yard_scene().map, toml);
    // The scan's poles stand elsewhere than the map's, which without a robust loss tells.
    const double accuracy = toml == "kernel = \"none\"" ? 0.05 : 0.01;
    for (int i = 0; i < matcher.offsets; ++i) {
      const Pose guess = test::disturbed(kYardPose, 0.5, 3.0, random);
      const Alignment alignment = aligned(*target, yard_scene().scan, guess);
      CHECK(metres_off(alignment, kYardPose) < accuracy);
      CHECK(degrees_off(alignment, kYardPose) < 0.1);
      CHECK(alignment.termination != Termination::max_iterations);
      if (matcher.always_converges) CHECK(alignment.termination == Termination::converged);
    }
  });
}

TEST_CASE("guesses 2 m and 5 degrees off are recovered in every mode") {
  for_each({&Matcher::modes, &Matcher::maps}, [&](const Matcher& matcher, const auto& toml) {
    const auto target = prepared_by(matcher.plugin, yard_scene().map, toml);
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d by = 2.0 * Eigen::Vector3d(std::cos(i), std::sin(i), 0.0);
      const Pose guess{
          rotation_from_vector({0.0, 0.0, i % 2 == 0 ? 0.087 : -0.087}) * kYardPose.rotation,
          kYardPose.translation + by};
      const Alignment alignment = aligned(*target, yard_scene().scan, guess);
      CHECK(metres_off(alignment, kYardPose) < 0.01);
      CHECK(degrees_off(alignment, kYardPose) < 0.1);
    }
  });
}

TEST_CASE("an alignment says what it ended with") {
  for (const Matcher& matcher : matchers()) {
    CAPTURE(matcher.plugin);
    const auto target = prepared_by(matcher.plugin, yard_scene().map, matcher.smooth);
    std::mt19937 random(2);
    const Pose guess = test::disturbed(kYardPose, 0.4, 2.0, random);
    const Alignment alignment = aligned(*target, yard_scene().scan, guess);
    CHECK(alignment.termination == Termination::converged);
    CHECK(alignment.iterations > 1);
    const auto score = target->score(yard_scene().scan, alignment.T_map_scan);
    REQUIRE(score);
    const auto about = [&](double value) {
      return doctest::Approx(value).epsilon(matcher.score_epsilon);
    };
    CHECK(alignment.score.fitness == about(score->fitness));
    CHECK(alignment.score.nvtl == about(score->nvtl));
    CHECK(alignment.score.coverage == score->coverage);

    // At a minimum the Hessian is symmetric and positive definite.
    CHECK(alignment.hessian == alignment.hessian.transpose());
    const Eigen::Matrix<double, 6, 6> hessian = alignment.hessian;
    CHECK(Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(hessian).eigenvalues()[0] >
          0.0);

    const auto limited = prepared_by(matcher.plugin, yard_scene().map, "max_iterations = 1");
    const Alignment cut_short = aligned(*limited, yard_scene().scan, guess);
    CHECK(cut_short.termination == Termination::max_iterations);
    CHECK(cut_short.iterations == 1);

    // A step is never longer than its limits.
    const auto slow =
        prepared_by(matcher.plugin, yard_scene().map,
                    "max_iterations = 1\nmax_step_translation = 0.01\nmax_step_rotation = 0.001");
    const Alignment first = aligned(*slow, yard_scene().scan, guess);
    const double metres = metres_off(first, guess);
    const double radians = rotation_between(first.T_map_scan, guess);
    CHECK(metres <= 0.01 + 1e-12);
    CHECK(radians <= 0.001 + 1e-12);
    CHECK(std::max(metres / 0.01, radians / 0.001) > matcher.least_of_step);
  }
}

TEST_CASE("two clouds matched both ways give inverse poses") {
  const PointCloud a = test::seen_from(yard_scene().map, kYardPose, 18.0, 1000000, 1);
  const Pose other = pose_from_xyz_rpy({-0.8, 0.6, 1.2}, {-0.01, 0.02, 0.9});
  const PointCloud b = test::seen_from(test::yard(43), other, 18.0, 1000000, 1);
  const Pose T_a_b = kYardPose.inverse() * other;
  for (const Matcher& matcher : matchers()) {
    CAPTURE(matcher.plugin);
    std::mt19937 random(3);
    const Alignment forth =
        aligned(*prepared_by(matcher.plugin, a), b, test::disturbed(T_a_b, 0.2, 1.0, random));
    const Alignment back = aligned(*prepared_by(matcher.plugin, b), a,
                                   test::disturbed(T_a_b.inverse(), 0.2, 1.0, random));
    const Pose loop = forth.T_map_scan * back.T_map_scan;
    CHECK(loop.translation.norm() < 0.01);
    CHECK(test::degrees(rotation_between(loop, Pose{})) < 0.1);
  }
}

TEST_CASE("the score is best at the truth and tells a bad pose as the localizer does") {
  Random numbers(4);
  for_each({&Matcher::modes}, [&](const Matcher& matcher, const auto& toml) {
    std::mt19937& random = numbers.of(matcher);
    const auto target = prepared_by(matcher.plugin, yard_scene().map, toml);
    const auto best = target->score(yard_scene().scan, kYardPose);
    REQUIRE(best);
    CHECK(best->nvtl > matcher.least_nvtl);
    for (int i = 0; i < 20; ++i) {
      Pose off = test::disturbed(kYardPose, 0.3, 2.0, random);
      off.translation.z() += 0.1;
      const auto score = target->score(yard_scene().scan, off);
      REQUIRE(score);
      CHECK(score->fitness < best->fitness);
      CHECK(score->nvtl < best->nvtl);
    }
  });
}

TEST_CASE("a map at UTM coordinates gives the answer of the same map at zero") {
  for_each({&Matcher::modes}, [](const Matcher& matcher, const auto& toml) {
    std::mt19937 random(5);
    const Pose guess = test::disturbed(kYardPose, 0.3, 2.0, random);
    const Alignment near =
        aligned(*prepared_by(matcher.plugin, yard_scene().map, toml), yard_scene().scan, guess);
    for (const Eigen::Vector3d& by :
         {Eigen::Vector3d(1e6, 0.0, 0.0), Eigen::Vector3d(-4e5, 5e6, 2000.0)}) {
      const auto target = prepared_by(matcher.plugin, test::shifted(yard_scene().map, by), toml);
      Pose shifted_guess = guess;
      shifted_guess.translation += by;
      const Alignment far = aligned(*target, yard_scene().scan, shifted_guess);
      CHECK((far.T_map_scan.translation - by - near.T_map_scan.translation).norm() < 1e-6);
      CHECK(rotation_between(far.T_map_scan, near.T_map_scan) < 1e-7);
      CHECK(far.score.fitness == doctest::Approx(near.score.fitness).epsilon(matcher.utm_epsilon));
      CHECK(far.iterations == near.iterations);
    }
  });
}

TEST_CASE("the number of threads changes no bit, nor the order of the map where that is promised" *
          doctest::test_suite("slow")) {
  const PointCloud yard = test::yard(42);
  Random numbers(6);
  for_each({&Matcher::modes, &Matcher::maps}, [&](const Matcher& matcher, const auto& toml) {
    const PointCloud scan = test::seen_from(yard, kYardPose, 18.0, matcher.points, 1);
    std::mt19937& random = numbers.of(matcher);
    const auto target = prepared_by(matcher.plugin, yard_scene().map, toml);
    const Pose guess = test::disturbed(kYardPose, 0.5, 3.0, random);
    const Alignment plain = aligned(*target, scan, guess);
    for (const std::size_t threads : {1, 2, 3}) {
      CAPTURE(threads);
      const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
      CHECK(same_bits(aligned(*target, scan, guess), plain));
      // Also of a map made ready on so many threads.
      CHECK(same_bits(aligned(*prepared_by(matcher.plugin, yard_scene().map, toml), scan, guess),
                      plain));
    }
    if (!matcher.any_order) return;
    PointCloud shuffled = yard_scene().map;
    std::shuffle(shuffled.begin(), shuffled.end(), random);
    CHECK(same_bits(aligned(*prepared_by(matcher.plugin, shuffled, toml), scan, guess), plain));
  });
}

TEST_CASE("concurrent alignments agree with serial ones bit for bit") {
  for_each({&Matcher::modes}, [](const Matcher& matcher, const auto& toml) {
    std::mt19937 random(7);
    std::vector<Pose> guesses;
    while (guesses.size() < matcher.guesses) {
      guesses.push_back(test::disturbed(kYardPose, 0.4, 2.0, random));
    }
    const auto target = prepared_by(matcher.plugin, yard_scene().map, toml);
    // Scans of different sizes, so that workspaces are reused by others.
    const auto scan_of = [&](std::size_t i) {
      return PointsView(yard_scene().scan).first(2000 + 80 * i);
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
  });
}

TEST_CASE("scans that cannot be matched are errors, never poses") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  constexpr double inf = std::numeric_limits<double>::infinity();
  for_each({&Matcher::modes}, [=](const Matcher& matcher, const auto& toml) {
    const auto target = prepared_by(matcher.plugin, yard_scene().map, toml);
    const auto code_of = [&](PointsView scan, const Pose& guess) {
      const auto alignment = target->align(scan, guess);
      REQUIRE(!alignment);
      return alignment.error().code;
    };
    CHECK(code_of({}, kYardPose) == ErrorCode::too_few_matches);
    CHECK(target->score({}, kYardPose).error().code == ErrorCode::too_few_matches);

    for (const double bad : {nan, inf, -inf}) {
      CAPTURE(bad);
      PointCloud scan = yard_scene().scan;
      scan[17].z() = bad;
      CHECK(code_of(scan, kYardPose) == ErrorCode::invalid_input);
      CHECK(target->score(scan, kYardPose).error().code == ErrorCode::invalid_input);
      Pose guess = kYardPose;
      guess.translation.y() = bad;
      CHECK(code_of(yard_scene().scan, guess) == ErrorCode::invalid_input);
      guess = kYardPose;
      guess.rotation.w() = bad;
      CHECK(code_of(yard_scene().scan, guess) == ErrorCode::invalid_input);
    }
    Pose stretched = kYardPose;
    stretched.rotation.coeffs() *= 2.0;
    CHECK(code_of(yard_scene().scan, stretched) == ErrorCode::invalid_input);

    for (const double far : {100.0, 3e6, 1e12, 1e200, -1e308}) {
      CAPTURE(far);
      Pose guess = kYardPose;
      guess.translation.x() = far;
      CHECK(code_of(yard_scene().scan, guess) == ErrorCode::too_few_matches);
      const auto score = target->score(yard_scene().scan, guess);
      REQUIRE(score);
      CHECK(score->fitness == 0.0);
      CHECK(score->coverage == 0.0);
      CHECK(code_of(PointCloud(100, Point(0.0, far, far)), kYardPose) ==
            ErrorCode::too_few_matches);
    }

    PointCloud scan = yard_scene().scan;
    for (std::size_t i = 150; i < scan.size(); ++i) scan[i].z() += 500.0;  // 3.75 % are left
    const auto alignment = target->align(scan, kYardPose);
    REQUIRE(!alignment);
    CHECK(alignment.error().code == ErrorCode::too_few_matches);
    CHECK(alignment.error().message.find(" of 4000 scan points") != std::string::npos);
    CHECK(prepared_by(matcher.plugin, yard_scene().map, toml + "\nmin_coverage = 0.01")
              ->align(scan, kYardPose));
    CHECK(code_of(PointsView(scan).first(10), kYardPose) == ErrorCode::too_few_matches);
  });
}

TEST_CASE("a few far-away points do no harm") {
  for (const Matcher& matcher : matchers()) {
    CAPTURE(matcher.plugin);
    const auto target = prepared_by(matcher.plugin, yard_scene().map);
    const Alignment clean = aligned(*target, yard_scene().scan, kYardPose);
    PointCloud scan = yard_scene().scan;
    scan.emplace_back(1e300, -1e300, 1e300);
    scan.emplace_back(1e7, 0.0, 0.0);
    const Alignment alignment = aligned(*target, scan, kYardPose);
    CHECK(metres_off(alignment, clean.T_map_scan) < 1e-9);
  }
}

TEST_CASE("maps that cannot be matched against are errors") {
  for (const Matcher& row : matchers()) {
    CAPTURE(row.plugin);
    CHECK(test::refusal_of_map(row.plugin, {}).code == ErrorCode::invalid_input);
    PointCloud map = yard_scene().map;
    map[5].x() = std::numeric_limits<double>::quiet_NaN();
    CHECK(test::refusal_of_map(row.plugin, map).code == ErrorCode::invalid_input);
  }
}

TEST_CASE("bad parameters are refused") {
  for_each({&Matcher::refused_params}, [](const Matcher& matcher, const auto& toml) {
    const auto loaded = test::built_plugins().load<ScanMatcher>(
        {.plugin = matcher.plugin, .library = {}, .params = test::table(toml), .where = {}});
    REQUIRE(!loaded);
    CHECK(loaded.error().code == ErrorCode::invalid_config);
  });
}

}  // namespace vantage
