#include "vantage/build/outliers.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vantage/kit/neighbour_distances.hpp"

namespace vantage {
namespace {

// Distances are summed as whole numbers of this unit, so that the sums do not depend on the order.
constexpr double kUnit = 0x1p-24;    // [m]
constexpr double kLongest = 0x1p45;  // of a distance [units]: 2000 km

__extension__ using Whole = unsigned __int128;  // NOLINT: no other type holds the sum of squares

/// The mean and the standard deviation of distances, and what follows from them.
class Spread {
 public:
  [[nodiscard]] static std::uint64_t units(double distance) {
    return static_cast<std::uint64_t>(std::llround(std::min(distance / kUnit, kLongest)));
  }
  void add(std::uint64_t units) {
    ++count_;
    sum_ += units;
    squares_ += Whole{units} * units;
  }
  /// A point with a larger distance is an outlier [units]; below 0 if all points are outliers.
  [[nodiscard]] double limit(double ratio) const {
    const auto n = static_cast<double>(count_);
    const double mean = static_cast<double>(sum_) / n;
    if (count_ < 2) return mean + 1.0;
    const double squares = static_cast<double>(squares_) - static_cast<double>(sum_) * mean;
    const double deviation = std::sqrt(std::max(squares, 0.0) / (n - 1.0));
    return mean + ratio * deviation + 1.0;  // equal distances stay, however the mean is rounded
  }

 private:
  std::uint64_t count_ = 0;
  Whole sum_ = 0, squares_ = 0;
};

}  // namespace

IndexList without_outliers(PointsView points, const OutlierParams& params) {
  Spread spread;
  std::vector<std::uint64_t> units;
  units.reserve(points.size());
  for (const double distance : neighbour_distances(points, params.neighbours)) {
    units.push_back(Spread::units(distance));
    spread.add(units.back());
  }
  const double limit = spread.limit(params.ratio);
  IndexList stay;
  for (std::uint32_t k = 0; k < units.size(); ++k) {
    if (static_cast<double>(units[k]) <= limit) stay.push_back(k);
  }
  return stay;
}

}  // namespace vantage
