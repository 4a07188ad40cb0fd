#include "integrity_runs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

namespace vantage::benchmarks {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

bool is_tracked(const JudgedScan& scan) { return scan.tracking == Tracking::tracked; }

bool is_tracked_and_wrong(const JudgedScan& scan) { return is_tracked(scan) && !scan.is_right(); }

/// Until the next event at most.
double scans_until_found(std::span<const JudgedScan> from_event) {
  for (std::size_t i = 0; i < from_event.size(); ++i) {
    if (i > 0 && from_event[i].misled) break;
    if (is_tracked(from_event[i]) && from_event[i].is_right()) return static_cast<double>(i);
  }
  return kNever;
}

nlohmann::ordered_json number_or_null(const std::optional<double>& x) {
  return x ? nlohmann::ordered_json(*x) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json to_json(const Verdict& verdict) {
  nlohmann::ordered_json result{{"scans", verdict.scans},
                                {"kilometres", verdict.kilometres},
                                {"tracked", verdict.wrong_of_tracked.of},
                                {"wrong", verdict.wrong_of_tracked.hits},
                                {"stretches", verdict.stretches},
                                {"farthest_m", verdict.farthest},
                                {"least_risk", verdict.least_risk},
                                {"goals", nlohmann::ordered_json::array()}};
  for (const Goal& goal : goals(verdict)) {
    result["goals"].push_back({{"name", goal.name},
                               {"what", goal.what},
                               {"value", goal.value},
                               {"low", goal.interval.low},
                               {"high", goal.interval.high},
                               {"limit", goal.limit},
                               {"met", goal.is_met()}});
  }
  return result;
}

}  // namespace

void Verdict::add(const JudgedRun& run) {
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const JudgedScan& scan = run.scans[i];
    ++scans;
    kilometres += scan.driven / 1000.0;
    uncertain.add(scan.tracking == Tracking::uncertain);
    if (!run.ambiguous) uncertain_if_clear.add(scan.tracking == Tracking::uncertain);
    if (is_tracked(scan)) wrong_of_tracked.add(!scan.is_right());
    if (is_tracked_and_wrong(scan)) {
      if (i == 0 || !is_tracked_and_wrong(run.scans[i - 1])) ++stretches;
      farthest = std::max(farthest, scan.metres);
      least_risk = std::min(least_risk, scan.risk);
    }
    if (scan.is_right()) lost_of_right.add(scan.tracking == Tracking::lost);
    if (i > 0 && is_tracked(scan) && !is_tracked(run.scans[i - 1])) {
      ++finds;
      wrong_finds += scan.is_right() ? 0 : 1;
    }
    if (scan.misled) found_after.push_back(scans_until_found(std::span(run.scans).subspan(i)));
    if (scan.seconds_align > 0.0) {
      seconds_align += scan.seconds_align;
      ++aligned;
    }
  }
}

Calibration calibration(const std::vector<const JudgedRun*>& runs, double risk) {
  Calibration result;
  result.risk = risk;
  for (const JudgedRun* run : runs) {
    bool in_stretch = false;
    for (const JudgedScan& scan : run->scans) {
      const bool counts = scan.risk <= risk;
      const bool wrong = counts && !scan.is_right();
      if (counts) {
        result.wrong.add(wrong);
        result.stated += scan.risk;
      }
      if (counts && !(wrong && in_stretch)) result.wrong_by_stretch.add(wrong);
      in_stretch = wrong;
    }
  }
  if (result.wrong.of > 0) result.stated /= static_cast<double>(result.wrong.of);
  return result;
}

Kept kept(const Count& wrong, double risk) {
  if (upper_limit(wrong) <= risk) return Kept::yes;
  if (clopper_pearson(wrong).low > risk) return Kept::no;
  return Kept::undecided;
}

std::vector<Goal> goals(const Verdict& verdict) {
  const auto share = [](const char* name, const char* what, const Count& count, double limit) {
    return Goal{.name = name,
                .what = what,
                .value = count.share(),
                .interval = clopper_pearson(count),
                .limit = limit};
  };
  const double per_kilometre = verdict.kilometres > 0.0 ? 1.0 / verdict.kilometres : 0.0;
  const Interval events = poisson_interval(verdict.stretches);
  return {share("wrong", "wrong of the tracked", verdict.wrong_of_tracked, 1e-3),
          {.name = "stretches",
           .what = "wrong stretches a kilometre",
           .value = static_cast<double>(verdict.stretches) * per_kilometre,
           .interval = {events.low * per_kilometre, events.high * per_kilometre},
           .limit = 1.0 / 20.0},
          share("lost", "lost of the right", verdict.lost_of_right, 5e-3),
          share("uncertain", "uncertain, where a place is not ambiguous",
                verdict.uncertain_if_clear, 3e-2)};
}

Verdict verdict_of(const std::vector<const JudgedRun*>& runs) {
  Verdict verdict;
  for (const JudgedRun* run : runs) verdict.add(*run);
  return verdict;
}

std::vector<std::string> in_order(const std::vector<JudgedRun>& runs, std::string JudgedRun::*key) {
  std::vector<std::string> all;
  for (const JudgedRun& run : runs) {
    if (std::ranges::find(all, run.*key) == all.end()) all.push_back(run.*key);
  }
  return all;
}

std::string to_json(const std::vector<JudgedRun>& runs) {
  nlohmann::ordered_json scans = nlohmann::ordered_json::array();
  for (const JudgedRun& run : runs) {
    for (const JudgedScan& scan : run.scans) {
      nlohmann::ordered_json one{{"world", run.world},
                                 {"seed", run.seed},
                                 {"matcher", run.matcher},
                                 {"map", run.map},
                                 {"scenario", run.scenario},
                                 {"part", run.part},
                                 {"stamp", scan.stamp},
                                 {"misled", scan.misled},
                                 {"tracking", to_string(scan.tracking)},
                                 {"risk", scan.risk},
                                 {"right", scan.is_right()},
                                 {"error_m", nullptr},
                                 {"error_deg", nullptr},
                                 {"nvtl", number_or_null(scan.nvtl)},
                                 {"coverage", number_or_null(scan.coverage)},
                                 {"driven_m", scan.driven},
                                 {"seconds_align", scan.seconds_align},
                                 {"seconds_search", scan.seconds_search},
                                 {"reason", scan.reason}};
      if (scan.has_pose) {
        one["error_m"] = scan.metres;
        one["error_deg"] = scan.degrees;
      }
      scans.push_back(std::move(one));
    }
  }
  nlohmann::ordered_json worlds;
  for (const std::string& world : in_order(runs, &JudgedRun::world)) {
    worlds[world] =
        to_json(verdict_of(those(runs, [&](const JudgedRun& run) { return run.world == world; })));
  }
  const nlohmann::ordered_json all{
      {"alert_m", kAlertMetres},
      {"alert_deg", kAlertDegrees},
      {"total", to_json(verdict_of(those(runs, [](const JudgedRun&) { return true; })))},
      {"worlds", std::move(worlds)},
      {"scans", std::move(scans)}};
  return all.dump(1) + "\n";
}

}  // namespace vantage::benchmarks
