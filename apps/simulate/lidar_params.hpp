#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <tuple>
#include <utility>

#include "vantage/params.hpp"

namespace vantage::simulation {

/// A sensor whose values are the defaults of [lidar].
enum class SensorModel : std::uint8_t { vlp16, hdl64, mid360 };
constexpr auto enum_names(SensorModel) {
  return std::array{std::pair{std::string_view("vlp16"), SensorModel::vlp16},
                    std::pair{std::string_view("hdl64"), SensorModel::hdl64},
                    std::pair{std::string_view("mid360"), SensorModel::mid360}};
}

/// [lidar]: a Velodyne VLP-16 by default. In a world file, the defaults are those of its model.
struct LidarParams {
  SensorModel model = SensorModel::vlp16;
  int rings = 16;
  double lowest_ring = -15.0, highest_ring = 15.0;
  int upper_rings = 0;
  double upper_spacing = 0.0;
  double azimuth_step = 0.2;
  double turns = 1.0, sweeps = 0.0;
  double ring_spacing = 0.0;
  double rate = 10.0;
  double min_range = 0.5, max_range = 100.0;
  double sure_range = 1000.0;
  double range_noise = 0.03, angle_noise = 0.0;
  double dropout = 0.01;
  double grazing_angle = 3.0;
  double height = 1.0;
  double roll = 0.0, pitch = 0.0, yaw = 0.0;
  bool motion_distortion = true;
  std::optional<double> covered_from, covered_to;
  double clutter = 0.0;
  int people = 0;
  double disturbed_from = 0.0, disturbed_to = 1.0;

  static constexpr auto schema() {
    using P = LidarParams;
    return std::tuple{
        optional("model", &P::model, "",
                 "whose values the keys of [lidar] have if they are left out: Velodyne VLP-16, "
                 "Velodyne HDL-64E, Livox MID-360"),
        optional("rings", &P::rings, "",
                 "lasers that fire at once, evenly spread in elevation unless upper_rings or "
                 "sweeps is given",
                 between(1, 256)),
        optional("lowest_ring", &P::lowest_ring, "deg", "elevation", between(-89, 89)),
        optional("highest_ring", &P::highest_ring, "deg", "elevation", between(-89, 89)),
        optional("upper_rings", &P::upper_rings, "",
                 "this many rings are a separate block below highest_ring, upper_spacing apart; "
                 "the others are evenly spread from there to lowest_ring",
                 between(0, 255)),
        optional("upper_spacing", &P::upper_spacing, "deg", "see upper_rings", between(0, 10)),
        optional("azimuth_step", &P::azimuth_step, "deg", "between two firings", between(0.05, 10)),
        optional("turns", &P::turns, "",
                 "of the lasers in a sweep; with a fraction, each sweep begins at another azimuth",
                 between(0.1, 100)),
        optional("sweeps", &P::sweeps, "",
                 "how often in a sweep the lasers go up and down together between lowest_ring and "
                 "highest_ring; 0: they stay where they are",
                 between(0, 100)),
        optional("ring_spacing", &P::ring_spacing, "deg", "between two lasers that go up and down",
                 between(0, 30)),
        optional("rate", &P::rate, "Hz", "sweeps a second; of a spinning sensor, its revolutions",
                 between(0.1, 100)),
        optional("min_range", &P::min_range, "m", "nothing nearer is reported", between(0, 100)),
        optional("max_range", &P::max_range, "m", "nothing farther is reported", between(1, 1000)),
        optional("sure_range", &P::sure_range, "m",
                 "beyond it, returns are lost with a probability that grows to 1 at max_range, as "
                 "only bright surfaces are seen there",
                 between(0, 1000)),
        optional("range_noise", &P::range_noise, "m", "standard deviation along the ray",
                 between(0, 0.5)),
        optional("angle_noise", &P::angle_noise, "deg",
                 "standard deviation of the reported azimuth and elevation", between(0, 5)),
        optional("dropout", &P::dropout, "", "probability that a return is lost", between(0, 1)),
        optional("grazing_angle", &P::grazing_angle, "deg",
                 "below this angle between ray and surface, returns are lost with a probability "
                 "that grows to 1 at 0",
                 between(0, 45)),
        optional("height", &P::height, "m", "of the sensor above the ground", between(0.2, 3.5)),
        optional("roll", &P::roll, "deg",
                 "how the sensor is mounted on the body, whose x is forward and z up: "
                 "Rz(yaw) Ry(pitch) Rx(roll); 180: upside down",
                 between(-180, 180)),
        optional("pitch", &P::pitch, "deg", "see roll", between(-180, 180)),
        optional("yaw", &P::yaw, "deg", "see roll", between(-180, 180)),
        optional(
            "motion_distortion", &P::motion_distortion, "",
            "true: each firing is taken from the sensor's pose at that moment, in the frame of "
            "that pose; the field t [s] is its time after the scan's stamp, which is that of the "
            "first firing; false: all firings are taken from the pose at the scan's stamp"),
        optional(
            "covered_from", &P::covered_from, "deg",
            "nothing returns from covered_from counter-clockwise to covered_to, in the sensor's "
            "frame: 0 is ahead, 90 to the left; nothing is covered if left out",
            between(-180, 180)),
        optional("covered_to", &P::covered_to, "deg", "see covered_from", between(-180, 180)),
        optional("clutter", &P::clutter, "",
                 "share of the rays that return early, like from rain or dust: at any range up to "
                 "15 m before the surface",
                 between(0, 1)),
        optional("people", &P::people, "",
                 "who walk with the sensor, 1 to 5 m away from it, and are in no map",
                 between(0, 100)),
        optional("disturbed_from", &P::disturbed_from, "",
                 "share of the drive after which the sensor is covered and sees clutter and people",
                 between(0, 1)),
        optional("disturbed_to", &P::disturbed_to, "", "share of the drive at which this ends",
                 between(0, 1)),
    };
  }
  [[nodiscard]] Result<void> validate() const;
  [[nodiscard]] int firings() const noexcept;  ///< a sweep
};

/// The values of a sensor.
[[nodiscard]] LidarParams lidar_of(SensorModel model);

}  // namespace vantage::simulation
