#include "vantage/evaluation/gates.hpp"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "vantage/evaluation/evaluation.hpp"
#include "vantage/evaluation/metrics.hpp"

using namespace vantage;

namespace {

Statistics constant(double x) {
  Statistics s;
  s.count = 10;
  s.mean = s.rmse = s.min = s.median = s.p95 = s.p99 = s.max = x;
  return s;
}

void set(RunSummary& summary, std::string_view key, const Statistics& s) {
  summary.of_metrics.resize(metrics().size());
  summary.of_metrics[static_cast<std::size_t>(find_metric(key) - metrics().data())] = s;
}

RouteRun route(double error_m, std::size_t lost) {
  RouteRun run;
  run.summary.scans = 200;
  Statistics count;
  count.count = 200;
  count.sum = static_cast<double>(lost);
  set(run.summary, "lost", count);
  set(run.summary, "error_m", constant(error_m));
  set(run.summary, "coverage", constant(0.9));
  set(run.summary, "align_ms", constant(1.5));
  set(run.summary, "held_bytes", constant(12e6));
  return run;
}

EvaluatedConfig config(const std::string& name, std::vector<RouteRun> routes) {
  EvaluatedConfig c;
  c.name = name;
  c.routes = std::move(routes);
  c.region_points = constant(1000);
  c.index.map_points = 4000;
  c.index.regions = {{.points = 1000}};
  c.bundle_bytes = 3'000'000;
  return c;
}

GateResult judge_one(const std::string& text, const EvaluatedConfig& c,
                     const EvaluatedConfig* excess_over = nullptr) {
  const auto gates = parse_gates(text);
  REQUIRE_MESSAGE(gates, gates.error().message);
  const auto results = judge(*gates, c, {"a"}, excess_over);
  REQUIRE(results.size() == 1);
  return results.front();
}

}  // namespace

TEST_CASE("gates: a list of limits, each in the direction that is better") {
  const auto gates = parse_gates("error=0.5cm,lost=0,coverage=90%,T_align<=2ms,points>=10");
  REQUIRE_MESSAGE(gates, gates.error().message);
  REQUIRE(gates->size() == 5);
  CHECK((*gates)[0].metric == "error");
  CHECK((*gates)[0].limit == 0.5);
  CHECK((*gates)[0].unit == "cm");
  CHECK_FALSE((*gates)[0].at_least);
  CHECK((*gates)[1].limit == 0.0);
  CHECK((*gates)[2].at_least);
  CHECK_FALSE((*gates)[3].at_least);
  CHECK((*gates)[4].at_least);
}

TEST_CASE("gates: a share is one of the scans of which there is something to know") {
  EvaluatedConfig c = config("L20", {route(0.01, 0)});
  Statistics known;  // a reference for 10 of 200 scans
  known.count = 10;
  known.sum = 5;
  set(c.routes[0].summary, "wrong", known);
  CHECK_FALSE(judge_one("wrong=40%", c).holds);
  CHECK(judge_one("wrong=50%", c).holds);
}

TEST_CASE("gates: the help says of which scans a share is, and so it is computed") {
  const auto scan = [](Tracking tracking, std::optional<double> metres) {
    RunScan s;
    s.report.tracking = tracking;
    if (metres) s.error = PoseError{.metres = *metres};
    return s;
  };
  Run run;
  run.scans = {scan(Tracking::tracked, 9.0),   scan(Tracking::tracked, 0.0),
               scan(Tracking::tracked, 0.0),   scan(Tracking::tracked, 0.0),
               scan(Tracking::tracked, {}),    scan(Tracking::tracked, {}),
               scan(Tracking::uncertain, 9.0), scan(Tracking::lost, {})};
  EvaluatedConfig c = config("L20", {route(0.01, 0)});
  c.routes[0].summary = summarize(run);
  const std::string help = gate_help();
  struct Row {
    const char *metric, *scans;
    double percent;
  };
  for (const Row& row : {Row{"lost", "scans", 12.5}, Row{"uncertain", "scans", 12.5},
                         Row{"far_off", "scans with a pose and a reference", 40.0},
                         Row{"wrong", "tracked scans with a reference", 25.0},
                         Row{"misleading", "tracked scans with a reference", 25.0}}) {
    CAPTURE(row.metric);
    const Metric& metric = *find_metric(row.metric);
    const std::string meaning =
        "share of the " + std::string(row.scans) + ": " + std::string(metric.doc) + "\n";
    CHECK(help.find(meaning) != std::string::npos);
    CHECK(*judge_one(std::string(row.metric) + "=50%", c).value == doctest::Approx(row.percent));
  }
  run.scans = {scan(Tracking::tracked, {}), scan(Tracking::lost, 9.0)};
  c.routes[0].summary = summarize(run);
  CHECK_FALSE(judge_one("wrong=100%", c).value);  // no tracked scan has a reference
}

TEST_CASE("gates: what is wrong is named, with what was expected") {
  const auto message = [](const char* text) {
    const auto gates = parse_gates(text);
    REQUIRE_FALSE(gates);
    CHECK(gates.error().code == ErrorCode::invalid_input);
    return gates.error().message;
  };
  CHECK(message("").find("expected a metric and its limit") != std::string::npos);
  CHECK(message("error").find("gate 'error'") != std::string::npos);
  CHECK(message("=3").find("expected a metric") != std::string::npos);
  CHECK(message("eror=1cm").find("did you mean 'error'") != std::string::npos);
  CHECK(message("error=much").find("expected a number") != std::string::npos);
  CHECK(message("error=nan").find("expected a number") != std::string::npos);
  CHECK(message("error=1").find("m, cm, mm") != std::string::npos);
  CHECK(message("error=1ms").find("error has no unit 'ms'; expected m, cm") != std::string::npos);
  CHECK(message("error=1cm,,lost=0").find("gate ''") != std::string::npos);
}

TEST_CASE("gates: values are measured in the gate's unit, and a limit is kept when it is met") {
  EvaluatedConfig c = config("c", {route(0.004, 3)});
  Statistics uncertain;
  uncertain.count = 200;
  uncertain.sum = 20;
  set(c.routes.front().summary, "uncertain", uncertain);
  Statistics misleading;
  misleading.count = 177;  // those that are tracked
  misleading.sum = 1;
  set(c.routes.front().summary, "misleading", misleading);
  Statistics risk = constant(2e-5);
  risk.max = 1e-4;
  set(c.routes.front().summary, "risk", risk);
  CHECK(*judge_one("error=0.4cm", c).value == doctest::Approx(0.4));
  CHECK(judge_one("error<=0.004m", c).holds);
  CHECK_FALSE(judge_one("error=0.39cm", c).holds);
  CHECK_FALSE(judge_one("error>=5mm", c).holds);
  CHECK(judge_one("lost=3", c).holds);
  CHECK_FALSE(judge_one("lost=2", c).holds);
  CHECK(*judge_one("lost=1%", c).value == doctest::Approx(1.5));
  CHECK_FALSE(judge_one("lost=1%", c).holds);
  CHECK(judge_one("uncertain=20", c).holds);
  CHECK_FALSE(judge_one("uncertain=9%", c).holds);
  CHECK_FALSE(judge_one("misleading=0", c).holds);
  CHECK(judge_one("risk=1e-4", c).holds);
  CHECK_FALSE(judge_one("risk_max=9e-5", c).holds);
  CHECK(to_string(judge_one("risk=1e-4", c)) == "risk 2e-05 <= 0.0001 on a");
  CHECK(judge_one("coverage=0.9", c).holds);
  CHECK_FALSE(judge_one("coverage=91%", c).holds);
  CHECK(judge_one("memory=12MB", c).holds);
  CHECK(judge_one("bytes=3MB", c).holds);
  CHECK(*judge_one("reduction=70%", c).value == doctest::Approx(75));
  CHECK(judge_one("T_align=0.0015s", c).holds);
}

TEST_CASE("gates: what cannot be measured does not pass") {
  EvaluatedConfig c = config("c", {route(0.004, 0)});
  CHECK_FALSE(judge_one("excess=1m", c).holds);
  CHECK_FALSE(judge_one("over_baselines=1m", c).holds);
  set(c.routes.front().summary, "error_m", {});
  CHECK_FALSE(judge_one("error=1m", c).holds);
  CHECK_FALSE(judge_one("error=1m", c).value.has_value());
  CHECK(to_string(judge_one("error=1m", c)) == "error not measured <= 1 m on a");
}

TEST_CASE("gates: excess over a configuration, and over the best baseline") {
  EvaluatedConfig c = config("c", {route(0.004, 0)});
  const EvaluatedConfig wide = config("wide", {route(0.003, 0)});
  CHECK(*judge_one("excess=1cm", c, &wide).value == doctest::Approx(0.1));
  c.baselines.push_back({"random", {route(0.0035, 0)}});
  c.baselines.push_back({"voxel", {route(0.0025, 0)}});
  CHECK(*judge_one("over_baselines=1mm", c).value == doctest::Approx(1.5));
  CHECK_FALSE(judge_one("over_baselines=1mm", c).holds);
}

TEST_CASE("gates: on every route; what belongs to the maps once; one configuration if so said") {
  const EvaluatedConfig c = config("L20", {route(0.004, 0), route(0.006, 1)});
  const auto results =
      judge(parse_gates("error=0.5cm,points=1000").value(), c, {"a", "b"}, nullptr);
  REQUIRE(results.size() == 3);
  CHECK(results[0].holds);
  CHECK(results[0].route == "a");
  CHECK_FALSE(results[1].holds);
  CHECK(results[1].route == "b");
  CHECK(results[2].route.empty());
  CHECK(judge(parse_gates("wide:error=0.5cm").value(), c, {"a", "b"}, nullptr).empty());
  CHECK(judge(parse_gates("L20:error=0.5cm,lost=0").value(), c, {"a", "b"}, nullptr).size() == 4);
}

TEST_CASE("gates: the help has a line for every metric") {
  const std::string help = gate_help();
  for (const char* name : {"error ", "excess", "over_baselines", "lost", "stall", "held"}) {
    CHECK_MESSAGE(help.find(name) != std::string::npos, name);
  }
  for (const Metric& metric : metrics()) {
    CHECK_MESSAGE(help.find("  " + std::string(name_in_gates(metric)) + " ") != std::string::npos,
                  metric.key);
  }
}

TEST_CASE("gates: each metric has its statistics, and the names of before still count") {
  EvaluatedConfig c = config("c", {route(0.004, 3)});
  Statistics s = constant(0.02);
  s.p95 = 0.05;
  set(c.routes.front().summary, "error_m", s);
  CHECK(*judge_one("error_p95=9cm", c).value == doctest::Approx(5.0));
  CHECK(*judge_one("error_mean=9cm", c).value == doctest::Approx(2.0));
  CHECK(judge_one("T_align_p95=2ms", c).gate.metric == "align_p95");
  CHECK(judge_one("rotation=1deg", c).gate.metric == "error");
  CHECK(parse_gates("NVTL=1,blocking=0,over_opponents=0cm"));
  CHECK_FALSE(parse_gates("lost_p95=1"));  // counts have no percentiles
}

TEST_CASE("gates: a bundle without points has no size that a gate could be measured on") {
  EvaluatedConfig c = config("prepared", {route(0.004, 0)});
  c.index.regions = {{.elements = 4659}};
  c.region_points = {};
  CHECK_FALSE(c.reduction());
  for (const char* text : {"reduction=99%", "points=10", "map_points=10", "reduction_used=1%",
                           "lcp=0", "map_points_p95=10"}) {
    CAPTURE(text);
    const auto checked = check_measurable(parse_gates(text).value(), "prepared", c.index);
    REQUIRE_FALSE(checked);
    CHECK(checked.error().message.starts_with("gate '" + std::string(text) +
                                              "': the bundle of 'prepared' stores no points"));
  }
  CHECK(check_measurable(parse_gates("error=1cm,bytes=1MB").value(), "prepared", c.index));
  CHECK(check_measurable(parse_gates("other:reduction=99%").value(), "prepared", c.index));
  c.index.regions = {{.points = 1000}};
  CHECK(check_measurable(parse_gates("reduction=99%").value(), "prepared", c.index));
}
