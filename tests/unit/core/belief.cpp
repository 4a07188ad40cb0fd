#include "localize/belief.hpp"

#include <doctest/doctest.h>

using vantage::Belief;

TEST_CASE("belief adds up to 1, whatever the evidence") {
  Belief belief = Belief::in_one(0.9);
  CHECK(belief.of(0) == doctest::Approx(0.9));
  CHECK(belief.elsewhere() == doctest::Approx(0.1));
  belief.add(std::log(4.0), 0.0);  // four times as likely as elsewhere
  CHECK(belief.of(1) == doctest::Approx(4.0 * belief.elsewhere()));
  CHECK(belief.of(0) + belief.of(1) + belief.elsewhere() == doctest::Approx(1.0));
  belief.weigh({-500.0, 500.0});
  CHECK(belief.of(1) == doctest::Approx(1.0));
  CHECK(belief.of(0) > 0.0);  // it can come back
  belief.weigh({500.0, -500.0});
  belief.weigh({500.0, -500.0});
  CHECK(belief.of(0) == doctest::Approx(1.0));
}

TEST_CASE("Bayes: two scans of odds e are one of odds e squared") {
  Belief twice = Belief::in_one(0.5), once = Belief::in_one(0.5);
  twice.weigh({1.0});
  twice.weigh({1.0});
  once.weigh({2.0});
  CHECK(twice.of(0) == doctest::Approx(once.of(0)));
  CHECK(once.of(0) == doctest::Approx(1.0 / (1.0 + std::exp(-2.0))));
}

TEST_CASE("what is forgotten, and what is dropped, goes elsewhere") {
  Belief belief = Belief::in_one(0.8);
  belief.forget(0.25);
  CHECK(belief.of(0) == doctest::Approx(0.6));
  CHECK(belief.elsewhere() == doctest::Approx(0.4));
  belief.add(0.0, 0.0);
  belief.add(0.0, 0.0);  // 0.6, 0.4, 0.4 and 0.4 elsewhere, over 1.8
  belief.keep({{2, 1}});
  REQUIRE(belief.size() == 1);
  CHECK(belief.of(0) == doctest::Approx(0.8 / 1.8));
  CHECK(belief.elsewhere() == doctest::Approx(1.0 / 1.8));
}

TEST_CASE("a prior counts once, however often it is seen, and a later one replaces it") {
  Belief belief = Belief::in_one(0.9);
  for (int k = 0; k < 10; ++k) belief.see_prior({-2.0});
  const double contradicted = 0.9 * std::exp(-2.0);
  CHECK(belief.of(0) == doctest::Approx(contradicted / (contradicted + 0.1)));
  belief.see_prior({0.0});
  CHECK(belief.of(0) == doctest::Approx(0.9));
}

TEST_CASE("what is added beside another hypothesis is as likely as it, times the odds") {
  Belief belief = Belief::in_one(0.8);
  belief.see_prior({-1.0});
  belief.add_beside(0, std::log(0.5));
  CHECK(belief.of(1) == doctest::Approx(0.5 * belief.of(0)));
  CHECK(belief.of(0) + belief.of(1) + belief.elsewhere() == doctest::Approx(1.0));
}
