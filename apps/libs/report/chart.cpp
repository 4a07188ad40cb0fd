#include "report/chart.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>

#include "report/html.hpp"
#include "vantage/evaluation/statistics.hpp"

namespace vantage::report {
namespace {

constexpr std::size_t kColours = 8;
constexpr double kLetter = 6.6;  // approximate width of a letter at 12 px
constexpr double kRow = 20.0;

std::vector<double> sorted_finite(std::span<const double> sample) {
  std::vector<double> values;
  std::copy_if(sample.begin(), sample.end(), std::back_inserter(values),
               [](double x) { return std::isfinite(x); });
  std::sort(values.begin(), values.end());
  return values;
}

bool finite(const Eigen::Vector2d& p) { return p.allFinite(); }

const char* dash(Marker marker) {
  switch (marker) {
    case Marker::disc: return "";
    case Marker::ring: return " stroke-dasharray=\"2 3\"";
    case Marker::square: return " stroke-dasharray=\"7 3\"";
    case Marker::triangle: return " stroke-dasharray=\"7 3 2 3\"";
    case Marker::diamond: return " stroke-dasharray=\"12 3\"";
  }
  return "";
}

std::string mark(Look look, double x, double y, double size, const std::string& tip = {}) {
  const std::string paint =
      look.marker == Marker::disc
          ? fmt::format("fill=\"{}\"", colour(look.colour))
          : fmt::format("fill=\"var(--card)\" stroke=\"{}\"", colour(look.colour));
  const std::string title = tip.empty() ? "" : "<title>" + escaped(tip) + "</title>";
  const auto path = [&](const std::string& d) {
    return fmt::format("<path d=\"{}\" {}>{}</path>", d, paint, title);
  };
  switch (look.marker) {
    case Marker::disc:
    case Marker::ring:
      return fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{:.1f}\" {}>{}</circle>", x, y,
                         size, paint, title);
    case Marker::square:
      return path(
          fmt::format("M{0:.1f} {1:.1f}h{2:.1f}v{2:.1f}h-{2:.1f}z", x - size, y - size, 2 * size));
    case Marker::triangle:
      return path(fmt::format("M{:.1f} {:.1f}l{:.1f} {:.1f}h-{:.1f}z", x, y - 1.2 * size,
                              1.1 * size, 2.1 * size, 2.2 * size));
    case Marker::diamond:
      return path(
          fmt::format("M{0:.1f} {1:.1f}l{2:.1f} {2:.1f}l-{2:.1f} {2:.1f}l-{2:.1f} -{2:.1f}z", x,
                      y - 1.3 * size, 1.3 * size));
  }
  return {};
}

std::string text(double x, double y, const std::string& words, const char* look,
                 const char* anchor = "start") {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" class=\"{}\" text-anchor=\"{}\">{}</text>\n",
                     x, y, look, anchor, escaped(words));
}

std::string opening(const std::string& title, double width, double height) {
  return fmt::format(
      "<svg viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\" "
      "xmlns=\"http://www.w3.org/2000/svg\">\n",
      width, height, escaped(title));
}

struct Area {
  double left, top, right, bottom;
  [[nodiscard]] double x(const Axis& axis, double v) const {
    return left + axis.along(v) * (right - left);
  }
  [[nodiscard]] double y(const Axis& axis, double v) const {
    return bottom - axis.along(v) * (bottom - top);
  }
};

std::string x_axis(const Axis& axis, const Area& area) {
  std::string svg;
  double last = -1e9;
  for (const Tick& tick : axis.ticks) {
    const double x = area.x(axis, tick.value);
    svg += fmt::format("<path class=\"grid\" d=\"M{0:.1f} {1:.1f}V{2:.1f}\"/>", x, area.top,
                       area.bottom);
    const double half = 0.5 * kLetter * static_cast<double>(tick.text.size());
    if (x - half < last + 5.0) continue;  // labels must never touch
    svg += text(x, area.bottom + 15.0, tick.text, "tick", "middle");
    last = x + half;
  }
  return svg +
         text(0.5 * (area.left + area.right), area.bottom + 33.0, axis.label, "soft", "middle");
}

std::string y_axis(const Axis& axis, const Area& area) {
  std::string svg;
  for (const Tick& tick : axis.ticks) {
    const double y = area.y(axis, tick.value);
    svg +=
        fmt::format("<path class=\"grid\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>", area.left, y, area.right);
    svg += text(area.left - 6.0, y + 4.0, tick.text, "tick", "end");
  }
  return svg;
}

struct LegendItem {
  const Curve* curve;
  double x, y;
};

std::vector<LegendItem> legend(const std::vector<Curve>& curves, double left, double right,
                               double y) {
  std::vector<LegendItem> items;
  double x = left;
  for (const Curve& curve : curves) {
    const double width = 46.0 + kLetter * static_cast<double>(shortened(curve.name, 26).size());
    if (x > left && x + width > right) {
      x = left;
      y += 18.0;
    }
    items.push_back({&curve, x, y});
    x += width;
  }
  return items;
}

std::string path_of(const std::vector<Eigen::Vector2d>& points, const LinePanel& panel,
                    const Area& area) {
  std::string d;
  bool pen_down = false;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d& p = points[i];
    if (!finite(p)) {
      pen_down = false;
      continue;
    }
    d += fmt::format("{}{:.1f} {:.1f}", pen_down ? 'L' : 'M', area.x(panel.x, p.x()),
                     area.y(panel.y, p.y()));
    // A point between two gaps is shown as a dot.
    if (!pen_down && (i + 1 == points.size() || !finite(points[i + 1]))) d += "h0.1";
    pen_down = true;
  }
  return d;
}

std::string drawn(const Curve& curve, const LinePanel& panel, const Area& area) {
  if (curve.marked) {
    std::string svg;
    for (const Eigen::Vector2d& p : curve.points) {
      if (finite(p)) svg += mark(curve.look, area.x(panel.x, p.x()), area.y(panel.y, p.y()), 3.0);
    }
    return svg + "\n";
  }
  return fmt::format("<path class=\"line\" stroke=\"{}\"{} d=\"{}\"/>\n", colour(curve.look.colour),
                     dash(curve.look.marker), path_of(thinned(curve.points, 500), panel, area));
}

std::string number(double x) {
  const double size = std::abs(x);
  return size >= 1000.0 ? fmt::format("{:.0f}", x)
         : size >= 0.01 ? fmt::format("{:.4g}", x)
                        : fmt::format("{:.3g}", x);
}

std::string box_svg(const Row& row, const Axis& axis, const Area& area, double y) {
  const Box box = box_of(row.sample);
  if (box.count == 0) return text(area.left + 6.0, y + 4.0, "none", "soft");
  const double half = row.beneath ? 4.0 : 6.5;
  const auto x = [&](double v) { return area.x(axis, v); };
  const std::string c = colour(row.look.colour);
  std::string svg = fmt::format(
      "<g stroke=\"{}\" fill=\"none\"><path stroke-width=\"1.2\" d=\"M{:.1f} {:.1f}H{:.1f}M{:.1f} "
      "{:.1f}H{:.1f}M{:.1f} {:.1f}v{:.1f}M{:.1f} {:.1f}v{:.1f}\"/>",
      c, x(box.low), y, x(box.q1), x(box.q3), y, x(box.high), x(box.low), y - 0.6 * half,
      1.2 * half, x(box.high), y - 0.6 * half, 1.2 * half);
  svg += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"{}\" "
      "fill-opacity=\"{}\" stroke-width=\"1.2\"/><path stroke-width=\"2.4\" d=\"M{:.1f} "
      "{:.1f}v{:.1f}\"/></g>",
      x(box.q1), y - half, std::max(0.5, x(box.q3) - x(box.q1)), 2 * half, c,
      row.beneath ? "0" : "0.28", x(box.median), y - half, 2 * half);
  // Values that fall onto one place are drawn only once.
  double last = -1e9;
  for (const double v : box.outliers) {
    const double at = x(v);
    if (at - last < 1.0) continue;
    last = at;
    svg += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"1.3\" fill=\"{}\" "
        "fill-opacity=\"0.6\"/>",
        at, y, c);
  }
  svg += mark({row.look.colour, row.beneath ? row.look.marker : Marker::diamond}, x(box.mean), y,
              row.beneath ? 3.0 : 3.2);
  // The whole row reacts to the pointer.
  return svg +
         fmt::format(
             "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" "
             "fill=\"transparent\" stroke=\"none\"><title>{}\nmean {}, median {}\nhalf of all: {} "
             "to {}\n"
             "least {}, greatest {}\n{} values</title></rect>\n",
             area.left, y - 0.5 * kRow, area.right - area.left, kRow, escaped(row.name),
             number(box.mean), number(box.median), number(box.q1), number(box.q3),
             number(box.outliers.empty() ? box.low : std::min(box.low, box.outliers.front())),
             number(box.outliers.empty() ? box.high : std::max(box.high, box.outliers.back())),
             box.count);
}

std::string dots_svg(const Row& row, const Axis& axis, const Area& area, double y) {
  if (row.sample.empty()) return text(area.left + 6.0, y + 4.0, "none", "soft");
  std::string svg;
  double sum = 0.0;
  for (std::size_t i = 0; i < row.sample.size(); ++i) {
    sum += row.sample[i];
    // Neighbours are set apart, so that dots at one place can be distinguished.
    const double aside = 1.7 * static_cast<double>(static_cast<int>(i % 5) - 2);
    svg += fmt::format("<g fill-opacity=\"0.65\">{}</g>",
                       mark(row.look, area.x(axis, row.sample[i]), y + aside, 2.4,
                            i < row.tips.size() ? row.tips[i] : ""));
  }
  const double mean = area.x(axis, sum / static_cast<double>(row.sample.size()));
  return svg + fmt::format(
                   "<path stroke=\"var(--ink)\" stroke-width=\"2\" d=\"M{:.1f} {:.1f}v{:.1f}\"/>\n",
                   mean, y - 7.5, 15.0);
}

}  // namespace

Axis axis_over(std::string label, std::span<const double> sample, bool from_zero,
               std::size_t most) {
  const std::vector<double> values = sorted_finite(sample);
  if (values.empty()) return linear_axis(std::move(label), 0.0, 1.0, most);
  const double low = values.front(), high = values.back();
  const double middle = percentile(values, 0.5);
  if (low >= 0.0 && middle > 0.0 && high > 25.0 * middle) {
    // A few values near 0 would stretch the axis over decades without values.
    const double least = std::max({low, percentile(values, 0.02), 1e-4 * middle});
    return logarithmic_axis(std::move(label), least, high);
  }
  return linear_axis(std::move(label), from_zero ? std::min(0.0, low) : low, high, most);
}

Axis risk_axis(std::span<const double> risks) {
  double least = 0.1;
  for (const double risk : risks) least = std::min(least, std::max(risk, 1e-9));
  return logarithmic_axis("integrity risk, less is better", least, 1.0);
}

Box box_of(std::span<const double> sample) {
  const std::vector<double> values = sorted_finite(sample);
  Box box{.count = values.size(), .outliers = {}};
  if (values.empty()) return box;
  box.q1 = percentile(values, 0.25);
  box.median = percentile(values, 0.5);
  box.q3 = percentile(values, 0.75);
  box.mean =
      std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  const double reach = 1.5 * (box.q3 - box.q1);
  box.low = box.q1;
  box.high = box.q3;
  for (const double v : values) {
    if (v < box.q1 - reach || v > box.q3 + reach) {
      box.outliers.push_back(v);
    } else {
      box.low = std::min(box.low, v);
      box.high = std::max(box.high, v);
    }
  }
  return box;
}

std::vector<Eigen::Vector2d> thinned(std::vector<Eigen::Vector2d> points, std::size_t most) {
  if (points.size() <= most || most < 2) return points;
  const std::size_t pieces = most / 2;
  std::vector<Eigen::Vector2d> kept;
  for (std::size_t k = 0; k < pieces; ++k) {
    const std::size_t begin = k * points.size() / pieces, end = (k + 1) * points.size() / pieces;
    std::size_t least = begin, greatest = begin;
    std::optional<std::size_t> gap;
    for (std::size_t i = begin; i < end; ++i) {
      if (!finite(points[i])) {
        gap = i;
        continue;
      }
      if (!finite(points[least]) || points[i].y() < points[least].y()) least = i;
      if (!finite(points[greatest]) || points[i].y() > points[greatest].y()) greatest = i;
    }
    std::vector<std::size_t> chosen{least, greatest};
    if (gap) chosen.push_back(*gap);
    std::sort(chosen.begin(), chosen.end());
    chosen.erase(std::unique(chosen.begin(), chosen.end()), chosen.end());
    for (const std::size_t i : chosen) kept.push_back(points[i]);
  }
  return kept;
}

std::vector<Eigen::Vector2d> cumulative(std::span<const double> sample) {
  const std::vector<double> values = sorted_finite(sample);
  std::vector<Eigen::Vector2d> curve;
  for (std::size_t i = 0; i < values.size(); ++i) {
    curve.emplace_back(values[i], static_cast<double>(i + 1) / static_cast<double>(values.size()));
  }
  return curve;
}

std::string colour(std::size_t number) { return fmt::format("var(--c{})", number % kColours); }

std::string shortened(const std::string& name, std::size_t most) {
  if (name.size() <= most) return name;
  // The bytes of one character stay together.
  const auto within = [&](std::size_t i) {
    return i < name.size() && (static_cast<unsigned char>(name[i]) & 0xC0U) == 0x80U;
  };
  std::size_t head = most / 2, tail = name.size() - (most - most / 2 - 1);
  while (head > 0 && within(head)) --head;
  while (within(tail)) ++tail;
  return name.substr(0, head) + "…" + name.substr(tail);
}

std::string to_svg(const LinePanel& panel, double width, double height) {
  std::size_t widest = 1;
  for (const Tick& tick : panel.y.ticks) widest = std::max(widest, tick.text.size());
  const double left = 14.0 + kLetter * static_cast<double>(widest);
  const auto items = legend(panel.curves, 4.0, width - 4.0, 36.0);
  const double top = (items.empty() ? 36.0 : items.back().y) + 34.0;
  const Area area{left, top, width - 14.0, top + height};
  std::string svg = opening(panel.title, width, area.bottom + 42.0);
  svg += text(4.0, 16.0, panel.title, "title");
  for (const LegendItem& item : items) {
    const Curve& c = *item.curve;
    svg += c.marked ? mark(c.look, item.x + 13.0, item.y - 4.0, 3.5)
                    : fmt::format("<path class=\"line\" stroke=\"{}\"{} d=\"M{:.1f} {:.1f}h26\"/>",
                                  colour(c.look.colour), dash(c.look.marker), item.x, item.y - 4.0);
    svg += text(item.x + 32.0, item.y, shortened(c.name, 26), "soft");
  }
  svg += text(4.0, top - 10.0, panel.y.label, "soft");
  svg += y_axis(panel.y, area) + x_axis(panel.x, area);
  svg += fmt::format("<path class=\"axis\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>\n", area.left, area.bottom,
                     area.right);
  // The curves of a configuration lie above those of its baselines.
  for (auto curve = panel.curves.rbegin(); curve != panel.curves.rend(); ++curve) {
    svg += drawn(*curve, panel, area);
  }
  return svg + "</svg>\n";
}

std::string to_svg(const RowPanel& panel, double width) {
  constexpr std::size_t kMost = 22;
  std::size_t widest = 4;
  for (const Row& row : panel.rows) {
    widest = std::max(widest, shortened(row.name, kMost).size() + (row.beneath ? 3U : 0U));
  }
  const double left = 28.0 + kLetter * static_cast<double>(widest);
  double height = 0.0;
  std::vector<double> rows;
  for (const Row& row : panel.rows) {
    height += row.beneath || rows.empty() ? 0.0 : 7.0;
    rows.push_back(height + 0.5 * kRow);
    height += kRow;
  }
  const Area area{left, 30.0, width - 18.0, 30.0 + height + 6.0};
  std::string svg = opening(panel.title, width, area.bottom + 42.0);
  svg += text(4.0, 16.0, panel.title, "title");
  svg += x_axis(panel.x, area);
  svg += fmt::format("<path class=\"axis\" d=\"M{:.1f} {:.1f}H{:.1f}\"/>\n", area.left, area.bottom,
                     area.right);
  for (std::size_t i = 0; i < panel.rows.size(); ++i) {
    const Row& row = panel.rows[i];
    const double y = area.top + 3.0 + rows[i];
    svg += mark(row.look, 9.0 + (row.beneath ? 12.0 : 0.0), y, row.beneath ? 3.0 : 4.0);
    svg += text(19.0 + (row.beneath ? 12.0 : 0.0), y + 4.0, shortened(row.name, kMost),
                row.beneath ? "soft" : "");
    svg += panel.style == RowStyle::boxes ? box_svg(row, panel.x, area, y)
                                          : dots_svg(row, panel.x, area, y);
  }
  return svg + "</svg>\n";
}

}  // namespace vantage::report
