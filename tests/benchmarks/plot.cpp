#include "plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace vantage::benchmarks {
namespace {

constexpr double kLeft = 62.0, kRight = 26.0, kTop = 68.0, kBottom = 52.0;  // around a panel
constexpr double kNote = 20.0, kLegendY = 22.0, kLetter = 6.6,
                 kLineHeight = 14.0;  // of text, about

struct Look {
  const char *colour, *dash;
};
// Also told apart without colour: by dash and mark.
constexpr std::array<Look, kMostCurves> kLooks{{{"#1f5fa8", ""},
                                                {"#d1570a", "7 4"},
                                                {"#1b7837", "2 4"},
                                                {"#8e44ad", "10 3 2 3"},
                                                {"#a50f15", "4 2"},
                                                {"#555555", "1 3"}}};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '&': out += "&amp;"; break;
      default: out += c;
    }
  }
  return out;
}

std::string text(double x, double y, const std::string& words, const std::string& attributes) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" {}>{}</text>\n", x, y, attributes,
                     escaped(words));
}

std::string line(double x1, double y1, double x2, double y2, const char* attributes) {
  return fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x1, y1,
                     x2, y2, attributes);
}

std::string mark(std::size_t look, double x, double y, bool hollow = false) {
  constexpr std::array kShapes{"M-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0z",
                               "M-3.6-3.6h7.2v7.2h-7.2z",
                               "M0-5l4.6 8h-9.2z",
                               "M0-5l5 5l-5 5l-5-5z",
                               "M0 5l4.6-8h-9.2z",
                               "M-4-1.2h2.8v-2.8h2.4v2.8h2.8v2.4h-2.8v2.8h-2.4v-2.8h-2.8z"};
  const char* colour = kLooks[look].colour;
  return fmt::format(
      "<path transform=\"translate({:.1f} {:.1f})\" d=\"{}\" fill=\"{}\" stroke=\"{}\"/>\n", x, y,
      kShapes[look], hollow ? "#fff" : colour, colour);
}

std::string stroke(std::size_t look) {
  return fmt::format(
      "fill=\"none\" stroke=\"{}\" stroke-width=\"2\" stroke-linejoin=\"round\" "
      "stroke-dasharray=\"{}\"",
      kLooks[look].colour, kLooks[look].dash);
}

/// 0 at the first tick, 1 at the last; what lies outside is moved to the border.
double along(const Axis& axis, double value) {
  const auto scaled = [&](double v) { return axis.logarithmic ? std::log10(v) : v; };
  const double low = scaled(axis.ticks.front().value), high = scaled(axis.ticks.back().value);
  if (axis.logarithmic && value <= 0.0) return 0.0;
  return std::clamp((scaled(value) - low) / (high - low), 0.0, 1.0);
}

// White around the letters, so that lines do not cross them.
constexpr const char* kHalo = "paint-order=\"stroke\" stroke=\"#fff\" stroke-width=\"3\"";

/// From the least to the most of each mark; nothing for a curve without.
template <class X, class Y>
std::string band(const Curve& curve, std::size_t look, const X& x, const Y& y) {
  if (std::ranges::all_of(curve.marks, [](const Mark& m) { return m.least == m.most; })) return {};
  std::string points;
  for (const Mark& m : curve.marks) points += fmt::format("{:.1f},{:.1f} ", x(m.x), y(m.most));
  for (auto m = curve.marks.rbegin(); m != curve.marks.rend(); ++m) {
    points += fmt::format("{:.1f},{:.1f} ", x(m->x), y(m->least));
  }
  return fmt::format("<polygon points=\"{}\" fill=\"{}\" fill-opacity=\"0.2\"/>\n", points,
                     kLooks[look].colour);
}

struct Placed {
  double left, right, at;
};
double width_of(const std::string& words) { return kLetter * static_cast<double>(words.size()); }

/// The curves' names, from their first marks on but not beyond the right border, above the curve or
/// below it; moved on until none covers another text.
template <class X, class Y>
std::string names(const std::vector<Curve>& curves, std::vector<Placed> placed, double right,
                  const X& x, const Y& y) {
  std::string svg;
  for (std::size_t k = 0; k < curves.size(); ++k) {
    const Curve& curve = curves[k];
    if (curve.marks.empty()) continue;
    const double wide = width_of(curve.name) + 8.0, sign = curve.texts_below ? 1.0 : -1.0;
    const double left = std::min(x(curve.marks.front().x) - 4.0, right - wide);
    Placed name{left, left + wide, y(curve.marks.front().y)};
    for (const Mark& m : curve.marks) {
      if (x(m.x) < name.right) name.at = sign * std::max(sign * name.at, sign * y(m.y));
    }
    name.at += curve.texts_below ? 19.0 : -9.0;
    const auto covers = [&](const Placed& other) {
      return name.left < other.right && other.left < name.right &&
             std::abs(name.at - other.at) < kLineHeight;
    };
    while (std::ranges::any_of(placed, covers)) name.at += 0.25 * sign * kLineHeight;
    placed.push_back(name);
    svg += text(name.left, name.at, curve.name,
                fmt::format("fill=\"{}\" font-weight=\"600\" {}", kLooks[k].colour, kHalo));
  }
  return svg;
}

std::string drawn(const Panel& panel, double left, double width, double height) {
  const double right = left + width - kRight, bottom = height - kBottom;
  left += kLeft;
  const auto x = [&](double value) { return left + along(panel.x, value) * (right - left); };
  const auto y = [&](double value) { return bottom - along(panel.y, value) * (bottom - kTop); };

  std::string svg = text(0.5 * (left + right), kTop - (panel.names ? 34.0 : 12.0), panel.title,
                         "text-anchor=\"middle\" font-weight=\"600\"");
  for (const Tick& tick : panel.y.ticks) {
    svg += line(left, y(tick.value), right, y(tick.value), "stroke=\"#ddd\"");
    svg += text(left - 7.0, y(tick.value) + 4.0, tick.text, "text-anchor=\"end\"");
  }
  for (const Tick& tick : panel.x.ticks) {
    svg += line(x(tick.value), kTop, x(tick.value), bottom, "stroke=\"#eee\"");
    svg += text(x(tick.value), bottom + 17.0, tick.text, "text-anchor=\"middle\"");
  }
  svg += line(left, bottom, right, bottom, "stroke=\"#444\"");
  svg += line(left, kTop, left, bottom, "stroke=\"#444\"");
  svg += text(0.5 * (left + right), bottom + 38.0, panel.x.label, "text-anchor=\"middle\"");
  const double middle = 0.5 * (kTop + bottom);
  svg += text(left - 46.0, middle, panel.y.label,
              fmt::format("text-anchor=\"middle\" transform=\"rotate(-90 {:.1f} {:.1f})\"",
                          left - 46.0, middle));
  std::vector<Placed> texts;
  for (const Level& level : panel.levels) {
    texts.push_back({right - width_of(level.text), right, y(level.y) + 15.0});
    svg += line(left, y(level.y), right, y(level.y), "stroke=\"#111\" stroke-width=\"1.4\"");
    svg += text(right - 3.0, texts.back().at, level.text,
                fmt::format("text-anchor=\"end\" {}", kHalo));
  }
  for (std::size_t k = 0; k < panel.curves.size(); ++k) svg += band(panel.curves[k], k, x, y);
  for (std::size_t k = 0; k < panel.curves.size(); ++k) {
    svg += fmt::format("<polyline {} points=\"", stroke(k));
    for (const Mark& m : panel.curves[k].marks)
      svg += fmt::format("{:.1f},{:.1f} ", x(m.x), y(m.y));
    svg += "\"/>\n";
    for (const Mark& m : panel.curves[k].marks) {
      svg += mark(k, x(m.x), y(m.y), m.hollow);
      if (m.text.empty()) continue;
      svg += text(x(m.x), y(m.y) + (panel.curves[k].texts_below ? 18.0 : -9.0), m.text,
                  fmt::format("text-anchor=\"middle\" font-size=\"11\" fill=\"#555\" {}", kHalo));
    }
  }
  if (panel.names) svg += names(panel.curves, std::move(texts), right, x, y);
  return svg;
}

/// In the middle of the top.
std::string legend(const std::vector<Curve>& curves, double width) {
  constexpr double kLine = 34.0, kGap = 26.0;
  const auto wide = [](const Curve& curve) { return kLine + 6.0 + width_of(curve.name) + kGap; };
  double x = width + kGap;
  for (const Curve& curve : curves) x -= wide(curve);
  x *= 0.5;
  std::string svg;
  for (std::size_t k = 0; k < curves.size(); ++k) {
    svg += line(x, kLegendY, x + kLine, kLegendY, stroke(k).c_str());
    svg += mark(k, x + 0.5 * kLine, kLegendY);
    svg += text(x + kLine + 6.0, kLegendY + 4.5, curves[k].name, "");
    x += wide(curves[k]);
  }
  return svg;
}

}  // namespace

std::vector<Tick> ticks(const std::vector<double>& values) {
  std::vector<Tick> all;
  for (const double value : values) all.push_back({value, fmt::format("{:g}", value)});
  return all;
}

std::string to_svg(const std::vector<Panel>& panels, double width, double height,
                   const std::string& note) {
  // The background is drawn: a page may be dark.
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:g} {1:g}\" width=\"{0:g}\" "
      "height=\"{1:g}\" role=\"img\" font-family=\"system-ui, sans-serif\" font-size=\"12.5\" "
      "fill=\"#222\">\n<rect width=\"{0:g}\" height=\"{1:g}\" fill=\"#fff\"/>\n",
      width, height);
  if (!panels.front().names) svg += legend(panels.front().curves, width);
  if (!note.empty()) {
    height -= kNote;
    svg += text(0.5 * width, height + 8.0, note, "text-anchor=\"middle\" fill=\"#555\"");
  }
  const double each = width / static_cast<double>(panels.size());
  for (std::size_t k = 0; k < panels.size(); ++k) {
    svg += drawn(panels[k], static_cast<double>(k) * each, each, height);
  }
  return svg + "</svg>\n";
}

}  // namespace vantage::benchmarks
