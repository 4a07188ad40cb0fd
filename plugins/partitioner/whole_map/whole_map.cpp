#include <cmath>
#include <limits>
#include <memory>

#include "vantage/plugin.hpp"

namespace {

using vantage::ErrorCode, vantage::fail, vantage::PointsView, vantage::Result;

/// One region that owns every point: the wide-area map as the paper compares it.
class WholeMap final : public vantage::Partitioner {
 public:
  struct Params {
    double margin = 0.0;
    static constexpr auto schema() {
      return std::tuple{vantage::optional("margin", &Params::margin, "m",
                                          "how far the region reaches beyond the map's points",
                                          vantage::non_negative)};
    }
  };

  static Result<std::unique_ptr<vantage::Partitioner>> create(const Params& params) {
    return std::make_unique<WholeMap>(params);
  }
  explicit WholeMap(const Params& params) : params_(params) {}

  [[nodiscard]] Result<vantage::Partition> partition(
      PointsView map, PointsView, const vantage::MapSurvey&) const noexcept override {
    return vantage::guarded([&]() -> Result<vantage::Partition> {
      VANTAGE_CHECK(vantage::check_points(map, "the map"));
      const vantage::Bounds3 bounds = vantage::bounds_of(map);
      const Eigen::Vector2d margin = Eigen::Vector2d::Constant(params_.margin);
      // The box is half-open: it extends one step further, so that it also owns the greatest point.
      const Eigen::Vector2d max = (bounds.max.head<2>() + margin).unaryExpr([](double x) {
        return std::nextafter(x, std::numeric_limits<double>::infinity());
      });
      return vantage::Partition::from(
          {{.label = "map",
            .footprint = vantage::HalfOpenBox{bounds.min.head<2>() - margin, max},
            .height = {}}});
    });
  }

 private:
  Params params_;
};

}  // namespace

VANTAGE_PLUGIN(vantage::Partitioner, WholeMap, "whole_map", "one region that owns every point");
