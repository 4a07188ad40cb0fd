#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "vantage/point_cloud.hpp"
#include "vantage/result.hpp"

namespace vantage::io::velodyne {

inline constexpr std::size_t kPacketSize = 1206;  ///< [bytes]
inline constexpr std::size_t kBlocks = 12;        ///< in a packet
inline constexpr std::size_t kChannels = 32;      ///< in a block
inline constexpr std::int32_t kFullTurn = 36000;  ///< azimuths are in 1/100 deg

/// A data packet as it was received.
struct Packet {
  double stamp = 0.0;        ///< of its receipt [s]; finite
  std::string_view data;     ///< the payload of the UDP datagram
  std::uint64_t offset = 0;  ///< for messages: where it is in its file [bytes]
};

/// A kind of sensor: what the manual says about each of the 32 channels of a block.
struct Model {
  struct Channel {
    std::uint8_t ring = 0;  ///< lasers counted from the lowest
    double cosine = 1.0;    ///< of its elevation
    double sine = 0.0;
    double delay = 0.0;  ///< of its firing after the block's first one [s]
  };
  std::string_view name;
  std::array<Channel, kChannels> channels;
  double block_time = 0.0;   ///< between the first firings of two blocks [s]
  double stamp_block = 0.0;  ///< the timestamp is that of this firing after the first [blocks] ...
  double stamp_delay = 0.0;  ///< ... and this much later [s]
};

enum class ReturnMode : std::uint8_t { strongest = 0x37, last = 0x38, dual = 0x39 };

/// What one firing of all lasers measured; in dual return mode, both of its blocks.
struct Column {
  std::int32_t azimuth = 0;      ///< of its first firing, clockwise seen from above [1/100 deg]
  double turn = 0.0;             ///< until the next column [1/100 deg]
  const char* first = nullptr;   ///< 32 channels of 3 bytes
  const char* second = nullptr;  ///< the other return; none in single return mode
};

/// A data packet taken apart (VLP-16 User Manual 63-9243 Rev. E, sec. 9.3; HDL-32E User's Manual
/// 63-9113, App. B). It points into the packet's bytes.
struct DataPacket {
  const Model* model = nullptr;
  ReturnMode mode = ReturnMode::strongest;
  std::uint32_t timestamp = 0;  ///< [us] past the hour, < 3.6e9
  double first_delay = 0.0;     ///< from the timestamp to the first firing [s]; <= 0
  std::array<Column, kBlocks> columns;
  std::size_t size = 0;  ///< how many columns: 12, in dual return mode 6
};

/// Whether a datagram is a data packet of some Velodyne sensor: its size and the first flag.
[[nodiscard]] bool is_data_packet(std::string_view payload) noexcept;

/// Errors (`where` is the file, the message gives the packet's byte): `corrupt_data` for a wrong
/// size, a flag that starts no block, or an azimuth of more than a full turn; `unsupported` for a
/// model other than the VLP-16 (or Puck LITE) and HDL-32E, or another return mode.
[[nodiscard]] Result<DataPacket> parse_packet(const Packet& packet, const std::string& file);

/// Turns columns into points. The frame is that of ROS: x forward (azimuth 0), y left, z up.
class PointDecoder {
 public:
  PointDecoder();

  /// Appends the returns of a column; if there are two, the second only if it differs from the
  /// first. The lasers' vertical offsets (at most 11 mm, VLP-16 manual Table 9-1) are left out, as
  /// in other decoders.
  /// @param after  the time from the scan's stamp to the column's first firing [s]
  void decode(const DataPacket& packet, const Column& column, double after, PointCloud& points,
              std::vector<float>& seconds, std::vector<std::uint8_t>& rings) const;

 private:
  std::vector<std::pair<double, double>> turns_;  // cosine and sine of every azimuth
};

}  // namespace vantage::io::velodyne
