#include <fmt/format.h>

#include <algorithm>
#include <tuple>
#include <utility>

#include "localize/run_parts.hpp"
#include "report/html.hpp"
#include "terminal/counts.hpp"

namespace vantage::run_page {
namespace {

using report::Cell;
using report::escaped;

/// Scans in a row of one state.
struct Stretch {
  std::size_t begin = 0, scans = 0;
  double seconds = 0.0, metres = 0.0;  ///< until the scan after it, or the last
};

Stretch longest(const Scans& scans, Tracking state) {
  Stretch longest;
  for (std::size_t i = 0; i < scans.size(); ++i) {
    if (!scans.is(i, state)) continue;
    const std::size_t begin = i;
    while (i < scans.size() && scans.is(i, state)) ++i;
    const std::size_t end = std::min(i, scans.size() - 1);
    const Stretch one{begin, i - begin, scans.time[end] - scans.time[begin],
                      scans.way[end] - scans.way[begin]};
    if (std::tie(one.seconds, one.scans) > std::tie(longest.seconds, longest.scans)) longest = one;
  }
  return longest;
}

std::string table_of_states(const Scans& scans, const RunSummary& summary) {
  report::Table table{
      .caption = "States of the scans",
      .groups = {{"", 3}, {"longest stretch", 4}},
      .header = {"state", "scans", "share [%]", "scans", "from scan", "[s]", "[m]"}};
  for (const Tracking state : {Tracking::tracked, Tracking::uncertain, Tracking::lost}) {
    const std::string name(to_string(state));
    const std::size_t count = state == Tracking::tracked ? summary.tracked : summary.count(name);
    report::TableRow row;
    row.cells = {
        {name},
        {cli::grouped(count), {{"metric", "scans." + name}, {"value", fmt::format("{}", count)}}},
        {fmt::format("{:.1f}", 100.0 * static_cast<double>(count) /
                                   static_cast<double>(std::max<std::size_t>(1, scans.size())))}};
    const Stretch stretch = longest(scans, state);
    if (stretch.scans == 0) {
      row.cells.insert(row.cells.end(), 4, Cell{"–"});
    } else {
      row.cells.push_back({cli::grouped(stretch.scans)});
      row.cells.push_back({cli::grouped(stretch.begin + 1)});
      row.cells.push_back({fmt::format("{:.1f}", stretch.seconds)});
      row.cells.push_back({fmt::format("{:.1f}", stretch.metres)});
    }
    table.rows.push_back(std::move(row));
  }
  return to_html(table);
}

std::string table_of_reasons(const std::map<std::string, std::size_t>& reasons) {
  if (reasons.empty()) return {};
  std::vector<std::pair<std::size_t, std::string>> sorted;
  for (const auto& [reason, scans] : reasons) sorted.emplace_back(scans, reason);
  std::sort(sorted.rbegin(), sorted.rend());
  report::Table table{.caption = "Why scans were not tracked", .header = {"reason", "scans"}};
  for (const auto& [scans, reason] : sorted) {
    table.rows.push_back({.cells = {{reason}, {cli::grouped(scans)}}});
  }
  return to_html(table);
}

std::string badge_of(const RunFacts& facts) {
  const RunSummary& s = facts.summary;
  if (facts.run.failure) return report::badge(false, "ended early");
  if (s.tracked == 0) return report::badge(false, "never tracked");
  if (s.count("lost") > 0) return report::badge(false, "lost at times");
  if (s.tracked == s.scans) return report::badge(true, "tracked throughout");
  return report::badge(10 * s.tracked >= 9 * s.scans, "never lost, uncertain at times");
}

std::string list_of(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<li>" + escaped(text) + "</li>\n";
  return html.empty() ? html : "<ul>\n" + html + "</ul>\n";
}

}  // namespace

std::string verdict(const RunFacts& facts, const Scans& scans,
                    const std::map<std::string, std::size_t>& reasons) {
  std::string html = "<p>" + badge_of(facts);
  if (facts.run.failure) html += " " + escaped(to_string(*facts.run.failure));
  html += "</p>\n";
  const double metres = scans.way.back();
  const Stretch lost = longest(scans, Tracking::lost);
  std::vector<std::string> remarks{
      fmt::format("{:.1f} m driven in {:.1f} s, {}", metres, scans.time.back(),
                  facts.reference ? "along the reference" : "along the poses"),
      lost.scans == 0
          ? std::string("never lost")
          : fmt::format("longest lost stretch: {:.1f} s and {:.1f} m, {} from scan {} on",
                        lost.seconds, lost.metres, cli::counted(lost.scans, "scan"),
                        cli::grouped(lost.begin + 1))};
  remarks.insert(remarks.begin(), facts.remarks.begin(), facts.remarks.end());
  html += list_of(remarks);
  html += "<h3>What is suspicious</h3>\n";
  if (facts.notes.empty())
    html += "<p>Nothing was noticed about the map, the scans and the configuration.</p>\n";
  std::vector<std::string> notes;
  for (const checks::Note& note : facts.notes) notes.push_back(note.what + ": " + note.advice);
  html += list_of(notes) + table_of_states(scans, facts.summary) + table_of_reasons(reasons);
  return html +
         (facts.reference
              ? "<p>The run had a reference. This page does not use it: <code>vantage "
                "evaluate</code> compares with a reference.</p>\n"
              : "<p>Without a reference, nobody knows the errors. <code>vantage evaluate</code> "
                "compares with one.</p>\n");
}

}  // namespace vantage::run_page
