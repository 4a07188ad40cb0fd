#pragma once

#include <string>
#include <vector>

namespace vantage::benchmarks {

struct Tick {
  double value;
  std::string text;
};

/// Ticks bound the axis: the first is its least value, the last its greatest.
struct Axis {
  std::string label;  ///< with the unit
  std::vector<Tick> ticks;
  bool logarithmic = false;  ///< then every value is above 0
};

/// Values as ticks, written as short as they can be.
[[nodiscard]] std::vector<Tick> ticks(const std::vector<double>& values);

struct Mark {
  double x, y;
  std::string text{};          ///< beside it; may be empty
  double least = y, most = y;  ///< ends of the band around the curve
  bool hollow = false;
};

struct Curve {
  std::string name;
  std::vector<Mark> marks;   ///< joined in this order
  bool texts_below = false;  ///< their texts, instead of above; its name, see Panel::names
};

/// A horizontal line.
struct Level {
  double y;
  std::string text;  ///< below its right end
};

struct Panel {
  std::string title;
  Axis x, y;
  std::vector<Curve> curves;  ///< at most kMostCurves; alike in all panels of a plot
  std::vector<Level> levels{};
  bool names = false;  ///< of the curves are written beside their first marks: no legend
};
inline constexpr std::size_t kMostCurves = 6;

/// Panels side by side as an SVG that needs nothing but itself: axes with ticks and a grid, curves
/// that differ in colour, dash and mark, one legend over all. A mark outside the axes is drawn on
/// the border.
/// @param note  below all
/// Precondition: two ticks an axis, at least one panel.
[[nodiscard]] std::string to_svg(const std::vector<Panel>& panels, double width = 900.0,
                                 double height = 420.0, const std::string& note = {});

}  // namespace vantage::benchmarks
