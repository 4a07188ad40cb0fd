#pragma once

#include <Eigen/Core>
#include <string>

#include "vantage/partition.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::report {

/// A window onto the map from above, as a picture: x to the right, y up.
struct PlanWindow {
  Eigen::Vector2d min, max;  ///< map frame [m]
  double width = 900.0;      ///< of the picture [px]

  [[nodiscard]] double pixels_per_metre() const { return width / (max - min).x(); }
  [[nodiscard]] double height() const { return (max - min).y() * pixels_per_metre(); }
  [[nodiscard]] double x(double metres) const { return (metres - min.x()) * pixels_per_metre(); }
  [[nodiscard]] double y(double metres) const { return (max.y() - metres) * pixels_per_metre(); }
};

/// Around all of `low`..`high` with a border [m], not narrower than `least` [m] nor more slender
/// than 1 to 2.5; width and height at most as given [px].
[[nodiscard]] PlanWindow window_around(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                                       double border, double least, double most_width,
                                       double most_height);

/// How densely points lie: black, the more of them the less transparent, as "data:image/png;...".
/// Errors: `internal` for what the PNG library refuses.
[[nodiscard]] Result<std::string> density_picture(PointsView points, const PlanWindow& window);

/// Points by height: the highest of a pixel from violet (low) to yellow (high), the fewer there
/// are the more transparent.
/// @param low, high  the ends of the colours [m]
/// Errors: as above.
[[nodiscard]] Result<std::string> height_picture(PointsView points, const PlanWindow& window,
                                                 double low, double high);

/// Where half a percent of the points lie below, and above [m]; 0 and 1 for no points.
struct Heights {
  double low = 0.0, high = 1.0;
};
[[nodiscard]] Heights heights_of(PointsView points);

/// The colours of heights as stops of an SVG gradient.
[[nodiscard]] std::string height_gradient_stops();

/// The data of an SVG path around a footprint; the border between boxes of a union is left out.
/// Empty if the footprint is outside the window.
[[nodiscard]] std::string outline(const Footprint& footprint, const PlanWindow& window);

/// The same as points in the plan [m]: pairs of ends of lines.
[[nodiscard]] std::vector<Eigen::Vector2d> outline_lines(const Footprint& footprint);

/// A bar of a round length with its length beside it, in the lower left corner.
[[nodiscard]] std::string scale_bar(const PlanWindow& window);

}  // namespace vantage::report
