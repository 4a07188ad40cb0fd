// One region that owns every point, but for the clause to be broken.
#include <cmath>
#include <cstdlib>
#include <limits>

#include "breaks.hpp"

namespace vantage::broken {
namespace {

class Broken final : public Partitioner {
 public:
  struct Params {
    double margin = 0.0;
    static auto schema() {
      return std::tuple{optional("margin", &Params::margin, "m",
                                 "how far the region reaches beyond", non_negative)};
    }
  };
  static Result<std::unique_ptr<Partitioner>> create(const Params&) {
    return std::make_unique<Broken>();
  }

  [[nodiscard]] Result<Partition> partition(const MapPasses& map, PointsView trajectory,
                                            const MapSurvey& survey) const noexcept override {
    if (breaks("exits")) std::_Exit(0);
    while (breaks("hangs")) std::this_thread::sleep_for(std::chrono::seconds(1));
    class Pieces final : public MapVisitor {
     public:
      [[nodiscard]] Result<void> see(PointsView points) noexcept override {
        if (breaks("P11")) seen.clear();  // looks at the last one only
        seen.insert(seen.end(), points.begin(), points.end());
        return {};
      }
      PointCloud seen;
    };
    return guarded([&]() -> Result<Partition> {
      if (offers_least()) {
        VANTAGE_TRY(const PointsView points, map.in_memory());
        return cut(points, trajectory);
      }
      Pieces pieces;
      VANTAGE_CHECK(map.pass(pieces));
      VANTAGE_TRY(Partition partition, cut(pieces.seen, trajectory));
      return breaks("P13") ? counted(partition, survey) : std::move(partition);
    });
  }

 private:
  [[nodiscard]] Result<Partition> cut(PointsView map, PointsView trajectory) const {
    if (breaks("P1") && map.empty()) return fail(ErrorCode::internal, "nothing to do");
    if (breaks("P7") && !map.empty() && !all_finite(map))
      return Partition::from({{"map", HalfOpenBox{{0, 0}, {200, 200}}, {}}});
    VANTAGE_CHECK(check_points(map, "the map"));
    if (breaks("P8") && trajectory.empty()) return fail(ErrorCode::internal, "index 0 of 0");

    const Bounds3 bounds = bounds_of(map);
    HalfOpenBox box{bounds.min.head<2>(), bounds.max.head<2>()};
    if (breaks("P9") && (box.min.array() == box.max.array()).any()) {
      return fail(ErrorCode::invalid_input, "the map has no area");
    }
    box.max = box.max.unaryExpr(
        [](double x) { return std::nextafter(x, std::numeric_limits<double>::infinity()); });
    // Single precision does near the origin, and loses half a metre of what is far from it.
    if (breaks("P2") && box.max.y() > 4e6)
      box.max = box.max.cast<float>().cast<double>() - Eigen::Vector2d(0.5, 0.5);

    std::string label = "map";
    if (breaks("P3")) label += std::to_string(instance_);
    if (breaks("P4")) label = box.min.x() < 0 ? "map/west" : "map";
    if (breaks("P5")) label += std::to_string(static_cast<int>(map.front().x()));
    if (breaks("P6") && Crowded(inside_)) label += "_2";
    if (breaks("P12") && threads_are_unusual()) label += "_part";

    std::vector<Region> regions{{label, box, {}}};
    if (breaks("P10")) {
      regions.push_back({"beside", HalfOpenBox{box.max, box.max + Eigen::Vector2d(20, 20)}, {}});
    }
    return Partition::from(std::move(regions));
  }

  /// Takes what is above enough for a number of points.
  [[nodiscard]] static Result<Partition> counted(const Partition& partition,
                                                 const MapSurvey& survey) {
    std::vector<Region> regions = partition.regions();
    VANTAGE_TRY(const auto seen, survey.observable_points(regions.front(), 100));
    regions.front().label += "_of_" + std::to_string(seen);
    return Partition::from(std::move(regions));
  }

  static inline std::atomic<int> instances_ = 0;
  int instance_ = ++instances_;
  mutable std::atomic<int> inside_ = 0;
};

}  // namespace
}  // namespace vantage::broken

VANTAGE_BROKEN_PLUGIN(vantage::Partitioner);
