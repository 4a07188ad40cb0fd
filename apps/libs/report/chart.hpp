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

/// An axis with its ends on ticks.
struct Axis {
  std::string label;  ///< with the unit
  std::vector<Tick> ticks;
  bool logarithmic = false;

  /// 0 at the first tick, 1 at the last; what lies outside is moved to the border.
  [[nodiscard]] double along(double value) const;
};

/// Ticks at 1, 2 or 5 times a power of ten that enclose both ends; about `most` of them.
/// Precondition: finite ends. Ends that are equal get an axis around them.
[[nodiscard]] Axis linear_axis(std::string label, double low, double high, std::size_t most = 6);

/// Ticks at powers of ten, and at 2 and 5 times them where there are few.
/// Precondition: 0 < low <= high, finite.
[[nodiscard]] Axis logarithmic_axis(std::string label, double low, double high);

/// An axis over a sample: logarithmic if its greatest values would leave the others no room, from 0
/// if that is asked for.
[[nodiscard]] Axis axis_over(std::string label, std::span<const double> sample, bool from_zero,
                             std::size_t most = 6);

/// A sample as a box (Tukey): quartiles, linear between neighbours; whiskers to the last values
/// within 1.5 times the box from it.
struct Box {
  std::size_t count = 0;
  double low = 0, q1 = 0, median = 0, q3 = 0, high = 0, mean = 0;
  std::vector<double> outliers;  ///< beyond the whiskers, ascending
};
[[nodiscard]] Box box_of(std::span<const double> sample);

/// At most about `most` points that look like all of them: of each piece of the way, the least and
/// the greatest. Points that are not finite part a curve, and stay.
[[nodiscard]] std::vector<Eigen::Vector2d> thinned(std::vector<Eigen::Vector2d> points,
                                                   std::size_t most);

/// The share of a sample at or below each of its values, as a curve.
[[nodiscard]] std::vector<Eigen::Vector2d> cumulative(std::span<const double> sample);

enum class Marker { disc, ring, square, triangle, diamond };

/// Who a curve or a row belongs to: the colour; and which of theirs it is: marker and dash.
struct Look {
  std::size_t colour = 0;
  Marker marker = Marker::disc;
};

struct Curve {
  std::string name;
  Look look;
  std::vector<Eigen::Vector2d> points;  ///< joined in this order; not finite: a gap
  bool marked = false;                  ///< a marker at each point instead of a line
};

struct LinePanel {
  std::string title;
  Axis x, y;
  std::vector<Curve> curves;
};
/// @param height  of the axes' area; the legend comes on top of it
[[nodiscard]] std::string to_svg(const LinePanel& panel, double width = 560.0,
                                 double height = 240.0);

/// A sample of one row.
struct Row {
  std::string name;
  Look look;
  bool beneath = false;  ///< belongs to the row above that is not
  std::vector<double> sample;
  std::vector<std::string> tips = {};  ///< of each value; empty: none
};

enum class RowStyle {
  boxes,  ///< a box, its mean as a diamond
  dots,   ///< every value, their mean as a line
};

/// Rows one below the other, names on the left.
struct RowPanel {
  std::string title;
  Axis x;
  std::vector<Row> rows;
  RowStyle style = RowStyle::boxes;
};
[[nodiscard]] std::string to_svg(const RowPanel& panel, double width = 560.0);

/// "var(--c0)": the colour of a configuration on the page.
[[nodiscard]] std::string colour(std::size_t number);

/// A name that fits: cut in its middle.
[[nodiscard]] std::string shortened(const std::string& name, std::size_t most);

}  // namespace vantage::report
