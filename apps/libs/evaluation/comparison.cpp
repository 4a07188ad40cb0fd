#include "vantage/evaluation/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "vantage/evaluation/statistics.hpp"

namespace vantage {
namespace {

constexpr double kSameStamp = 1e-6;  // [s]
constexpr std::size_t kResamples = 2000;

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

struct Quantity {
  const char *name, *column, *unit;
  double scale;  // from the column's unit
  int digits;
  Compared::Better better;
  bool tracked;  // of tracked scans only
};
constexpr std::array kQuantities{
    Quantity{"position error", "error_m", "cm", 100.0, 2, Compared::Better::less, true},
    Quantity{"rotation error", "error_deg", "°", 1.0, 3, Compared::Better::less, true},
    Quantity{"T_align", "T_align_ms", "ms", 1.0, 2, Compared::Better::less, false},
    Quantity{"stall", "stall_ms", "ms", 1.0, 2, Compared::Better::less, false},
    Quantity{"S_fitness", "fitness", "", 1.0, 4, Compared::Better::more, true},
    Quantity{"coverage", "coverage", "%", 100.0, 2, Compared::Better::more, true},
    Quantity{"NVTL", "NVTL", "", 1.0, 3, Compared::Better::more, true},
    Quantity{"LCP", "LCP", "1e-6", 1e6, 3, Compared::Better::more, true},
    Quantity{"map points", "N_point", "", 1.0, 0, Compared::Better::less, false},
    Quantity{"memory", "held_bytes", "MB", 1e-6, 2, Compared::Better::less, false}};

Compared compared(const Comparison& c, const Quantity& q) {
  Compared result{.name = q.name,
                  .column = q.column,
                  .unit = q.unit,
                  .digits = q.digits,
                  .better = q.better,
                  .pairs = {},
                  .a = {},
                  .b = {},
                  .interval = {},
                  .share_better = {}};
  const auto& a = c.a.columns.at(q.column);
  const auto& b = c.b.columns.at(q.column);
  std::vector<double> differences;
  std::size_t better = 0;
  for (std::size_t i = 0; i < c.pairs.size(); ++i) {
    const auto [at_a, at_b] = c.pairs[i];
    if (!a[at_a] || !b[at_b]) continue;
    if (q.tracked && (!c.a.tracked[at_a] || !c.b.tracked[at_b])) continue;
    const double x = q.scale * *a[at_a], y = q.scale * *b[at_b];
    result.pairs.push_back(i);
    result.a.push_back(x);
    result.b.push_back(y);
    differences.push_back(y - x);
    better += (q.better == Compared::Better::less ? y < x : y > x) ? 1 : 0;
  }
  if (differences.empty()) return result;
  result.mean_a = mean(result.a);
  result.mean_b = mean(result.b);
  result.difference = mean(differences);
  result.interval = bootstrap_mean(differences);
  result.share_better = static_cast<double>(better) / static_cast<double>(differences.size());
  return result;
}

void pair_up(Comparison& c) {
  std::size_t a = 0, b = 0;
  while (a < c.a.size() && b < c.b.size()) {
    const double ahead = c.a.stamps[a] - c.b.stamps[b];
    if (std::abs(ahead) <= kSameStamp) {
      c.pairs.push_back({a++, b++});
    } else if (ahead < 0.0) {
      c.only_a.push_back(c.a.stamps[a++]);
    } else {
      c.only_b.push_back(c.b.stamps[b++]);
    }
  }
  for (; a < c.a.size(); ++a) c.only_a.push_back(c.a.stamps[a]);
  for (; b < c.b.size(); ++b) c.only_b.push_back(c.b.stamps[b]);
}

std::string stamps_text(const std::vector<double>& stamps) {
  constexpr std::size_t kMost = 5;
  std::string text;
  for (std::size_t i = 0; i < std::min(stamps.size(), kMost); ++i) {
    text += fmt::format("{}{:.6g} s", i == 0 ? "" : ", ", stamps[i]);
  }
  return text + (stamps.size() > kMost ? ", ..." : "");
}

std::string with_unit(const Compared& q) {
  return q.unit.empty() ? q.name : fmt::format("{} [{}]", q.name, q.unit);
}

}  // namespace

Interval bootstrap_mean(std::span<const double> values) {
  std::mt19937_64 random(20260101);
  std::vector<double> means(kResamples);
  for (double& m : means) {
    double sum = 0.0;
    // The bias of the remainder is below n / 2^64.
    for (std::size_t i = 0; i < values.size(); ++i) sum += values[random() % values.size()];
    m = sum / static_cast<double>(values.size());
  }
  std::sort(means.begin(), means.end());
  return {percentile(means, 0.025), percentile(means, 0.975)};
}

Result<Comparison> compare(ScanTable a, ScanTable b) {
  Comparison c{.a = std::move(a),
               .b = std::move(b),
               .pairs = {},
               .only_a = {},
               .only_b = {},
               .quantities = {}};
  pair_up(c);
  if (c.pairs.empty()) {
    return fail(
        ErrorCode::invalid_input,
        fmt::format("the runs have no scan in common: stamps go from {} to {} s here, from {} "
                    "to {} s in {}",
                    c.b.stamps.front(), c.b.stamps.back(), c.a.stamps.front(), c.a.stamps.back(),
                    c.a.file.string()),
        SourceLocation{c.b.file.string(), c.b.lines.front(), 0});
  }
  for (const ScanPair& pair : c.pairs) {
    const auto count = [&](const ScanTable& table, std::size_t at, std::size_t run) {
      c.lost[run] += table.tracked[at] ? 0 : 1;
      c.switches[run] += at > 0 && table.columns.at("switched")[at].value_or(0.0) != 0.0 ? 1 : 0;
      c.blocking[run] += table.columns.at("blocked")[at].value_or(0.0) != 0.0 ? 1 : 0;
    };
    count(c.a, pair.a, 0);
    count(c.b, pair.b, 1);
  }
  for (const Quantity& q : kQuantities) {
    Compared result = compared(c, q);
    if (!result.pairs.empty()) c.quantities.push_back(std::move(result));
  }
  return c;
}

std::string pairing_text(const Comparison& c) {
  std::string text = fmt::format("{} scans in both", c.pairs.size());
  if (!c.only_a.empty()) {
    text += fmt::format("; only in A: {} ({})", c.only_a.size(), stamps_text(c.only_a));
  }
  if (!c.only_b.empty()) {
    text += fmt::format("; only in B: {} ({})", c.only_b.size(), stamps_text(c.only_b));
  }
  return text;
}

std::vector<std::vector<std::string>> rows_of(const Comparison& c) {
  std::vector<std::vector<std::string>> rows{
      {"", "scans", "A", "B", "B - A", "95 % interval", "B better [%]"}};
  for (const Compared& q : c.quantities) {
    const auto text = [&](double x, const char* sign = "") {
      return q.digits == 0 && std::abs(x) < 0.5
                 ? std::string("0")
                 : fmt::format("{}{:.{}f}", x > 0.0 ? sign : "", x, q.digits);
    };
    rows.push_back({with_unit(q), std::to_string(q.pairs.size()), text(q.mean_a), text(q.mean_b),
                    text(q.difference, "+"),
                    fmt::format("{} .. {}", text(q.interval.low, "+"), text(q.interval.high, "+")),
                    fmt::format("{:.1f}", 100.0 * q.share_better.value_or(0.0))});
  }
  const auto counts = [&](const char* name, const std::array<std::size_t, 2>& n) {
    rows.push_back(
        {name, std::to_string(c.pairs.size()), std::to_string(n[0]), std::to_string(n[1]),
         fmt::format("{:+d}", static_cast<long long>(n[1]) - static_cast<long long>(n[0])), "",
         ""});
  };
  counts("lost scans", c.lost);
  counts("switches", c.switches);
  counts("blocking loads", c.blocking);
  return rows;
}

}  // namespace vantage
