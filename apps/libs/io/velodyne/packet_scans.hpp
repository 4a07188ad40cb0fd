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
  /// Makes next() continue with the first packet. Errors: those of next().
  [[nodiscard]] virtual Result<void> rewind() = 0;
};

/// What a packet's sensor and clock say about the scans: the fields and the stamp rule. The model
/// and the return mode ("VLP-16, dual return") follow `container` in the format.
/// Errors: those of parse_packet.
[[nodiscard]] Result<ScanDescription> describe_packets(const Packet& first,
                                                       const std::string& container,
                                                       const std::string& file);

/// Packets say when each point was measured, and have no tags.
/// Errors (`where` is the path): `invalid_input` for options that choose either.
[[nodiscard]] Result<void> check_packet_options(const ScanOptions& options);

/// The revolutions of a sensor (see SpinAssembler) as scans, whatever the source of the packets.
/// Incomplete revolutions are left out and counted. If there is no complete one at all, next() ends
/// with `corrupt_data`, as it does for packets that parse_packet refuses.
/// @param packets  at the first packet
[[nodiscard]] std::unique_ptr<ScanSource> scans_of_packets(std::unique_ptr<PacketSource> packets,
                                                           ScanDescription description);

}  // namespace vantage::io::velodyne
