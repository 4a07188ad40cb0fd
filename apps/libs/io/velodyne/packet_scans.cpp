#include "io/velodyne/packet_scans.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <limits>
#include <utility>

#include "io/velodyne/spins.hpp"

namespace vantage::io::velodyne {
namespace {

constexpr double kBeginning = -std::numeric_limits<double>::infinity();

const char* words(ReturnMode mode) noexcept {
  switch (mode) {
    case ReturnMode::strongest: return "strongest return";
    case ReturnMode::last: return "last return";
    default: return "dual return";
  }
}

class PacketScans final : public ScanSource {
 public:
  PacketScans(std::unique_ptr<PacketSource> packets, ScanDescription description)
      : packets_(std::move(packets)),
        description_(std::move(description)),
        spins_(packets_->file(), kBeginning) {}

  [[nodiscard]] Result<std::optional<StampedScan>> next() override {
    while (!over_) {
      while (auto spin = spins_.take()) {
        if (auto scan = accept(*std::move(spin))) return scan;
      }
      if (drained_) break;
      if (auto read = read_packet(); !read) {
        over_ = true;
        return fail(std::move(read).error());
      }
    }
    if (!over_ && complete_ == 0 && from_ == kBeginning) {
      over_ = true;
      return fail(
          ErrorCode::corrupt_data,
          fmt::format("holds no whole revolution of the sensor, from azimuth 0 to azimuth 0, "
                      "in {} packets ({:.2f} s); expected at least one",
                      read_, read_ == 0 ? 0.0 : last_stamp_ - first_stamp_),
          SourceLocation{packets_->file(), 0, 0});
    }
    over_ = true;
    return std::nullopt;
  }

  [[nodiscard]] Result<void> seek(double stamp) override {
    over_ = true;  // unless the following steps succeed
    VANTAGE_CHECK(packets_->rewind());
    spins_ = SpinAssembler(packets_->file(), stamp);
    from_ = stamp;
    last_ = kBeginning;
    skipped_ = {};
    complete_ = read_ = 0;
    over_ = drained_ = false;
    return {};
  }

  [[nodiscard]] const ScanDescription& describe() const override { return description_; }
  [[nodiscard]] SkippedScans skipped() const override { return skipped_; }

 private:
  /// The scan of a revolution, if the revolution can be used.
  [[nodiscard]] std::optional<StampedScan> accept(Spin spin) {
    if (!spin.complete) {
      ++skipped_.incomplete;
      return std::nullopt;
    }
    ++complete_;
    if (spin.stamp <= last_) {
      ++skipped_.not_later;
      return std::nullopt;
    }
    last_ = spin.stamp;
    return StampedScan{.stamp = spin.stamp,
                       .points = std::move(spin.points),
                       .seconds = std::move(spin.seconds),
                       .dropped = 0,
                       .name = fmt::format("{} at byte {}", packets_->file(), spin.offset)};
  }

  [[nodiscard]] Result<void> read_packet() {
    VANTAGE_TRY(const auto packet, packets_->next());
    if (!packet) {
      drained_ = true;
      spins_.finish();
      return {};
    }
    if (read_++ == 0) first_stamp_ = packet->stamp;
    last_stamp_ = packet->stamp;
    return spins_.add(*packet);
  }

  std::unique_ptr<PacketSource> packets_;
  ScanDescription description_;
  SpinAssembler spins_;
  double from_ = kBeginning;
  double last_ = kBeginning;  // stamp of the last scan
  SkippedScans skipped_;
  std::uint64_t complete_ = 0;  // revolutions
  std::uint64_t read_ = 0;      // packets
  double first_stamp_ = 0.0, last_stamp_ = 0.0;
  bool drained_ = false;  // there are no more packets
  bool over_ = false;     // there are no more scans
};

}  // namespace

Result<void> check_packet_options(const ScanOptions& options) {
  const auto error = [&](std::string message) {
    return fail(ErrorCode::invalid_input, std::move(message),
                SourceLocation{options.path.string(), 0, 0});
  };
  if (options.stamped) {
    return error(
        "packets say when each point was measured, so the point of the stamp cannot be chosen");
  }
  if (options.tags != Tags::all) {
    return error("points of packets have no tags, so none can be left out by them");
  }
  return {};
}

Result<ScanDescription> describe_packets(const Packet& first, const std::string& container,
                                         const std::string& file) {
  VANTAGE_TRY(const DataPacket parsed, parse_packet(first, file));
  SensorClock clock;
  static_cast<void>(clock.first_firing(first, parsed));
  ScanDescription description;
  description.format =
      fmt::format("{} ({}, {})", container, parsed.model->name, words(parsed.mode));
  description.fields = {"azimuth uint16", "distance uint16", "reflectivity uint8",
                        "timestamp uint32"};
  description.stamp_rule = clock.rule();
  return description;
}

std::unique_ptr<ScanSource> scans_of_packets(std::unique_ptr<PacketSource> packets,
                                             ScanDescription description) {
  return std::make_unique<PacketScans>(std::move(packets), std::move(description));
}

}  // namespace vantage::io::velodyne
