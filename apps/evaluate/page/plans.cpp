#include "evaluate/page/plans.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "report/html.hpp"

namespace vantage::page {

namespace {

using report::escaped;
using report::PlanWindow;

}  // namespace

std::string shared_picture(const std::string& id, const PlanWindow& window,
                           const std::string& png) {
  return fmt::format(
      "<svg width=\"0\" height=\"0\" class=\"shared\" aria-hidden=\"true\"><defs><image id=\"{}\" "
      "width=\"{:.0f}\" height=\"{:.1f}\" href=\"{}\" "
      "style=\"image-rendering:auto\"/></defs></svg>\n",
      id, window.width, window.height(), png);
}

std::string plan_opening(const std::string& title, const std::string& note,
                         const PlanWindow& window) {
  constexpr double kHead = 26.0;
  std::string svg = fmt::format(
      "<svg class=\"plan\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" aria-label=\"{}\" "
      "xmlns=\"http://www.w3.org/2000/svg\">\n",
      window.width, window.height() + kHead, escaped(title));
  svg += fmt::format(
      "<text class=\"title\" x=\"2\" y=\"16\">{}<tspan class=\"soft\" "
      "dx=\"8\">{}</tspan></text>\n",
      escaped(report::shortened(title, 40)), escaped(note));
  svg += fmt::format("<svg y=\"{:.0f}\" width=\"{:.0f}\" height=\"{:.1f}\">\n", kHead, window.width,
                     window.height());
  return svg + fmt::format("<rect class=\"frame\" width=\"{:.0f}\" height=\"{:.1f}\"/>\n",
                           window.width, window.height());
}

std::string plan_end() { return "</svg></svg>\n"; }

std::string polyline_point(const Eigen::Vector2d& p, const PlanWindow& window) {
  return fmt::format("{:.1f},{:.1f} ", window.x(p.x()), window.y(p.y()));
}

std::size_t error_class_of(double cm) {
  std::size_t k = 0;
  while (k + 1 < kErrorClasses.size() && cm >= kErrorClasses[k].below_cm) ++k;
  return k;
}

std::string error_class_legend() {
  std::string html;
  for (std::size_t k = 0; k < kErrorClasses.size(); ++k) {
    html += fmt::format("<span><i class=\"dot e{}\"></i>{}</span> ", k, kErrorClasses[k].label);
  }
  return html;
}

}  // namespace vantage::page
