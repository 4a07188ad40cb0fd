#include "vantage/engine/predicted_errors.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

using namespace vantage;

namespace predicted_errors_test {
namespace {

constexpr float kNoLimit = std::numeric_limits<float>::infinity();

PredictedErrors made() {
  PredictedErrors errors;
  errors.regions = {
      {{{1.0, -2.0, 3.5}, 0.004F, 0.01F, 0.005F}, {{4.0, 5.0, 6.0}, 0.3F, kNoLimit, 0.2F}},
      {},
      {{{7.0, 8.0, 9.0}, 0.02F, 0.03F, kNoLimit}}};
  return errors;
}

TEST_CASE("predicted errors come back from their bytes") {
  const PredictedErrors errors = made();
  const auto again = PredictedErrors::decode(errors.encode(), 3);
  REQUIRE(again);
  CHECK(again->regions == errors.regions);
  CHECK(PredictedErrors::decode(PredictedErrors{}.encode(), 0)->regions.empty());
}

TEST_CASE("predicted errors: damaged bytes are refused") {
  const std::vector<std::byte> bytes = made().encode();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    CHECK_FALSE(PredictedErrors::decode(std::span(bytes).first(size), 3));
  }
  CHECK_FALSE(PredictedErrors::decode(bytes, 2));  // those of another bundle
  auto more = bytes;
  more.push_back(std::byte{0});
  CHECK_FALSE(PredictedErrors::decode(more, 3));
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    auto changed = bytes;
    changed[k] ^= std::byte{0xFF};
    const auto decoded = PredictedErrors::decode(changed, 3);
    if (!decoded) continue;
    for (const auto& region : decoded->regions) {
      for (const PredictedError& at : region) {
        CHECK((at.expected >= 0.0F && at.error >= 0.0F && at.whole >= 0.0F));
      }
    }
  }
}

TEST_CASE("a position is promised what the four nearest places are, in the mean square") {
  PredictedErrors errors;
  errors.regions.resize(2);
  for (const float x : {50.0F, 1.0F, 2.0F, 3.0F, 4.0F}) {
    errors.regions[1].push_back({{x, 0.0, 0.0}, x, 2.0F * x, 3.0F * x});
  }
  const auto near = errors.at(RegionId{1}, {0.0, 0.0, 0.0});
  REQUIRE(near);
  const double mean = std::sqrt((1.0 + 4.0 + 9.0 + 16.0) / 4.0);
  CHECK(near->expected == doctest::Approx(mean));
  CHECK(near->error == doctest::Approx(2.0 * mean));
  CHECK(near->whole == doctest::Approx(3.0 * mean));
  CHECK_FALSE(errors.at(RegionId{0}, {0.0, 0.0, 0.0}));
  errors.regions[1].resize(1);
  CHECK(errors.at(RegionId{1}, {0.0, 0.0, 0.0})->expected == doctest::Approx(50.0));
  errors.regions[1][0].expected = kNoLimit;
  CHECK(errors.at(RegionId{1}, {0.0, 0.0, 0.0})->expected == kNoLimit);
}

TEST_CASE("the predicted error that a share of the places keeps") {
  std::vector<float> errors;
  for (int k = 20; k >= 1; --k) errors.push_back(static_cast<float>(k));
  const auto kept_by = [&](double share) { return error_kept_by(share, errors); };
  CHECK(kept_by(0.0) == 1.0);
  CHECK(kept_by(0.5) == 10.0);
  CHECK(kept_by(0.95) == 19.0);
  CHECK(kept_by(1.0) == 20.0);
  CHECK(error_kept_by(0.95, {3.0F, 9.0F, 5.0F}) == 9.0);  // of so few, 95 % are all
}

}  // namespace
}  // namespace predicted_errors_test
