#include "localize/support.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "localize/hypothesis.hpp"

using namespace vantage;

namespace {

/// What a scan with this share says, where nothing is usual yet.
void take(Support& support, double share, double news = 1.0) {
  const Evidence evidence{.share = share, .noise = 0.01, .margin = 0.3};
  support.take(log_ratio_to_far(evidence), news);
  support.take(evidence, news);
}

Hypothesis with_odds(double odds) {
  Hypothesis one;
  one.support = Support(std::log(odds));
  return one;
}

}  // namespace

TEST_CASE("beliefs add up to 1, whatever the evidence") {
  std::vector<Hypothesis> both{with_odds(9.0), with_odds(4.0)};
  CHECK(update_beliefs(both) == doctest::Approx(1.0 / 14.0));
  CHECK(both[0].belief == doctest::Approx(9.0 / 14.0));
  both[0].support.favour(-500.0);
  both[1].support.take(500.0, 1.0);
  CHECK(update_beliefs(both) + both[0].belief + both[1].belief == doctest::Approx(1.0));
  CHECK(both[1].belief == doctest::Approx(1.0));
  CHECK(both[0].belief > 0.0);  // it can come back
}

TEST_CASE("scans at different places tell a pose from those far off, but not from a lookalike") {
  const Lookalikes street{.count = 10.0, .scale = 0.06};
  Support once(0.0, street), often(0.0, street), sharp(0.0, street);
  take(once, 0.15);
  for (int k = 0; k < 20; ++k) take(often, 0.15);
  take(sharp, 0.7);
  CHECK(once.log_odds() < 1.0);
  CHECK(often.log_odds() < 1.0);
  CHECK(sharp.log_odds() > 5.0);
  Support alone(0.0, {.count = 10.0, .scale = 0.015});  // the others there did not fit at all
  take(alone, 0.15);
  CHECK(alone.log_odds() > once.log_odds() + 1.0);
  once.be_among(0.015);
  take(once, 0.15);
  CHECK(once.log_odds() > 1.0);
}

TEST_CASE("the odds of a lookalike fall with the share, also where it was chosen from many") {
  double before = 1e9;
  for (double share = 0.0; share < 1.0; share += 0.01) {
    const LookalikeOdds odds = odds_of_lookalike({.share = share, .noise = 0.01, .margin = 0.3},
                                                 {.count = 16.0, .scale = 0.1});
    CHECK(odds.elsewhere <= 1.3 * before);  // p(share | right) has a step at the least right share
    before = odds.elsewhere;
  }
}

TEST_CASE("one bad scan does not spoil the mean for long") {
  Support support(2.0);
  for (int k = 0; k < 5; ++k) take(support, 0.7);
  const Evidence covered{.share = -50.0, .noise = 0.01, .margin = -99.0, .margin_noise = 0.1};
  support.take(-6.0, 1.0);
  support.take(covered, 1.0);
  for (int k = 0; k < 12; ++k) take(support, 0.7);
  CHECK(support.log_odds() > 6.0);
}

TEST_CASE("a few scans that do not fit outweigh any number that did") {
  Support support(0.0);
  for (int k = 0; k < 1000; ++k) take(support, 0.7);
  for (int k = 0; k < 12; ++k) take(support, 0.0);
  CHECK(support.log_odds() < 0.0);
}

TEST_CASE("a prior counts once, however often it is seen, and a later one replaces it") {
  Support support(2.0);
  support.take(20.0, 1.0);
  const double before = support.log_odds();
  for (int k = 0; k < 10; ++k) support.see_prior(-2.0);
  CHECK(support.log_odds() == doctest::Approx(before - 2.0));
  support.see_prior(0.0);
  CHECK(support.log_odds() == doctest::Approx(before));
}

TEST_CASE("what is doubted goes elsewhere, and scans that fit bring it back") {
  std::vector<Hypothesis> one{with_odds(4.0)};
  take(one[0].support, 0.7);
  const double sure = one[0].support.log_odds();
  doubt(one, 0.25);
  CHECK(update_beliefs(one) == doctest::Approx(0.25).epsilon(0.01));
  doubt(one, 0.0);
  CHECK(update_beliefs(one) == doctest::Approx(0.25).epsilon(0.01));
  for (int k = 0; k < 3; ++k) take(one[0].support, 0.7);
  CHECK(one[0].support.log_odds() == doctest::Approx(sure).epsilon(0.05));
}

TEST_CASE("poses that became the same are believed together, and a dropped one is elsewhere") {
  std::vector<Hypothesis> all{with_odds(1.0), with_odds(3.0), with_odds(2.0)};
  all[1].last.translation.x() = 0.1;
  all[2].last.translation.x() = 50.0;
  const double elsewhere = update_beliefs(all) + sort_out(all, 1);
  REQUIRE(all.size() == 1);
  CHECK(all[0].belief + elsewhere == doctest::Approx(1.0));
  CHECK(all[0].last.translation.x() == 0.1);
  CHECK(update_beliefs(all) == doctest::Approx(3.0 / 7.0).epsilon(0.01));
}

TEST_CASE("the odds that a pose shared with rivals are its own again once it is alone") {
  std::vector<Hypothesis> all{with_odds(100.0)};
  take(all[0].support, 0.7);
  const double before = all[0].support.log_odds();
  for (int rival = 0; rival < 20; ++rival) {  // each is refuted at the next scan
    all.push_back(all[0]);
    all[1].last.translation.x() = 5.0;
    all[0].support.favour(std::log(0.5));
    all[1].support.favour(std::log(0.5) - 40.0);
    static_cast<void>(update_beliefs(all) + sort_out(all, 4));
    REQUIRE(all.size() == 1);
  }
  CHECK(all[0].support.log_odds() == doctest::Approx(before).epsilon(1e-3));
}

TEST_CASE("a search that found a pose adds to its odds, but once, and does not undo comparisons") {
  Support given(2.0), refuted(-3.0);
  const double before = given.log_odds(), before_refuted = refuted.log_odds();
  given.favour(-1.0);
  for (int search = 0; search < 3; ++search) given.be_found(0.1);
  CHECK(given.log_odds() == doctest::Approx(before - 1.0 + std::log(10.0)));
  refuted.be_found(10.1);  // many searches failed
  CHECK(refuted.log_odds() == doctest::Approx(before_refuted + 3.0 + std::log(0.97)));
  refuted.be_found(0.1);
  CHECK(refuted.log_odds() == doctest::Approx(before_refuted + 3.0 + std::log(0.97 / 0.1)));
}

TEST_CASE("a pose that was refuted has to be found anew, or to fit clearly") {
  Support support(3.5);
  for (int k = 0; k < 5; ++k) take(support, 0.7);
  for (int k = 0; k < 15; ++k) support.take(-6.0, 1.0);
  CHECK(support.log_odds() < -3.0);
  Support weak = support, clear = support, again = support;
  for (int k = 0; k < 12; ++k) {
    take(weak, 0.2);
    take(clear, 0.7);
    take(again, 0.2);
  }
  CHECK(weak.log_odds() < 1.0);
  CHECK(clear.log_odds() > 4.6);
  again.be_found(0.1);
  CHECK(again.log_odds() > weak.log_odds() + 4.0);
}

TEST_CASE("the example of docs/localization.md, by hand") {
  const auto elsewhere = [](double margin, const Contrast& contrast) {
    const Evidence evidence{.share = 0.7, .noise = 0.018, .margin = margin, .margin_noise = 0.019};
    std::vector<Hypothesis> one(1);
    one[0].support = Support(std::log(0.95 / 0.05));
    one[0].support.take(contrast);
    one[0].support.take(log_ratio_to_far(evidence), 1.0);
    one[0].support.take(evidence, 1.0);
    return update_beliefs(one);
  };
  const auto is = [](double value) { return doctest::Approx(value).epsilon(0.01).scale(0.0); };
  CHECK(elsewhere(0.25, {.summit = 0.6, .slope = 0.5, .noise = 0.08}) == is(8.50e-6));
  CHECK(elsewhere(0.25, {.summit = 0.05, .slope = 0.05, .noise = 0.08}) == is(0.416));
  CHECK(1.0 - elsewhere(-0.15, {.summit = -0.3, .slope = -0.3, .noise = 0.08}) == is(1.91e-5));
}

TEST_CASE("a pose with an equal one beside it is doubted, however many scans fit") {
  std::vector<Hypothesis> one(1);
  Support& support = one[0].support = Support(3.5);
  const auto drive = [&](double contrast) {
    for (int k = 0; k < 20; ++k) {
      support.take(Contrast{.summit = contrast, .slope = contrast, .noise = 0.05});
      take(support, 0.9);
    }
    return update_beliefs(one);
  };
  CHECK(drive(0.6) < 1e-4);
  CHECK(drive(0.05) > 0.3);
  CHECK(drive(0.6) < 1e-4);  // the place is left behind
}

TEST_CASE("what was seen elsewhere does not speak for the pose after a surprise") {
  Support support(3.5);
  for (int k = 0; k < 5; ++k) take(support, 0.9);
  support.be_found(0.11);
  Support startled = support;
  startled.start_anew();
  CHECK(startled.log_odds() < support.log_odds() - 2.0);
  take(support, 0.12);
  take(startled, 0.12);
  CHECK(startled.log_odds() < support.log_odds() - 1.0);
}
