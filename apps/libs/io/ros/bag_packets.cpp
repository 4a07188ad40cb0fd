#include "io/ros/bag_packets.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "io/ros/messages.hpp"
#include "io/ros/topic_choice.hpp"
#include "io/velodyne/packet_scans.hpp"

namespace vantage::io::ros {
namespace {

class BagPackets final : public velodyne::PacketSource {
 public:
  explicit BagPackets(std::unique_ptr<MessageReader> reader) : reader_(std::move(reader)) {}

  [[nodiscard]] const std::string& file() const override { return reader_->file(); }

  [[nodiscard]] Result<std::optional<velodyne::Packet>> next() override {
    while (next_ == scan_.packets.size()) {
      VANTAGE_TRY(const auto message, reader_->next());
      if (!message) return std::optional<velodyne::Packet>();
      VANTAGE_CHECK(read(*message));
    }
    const VelodynePacket& packet = scan_.packets[next_++];
    return velodyne::Packet{.stamp = packet.stamp, .data = packet.data, .offset = offset_};
  }

  [[nodiscard]] Result<void> rewind() override {
    scan_ = {};
    next_ = 0;
    return reader_->seek(std::numeric_limits<std::int64_t>::min());
  }

  /// The frame of the last message read.
  [[nodiscard]] const std::string& frame() const { return scan_.header.frame; }

 private:
  [[nodiscard]] Result<void> read(const BagMessage& message) {
    auto scan = parse_velodyne_scan(message.bytes, *reader_->topics()[message.topic].encoding,
                                    SourceLocation{file(), 0, 0});
    if (!scan) return in_message(std::move(scan).error(), *reader_, message);
    scan_ = *std::move(scan);
    next_ = 0;
    offset_ = message.offset;
    return {};
  }

  std::unique_ptr<MessageReader> reader_;
  VelodyneScanMessage scan_;
  std::size_t next_ = 0;  // of its packets
  std::uint64_t offset_ = 0;
};

}  // namespace

Result<std::unique_ptr<ScanSource>> packet_scans(std::unique_ptr<MessageReader> reader,
                                                 const std::vector<std::size_t>& topics) {
  VANTAGE_CHECK(reader->select(topics));
  const std::string format = reader->format();
  const std::string topic = reader->topics()[topics.front()].name;
  auto packets = std::make_unique<BagPackets>(std::move(reader));
  VANTAGE_TRY(const auto first, packets->next());
  if (!first) {
    return fail(ErrorCode::corrupt_data,
                "holds no packet on " + topic + ", expected packets of a Velodyne sensor",
                SourceLocation{packets->file(), 0, 0});
  }
  VANTAGE_TRY(ScanDescription description,
              velodyne::describe_packets(*first, format, packets->file()));
  description.topic = topic;
  description.frame = packets->frame();
  VANTAGE_CHECK(packets->rewind());
  return velodyne::scans_of_packets(std::move(packets), std::move(description));
}

}  // namespace vantage::io::ros
