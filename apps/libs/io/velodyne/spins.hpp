#pragma once

#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "io/velodyne/packet.hpp"
#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::io::velodyne {

/// Gives packets the time of their first firing. Sensors count microseconds past the hour. If the
/// sensor's clock is within a minute of the time of receipt (it is synchronised, by GPS for
/// example), the hour is that of the receipt. Otherwise the first packet has its time of receipt,
/// and the sensor's clock counts from there. Both start again if the two clocks move apart by more
/// than a second between two packets.
class SensorClock {
 public:
  /// [s]
  [[nodiscard]] double first_firing(const Packet& packet, const DataPacket& parsed) noexcept;
  [[nodiscard]] bool synchronised() const noexcept { return synchronised_; }
  /// A sentence that says where the stamps come from.
  [[nodiscard]] std::string rule() const;

 private:
  void begin(const Packet& packet, const DataPacket& parsed) noexcept;

  bool begun_ = false;
  bool synchronised_ = false;
  double start_ = 0.0;        // the sensor's clock at the first packet [s]
  std::int64_t elapsed_ = 0;  // since then [us]
  std::uint32_t last_timestamp_ = 0;
  double last_receipt_ = 0.0;
};

/// One revolution, in the sensor frame.
struct Spin {
  double stamp = 0.0;               ///< of its first firing [s]
  PointCloud points;                ///< [m]
  std::vector<float> seconds;       ///< of each point after `stamp`
  std::vector<std::uint8_t> rings;  ///< of each point: its laser, counted from the lowest
  bool complete = false;     ///< from one passage of azimuth 0 to the next; packets may be missing
  std::uint64_t offset = 0;  ///< of the packet in which it begins [bytes]
};

/// Cuts the firings of a sensor into revolutions: packets in, scans out.
///
/// A revolution begins with the first block (of both returns, in dual return mode) whose azimuth is
/// 0 or more: straight ahead, where ROS' velodyne driver cuts by default. That may be inside a
/// packet; the last firings of the block before, which passes 0, stay with the block. Lost packets
/// are missing points. If the azimuth goes back by more than 90 deg, either a revolution or more is
/// missing or the sensor does not turn. The current revolution then ends incomplete, and so will
/// the one that begins there.
class SpinAssembler {
 public:
  /// @param file  for errors
  /// @param from  revolutions stamped before this time are neither decoded nor returned [s]
  explicit SpinAssembler(std::string file, double from = -std::numeric_limits<double>::infinity());

  /// Errors: those of parse_packet.
  [[nodiscard]] Result<void> add(const Packet& packet);
  /// Ends the open revolution, which is incomplete.
  void finish();
  /// The next revolution that has ended.
  [[nodiscard]] std::optional<Spin> take();

  [[nodiscard]] const SensorClock& clock() const noexcept { return clock_; }

 private:
  void place(const DataPacket& packet, const Column& column, double time, std::uint64_t offset);
  void begin(std::int32_t azimuth, double time, std::uint64_t offset, bool at_cut);
  void end(bool at_cut);

  std::string file_;
  double from_;
  PointDecoder decoder_;
  SensorClock clock_;
  std::deque<Spin> ended_;
  std::optional<Spin> open_;
  bool from_cut_ = false;      // the open revolution began at azimuth 0
  double turned_ = 0.0;        // by the open revolution, starting at azimuth 0 [1/100 deg]
  std::size_t columns_ = 0;    // in the open revolution
  std::int32_t azimuth_ = 0;   // of the last column
  double time_ = 0.0;          // of the last column [s]
  double rate_ = 0.0;          // [1/100 deg/s]
  std::size_t last_size_ = 0;  // points of the last revolution
};

}  // namespace vantage::io::velodyne
