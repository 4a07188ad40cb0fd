#include "intervals.hpp"

#include <doctest/doctest.h>

#include <cmath>

namespace vantage::benchmarks {
namespace {

/// The probability of at most `hits` of `of` trials.
double at_most(std::size_t hits, std::size_t of, double p) {
  double sum = 0.0;
  for (std::size_t k = 0; k <= hits; ++k) {
    const auto n = static_cast<double>(of), x = static_cast<double>(k);
    sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(x + 1.0) - std::lgamma(n - x + 1.0) +
                    x * std::log(p) + (n - x) * std::log1p(-p));
  }
  return sum;
}

TEST_CASE("intervals of Clopper and Pearson") {
  SUBCASE("have the published values") {
    const Interval some = clopper_pearson({.hits = 4, .of = 20});  // table of the paper, 95 %
    CHECK(some.low == doctest::Approx(0.0573).epsilon(0.001));
    CHECK(some.high == doctest::Approx(0.4366).epsilon(0.001));
    const Interval half = clopper_pearson({.hits = 5, .of = 10});
    CHECK(half.low == doctest::Approx(0.1871).epsilon(0.001));
    CHECK(half.high == doctest::Approx(0.8129).epsilon(0.001));
  }
  SUBCASE("leave half of the tail on either side") {
    for (const Count count : {Count{1, 7}, Count{3, 1000}, Count{50, 60}}) {
      const Interval interval = clopper_pearson(count, 0.9);
      CHECK(at_most(count.hits, count.of, interval.high) == doctest::Approx(0.05));
      CHECK(1.0 - at_most(count.hits - 1, count.of, interval.low) == doctest::Approx(0.05));
      CHECK(at_most(count.hits, count.of, upper_limit(count)) == doctest::Approx(0.05));
    }
  }
  SUBCASE("of nothing and of everything have closed forms") {
    const Interval none = clopper_pearson({.hits = 0, .of = 100});
    CHECK(none.low == 0.0);
    CHECK(none.high == doctest::Approx(1.0 - std::pow(0.025, 0.01)));
    const Interval all = clopper_pearson({.hits = 100, .of = 100});
    CHECK(all.low == doctest::Approx(std::pow(0.025, 0.01)));
    CHECK(all.high == 1.0);
    CHECK(upper_limit({.hits = 0, .of = 2995}) == doctest::Approx(0.001).epsilon(0.001));
  }
  SUBCASE("without trials say nothing") {
    const Interval interval = clopper_pearson({});
    CHECK(interval.low == 0.0);
    CHECK(interval.high == 1.0);
    CHECK(upper_limit({}) == 1.0);
  }
}

TEST_CASE("intervals of a Poisson mean") {
  // P(at most `events`) for a mean.
  const auto at_most = [](std::size_t events, double mean) {
    double term = std::exp(-mean), sum = term;
    for (std::size_t k = 1; k <= events; ++k) sum += term *= mean / static_cast<double>(k);
    return sum;
  };
  CHECK(poisson_interval(0).low == 0.0);
  CHECK(poisson_interval(0).high == doctest::Approx(-std::log(0.025)));
  for (const std::size_t events : {1U, 4U, 30U}) {
    const Interval interval = poisson_interval(events, 0.9);
    CHECK(at_most(events, interval.high) == doctest::Approx(0.05));
    CHECK(1.0 - at_most(events - 1, interval.low) == doctest::Approx(0.05));
  }
}

}  // namespace
}  // namespace vantage::benchmarks
