#include "export/float_points.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace vantage::exporting {

std::vector<FloatPoint> rounded(PointsView points, const Point& origin) {
  std::vector<FloatPoint> rounded_points;
  rounded_points.reserve(points.size());
  for (const Point& p : points) rounded_points.push_back((p - origin).cast<float>());
  return rounded_points;
}

// It is measured apart from the rounding, because GCC 12 turns a vectorized float(x) that is at
// once converted back to double into x itself.
Result<double> rounding_of(PointsView points, const Point& origin,
                           std::span<const FloatPoint> rounded_points, const std::string& format,
                           const std::string& bundle) {
  double largest = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& p = points[i];
    const Point local = p - origin;
    const double rounding = (rounded_points[i].cast<double>() - local).cwiseAbs().maxCoeff();
    // Written so that infinity, which is not a float32, fails, too.
    if (!(rounding <= kMostRounding)) {
      return fail(ErrorCode::invalid_input,
                  fmt::format("{} hold float32, which would move the point ({:.3f}, {:.3f}, "
                              "{:.3f}) by {:.3g} m; give an origin near the map that is "
                              "subtracted: --origin X,Y,Z or --origin auto",
                              format, p.x(), p.y(), p.z(), rounding),
                  SourceLocation{bundle, 0, 0});
    }
    largest = std::max(largest, rounding);
  }
  return largest;
}

}  // namespace vantage::exporting
