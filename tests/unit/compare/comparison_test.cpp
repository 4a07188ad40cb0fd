#include "vantage/evaluation/comparison.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "compare/page.hpp"
#include "evaluation/json.hpp"
#include "support/process.hpp"
#include "support/real_data.hpp"
#include "tiny_scans.hpp"

namespace vantage {
namespace {

using test::tiny_csv;
using test::TinyScan;

Result<Comparison> compared(const std::vector<TinyScan>& a, const std::vector<TinyScan>& b) {
  const test::TemporaryFolder folder;
  test::write_text(folder.path() / "a.csv", tiny_csv(a));
  test::write_text(folder.path() / "b.csv", tiny_csv(b));
  VANTAGE_TRY(ScanTable table_a, read_scans(folder.path() / "a.csv"));
  VANTAGE_TRY(ScanTable table_b, read_scans(folder.path() / "b.csv"));
  return compare(std::move(table_a), std::move(table_b));
}

TEST_CASE("means, difference and share are those of the paired scans, by hand") {
  // Pairs: 2, 3, 4 s; at 4 s B is lost, so its error does not count.
  const auto c = compared({{.stamp = "1", .error_m = "9"},
                           {.stamp = "2", .error_m = "0.02", .align_ms = "4"},
                           {.stamp = "3", .error_m = "0.04", .align_ms = "6"},
                           {.stamp = "4", .error_m = "0.05", .align_ms = "8"}},
                          {{.stamp = "2.0000000001", .error_m = "0.03", .align_ms = "1"},
                           {.stamp = "3", .error_m = "0.01", .align_ms = "1"},
                           {.stamp = "4", .tracking = "lost", .error_m = "7", .align_ms = "1"},
                           {.stamp = "5"}});
  REQUIRE_MESSAGE(c, to_string(c.error()));
  CHECK(pairing_text(*c) == "3 scans in both; only in A: 1 (1 s); only in B: 1 (5 s)");
  const Compared& error = c->quantities.front();
  CHECK(error.metric->key == "error_m");
  CHECK(error.pairs.size() == 2);
  CHECK(error.mean_a == doctest::Approx(3.0));
  CHECK(error.mean_b == doctest::Approx(2.0));
  CHECK(error.difference == doctest::Approx(-1.0));
  CHECK(*error.share_better == doctest::Approx(0.5));
  CHECK(error.interval.low == doctest::Approx(-3.0));  // of two values, a resample may be all one
  CHECK(error.interval.high == doctest::Approx(1.0));
  const auto found = std::find_if(c->quantities.begin(), c->quantities.end(),
                                  [](const Compared& q) { return q.metric->key == "align_ms"; });
  REQUIRE(found != c->quantities.end());
  const Compared& time = *found;
  CHECK(time.metric->key == "align_ms");
  CHECK(time.pairs.size() == 3);
  CHECK(time.difference == doctest::Approx(-5.0));
  CHECK(*time.share_better == 1.0);
  CHECK(c->counts.front().metric->key == "lost");
  CHECK(c->counts.front().a == 0);
  CHECK(c->counts.front().b == 1);
  const auto json = to_json(*c);
  CHECK(json["quantities"]["error_m"]["difference"] == error.difference);
  CHECK(json["stamps_only_in_b"] == nlohmann::ordered_json{5.0});
}

const ComparedCount* count_of(const Comparison& c, std::string_view key) {
  const auto found = std::find_if(c.counts.begin(), c.counts.end(),
                                  [&](const ComparedCount& n) { return n.metric->key == key; });
  return found == c.counts.end() ? nullptr : &*found;
}

TEST_CASE("uncertain scans are counted, are not lost, and their errors do not count") {
  // tiny_csv gives every scan 0.5 degrees.
  const auto c = compared({{.stamp = "1", .error_m = "0.02"},
                           {.stamp = "2", .error_m = "0.6"},
                           {.stamp = "3", .error_m = "3"}},
                          {{.stamp = "1", .error_m = "0.02"},
                           {.stamp = "2", .tracking = "uncertain", .error_m = "0.6"},
                           {.stamp = "3", .tracking = "lost", .error_m = "3"}});
  REQUIRE_MESSAGE(c, to_string(c.error()));
  const auto both = [&](std::string_view key) {
    const ComparedCount* n = count_of(*c, key);
    REQUIRE_MESSAGE(n != nullptr, key);
    return std::pair(n->a, n->b);
  };
  CHECK(both("lost") == std::pair<std::size_t, std::size_t>(0, 1));
  CHECK(both("uncertain") == std::pair<std::size_t, std::size_t>(0, 1));
  CHECK(both("far_off") == std::pair<std::size_t, std::size_t>(1, 1));
  CHECK(both("wrong") == std::pair<std::size_t, std::size_t>(1, 0));
  CHECK(both("misleading") == std::pair<std::size_t, std::size_t>(2, 0));
  CHECK(c->quantities.front().pairs.size() == 1);
  const auto risk = std::find_if(c->quantities.begin(), c->quantities.end(),
                                 [](const Compared& q) { return q.metric->key == "risk"; });
  REQUIRE(risk != c->quantities.end());
  CHECK(risk->pairs.size() == 3);
}

TEST_CASE("misleading scans of two runs are counted by each run's own alert limit") {
  const test::TemporaryFolder folder;
  for (const char* run : {"a", "b"}) {
    std::filesystem::create_directories(folder.path() / run);
    test::write_text(
        folder.path() / run / "scans.csv",
        tiny_csv({{.stamp = "1", .error_m = "0.6"}, {.stamp = "2", .error_m = "0.3"}}));
  }
  test::write_text(folder.path() / "b" / "summary.json",
                   "{\"alert_limit\": {\"m\": 0.2, \"deg\": 3.0}}");
  const auto c =
      compare(read_scans(folder.path() / "a").value(), read_scans(folder.path() / "b").value());
  REQUIRE_MESSAGE(c, to_string(c.error()));
  const ComparedCount* n = count_of(*c, "misleading");
  REQUIRE(n != nullptr);
  CHECK(n->a == 1);
  CHECK(n->b == 2);
}

TEST_CASE("what needs a reference is not counted without one") {
  const auto c = compared({{.stamp = "1", .error_m = ""}}, {{.stamp = "1", .error_m = "0.1"}});
  REQUIRE(c);
  for (const char* key : {"far_off", "wrong", "misleading"}) CHECK(count_of(*c, key) == nullptr);
  CHECK(count_of(*c, "uncertain") != nullptr);
}

TEST_CASE("runs without a scan in common are an error that names file and line") {
  const auto c = compared({{.stamp = "1"}}, {{.stamp = "2"}});
  REQUIRE_FALSE(c);
  CHECK(c.error().code == ErrorCode::invalid_input);
  REQUIRE(c.error().where);
  CHECK(c.error().where->line == 2);
  CHECK(c.error().message.find("no scan in common") != std::string::npos);
}

TEST_CASE("the interval of a mean") {
  SUBCASE("values that are all alike leave no doubt") {
    const auto interval = bootstrap_mean(std::vector<double>(20, 0.5));
    CHECK(interval.low == 0.5);
    CHECK(interval.high == 0.5);
  }
  SUBCASE("it is as wide as 1.96 standard errors, and the same each time") {
    std::vector<double> values;
    for (int i = 0; i < 400; ++i) values.push_back(i % 2 == 0 ? -1.0 : 1.0);
    const auto interval = bootstrap_mean(values);
    CHECK(interval.low == doctest::Approx(-1.96 / 20.0).epsilon(0.08));
    CHECK(interval.high == doctest::Approx(1.96 / 20.0).epsilon(0.08));
    CHECK(bootstrap_mean(values).low == interval.low);
  }
}

TEST_CASE("the comparison prints the stamps of unpaired scans in full") {
  const auto c = compared({{.stamp = "1700000000.25"}, {.stamp = "1700000000.35"}},
                          {{.stamp = "1700000000.25"}, {.stamp = "1700000000.451234"}});
  REQUIRE_MESSAGE(c, to_string(c.error()));
  CHECK(pairing_text(*c) ==
        "1 scan in both; only in A: 1 (1700000000.35 s); only in B: 1 (1700000000.451234 s)");
}

TEST_CASE("the page has both runs, their numbers, and disarmed names") {
  auto c = compared({{.stamp = "1", .error_m = "0.02"}, {.stamp = "2", .error_m = "0.03"}},
                    {{.stamp = "1", .error_m = "0.01"}, {.stamp = "2", .error_m = "0.02"}});
  REQUIRE(c);
  c->a.file = "<script>alert(1)</script>.csv";
  const std::string html = to_html(*c);
  CHECK(html.find("<script>alert") == std::string::npos);
  CHECK(html.find("data-metric=\"error_m.a\" data-value=\"2.5\"") != std::string::npos);
  for (const char* id : {"summary", "error", "match", "cost"}) {
    CHECK(html.find("<section id=\"" + std::string(id) + "\">") != std::string::npos);
  }
}

}  // namespace
}  // namespace vantage
