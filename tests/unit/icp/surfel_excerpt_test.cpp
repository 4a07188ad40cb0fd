// Prepared maps of icp and gicp: the codec from inside, the rest through the loaded plugins.
#include "common/surfel_excerpt.hpp"

#include <doctest/doctest.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "common/occupied_cubes.hpp"
#include "common/stored_bytes.hpp"
#include "common/surfel_voxels.hpp"
#include "matchers.hpp"
#include "support/plugins.hpp"

namespace vantage::matching {
namespace {

using Bytes = std::vector<std::byte>;

const SurfelMap::Options kOfGicp{};

SurfelMap yard_map() { return SurfelMap::build(test::sparse_yard(), kOfGicp).value(); }

/// One in so many.
std::vector<std::uint32_t> one_in(std::size_t size, std::uint32_t step) {
  std::vector<std::uint32_t> some;
  for (std::uint32_t i = 0; i < size; i += step) some.push_back(i);
  return some;
}

/// A few surfels, as all that were seen, and as some of them.
Bytes whole_bytes() { return encode(yard_map(), kOfGicp, one_in(200, 20)).value(); }
Bytes some_bytes() {
  return encode_some(yard_map(), kOfGicp, one_in(200, 1), one_in(200, 20)).value();
}

/// The checksum made right again, for what it would otherwise hide.
Bytes sealed(Bytes bytes) {
  const std::uint64_t sum = checksum_of(std::span(bytes).first(bytes.size() - 8));
  for (std::size_t k = 0; k < 8; ++k) {
    bytes[bytes.size() - 8 + k] = static_cast<std::byte>(sum >> (8 * k));
  }
  return bytes;
}

/// The same plane: normals have either sign.
double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return test::degrees(std::acos(std::min(1.0, std::abs(a.dot(b)))));
}

ErrorCode refusal(std::span<const std::byte> bytes, const SurfelMap::Options& wanted = kOfGicp) {
  const auto stored = decode(bytes, wanted);
  REQUIRE(!stored);
  return stored.error().code;
}

}  // namespace

TEST_CASE("a normal takes 18 bits, and comes back within a third of a degree") {
  std::mt19937 random(1);
  std::normal_distribution<double> any;
  double worst = 0.0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3d normal =
        Eigen::Vector3d(any(random), any(random), any(random)).normalized();
    const NormalCode code = code_of(normal);
    CHECK(code == code_of(-normal));
    const auto again = normal_of(code);
    REQUIRE(again);
    CHECK(again->norm() == doctest::Approx(1.0).epsilon(1e-12));
    CHECK(code_of(*again) == code);
    worst = std::max(worst, degrees_between(normal, *again));
  }
  CHECK(worst < 0.33);
  for (const Eigen::Index axis : {0, 1, 2}) {
    const Eigen::Vector3d normal = Eigen::Vector3d::Unit(axis);
    CHECK(degrees_between(normal, *normal_of(code_of(normal))) < 1e-6);
  }
  CHECK(normal_of(code_of(Eigen::Vector3d::Zero()))->isZero(0.0));
  CHECK_FALSE(normal_of({511, 0}));
  CHECK_FALSE(normal_of({0, 512}));
}

TEST_CASE("surfels come back within a fraction of a millimetre, also millions of metres away") {
  for (const double by : {0.0, 4e6}) {
    CAPTURE(by);
    const SurfelMap map =
        SurfelMap::build(test::shifted(test::sparse_yard(), {by, -by, 0.0}), kOfGicp).value();
    const auto which = one_in(map.points().size(), 3);
    for (const bool some : {false, true}) {
      const auto bytes = some ? encode_some(map, kOfGicp, one_in(map.points().size(), 1), which)
                              : encode(map, kOfGicp, which);
      REQUIRE(bytes);
      const auto stored = decode(*bytes, kOfGicp);
      REQUIRE(stored);
      CHECK(stored->occupied.has_value() == some);
      const double most = std::sqrt(3.0) * std::ldexp(1.0, some ? -11 : -13) + 1e-9;
      REQUIRE(stored->map.points().size() == which.size());
      std::vector<Point> left(stored->map.points().begin(), stored->map.points().end());
      const std::vector<test::Surfel> surfels = [&] {
        std::vector<test::Surfel> all;
        for (std::size_t i = 0; i < left.size(); ++i) {
          all.push_back({left[i] + stored->map.origin(), stored->map.normals()[i]});
        }
        return all;
      }();
      for (const std::uint32_t i : which) {
        const Point at = map.points()[i] + map.origin();
        const test::Surfel& nearest = surfels[test::nearest(surfels, at)];
        CHECK((nearest.point - at).norm() <= most);
        CHECK(nearest.normal.isZero() == map.normals()[i].isZero());
        if (!nearest.normal.isZero())
          CHECK(degrees_between(nearest.normal, map.normals()[i]) < 0.33);
      }
      // What is restored gives the same bytes.
      if (!some) {
        CHECK(encode(stored->map, kOfGicp, one_in(which.size(), 1)).value() == *bytes);
      }
    }
  }
}

TEST_CASE("a surfel takes about 7 bytes, one of some 6, and those not kept a few bits a cube") {
  const SurfelMap map = SurfelMap::build(test::yard(51), kOfGicp).value();
  const auto all = one_in(map.points().size(), 1);
  const auto count = static_cast<double>(all.size());
  CHECK(static_cast<double>(encode(map, kOfGicp, all)->size()) < 7.3 * count);
  const auto size_of_some = [&](std::uint32_t step) {
    return static_cast<double>(encode_some(map, kOfGicp, all, one_in(all.size(), step))->size());
  };
  CHECK(size_of_some(1) - size_of_some(10) < 6.5 * 0.9 * count);
  CHECK(size_of_some(10) < 0.1 * 6.7 * count + 1200.0);
}

TEST_CASE("the cubes of all surfels are kept, and nothing of a map is too_few_matches") {
  const SurfelMap map = yard_map();
  const auto all = one_in(map.points().size(), 1);
  const auto stored = decode(*encode_some(map, kOfGicp, all, one_in(all.size(), 50)), kOfGicp);
  REQUIRE(stored);
  for (const Point& p : map.points()) {
    CHECK(is_covered(*stored->occupied, p + map.origin() - stored->map.origin(), 0.0));
  }
  CHECK_FALSE(is_covered(*stored->occupied, Point(0.0, 0.0, 300.0), 1.0));
  CHECK(refusal(*encode_some(map, kOfGicp, all, {})) == ErrorCode::too_few_matches);
  CHECK(refusal(*encode_some(map, kOfGicp, {}, {})) == ErrorCode::too_few_matches);
  CHECK(refusal(*encode(map, kOfGicp, {})) == ErrorCode::too_few_matches);
}

TEST_CASE("surfels made with other parameters are refused, and the message names both") {
  SurfelMap::Options coarser = kOfGicp, more = kOfGicp, planes = kOfGicp;
  coarser.voxel = 0.5;
  more.neighbours = 12;
  planes.planes_only = true;
  for (const SurfelMap::Options& wanted : {coarser, more, planes}) {
    CHECK(refusal(whole_bytes(), wanted) == ErrorCode::invalid_input);
  }
  const std::string message = decode(whole_bytes(), coarser).error().message;
  CHECK(message.find("map_voxel 0.25") != std::string::npos);
  CHECK(message.find("map_voxel 0.5") != std::string::npos);
}

TEST_CASE("damaged or cut surfels are corrupt_data, whatever byte it is") {
  for (const Bytes& bytes : {whole_bytes(), some_bytes()}) {
    REQUIRE(decode(bytes, kOfGicp));
    for (std::size_t length = 0; length < bytes.size(); ++length) {
      CHECK(refusal(std::span(bytes).first(length)) == ErrorCode::corrupt_data);
    }
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      for (int bit = 0; bit < 8; ++bit) {
        Bytes damaged = bytes;
        damaged[i] ^= static_cast<std::byte>(1 << bit);
        CHECK(refusal(damaged) == ErrorCode::corrupt_data);
      }
    }
    Bytes longer = bytes;
    longer.push_back(std::byte{0});
    CHECK(refusal(longer) == ErrorCode::corrupt_data);
  }
}

TEST_CASE("damage of surfels under a right checksum is an error or a map, never a crash") {
  std::mt19937 random(5);
  for (const Bytes& bytes : {whole_bytes(), some_bytes()}) {
    REQUIRE(sealed(bytes) == bytes);
    std::size_t refused = 0, read = 0;
    for (std::size_t i = 0; i + 8 < bytes.size(); ++i) {
      for (int round = 0; round < 8; ++round) {
        Bytes damaged = bytes;
        damaged[i] = static_cast<std::byte>(random() % 256);
        const auto stored = decode(sealed(std::move(damaged)), kOfGicp);
        ++(stored ? read : refused);
        if (!stored) continue;
        CHECK(stored->map.points().size() == 10);
        for (std::size_t k = 0; k < 10; ++k) {
          CHECK(stored->map.points()[k].allFinite());
          CHECK(stored->map.normals()[k].allFinite());
        }
      }
    }
    CHECK(refused > 100);
    CHECK(read > 100);
    for (std::size_t length = 68; length < bytes.size(); ++length) {
      const Bytes cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(length));
      CHECK(refusal(sealed(cut)) == ErrorCode::corrupt_data);
    }
    // Sizes that the bytes do not hold: of surfels, of cubes, of the code.
    for (const std::size_t at : {std::size_t{48}, std::size_t{52}, std::size_t{56}}) {
      for (const auto value : {std::byte{0xff}, std::byte{0x7f}}) {
        Bytes huge = bytes;
        std::fill_n(huge.begin() + static_cast<std::ptrdiff_t>(at), 4, value);
        CHECK(refusal(sealed(huge)) == ErrorCode::corrupt_data);
      }
    }
  }
}

TEST_CASE("the first bytes of stored surfels are what README.md says") {
  const Bytes bytes = some_bytes();
  CHECK(std::memcmp(bytes.data(), "VSFL\1\0\1\0", 8) == 0);
  CHECK(ByteReader(std::span<const std::byte>(bytes).subspan(8)).number<double>() == 0.25);
  CHECK(bytes[16] == std::byte{10});
  CHECK(bytes[20] == std::byte{0});
  CHECK(bytes[48] == std::byte{10});
}

TEST_CASE("a point belongs to the surfel of its voxel, or to the one in its place") {
  const PointCloud cloud = test::sparse_yard();
  for (const double voxel : {0.25, 0.3, 0.0}) {
    CAPTURE(voxel);
    SurfelMap::Options options;
    options.voxel = voxel;
    const SurfelMap map = SurfelMap::build(cloud, options).value();
    const SurfelVoxels voxels(options);
    CHECK(voxels.bytes() == 0);
    CHECK(voxels.surfels_at(map, cloud) == one_in(map.points().size(), 1));
    CHECK(voxels.bytes() > 0);
    for (std::uint32_t i = 0; i < map.points().size(); i += 17) {
      const PointCloud one{map.points()[i] + map.origin()};
      CHECK(voxels.surfels_at(map, one) == std::vector<std::uint32_t>{i});
    }
    CHECK(voxels.surfels_at(map, PointCloud{{1e7, 0.0, 0.0}, {0.0, 1e300, 0.0}}).empty());
  }
}

TEST_CASE("no surfel is lost where coordinates lie on the borders of voxels") {
  for (const double by : {0.0, 0.3, 1234.5, 4e5}) {
    PointCloud cloud;  // a wall and ground, rounded to centimetres
    for (int i = -250; i < 250; ++i) {
      for (int j = 0; j < 30; ++j) {
        cloud.emplace_back(by + i * 0.04, by + 0.3, 0.1 * j);
        cloud.emplace_back(by + i * 0.04, by + 0.1 * j, 0.7);
      }
    }
    for (const double voxel : {0.1, 0.3, 0.25, 0.0}) {
      CAPTURE(by);
      CAPTURE(voxel);
      SurfelMap::Options options;
      options.voxel = voxel;
      const SurfelMap map = SurfelMap::build(cloud, options).value();
      CHECK(SurfelVoxels(options).surfels_at(map, cloud) == one_in(map.points().size(), 1));
    }
  }
}

}  // namespace vantage::matching

namespace vantage {
namespace {

using test::aligned, test::kYardPose, test::prepared_by, test::yard_scene;

std::vector<std::uint32_t> every(std::size_t elements, std::uint32_t step) {
  std::vector<std::uint32_t> some;
  for (std::uint32_t i = 0; i < elements; i += step) some.push_back(i);
  return some;
}

/// E times the factor of Alignment::hessian, as far as the pulls tell.
struct Total {
  Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
  Alignment::Hessian hessian = Alignment::Hessian::Zero();
};
Total total_of(const std::vector<Pull>& pulls) {
  Total total;
  for (const Pull& pull : pulls) {
    for (Eigen::Index row = 0, k = 0; row < 6; ++row) {
      total.gradient[row] += static_cast<double>(pull.gradient[static_cast<std::size_t>(row)]);
      for (Eigen::Index column = row; column < 6; ++column, ++k) {
        total.hessian(row, column) +=
            static_cast<double>(pull.hessian[static_cast<std::size_t>(k)]);
        total.hessian(column, row) = total.hessian(row, column);
      }
    }
  }
  return total;
}

PluginPtr<MatchTarget> restored_by(const std::string& plugin, std::span<const std::byte> bytes,
                                   const std::string& toml = {}) {
  const auto matcher = test::plugin<ScanMatcher>(plugin, toml);
  return in_library_of(matcher, matcher->restore(bytes).value());
}

}  // namespace

TEST_CASE("the pulls of the surfels that are kept add up to the Hessian of an alignment") {
  for (const std::string plugin : {"icp", "gicp"}) {
    const std::string toml =
        "translation_epsilon = 1e-9\nrotation_epsilon = 1e-9\nmax_iterations = 200";
    const auto whole = prepared_by(plugin, yard_scene().map, toml);
    for (const std::uint32_t step : {1U, 20U}) {
      CAPTURE(plugin);
      CAPTURE(step);
      const auto kept = every(whole->elements(), step);
      const auto some =
          restored_by(plugin, whole->excerpt_of(every(whole->elements(), 1), kept)->bytes, toml);
      const Alignment alignment = aligned(*some, yard_scene().scan, kYardPose);
      const auto pulls = some->pulls(yard_scene().scan, alignment.T_map_scan).value();
      REQUIRE(pulls.size() > 100);
      CHECK(std::ranges::is_sorted(pulls, {}, &Pull::element));
      CHECK(std::ranges::adjacent_find(pulls, {}, &Pull::element) == pulls.end());
      const Total total = total_of(pulls);
      CHECK((total.hessian - alignment.hessian).norm() < 1e-5 * alignment.hessian.norm());
      CHECK(total.hessian.ldlt().solve(total.gradient).norm() < 1e-4);
    }
  }
}

TEST_CASE("a surfel's pull is the slope of its term for all the scan points that are its own") {
  const PointCloud map = test::sparse_yard();
  const Pose pose = pose_from_xyz_rpy({0.43, -0.31, 1.02}, {0.02, -0.03, 0.65});
  const PointCloud scan = test::seen_from(test::yard(22), pose, 12.0, 600, 2);
  const auto target =
      prepared_by("icp", map, "map_voxel = 0.0\nneighbours = 8\nsigma = 0.07\nmax_distance = 0.8");
  const auto surfels = test::surfels_of(map, 8);
  constexpr double kOwn = 2.5 * 0.25, kInformation = 0.55;
  const auto pulls = target->pulls(scan, pose).value();
  REQUIRE(pulls.size() > 100);
  const auto elements = target->elements_at(map).value();
  REQUIRE(elements.size() == target->elements());
  for (const Pull& pull : pulls) {
    const test::Surfel& q = surfels[test::nearest(surfels, elements[pull.element].middle)];
    const auto value = [&](const Eigen::Matrix<double, 6, 1>& step) {
      double sum = 0.0;
      for (const Point& p : scan) {
        if ((pose * p - q.point).norm() > kOwn) continue;
        const Eigen::Vector3d y = rotation_from_vector(step.tail<3>()) * (pose.rotation * p);
        const double r = q.normal.dot(pose.translation + step.head<3>() + y - q.point) / 0.07;
        sum += 0.5 * r * r / (1.0 + r * r / 9.0);
      }
      return kInformation * sum;
    };
    const double largest =
        *std::ranges::max_element(pull.gradient, {}, [](float x) { return std::abs(x); });
    for (Eigen::Index k = 0; k < 6; ++k) {
      const Eigen::Matrix<double, 6, 1> step = 1e-6 * Eigen::Matrix<double, 6, 1>::Unit(k);
      const double slope = (value(step) - value(-step)) / 2e-6;
      CHECK(static_cast<double>(pull.gradient[static_cast<std::size_t>(k)]) ==
            doctest::Approx(slope).epsilon(1e-3).scale(1.0 + std::abs(largest)));
    }
  }
}

TEST_CASE("with a part of its surfels a map scores nearly as with all, and aligns") {
  std::mt19937 random(1);
  for (const std::string plugin : {"icp", "gicp"}) {
    const auto whole = prepared_by(plugin, yard_scene().map);
    const ScanScore expected = whole->score(yard_scene().scan, kYardPose).value();
    for (const std::uint32_t step : {1U, 3U, 10U}) {
      CAPTURE(plugin);
      CAPTURE(step);
      const auto kept = every(whole->elements(), step);
      const auto excerpt = whole->excerpt_of(every(whole->elements(), 1), kept);
      REQUIRE(excerpt);
      CHECK(excerpt->elements == kept.size());
      const auto some = restored_by(plugin, excerpt->bytes);
      CHECK(some->elements() == kept.size());
      const ScanScore score = some->score(yard_scene().scan, kYardPose).value();
      CHECK(score.coverage == doctest::Approx(expected.coverage).epsilon(0.02));
      CHECK(score.nvtl == doctest::Approx(expected.nvtl).epsilon(0.15));
      Pose wrong = kYardPose;
      wrong.translation += Point(2.0, 1.0, 0.3);
      CHECK(some->score(yard_scene().scan, wrong)->nvtl <
            0.2 + whole->score(yard_scene().scan, wrong)->nvtl);
      for (const double off : {0.2, 1.5}) {
        CAPTURE(off);
        const auto alignment =
            some->align(yard_scene().scan, test::disturbed(kYardPose, off, 2.0 * off, random));
        REQUIRE(alignment);
        CHECK((alignment->T_map_scan.translation - kYardPose.translation).norm() < 0.03);
      }
    }
  }
}

TEST_CASE("what another matcher has stored is refused") {
  const auto refused_by = [](const std::string& plugin, const PluginPtr<MatchTarget>& target) {
    const auto bytes = target->excerpt(yard_scene().map)->bytes;
    const auto matcher = test::plugin<ScanMatcher>(plugin, "");
    const auto restored = matcher->restore(bytes);
    REQUIRE(!restored);
    return restored.error().code;
  };
  const PointCloud& map = yard_scene().map;
  CHECK(refused_by("icp", prepared_by("gicp", map)) == ErrorCode::invalid_input);
  CHECK(refused_by("gicp", prepared_by("icp", map)) == ErrorCode::invalid_input);
  CHECK(refused_by("icp", prepared_by("ndt", map)) == ErrorCode::corrupt_data);
  CHECK(refused_by("ndt", prepared_by("icp", map)) == ErrorCode::corrupt_data);
}

TEST_CASE(
    "elements_at gives places and points of surfels, and refuses points that are not finite") {
  const auto whole = prepared_by("icp", yard_scene().map);
  const auto elements = whole->elements_at(yard_scene().map).value();
  REQUIRE(elements.size() == whole->elements());
  std::size_t points = 0;
  for (std::uint32_t i = 0; i < elements.size(); ++i) {
    CHECK(elements[i].number == i);
    points += elements[i].points;
  }
  CHECK(points <= yard_scene().map.size());
  CHECK(points > yard_scene().map.size() / 2);
  const PointCloud bad{{0.0, std::numeric_limits<double>::quiet_NaN(), 0.0}};
  CHECK(whole->elements_at(bad).error().code == ErrorCode::invalid_input);
  CHECK(whole->excerpt(bad).error().code == ErrorCode::invalid_input);
  CHECK(whole->pulls(bad, kYardPose).error().code == ErrorCode::invalid_input);
  const std::vector<std::uint32_t> seen{1, 5}, other{2}, twice{5, 5}, beyond{1, 100'000'000};
  for (const auto& [which, kept] : {std::pair{seen, other}, {seen, twice}, {beyond, seen}}) {
    CHECK(whole->excerpt_of(which, kept).error().code == ErrorCode::invalid_input);
  }
}

}  // namespace vantage
