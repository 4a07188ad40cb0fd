#include "vantage/engine/localizer_params.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace vantage {

Result<void> LocalizerParams::validate() const {
  for (const auto& [key, mount] :
       {std::pair{"T_sensor_imu", &T_sensor_imu}, {"T_sensor_body", &T_sensor_body}}) {
    const bool finite =
        std::all_of(mount->begin(), mount->end(), [](double x) { return std::isfinite(x); });
    if (mount->size() == 6 && finite) continue;
    return fail_at({key}, "'" + std::string(key) + "' has " + std::to_string(mount->size()) +
                              " numbers, expected six finite ones: x, y, z, roll, pitch, yaw");
  }
  return {};
}

}  // namespace vantage
