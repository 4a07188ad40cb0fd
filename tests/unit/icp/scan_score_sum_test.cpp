#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <vector>

#include "common/ndt_coefficients.hpp"
#include "common/scan_score_sum.hpp"

using namespace vantage;
using namespace vantage::matching;

TEST_CASE("coefficients for outlier ratio 0.55 and 1 m are the published -2.217, 0.433, 0.598") {
  const auto d = NdtCoefficients::derive(0.55, 1.0);
  REQUIRE(d);
  CHECK(d->d1 == doctest::Approx(-2.217).epsilon(1e-3));
  CHECK(d->d2 == doctest::Approx(0.433).epsilon(2e-3));
  CHECK(d->d3 == doctest::Approx(0.598).epsilon(1e-3));
}

TEST_CASE(
    "the Gaussian matches the mixture's log-likelihood where it was fitted: at 0, 1 sigma and "
    "far") {
  for (const double outliers : {0.1, 0.55, 0.9}) {
    for (const double resolution : {0.5, 1.0, 3.0}) {
      const auto d = NdtCoefficients::derive(outliers, resolution);
      REQUIRE(d);
      const double c1 = 10.0 * (1.0 - outliers), c2 = outliers / std::pow(resolution, 3);
      const auto mixture = [&](double m) { return std::log(c1 * std::exp(-m / 2) + c2); };
      CHECK(d->likelihood(0.0) - d->d3 == doctest::Approx(mixture(0.0)));
      CHECK(d->likelihood(1.0) - d->d3 == doctest::Approx(mixture(1.0)));
      CHECK(d->likelihood(1e6) - d->d3 == doctest::Approx(mixture(1e6)));
    }
  }
}

TEST_CASE("coefficients refuse impossible settings") {
  for (const double outliers : {0.0, 1.0, -0.1, std::nan("")}) {
    CHECK_FALSE(NdtCoefficients::derive(outliers, 1.0).has_value());
  }
  for (const double resolution : {0.0, -1.0, std::nan("")}) {
    CHECK_FALSE(NdtCoefficients::derive(0.55, resolution).has_value());
  }
}

TEST_CASE("Eq. 12 by hand, with coverage and NVTL beside it") {
  const NdtCoefficients d{-2.0, 0.5, 0.6};
  ScanScoreSum sum(d);
  sum.add(std::array{0.0, 4.0});  // two voxels
  sum.add(std::array{1.0});
  sum.add(std::span<const double>{});  // no voxel
  const auto f = [&](double m) { return 2.0 * std::exp(-0.25 * m); };
  const ScanScore score = sum.mean();
  CHECK(score.fitness ==
        doctest::Approx((((f(0) - 0.6) + (f(4) - 0.6)) / 2 + (f(1) - 0.6) + 0.0) / 3));
  CHECK(score.nvtl == doctest::Approx((f(0) + f(1)) / 2));
  CHECK(score.coverage == doctest::Approx(2.0 / 3.0));
}

TEST_CASE("S_fitness rewards deleting map: why coverage stands beside it") {
  const auto d = NdtCoefficients::derive(0.55, 1.0);
  ScanScoreSum with_bad_match(*d), with_hole(*d);
  with_bad_match.add(std::array{0.0});
  with_bad_match.add(std::array{100.0});
  with_hole.add(std::array{0.0});
  with_hole.add(std::span<const double>{});
  CHECK(with_hole.mean().fitness > with_bad_match.mean().fitness);
  CHECK(with_hole.mean().coverage < with_bad_match.mean().coverage);
}

TEST_CASE("parts of a scan add up, and no points score zero") {
  const auto d = NdtCoefficients::derive(0.55, 1.0);
  ScanScoreSum whole(*d), left(*d), right(*d);
  for (int i = 0; i < 10; ++i) {
    const std::array m{0.3 * i};
    whole.add(m);
    (i < 4 ? left : right).add(m);
  }
  left.add(right);
  CHECK(left.mean().fitness == doctest::Approx(whole.mean().fitness));
  const ScanScore none = ScanScoreSum(*d).mean();
  CHECK(none.fitness == 0.0);
  CHECK(none.nvtl == 0.0);
  CHECK(none.coverage == 0.0);
}
