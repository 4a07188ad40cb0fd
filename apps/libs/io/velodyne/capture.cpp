#include "io/velodyne/capture.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <pcap/pcap.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "io/velodyne/datagram.hpp"
#include "io/velodyne/packet_scans.hpp"
#include "io/velodyne/pcap_file.hpp"

namespace vantage::io {
namespace {

using velodyne::Datagram;
using velodyne::Frame;
using velodyne::NoDatagram;
using velodyne::Packet;
using velodyne::PcapFile;
using velodyne::Source;

// More than a tenth of a second of an HDL-32E in dual return mode: all sensors that run at the same
// time show up in it.
constexpr std::size_t kPacketsToLookAt = 1000;
constexpr std::size_t kMostListed = 8;        // sensors in a message
constexpr std::size_t kPositionPacket = 512;  // [bytes]; VLP-16 manual sec. 9.3.3

/// What a capture contains besides data packets.
struct Others {
  std::uint64_t position = 0, datagrams = 0, fragments = 0, cut = 0, frames = 0;

  void count(const std::variant<Datagram, NoDatagram>& frame) noexcept {
    if (const auto* datagram = std::get_if<Datagram>(&frame)) {
      ++(datagram->payload.size() == kPositionPacket ? position : datagrams);
    } else if (const auto reason = std::get<NoDatagram>(frame); reason == NoDatagram::fragment) {
      ++fragments;
    } else {
      ++(reason == NoDatagram::cut ? cut : frames);
    }
  }
  [[nodiscard]] std::string words() const {
    std::vector<std::string> found;
    const auto add = [&](std::uint64_t count, const char* what) {
      if (count != 0) found.push_back(fmt::format("{} {}", count, what));
    };
    add(position, "position (GPS) packets");
    add(datagrams, "other UDP datagrams");
    add(fragments, "fragments of IP packets");
    add(cut, "frames that were captured in part");
    add(frames, "frames without UDP");
    return found.empty() ? "no packets at all" : fmt::format("{}", fmt::join(found, ", "));
  }
};

std::string list(const std::vector<Source>& sensors) {
  std::vector<std::string> names;
  for (const Source& sensor : sensors) {
    if (names.size() == kMostListed) {
      names.emplace_back("...");
      break;
    }
    names.push_back(to_string(sensor));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

/// The data packets of one sensor in a capture.
class CapturePackets final : public velodyne::PacketSource {
 public:
  CapturePackets(PcapFile capture, std::optional<Source> sensor)
      : capture_(std::move(capture)), chosen_(sensor.has_value()), sensor_(std::move(sensor)) {}

  [[nodiscard]] const std::string& file() const override { return capture_.name(); }

  [[nodiscard]] Result<std::optional<Packet>> next() override {
    while (true) {
      VANTAGE_TRY(const auto frame, capture_.next());
      if (!frame) return std::nullopt;
      const auto parsed = velodyne::udp_datagram(capture_.link_type(), frame->bytes);
      const auto* const datagram = std::get_if<Datagram>(&parsed);
      if (datagram == nullptr || !velodyne::is_data_packet(datagram->payload)) continue;
      if (!sensor_) sensor_ = datagram->source;
      if (datagram->source == *sensor_) {
        return Packet{.stamp = frame->stamp, .data = datagram->payload, .offset = frame->offset};
      }
      if (chosen_) continue;
      return fail(
          ErrorCode::invalid_input,
          fmt::format("the packet at byte {} is of a second sensor, choose one as the topic: "
                      "{}",
                      frame->offset, list({*sensor_, datagram->source})),
          SourceLocation{file(), 0, 0});
    }
  }

  [[nodiscard]] Result<void> rewind() override { return capture_.rewind(); }

 private:
  PcapFile capture_;
  bool chosen_;
  std::optional<Source> sensor_;
};

/// What the beginning of a capture shows.
struct Survey {
  std::vector<Source> sensors;
  std::optional<Source> sensor;                     // the one that is wanted
  std::array<char, velodyne::kPacketSize> first{};  // its first packet ...
  double stamp = 0.0;                               // ... its receipt [s] ...
  std::uint64_t offset = 0;                         // ... and its place [bytes]
  Others others;
};

/// Looks at a capture until enough is known about it, or at all of it if the sensor does not show
/// up.
Result<Survey> survey(PcapFile& capture, const std::string& wanted) {
  Survey seen;
  for (std::size_t packets = 0; packets < kPacketsToLookAt || (!seen.sensor && packets != 0);) {
    auto frame = capture.next();
    // What comes before the damage can be read; next() reports the damage in its place.
    if (!frame && seen.sensor) break;
    if (!frame) return fail(std::move(frame).error());
    if (!*frame) break;
    const auto parsed = velodyne::udp_datagram(capture.link_type(), (*frame)->bytes);
    const auto* const datagram = std::get_if<Datagram>(&parsed);
    if (datagram == nullptr || !velodyne::is_data_packet(datagram->payload)) {
      seen.others.count(parsed);
      continue;
    }
    ++packets;
    const bool is_new =
        std::find(seen.sensors.begin(), seen.sensors.end(), datagram->source) == seen.sensors.end();
    // More names than a message can list would only cost time.
    if (is_new && seen.sensors.size() <= kMostListed) seen.sensors.push_back(datagram->source);
    if (seen.sensor || !is_new) continue;
    if (!wanted.empty() && wanted != to_string(datagram->source)) continue;
    seen.sensor = datagram->source;
    std::copy_n(datagram->payload.begin(), seen.first.size(), seen.first.begin());
    seen.stamp = (*frame)->stamp;
    seen.offset = (*frame)->offset;
  }
  return seen;
}

Result<void> check(const Survey& seen, const std::string& wanted, const std::string& file) {
  const SourceLocation where{file, 0, 0};
  if (seen.sensors.empty()) {
    return fail(ErrorCode::corrupt_data,
                fmt::format("no data packets of a Velodyne sensor (UDP, 1206 bytes), found {}",
                            seen.others.words()),
                where);
  }
  if (!seen.sensor) {
    return fail(
        ErrorCode::invalid_input,
        fmt::format("no data packets come from '{:.80}', found {}", wanted, list(seen.sensors)),
        where);
  }
  if (wanted.empty() && seen.sensors.size() > 1) {
    return fail(ErrorCode::invalid_input,
                fmt::format("the capture has several sensors, choose one as the topic: {}",
                            list(seen.sensors)),
                where);
  }
  return {};
}

}  // namespace

bool looks_like_pcap(std::string_view head) noexcept {
  // Microseconds, nanoseconds and Kuznetzov's variant, little and big endian; pcapng.
  constexpr std::array<std::string_view, 7> kMagics{
      "\xD4\xC3\xB2\xA1", "\xA1\xB2\xC3\xD4", "\x4D\x3C\xB2\xA1", "\xA1\xB2\x3C\x4D",
      "\x34\xCD\xB2\xA1", "\xA1\xB2\xCD\x34", "\x0A\x0D\x0D\x0A"};
  return std::any_of(kMagics.begin(), kMagics.end(),
                     [&](std::string_view magic) { return head.starts_with(magic); });
}

Result<std::unique_ptr<ScanSource>> open_velodyne_capture(InputFile file,
                                                          const std::string& sensor) {
  const std::string name = file.name();
  std::array<char, 4> magic{};
  if (file.size() >= magic.size()) VANTAGE_CHECK(file.read(0, magic));
  const bool is_pcapng = magic[0] == '\x0A';
  VANTAGE_TRY(PcapFile capture, PcapFile::open(std::move(file)));
  if (!velodyne::is_known_link(capture.link_type())) {
    const char* const link = pcap_datalink_val_to_name(capture.link_type());
    return fail(ErrorCode::unsupported,
                fmt::format("the capture is of link type {} ({}), expected Ethernet, Linux cooked, "
                            "raw IP or BSD loopback",
                            capture.link_type(), link == nullptr ? "unknown" : link),
                SourceLocation{name, 0, 0});
  }
  VANTAGE_TRY(const Survey seen, survey(capture, sensor));
  VANTAGE_CHECK(check(seen, sensor, name));
  const Packet first{
      .stamp = seen.stamp, .data = {seen.first.data(), seen.first.size()}, .offset = seen.offset};
  VANTAGE_TRY(ScanDescription description,
              velodyne::describe_packets(first, is_pcapng ? "pcapng" : "pcap", name));
  description.topic = to_string(*seen.sensor);
  VANTAGE_CHECK(capture.rewind());
  return velodyne::scans_of_packets(
      std::make_unique<CapturePackets>(std::move(capture),
                                       sensor.empty() ? std::nullopt : seen.sensor),
      std::move(description));
}

}  // namespace vantage::io
