#include "vantage/engine/atlas.hpp"

#include <doctest/doctest.h>

#include "support/fakes.hpp"

using namespace vantage;

namespace {

Atlas some_atlas() {
  Atlas atlas;
  atlas.matcher = {.plugin = "ndt", .params = "resolution = 1.0\n"};
  atlas.sites = {
      {.region = RegionId{2}, .position = {1, 2, 3}, .precision = {}, .alike = {}},
      {.region = RegionId{2},
       .position = {30, -2, 3},
       .precision = SitePrecision{.expected_error = 0.02,
                                  .sigma_strong = 0.01,
                                  .sigma_weak = 0.04,
                                  .weak_direction = 1.5,
                                  .basin = 2.0},
       .alike = {{.T_map_scan = pose_from_xyz_rpy({50, -2, 3}, {0, 0, 0.3}), .likeness = 1.1},
                 {.T_map_scan = pose_from_xyz_rpy({9, -2, 3}, {0, 0, 2.3}), .likeness = 0.6}}}};
  return atlas;
}

void check_refused(const std::vector<std::byte>& bytes) {
  const auto decoded = Atlas::decode(bytes);
  REQUIRE_FALSE(decoded);
  CHECK(decoded.error().code == ErrorCode::corrupt_data);
}

}  // namespace

TEST_CASE("an atlas comes back from its bytes as it was") {
  const Atlas atlas = some_atlas();
  const auto bytes = atlas.encode();
  const auto again = Atlas::decode(bytes);
  REQUIRE_MESSAGE(again, again.error().message);
  CHECK(again->matcher == atlas.matcher);
  REQUIRE(again->sites.size() == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK(again->sites[k].region == atlas.sites[k].region);
    CHECK(again->sites[k].position == atlas.sites[k].position);
    CHECK(again->sites[k].precision == atlas.sites[k].precision);
    CHECK(again->sites[k].alike.size() == atlas.sites[k].alike.size());
  }
  CHECK(again->sites[1].alike[1].likeness == 0.6);
  CHECK(again->sites[1].alike[0].T_map_scan.translation == Point(50, -2, 3));
  CHECK(again->encode() == bytes);
  CHECK(Atlas::decode(Atlas{}.encode())->sites.empty());
}

TEST_CASE("bytes that are no atlas are refused, wherever they are cut or changed") {
  const auto bytes = some_atlas().encode();
  for (std::size_t n = 0; n < bytes.size(); ++n) {
    check_refused({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(n)});
  }
  auto longer = bytes;
  longer.push_back({});
  check_refused(longer);
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    for (const std::byte change : {std::byte{0xFF}, std::byte{0x80}, std::byte{1}}) {
      auto changed = bytes;
      changed[at] ^= change;
      const auto decoded = Atlas::decode(changed);
      // What is accepted is what encode makes, of other numbers.
      if (decoded) {
        CHECK(decoded->encode() == changed);
      } else {
        CHECK(decoded.error().code == ErrorCode::corrupt_data);
      }
    }
  }
}

TEST_CASE("numbers outside their ranges are refused") {
  const auto refused = [](const auto& change) {
    Atlas atlas = some_atlas();
    change(atlas);
    check_refused(atlas.encode());
  };
  refused([](Atlas& a) { a.sites[0].position.x() = INFINITY; });
  refused([](Atlas& a) { a.sites[0].region = RegionId{3}; });  // not in the order of regions
  refused([](Atlas& a) { a.sites[1].precision->weak_direction = 3.2; });
  refused([](Atlas& a) { a.sites[1].precision->sigma_strong = 0.05; });  // weaker than the weak
  refused([](Atlas& a) { a.sites[1].precision->expected_error = -1.0; });
  refused([](Atlas& a) { a.sites[1].alike[0].likeness = 0.5; });  // the most alike is first
  refused([](Atlas& a) { a.sites[1].alike[1].likeness = 0.0; });
  refused([](Atlas& a) { a.sites[1].alike[0].T_map_scan.rotation.coeffs()[0] = 2.0; });
}

TEST_CASE("a bundle of a store that keeps regions only has no atlas") {
  const auto memory = std::make_shared<test::Memory>();
  memory->index.partition = Partition::from({{"all", HalfOpenBox{{0, 0}, {9, 9}}, {}}}).value();
  memory->index.regions = {{}};
  const auto bundle = test::bundle_in(memory);
  REQUIRE_MESSAGE(bundle, bundle.error().message);
  const auto atlas = Atlas::of_bundle(*bundle);
  REQUIRE(atlas);
  CHECK_FALSE(*atlas);
}

TEST_CASE("the nearest site is found") {
  const Atlas atlas = some_atlas();
  CHECK(atlas.nearest({25, 0, 0}) == &atlas.sites[1]);
  CHECK(atlas.nearest({0, 0, 0}) == &atlas.sites[0]);
  CHECK(Atlas{}.nearest({0, 0, 0}) == nullptr);
}
