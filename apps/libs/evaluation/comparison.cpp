#include "vantage/evaluation/comparison.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "terminal/counts.hpp"
#include "vantage/evaluation/metrics.hpp"
#include "vantage/evaluation/statistics.hpp"

namespace vantage {
namespace {

constexpr double kSameStamp = 1e-6;  // [s]
constexpr std::size_t kResamples = 2000;

std::optional<double> cell(const ScanTable& table, std::string_view column, std::size_t at) {
  return table.columns.find(column)->second[at];
}

/// What a metric counts at one scan; none if that is unknown.
std::optional<double> count_at(const Metric& metric, const ScanTable& table, std::size_t at) {
  if (at == 0 && metric.is(kAfterFirst)) return 0.0;
  if (!metric.is(kNotInFiles)) return cell(table, metric.key, at);
  // Such a count follows from the state and the error.
  RunScan scan;
  scan.report.tracking = table.tracking[at];
  scan.alert_limit = table.alert_limit;
  const auto metres = cell(table, "error_m", at), degrees = cell(table, "error_deg", at);
  if (metres && degrees) scan.error = PoseError{.metres = *metres, .degrees = *degrees};
  return metric.value(scan);
}

/// None if one of the runs has nothing to count.
std::optional<ComparedCount> counted(const Comparison& c, const Metric& metric) {
  ComparedCount n{.metric = &metric};
  bool in_a = false, in_b = false;
  for (const ScanPair& pair : c.pairs) {
    const auto a = count_at(metric, c.a, pair.a), b = count_at(metric, c.b, pair.b);
    n.a += static_cast<std::size_t>(a.value_or(0.0));
    n.b += static_cast<std::size_t>(b.value_or(0.0));
    in_a = in_a || a;
    in_b = in_b || b;
  }
  return in_a && in_b ? std::optional(n) : std::nullopt;
}

Compared compared(const Comparison& c, const Metric& metric) {
  Compared result{.metric = &metric};
  const auto& a = c.a.columns.find(metric.key)->second;
  const auto& b = c.b.columns.find(metric.key)->second;
  const double scale = metric.unit->scale;
  std::vector<double> differences;
  std::size_t better = 0;
  for (std::size_t i = 0; i < c.pairs.size(); ++i) {
    const auto [at_a, at_b] = c.pairs[i];
    if (!a[at_a] || !b[at_b]) continue;
    if (metric.is(kTrackedOnly) && (!c.a.is_tracked(at_a) || !c.b.is_tracked(at_b))) continue;
    const double x = scale * *a[at_a], y = scale * *b[at_b];
    result.pairs.push_back(i);
    result.a.push_back(x);
    result.b.push_back(y);
    differences.push_back(y - x);
    better += (metric.better == Better::less ? y < x : y > x) ? 1 : 0;
  }
  if (differences.empty()) return result;
  result.mean_a = statistics_of(result.a).mean;
  result.mean_b = statistics_of(result.b).mean;
  result.difference = statistics_of(differences).mean;
  result.interval = bootstrap_mean(differences);
  if (metric.better != Better::neither) {
    result.share_better = static_cast<double>(better) / static_cast<double>(differences.size());
  }
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
    text += fmt::format("{}{} s", i == 0 ? "" : ", ", stamps[i]);
  }
  return text + (stamps.size() > kMost ? ", ..." : "");
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
  Comparison c{.a = std::move(a), .b = std::move(b)};
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
  for (const Metric* metric : metrics_by_group()) {
    if (metric->is_count()) {
      if (const auto count = counted(c, *metric)) c.counts.push_back(*count);
      continue;
    }
    Compared result = compared(c, *metric);
    if (!result.pairs.empty()) c.quantities.push_back(std::move(result));
  }
  return c;
}

std::string pairing_text(const Comparison& c) {
  std::string text = cli::counted(c.pairs.size(), "scan") + " in both";
  if (!c.only_a.empty()) {
    text +=
        fmt::format("; only in A: {} ({})", cli::grouped(c.only_a.size()), stamps_text(c.only_a));
  }
  if (!c.only_b.empty()) {
    text +=
        fmt::format("; only in B: {} ({})", cli::grouped(c.only_b.size()), stamps_text(c.only_b));
  }
  return text;
}

std::vector<std::vector<std::string>> rows_of(const Comparison& c) {
  std::vector<std::vector<std::string>> rows{
      {"", "scans", "A", "B", "B - A", "95 % interval", "B better [%]"}};
  for (const Compared& q : c.quantities) {
    const auto text = [&](double x, const char* sign = "") {
      return q.metric->digits == 0 && std::abs(x) < 0.5
                 ? std::string("0")
                 : (x > 0.0 ? sign : "") + rounded(*q.metric, x);
    };
    rows.push_back({heading(*q.metric), cli::grouped(q.pairs.size()), text(q.mean_a),
                    text(q.mean_b), text(q.difference, "+"),
                    fmt::format("{} .. {}", text(q.interval.low, "+"), text(q.interval.high, "+")),
                    q.share_better ? fmt::format("{:.1f}", 100.0 * *q.share_better) : ""});
  }
  for (const ComparedCount& n : c.counts) {
    rows.push_back(
        {heading(*n.metric), cli::grouped(c.pairs.size()), cli::grouped(n.a), cli::grouped(n.b),
         fmt::format("{:+d}", static_cast<long long>(n.b) - static_cast<long long>(n.a)), "", ""});
  }
  return rows;
}

}  // namespace vantage
