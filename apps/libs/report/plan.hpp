#pragma once

#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

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

/// A box in plan view [m].
struct Extent {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;

  void see(const Eigen::Vector2d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  [[nodiscard]] bool empty() const { return !(low.array() <= high.array()).all(); }
};

/// A window around all of `low`..`high` with a border [m]. It is at least `least` [m] wide, and not
/// narrower than 1 to 2.5; the picture is at most as wide and high as given [px].
[[nodiscard]] PlanWindow window_around(const Eigen::Vector2d& low, const Eigen::Vector2d& high,
                                       double border, double least, double most_width,
                                       double most_height);

/// A window around the places of a drive, for a panel of a page; around the origin without any.
[[nodiscard]] PlanWindow window_of_drive(const Extent& drive);

/// The opening of a panel: a plan below one line of text.
/// @param title, note  as text; the note is shown smaller
[[nodiscard]] std::string plan_opening(const std::string& title, const std::string& note,
                                       const PlanWindow& window);
/// Closes the drawing that `plan_opening` opened.
[[nodiscard]] std::string plan_end();

/// A picture that several figures show; the page contains it only once.
[[nodiscard]] std::string shared_picture(const std::string& id, const PlanWindow& window,
                                         const std::string& png);

/// The points of a line in a plan, for an SVG polyline.
[[nodiscard]] std::string polyline_point(const Eigen::Vector2d& p, const PlanWindow& window);

/// Borders of regions, from the data of their outlines.
[[nodiscard]] std::string border_path(const std::string& outlines);

/// Marks in a plan: a dot, the ring of a switch of maps, the rhomb of an uncertain scan, the cross
/// of a lost one.
/// @param look  CSS classes
/// @param tip   as text
[[nodiscard]] std::string plan_dot(const Eigen::Vector2d& p, const PlanWindow& window,
                                   const std::string& look, double radius, const std::string& tip);
[[nodiscard]] std::string plan_ring(const Eigen::Vector2d& p, const PlanWindow& window,
                                    double radius, const std::string& tip);
[[nodiscard]] std::string plan_rhomb(const Eigen::Vector2d& p, const PlanWindow& window,
                                     const std::string& tip);
[[nodiscard]] std::string plan_cross(const Eigen::Vector2d& p, const PlanWindow& window,
                                     const std::string& tip);
/// What the ring, the rhomb, the cross and borders mean, as HTML.
[[nodiscard]] std::string legend_of_drive();

/// How densely points lie: black, and less transparent the more points there are, as
/// "data:image/png;...".
/// Errors: `internal` if the PNG library refuses the picture.
[[nodiscard]] Result<std::string> density_picture(PointsView points, const PlanWindow& window);

/// Points by height: the highest point of a pixel from violet (low) to yellow (high), more
/// transparent the fewer points there are.
/// @param low, high  the ends of the colour scale [m]
/// Errors: as above.
[[nodiscard]] Result<std::string> height_picture(PointsView points, const PlanWindow& window,
                                                 double low, double high);

/// The heights below which, and above which, half a percent of the points lie [m]; 0 and 1 without
/// points.
struct Heights {
  double low = 0.0, high = 1.0;
};
[[nodiscard]] Heights heights_of(PointsView points);

/// The colours of heights as stops of an SVG gradient.
[[nodiscard]] std::string height_gradient_stops();

/// The data of an SVG path around a footprint. Borders between boxes of one union are left out.
/// Empty if the footprint is outside the window.
[[nodiscard]] std::string outline(const Footprint& footprint, const PlanWindow& window);

/// The same as points in plan view [m]: pairs of line ends.
[[nodiscard]] std::vector<Eigen::Vector2d> outline_lines(const Footprint& footprint);

/// A bar of a round length, labelled with its length, in the lower left corner.
[[nodiscard]] std::string scale_bar(const PlanWindow& window);

}  // namespace vantage::report
