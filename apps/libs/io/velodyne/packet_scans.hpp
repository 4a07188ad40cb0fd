#pragma once

#include <memory>
#include <optional>
#include <string>

#include "io/velodyne/packet.hpp"
#include "vantage/io/scan_source.hpp"
#include "vantage/result.hpp"

namespace vantage::io::velodyne {

/// The data packets of one sensor in the order in which they were received.
class PacketSource {
 public:
  PacketSource() = default;
  virtual ~PacketSource() = default;
  PacketSource(const PacketSource&) = delete;
  PacketSource& operator=(const PacketSource&) = delete;

  [[nodiscard]] virtual const std::string& file() const = 0;
  /// The next packet, valid until the next call; nothing at the end.
  /// Errors (`where` is the file): `corrupt_data`, `io_failure`.
  [[nodiscard]] virtual Result<std::optional<Packet>> next() = 0;
  /// next() goes on with the first packet. Errors: those of next().
  [[nodiscard]] virtual Result<void> rewind() = 0;
};

/// What a packet's sensor and its clock say of the scans: the fields and the stamp rule; the model
/// and the return mode ("VLP-16, dual return") follow `container` in the format.
/// Errors: those of parse_packet.
[[nodiscard]] Result<ScanDescription> describe_packets(const Packet& first,
                                                       const std::string& container,
                                                       const std::string& file);

/// The revolutions of a sensor (see SpinAssembler) as scans, whatever its packets come from. Those
/// that are not complete are left out and counted; where there is no other at all, next() ends with
/// `corrupt_data`, as it does for packets that parse_packet refuses.
/// @param packets  at the first packet
[[nodiscard]] std::unique_ptr<ScanSource> scans_of_packets(std::unique_ptr<PacketSource> packets,
                                                           ScanDescription description);

}  // namespace vantage::io::velodyne
