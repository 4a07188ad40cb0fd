#include "atlas_places.hpp"

#include <doctest/doctest.h>

#include <cmath>

namespace vantage::benchmarks {
namespace {

TEST_CASE("rank correlation") {
  const Errors up{1.0, 2.0, 3.0, 4.0};
  CHECK(correlation(up, {1.0, 10.0, 11.0, 1000.0}) == "1.00");
  CHECK(correlation(up, {4.0, 3.0, 2.0, 1.0}) == "-1.00");
  CHECK(correlation(up, {1.0, 1.0, 1.0, 1.0}) == "0.00");
  CHECK(correlation(up, {1.0, 3.0, 2.0, 4.0}) == "0.80");
  // Only places that have both count.
  CHECK(correlation({1.0, 2.0, {}, 3.0, 9.0}, {1.0, 2.0, 0.0, 3.0, {}}) == "1.00");
  CHECK(correlation({1.0, {}, 3.0}, {1.0, 2.0, 3.0}) == "-");
}

TEST_CASE("errors of a place") {
  Atlas atlas;
  atlas.sites.resize(2);
  atlas.sites[0].precision = SitePrecision{.expected_error = 0.5};
  const Site* const site = &atlas.sites.front();
  std::vector<Localized> scans;
  for (std::size_t drive = 0; drive < 3; ++drive) {
    for (std::size_t k = 0; k < 5; ++k) {
      const double away = std::abs(static_cast<double>(k) - 2.0);
      scans.push_back({site, away, k == 2 ? 3.0 : drive == 1 ? 2.0 : 1.0, drive});
    }
  }
  scans.push_back({&atlas.sites.back(), 0.0, 100.0, 0});
  const auto places = places_of(atlas, scans);
  REQUIRE(places.size() == 1);  // nothing matched at the other
  const Place& place = places.front();
  CHECK(place.predicted == 0.5);
  CHECK(place.on_lane.value() == doctest::Approx(std::sqrt((8.0 + 2.0 * 9.0) / 10.0)));
  CHECK(place.beside.value() == doctest::Approx(std::sqrt((4.0 * 4.0 + 9.0) / 5.0)));
  CHECK(place.first == place.again);
  CHECK(place.at_site == 3.0);
  CHECK(place.elsewhere == 1.0);
  scans.erase(scans.begin());
  CHECK_FALSE(places_of(atlas, scans).front().first);  // too few scans
}

}  // namespace
}  // namespace vantage::benchmarks
