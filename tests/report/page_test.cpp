// The page of an evaluation, as text.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <map>
#include <nlohmann/json.hpp>
#include <random>
#include <regex>
#include <set>

#include "evaluate/report.hpp"
#include "evaluation/json.hpp"
#include "report/evaluation_fixture.hpp"
#include "report/markup.hpp"
#include "support/made_atlas.hpp"
#include "vantage/evaluation/metrics.hpp"

namespace vantage::test {
namespace {

std::string page_of(const Evaluation& evaluation) {
  auto page = to_html(evaluation);
  REQUIRE_MESSAGE(page, to_string(page.error()));
  return *std::move(page);
}

TEST_CASE("the page is valid HTML") {
  const std::string markup =
      markup_of(page_of(made_evaluation({.configs = {"wide", "L10"}, .routes = {"a", "b"}})));
  CHECK(imbalance(markup).empty());
  CHECK(invalid_html(markup) == "");
  CHECK(markup.find("</th>") != std::string::npos);
  // It can tell.
  CHECK(invalid_html("<tr><th>x</th scope=\"row\"></tr>") == "</th scope=\"row\"> is no end tag");
  CHECK(invalid_html("<p><ul></ul></p>") == "<ul> in <p>");
  CHECK(invalid_html("<div><li>x</li></div>") == "<li> in <div>");
  CHECK(invalid_html("<b id=\"a\"></b><i id=\"a\"></i>") == "id \"a\" is there twice");
}

TEST_CASE("the page names every metric and shows its statistics") {
  const Evaluation e = made_evaluation({.configs = {"wide", "L10"}});
  const std::string markup = markup_of(page_of(e));
  for (const Metric& metric : metrics()) {
    CAPTURE(metric.key);
    CHECK(markup.find("<code>" + std::string(metric.key) + "</code>") != std::string::npos);
    if (e.configs[0].routes[0].summary[metric.key].count == 0) continue;
    const std::string path =
        metric.is_count() ? "scans." + std::string(metric.key)
                          : std::string(metric.key) + "." + std::string(headline(metric).name);
    CHECK(markup.find("data-metric=\"" + path + "\"") != std::string::npos);
  }
}

TEST_CASE("the page has every section, each in the navigation, and closes what it opens") {
  const std::string page = page_of(made_evaluation({.configs = {"wide", "L10", "L20"}}));
  for (const std::string id :
       {"verdict", "points", "accuracy", "regionmaps", "alignment", "fitness", "lcp", "error",
        "motion", "risk", "trajectories", "view", "method"}) {
    CAPTURE(id);
    CHECK(page.find("<section id=\"" + std::string(id) + "\">") != std::string::npos);
    CHECK(page.find("<a href=\"#" + std::string(id) + "\">") != std::string::npos);
  }
  for (const std::string figure : {"Table 1.", "Fig. 9.", "Fig. 10 a.", "Fig. 10 b.", "Fig. 11.",
                                   "Fig. 12 a.", "Fig. 12 b."}) {
    CAPTURE(figure);
    CHECK(page.find(figure) != std::string::npos);
  }
  CHECK(imbalance(markup_of(page)).empty());
  CHECK(imbalance("<p><b></p></b>") == "</p> inside <b>");  // it can tell
}

TEST_CASE("the page asks for nothing that is not in it") {
  const std::string page = page_of(made_evaluation({}));
  CHECK(page.find("Content-Security-Policy\" content=\"default-src 'none'") != std::string::npos);
  const std::string markup = markup_of(page);
  const std::regex reference(
      "(?:src|href|srcset|data|action|poster)=\"([^\"]*)\"|url\\(([^)]*)\\)");
  std::size_t seen = 0;
  for (std::sregex_iterator it(markup.begin(), markup.end(), reference), end; it != end; ++it) {
    const std::string to = (*it)[1].matched ? (*it)[1].str() : (*it)[2].str();
    CAPTURE(to.substr(0, 60));
    CHECK((to.starts_with("#") || to.starts_with("data:")));
    ++seen;
  }
  CHECK(seen > 10);
  for (const std::string element : {"<iframe", "<object", "<embed", "<base", "@import"}) {
    CAPTURE(element);
    CHECK(markup.find(element) == std::string::npos);
  }
}

TEST_CASE("names of any author stay text") {
  const std::string script = "</script><script>alert(1)</script>",
                    image = "<img src=x onerror=alert(1)>";
  Evaluation e =
      made_evaluation({.configs = {"wide", script}, .routes = {image, "b\" onload=\"c"}});
  e.configs[1].no_baselines = script;
  e.configs[1].index.config = "</pre>" + script;
  e.configs[0].routes[0].run.stamp_rule = image;
  e.configs[1].baselines[0].name = image;
  e.configs[1].gates = {
      {.gate = {.text = script, .config = "", .metric = image, .unit = ""}, .route = image}};
  const std::string page = page_of(e);
  CHECK(page.find("<script>alert") == std::string::npos);
  CHECK(page.find("<img") == std::string::npos);
  CHECK(page.find("onload=\"c\"") == std::string::npos);
  CHECK(imbalance(markup_of(page)).empty());
}

using Key = std::array<std::string, 4>;

std::string unescaped(std::string text) {
  for (const auto& [from, to] :
       {std::pair{"&lt;", "<"}, {"&gt;", ">"}, {"&quot;", "\""}, {"&amp;", "&"}}) {
    for (auto at = text.find(from); at != std::string::npos; at = text.find(from, at)) {
      text.replace(at, std::string(from).size(), to);
    }
  }
  return text;
}

std::map<Key, double> numbers_of(const std::string& page) {
  const std::regex cell(
      "data-config=\"([^\"]*)\" data-route=\"([^\"]*)\" data-map=\"([^\"]*)\" "
      "data-metric=\"([^\"]*)\" "
      "data-value=\"([^\"]*)\"");
  std::map<Key, double> numbers;
  for (std::sregex_iterator it(page.begin(), page.end(), cell), end; it != end; ++it) {
    const auto& m = *it;
    numbers[{unescaped(m[1]), unescaped(m[2]), unescaped(m[3]), unescaped(m[4])}] = std::stod(m[5]);
  }
  return numbers;
}

TEST_CASE("every number of a run is the one at its path in the run's summary, in full") {
  const Evaluation e = made_evaluation({.configs = {"wide", "L<10"}, .routes = {"north", "south"}});
  const auto numbers = numbers_of(markup_of(page_of(e)));
  CHECK(numbers.size() > 300);
  const auto check = [&](const EvaluatedConfig& config, const std::string& map, const RouteRun& run,
                         const std::string& route) {
    const nlohmann::ordered_json json = to_json(run.run, run.summary);
    std::size_t of_this = 0;
    for (const auto& [key, value] : numbers) {
      if (key[0] != config.name || key[1] != route || key[2] != map) continue;
      ++of_this;
      std::string pointer = "/" + key[3];
      std::replace(pointer.begin(), pointer.end(), '.', '/');
      CAPTURE(pointer);
      CHECK(json.at(nlohmann::ordered_json::json_pointer(pointer)).get<double>() == value);
    }
    CHECK(of_this >= 25);
  };
  for (const EvaluatedConfig& config : e.configs) {
    for (std::size_t r = 0; r < e.routes.size(); ++r) {
      check(config, "observable", config.routes[r], e.routes[r].name);
      for (const Baseline& baseline : config.baselines) {
        check(config, baseline.name, baseline.routes[r], e.routes[r].name);
      }
    }
  }
}

TEST_CASE("the page is the same each time, whatever the order of the map's points") {
  Evaluation e = made_evaluation({});
  const std::string page = page_of(e);
  std::shuffle(e.map.begin(), e.map.end(), std::mt19937(2));
  CHECK(page_of(e) == page);
}

TEST_CASE("a bundle without points, no map and no error still make a page") {
  Evaluation e = made_evaluation({.configs = {"wide", "cells"}, .baselines = false});
  e.map.clear();
  for (EvaluatedConfig& config : e.configs) {
    config.specimen.reset();
    for (RegionSummary& region : config.index.regions) region = {.elements = 10, .bytes = 400};
    config.region_points = {};
    for (RouteRun& run : config.routes) {
      for (RunScan& scan : run.run.scans) {
        scan.error.reset();
        scan.map = {.elements = 10, .bytes = 400};
        scan.report.seconds_align = 0.0;
        scan.report.tracking = Tracking::lost;
        scan.report.alignment.reset();
      }
      run.summary = summarize(run.run);
    }
  }
  const std::string page = page_of(e);
  CHECK(imbalance(markup_of(page)).empty());
  CHECK(page.find("nan") == page.find("nan", page.find("<script")));  // none in text or pictures
  CHECK(markup_of(page).find("60 of 60 scans lost") != std::string::npos);
}

TEST_CASE("each configuration has a mark over the bytes of its maps, if its error is known") {
  Evaluation e = made_evaluation({.configs = {"wide", "cells"}, .baselines = false});
  const auto figure_of = [&] {
    const std::string markup = markup_of(page_of(e));
    const auto begin = markup.find("data-file=\"error-bytes");
    if (begin == std::string::npos) return std::string();
    return markup.substr(begin, markup.find("</figure>", begin) - begin);
  };
  CHECK(figure_of().find(">wide<") != std::string::npos);
  CHECK(figure_of().find(">cells<") != std::string::npos);
  for (RouteRun& run : e.configs.front().routes) {
    for (RunScan& scan : run.run.scans) scan.error.reset();
    run.summary = summarize(run.run);
  }
  CHECK(figure_of().find(">wide<") == std::string::npos);
  CHECK(figure_of().find(">cells<") != std::string::npos);
}

std::size_t times(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
  return n;
}

TEST_CASE("the page shows tracked, uncertain and lost scans, and the risk along the route") {
  const std::string markup = markup_of(page_of(made_evaluation({.configs = {"wide", "L10"}})));
  CHECK(times(markup, "<path class=\"uncertain\"") == 2);  // one a configuration
  CHECK(times(markup, "<path class=\"lost\"") == 2);
  CHECK(markup.find("risk 1e-06") != std::string::npos);
  CHECK(markup.find("uncertain: the fit is &lt;poor&gt;") != std::string::npos);
  CHECK(markup.find("60 scans, 1 uncertain, 1 lost") != std::string::npos);
  CHECK(markup.find("; 1 of 60 scans lost, 1 uncertain.") != std::string::npos);
  CHECK(markup.find("</i>scan uncertain</span>") != std::string::npos);
  CHECK(markup.find("data-file=\"risk-way\"") != std::string::npos);
  CHECK(markup.find("data-file=\"prediction-way\"") != std::string::npos);
  CHECK(markup.find("data-metric=\"scans.uncertain\" data-value=\"1\"") != std::string::npos);
}

TEST_CASE("the page shows the sites of an atlas, if a bundle has one") {
  Evaluation e = made_evaluation({.configs = {"wide", "L10", "L<20"}});
  CHECK(page_of(e).find("id=\"localizability\"") == std::string::npos);
  e.configs[1].atlas = made_atlas({20, 40, 1});
  const std::string page = page_of(e);
  CHECK(page.find("<section id=\"localizability\">") != std::string::npos);
  CHECK(page.find("<a href=\"#localizability\">") != std::string::npos);
  const std::string markup = markup_of(page);
  CHECK(imbalance(markup).empty());
  CHECK(invalid_html(markup) == "");
  CHECK(times(markup, "<circle class=\"site ") == 3);
  for (const char* colour : {"site e0", "site e3", "site e4"}) {
    CAPTURE(colour);
    CHECK(times(markup, colour) == 1);
  }
  CHECK(times(markup, "class=\"weak\"") == 3);
  CHECK(times(markup, "class=\"alike\"") == 2);
  CHECK(times(markup, "a scan from here matches nothing") == 1);
  CHECK(times(markup, "sigma 29.0 cm along 60° from the map") == 1);
  CHECK(times(markup, "alike place 5.0 m away, likeness 0.70") == 1);
  CHECK(times(markup, "4 sites for ndt, median 30.0 cm, 2 above 0.5 m") == 1);
  CHECK(markup.find("Bundles without an atlas: wide, L&lt;20; `vantage assess` makes it.") !=
        std::string::npos);

  e.configs[1].routes[0].run.alert_limit.metres = 5.6;
  CHECK(markup_of(page_of(e)).find("median 30.0 cm, 1 above 5.6 m") != std::string::npos);
  e.configs[1].routes[0].run.alert_limit = {};

  // Neither an atlas without sites nor one without a match, a map or a route stops the page.
  e.configs[1].atlas = Atlas{};
  CHECK(page_of(e).find("id=\"localizability\"") == std::string::npos);
  e.configs[1].atlas = made_atlas({20, 40, 1});
  e.configs[1].atlas->sites.erase(e.configs[1].atlas->sites.begin(),
                                  e.configs[1].atlas->sites.begin() + 3);
  e.map.clear();
  CHECK(markup_of(page_of(e)).find("1 site for ndt, 1 above 0.5 m") != std::string::npos);
}

TEST_CASE("the terminal's table: a row each, baselines beneath, nothing measured is a dash") {
  Evaluation e = made_evaluation({.configs = {"wide", "L10"}, .routes = {"north", "south"}});
  e.configs[0].routes[0].summary = RunSummary{};
  const auto rows = comparison(e);
  REQUIRE(rows.size() == 1 + 2 * (1 + 1 + 3));
  for (const auto& row : rows) CHECK(row.size() == rows.front().size());
  CHECK(rows[1][0] == "wide");
  CHECK(rows[1][3] == "-");
  CHECK(rows[3][3] != "-");
  CHECK(rows[3][1] == "random");
}

}  // namespace
}  // namespace vantage::test
