#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "drive.hpp"
#include "integrity_runs.hpp"

namespace vantage::benchmarks {
namespace {

constexpr std::array kRisks{1e-1, 3e-2, 1e-2, 3e-3, 1e-3};

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
  const auto never = std::ranges::count(found_after, std::numeric_limits<double>::infinity());
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

std::string shown(Kept kept) {
  switch (kept) {
    case Kept::yes: return "yes";
    case Kept::no: return "NO";
    case Kept::undecided: return "undecided";
  }
  return {};
}

/// "3.2 (0.4-11.5)": events in 100 km, with their exact interval.
std::string in_100_km(const Verdict& verdict) {
  if (verdict.kilometres == 0.0) return "-";
  const Interval interval = poisson_interval(verdict.stretches);
  const double scale = 100.0 / verdict.kilometres;
  return fmt::format("{:.3g} ({:.2g}-{:.2g})", scale * static_cast<double>(verdict.stretches),
                     scale * interval.low, scale * interval.high);
}

std::string of(const Count& count) {
  return count.of == 0 ? "-" : fmt::format("{} of {}", count.hits, count.of);
}

std::string metres(double x) {
  return std::isfinite(x) ? fmt::format("{:.2f}", x) : std::string("none is right");
}

std::string not_met(const Verdict& verdict) {
  std::vector<std::string> names;
  for (const Goal& goal : goals(verdict)) {
    if (!goal.is_met()) names.push_back(goal.name);
  }
  return names.empty() ? "-" : fmt::format("{}", fmt::join(names, ", "));
}

void print_failures(const std::vector<JudgedRun>& runs) {
  print_head("By failure, all matchers, maps and scenarios:",
             {"world", "scans", "km", "tracked", "wrong", "stretches", "in 100 km", "farthest [m]",
              "least risk of a wrong one", "lost of the right", "uncertain", "not met"});
  const auto add = [](const std::string& name, const Verdict& verdict) {
    const bool wrong = verdict.stretches > 0;
    print_row({name, std::to_string(verdict.scans), fmt::format("{:.1f}", verdict.kilometres),
               std::to_string(verdict.wrong_of_tracked.of),
               std::to_string(verdict.wrong_of_tracked.hits), std::to_string(verdict.stretches),
               in_100_km(verdict), wrong ? metres(verdict.farthest) : "-",
               wrong ? fmt::format("{:.1g}", verdict.least_risk) : "-", of(verdict.lost_of_right),
               of(verdict.uncertain), not_met(verdict)});
  };
  for (const std::string& world : in_order(runs, &JudgedRun::world)) {
    add(world, verdict_of(those(runs, [&](const JudgedRun& run) { return run.world == world; })));
  }
}

void print_goals(const std::vector<JudgedRun>& runs) {
  const Verdict verdict = verdict_of(those(runs, [](const JudgedRun&) { return true; }));
  print_head(fmt::format("Goals, {} scans and {:.1f} km:", verdict.scans, verdict.kilometres),
             {"what", "counted", "exact 95 % interval", "at most", "met"});
  for (const Goal& goal : goals(verdict)) {
    print_row({goal.what, fmt::format("{:.3g}", goal.value),
               fmt::format("{:.2g}-{:.2g}", goal.interval.low, goal.interval.high),
               fmt::format("{:g}", goal.limit), goal.is_met() ? "yes" : "NO"});
  }
}

void print_calibration(const std::vector<JudgedRun>& runs) {
  print_head("Is the stated risk kept?",
             {"matcher", "risk at most", "scans", "mean of the stated", "wrong", "upper limit",
              "kept", "wrong by stretch", "upper limit", "kept by stretch"});
  const auto add = [&](const std::string& name, const std::vector<const JudgedRun*>& chosen) {
    for (const double risk : kRisks) {
      const Calibration c = calibration(chosen, risk);
      const auto share = [](const Count& count) {
        return count.of > 0 ? fmt::format("{:.2g} ({})", count.share(), count.hits) : "-";
      };
      print_row({name, fmt::format("{:g}", risk), std::to_string(c.wrong.of),
                 c.wrong.of > 0 ? fmt::format("{:.2g}", c.stated) : "-", share(c.wrong),
                 fmt::format("{:.2g}", upper_limit(c.wrong)), shown(kept(c.wrong, risk)),
                 share(c.wrong_by_stretch), fmt::format("{:.2g}", upper_limit(c.wrong_by_stretch)),
                 shown(kept(c.wrong_by_stretch, risk))});
    }
  };
  const auto matchers = in_order(runs, &JudgedRun::matcher);
  for (const std::string& matcher : matchers) {
    add(matcher, those(runs, [&](const JudgedRun& run) { return run.matcher == matcher; }));
  }
  if (matchers.size() > 1) add("all", those(runs, [](const JudgedRun&) { return true; }));
}

}  // namespace

void print(const std::vector<JudgedRun>& runs) {
  print_verdicts(runs, "By world:", "world", &JudgedRun::world);
  print_verdicts(runs, "By scenario:", "scenario", &JudgedRun::scenario);
  print_verdicts(runs, "By map:", "map", &JudgedRun::map);
  print_totals(runs);
  print_failures(runs);
  print_calibration(runs);
  print_goals(runs);
}

}  // namespace vantage::benchmarks
