#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <string>

#include "report/plan.hpp"

namespace vantage::page {

/// A box in plan view.
struct Extent {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;

  void see(const Eigen::Vector2d& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  [[nodiscard]] bool empty() const { return !(low.array() <= high.array()).all(); }
};

/// A picture that several figures show; the page contains it only once.
[[nodiscard]] std::string shared_picture(const std::string& id, const report::PlanWindow& window,
                                         const std::string& png);

/// The opening of a panel: a plan below one line of text.
/// @param title, note  as text; the note is shown smaller
[[nodiscard]] std::string plan_opening(const std::string& title, const std::string& note,
                                       const report::PlanWindow& window);
/// Closes the drawing that `plan_opening` opened.
[[nodiscard]] std::string plan_end();

/// The points of a line in a plan, for an SVG polyline.
[[nodiscard]] std::string polyline_point(const Eigen::Vector2d& p,
                                         const report::PlanWindow& window);

struct ErrorClass {
  double below_cm;
  const char* label;
};
/// Ordered from good to bad: the page's colours --e0 to --e4.
inline constexpr std::array kErrorClasses{
    ErrorClass{2.0, "below 2 cm"}, ErrorClass{5.0, "2 to 5 cm"}, ErrorClass{10.0, "5 to 10 cm"},
    ErrorClass{50.0, "10 to 50 cm"},
    ErrorClass{std::numeric_limits<double>::infinity(), "50 cm and more"}};
[[nodiscard]] std::size_t error_class_of(double cm);
/// A dot with its label for each class, as HTML.
[[nodiscard]] std::string error_class_legend();

}  // namespace vantage::page
