#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace vantage::report {

struct Tick {
  double value;
  std::string text;
};

/// An axis that begins and ends on a tick.
struct Axis {
  std::string label;  ///< including the unit
  std::vector<Tick> ticks;
  bool logarithmic = false;

  /// 0 at the first tick, 1 at the last; values outside are moved to the border.
  [[nodiscard]] double along(double value) const;
};

/// An axis with about `most` ticks, at 1, 2 or 5 times a power of ten, that enclose both ends.
/// Precondition: both ends are finite. If they are equal, the axis extends to both sides.
[[nodiscard]] Axis linear_axis(std::string label, double low, double high, std::size_t most = 6);

/// An axis with ticks at powers of ten, and also at 2 and 5 times these if there are few.
/// Precondition: 0 < low <= high, finite.
[[nodiscard]] Axis logarithmic_axis(std::string label, double low, double high);

/// An axis for a sample. It is logarithmic if the greatest values would leave the others no room,
/// and starts at 0 if the caller asks for it.
[[nodiscard]] Axis axis_over(std::string label, std::span<const double> sample, bool from_zero,
                             std::size_t most = 6);

/// An axis for integrity risks: logarithmic, up to 1. Risks below 1e-9 are drawn at its lower end.
[[nodiscard]] Axis risk_axis(std::span<const double> risks);

/// A sample as a box (Tukey): quartiles, linear between neighbours; whiskers extend to the last
/// values within 1.5 box lengths of the box.
struct Box {
  std::size_t count = 0;
  double low = 0, q1 = 0, median = 0, q3 = 0, high = 0, mean = 0;
  std::vector<double> outliers;  ///< beyond the whiskers, ascending
};
[[nodiscard]] Box box_of(std::span<const double> sample);

/// At most about `most` points that look like all of them: the least and the greatest of each piece
/// of the axis. Points that are not finite divide a curve, and are kept.
[[nodiscard]] std::vector<Eigen::Vector2d> thinned(std::vector<Eigen::Vector2d> points,
                                                   std::size_t most);

/// The share of a sample at or below each of its values, as a curve.
[[nodiscard]] std::vector<Eigen::Vector2d> cumulative(std::span<const double> sample);

enum class Marker { disc, ring, square, triangle, diamond };

/// How a curve or a row looks: the colour says whose it is; marker and dash say which of theirs.
struct Look {
  std::size_t colour = 0;
  Marker marker = Marker::disc;
};

struct Curve {
  std::string name;
  Look look;
  std::vector<Eigen::Vector2d> points;  ///< joined in this order; a non-finite point is a gap
  bool marked = false;                  ///< a marker at each point instead of a line
};

struct LinePanel {
  std::string title;
  Axis x, y;
  std::vector<Curve> curves;
};
/// @param height  of the axes' area, without the legend
[[nodiscard]] std::string to_svg(const LinePanel& panel, double width = 560.0,
                                 double height = 240.0);

/// A sample of one row.
struct Row {
  std::string name;
  Look look;
  bool beneath = false;  ///< belongs to the last row above it for which this is false
  std::vector<double> sample;
  std::vector<std::string> tips = {};  ///< one per value; empty: none
};

enum class RowStyle {
  boxes,  ///< a box, with the mean as a diamond
  dots,   ///< every value, with the mean as a line
};

/// Rows below each other, with their names on the left.
struct RowPanel {
  std::string title;
  Axis x;
  std::vector<Row> rows;
  RowStyle style = RowStyle::boxes;
};
[[nodiscard]] std::string to_svg(const RowPanel& panel, double width = 560.0);

/// "var(--c0)": the colour of a configuration on the page.
[[nodiscard]] std::string colour(std::size_t number);

/// A name that fits: cut in the middle.
[[nodiscard]] std::string shortened(const std::string& name, std::size_t most);

}  // namespace vantage::report
