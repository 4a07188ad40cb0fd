#include "integrity_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>

#include "drive.hpp"
#include "vantage/evaluation/statistics.hpp"

namespace vantage::benchmarks {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr std::array kRisks{1e-1, 3e-2, 1e-2, 3e-3, 1e-3};

bool is_tracked(const JudgedScan& scan) { return scan.tracking == Tracking::tracked; }

/// Until the next event at most.
double scans_until_found(std::span<const JudgedScan> from_event) {
  for (std::size_t i = 0; i < from_event.size(); ++i) {
    if (i > 0 && from_event[i].misled) break;
    if (is_tracked(from_event[i]) && from_event[i].is_right()) return static_cast<double>(i);
  }
  return kNever;
}

// ---- what is printed

std::string percent(double share) { return fmt::format("{:.3g}", 100.0 * share); }

/// "0.25 % (3 of 1204; 0.05-0.73)".
std::string with_interval(const Count& count) {
  if (count.of == 0) return "-";
  const Interval interval = clopper_pearson(count);
  return fmt::format("{} % ({} of {}; {}-{})", percent(count.share()), count.hits, count.of,
                     percent(interval.low), percent(interval.high));
}

/// "2 / never (1 of 12)": median, worst and how often never.
std::string waits(std::vector<double> found_after) {
  if (found_after.empty()) return "-";
  std::ranges::sort(found_after);
  const auto text = [](double scans) {
    return std::isfinite(scans) ? fmt::format("{:g}", scans) : std::string("never");
  };
  const double median = found_after[(found_after.size() - 1) / 2];
  const auto never = std::ranges::count(found_after, kNever);
  std::string result = text(median) + " / " + text(found_after.back());
  if (never > 0) result += fmt::format(" ({} of {})", never, found_after.size());
  return result;
}

std::vector<std::string> row(const std::string& world, const std::string& matcher,
                             const Verdict& verdict) {
  const double align =
      verdict.aligned > 0 ? verdict.seconds_align / static_cast<double>(verdict.aligned) : 0.0;
  return {world,
          matcher,
          std::to_string(verdict.scans),
          with_interval(verdict.wrong_of_tracked),
          with_interval(verdict.lost_of_right),
          with_interval(verdict.uncertain),
          std::to_string(verdict.found_after.size()),
          waits(verdict.found_after),
          fmt::format("{} of {}", verdict.wrong_finds, verdict.finds),
          fmt::format("{:.2f}", 1e3 * align)};
}

template <class Key>
std::vector<std::string> in_order(const std::vector<JudgedRun>& runs, Key key) {
  std::vector<std::string> all;
  for (const JudgedRun& run : runs) {
    if (std::ranges::find(all, run.*key) == all.end()) all.push_back(run.*key);
  }
  return all;
}

template <class Take>
std::vector<const JudgedRun*> those(const std::vector<JudgedRun>& runs, Take take) {
  std::vector<const JudgedRun*> chosen;
  for (const JudgedRun& run : runs) {
    if (take(run)) chosen.push_back(&run);
  }
  return chosen;
}

Verdict verdict_of(const std::vector<const JudgedRun*>& runs) {
  Verdict verdict;
  for (const JudgedRun* run : runs) verdict.add(*run);
  return verdict;
}

void print_verdicts(const std::vector<JudgedRun>& runs, const char* title, const char* what,
                    std::string JudgedRun::*key) {
  print_head(title,
             {what, "matcher", "scans", "wrong of the tracked", "lost of the right", "uncertain",
              "misled", "scans until found: median / worst", "wrong finds", "align [ms]"});
  const auto matchers = in_order(runs, &JudgedRun::matcher);
  for (const std::string& name : in_order(runs, key)) {
    for (const std::string& matcher : matchers) {
      const auto chosen = those(
          runs, [&](const JudgedRun& run) { return run.*key == name && run.matcher == matcher; });
      if (!chosen.empty()) print_row(row(name, matcher, verdict_of(chosen)));
    }
  }
}

void print_totals(const std::vector<JudgedRun>& runs) {
  print_head("In total:", {"worlds", "matcher", "scans", "wrong of the tracked",
                           "lost of the right", "uncertain", "misled",
                           "scans until found: median / worst", "wrong finds", "align [ms]"});
  const auto add = [&](const std::string& name, const std::string& matcher, auto take) {
    const auto chosen = those(runs, take);
    if (!chosen.empty()) print_row(row(name, matcher, verdict_of(chosen)));
  };
  for (const std::string& matcher : in_order(runs, &JudgedRun::matcher)) {
    add("all", matcher, [&](const JudgedRun& run) { return run.matcher == matcher; });
  }
  add("ambiguous", "all", [](const JudgedRun& run) { return run.ambiguous; });
  add("the others", "all", [](const JudgedRun& run) { return !run.ambiguous; });
  add("all", "all", [](const JudgedRun&) { return true; });
}

/// "0.1 / 2 / 20 / 25": median, p90, p99 and worst.
std::string spread_of(std::vector<double> times) {
  if (times.empty()) return "-";
  std::ranges::sort(times);
  return fmt::format("{:.2f} / {:.2f} / {:.2f} / {:.2f}", percentile(times, 0.5),
                     percentile(times, 0.9), percentile(times, 0.99), times.back());
}

void print_recovery(const std::vector<JudgedRun>& runs) {
  print_head(
      "After kidnaps and wrong starts:",
      {"world", "matcher", "misled", fmt::format("found by {} scans", Recovery::kSoon),
       "tracked and wrong before", "such scans",
       "verdict and search until then [ms]: median / p90 / p99 / worst", "of the other scans"});
  for (const std::string& world : in_order(runs, &JudgedRun::world)) {
    for (const std::string& matcher : in_order(runs, &JudgedRun::matcher)) {
      Recovery all;
      for (const JudgedRun& run : runs) {
        if (run.world == world && run.matcher == matcher) all.add(run);
      }
      if (all.soon.of == 0) continue;
      print_row({world, matcher, std::to_string(all.soon.of), with_interval(all.soon),
                 std::to_string(all.misleading), std::to_string(all.wrong_scans),
                 spread_of(all.until_found), spread_of(all.otherwise)});
    }
  }
}

std::string shown(Kept kept) {
  switch (kept) {
    case Kept::yes: return "yes";
    case Kept::no: return "NO";
    case Kept::undecided: return "undecided";
  }
  return {};
}

void print_calibration(const std::vector<JudgedRun>& runs) {
  print_head("Is the stated risk kept?", {"matcher", "risk at most", "scans", "mean of the stated",
                                          "wrong", "stretches", "upper limit (95 %)", "kept"});
  const auto add = [&](const std::string& name, const std::vector<const JudgedRun*>& chosen) {
    for (const double risk : kRisks) {
      const Calibration c = calibration(chosen, risk);
      print_row({name, fmt::format("{:g}", risk), std::to_string(c.wrong.of),
                 c.wrong.of > 0 ? fmt::format("{:.2g}", c.stated) : "-",
                 c.wrong.of > 0 ? fmt::format("{:.2g} ({})", c.wrong.share(), c.wrong.hits) : "-",
                 std::to_string(c.stretches), fmt::format("{:.2g}", upper_limit(c.wrong)),
                 shown(kept(c))});
    }
  };
  const auto matchers = in_order(runs, &JudgedRun::matcher);
  for (const std::string& matcher : matchers) {
    add(matcher, those(runs, [&](const JudgedRun& run) { return run.matcher == matcher; }));
  }
  if (matchers.size() > 1) add("all", those(runs, [](const JudgedRun&) { return true; }));
}

nlohmann::ordered_json number_or_null(const std::optional<double>& x) {
  return x ? nlohmann::ordered_json(*x) : nlohmann::ordered_json(nullptr);
}

}  // namespace

void Verdict::add(const JudgedRun& run) {
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const JudgedScan& scan = run.scans[i];
    ++scans;
    uncertain.add(scan.tracking == Tracking::uncertain);
    if (is_tracked(scan)) wrong_of_tracked.add(!scan.is_right());
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

void Recovery::add(const JudgedRun& run) {
  bool searching = false;
  for (std::size_t i = 0; i < run.scans.size(); ++i) {
    const JudgedScan& scan = run.scans[i];
    if (scan.misled) {
      const auto from_event = std::span(run.scans).subspan(i);
      soon.add(scans_until_found(from_event) < static_cast<double>(kSoon));
      std::size_t wrong = 0;
      for (std::size_t k = 0; k < from_event.size() && (k == 0 || !from_event[k].misled); ++k) {
        if (!is_tracked(from_event[k])) continue;
        if (from_event[k].is_right()) break;
        ++wrong;
      }
      wrong_scans += wrong;
      misleading += wrong > 0 ? 1 : 0;
      searching = true;
    }
    (searching ? until_found : otherwise)
        .push_back(1e3 * (scan.seconds_verdict + scan.seconds_search));
    if (is_tracked(scan) && scan.is_right()) searching = false;
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
      if (wrong && !in_stretch) ++result.stretches;
      in_stretch = wrong;
    }
  }
  if (result.wrong.of > 0) result.stated /= static_cast<double>(result.wrong.of);
  return result;
}

Kept kept(const Calibration& calibration) {
  if (upper_limit(calibration.wrong) <= calibration.risk) return Kept::yes;
  if (clopper_pearson(calibration.wrong).low > calibration.risk) return Kept::no;
  return Kept::undecided;
}

void print(const std::vector<JudgedRun>& runs) {
  print_verdicts(runs, "By world:", "world", &JudgedRun::world);
  print_verdicts(runs, "By scenario:", "scenario", &JudgedRun::scenario);
  print_verdicts(runs, "By map:", "map", &JudgedRun::map);
  print_totals(runs);
  print_recovery(runs);
  print_calibration(runs);
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
                                 {"seconds_align", scan.seconds_align},
                                 {"seconds_search", scan.seconds_search},
                                 {"seconds_verdict", scan.seconds_verdict},
                                 {"reason", scan.reason}};
      if (scan.has_pose) {
        one["error_m"] = scan.metres;
        one["error_deg"] = scan.degrees;
      }
      scans.push_back(std::move(one));
    }
  }
  return nlohmann::ordered_json{
             {"alert_m", kAlertMetres}, {"alert_deg", kAlertDegrees}, {"scans", std::move(scans)}}
             .dump(1) +
         "\n";
}

}  // namespace vantage::benchmarks
