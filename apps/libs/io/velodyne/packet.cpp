#include "io/velodyne/packet.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <numbers>

namespace vantage::io::velodyne {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are read in place");

constexpr std::size_t kBlockSize = 100;
constexpr std::size_t kChannelSize = 3;
constexpr std::size_t kChannelsAt = 4;  // in a block, after its flag and azimuth
constexpr std::size_t kTimestampAt = 1200, kModeAt = 1204, kProductAt = 1205;
constexpr std::uint16_t kFlag = 0xEEFF;
constexpr std::uint16_t kLowerFlag = 0xDDFF;  // the second bank of lasers of other models
constexpr double kDistanceUnit = 0.002;       // [m]
constexpr std::uint32_t kHour = 3'600'000'000;
constexpr double kRadians = std::numbers::pi / 180.0;
// At 1200 rpm, twice what the manuals allow for, a column takes 0.8 deg.
constexpr std::int32_t kLargestTurn = 160;

template <class Number>
Number number_at(const char* bytes) noexcept {
  Number number;
  std::memcpy(&number, bytes, sizeof number);
  return number;
}

Model::Channel channel(std::size_t ring, double degrees, double delay) noexcept {
  return {.ring = static_cast<std::uint8_t>(ring),
          .cosine = std::cos(degrees * kRadians),
          .sine = std::sin(degrees * kRadians),
          .delay = delay};
}

/// VLP-16 manual, Table 9-1 (angles) and sec. 9.4: 16 lasers fire every 2.304 us, a block holds two
/// such sequences of 55.296 us; the timestamp is that of the first firing.
Model make_vlp16() noexcept {
  constexpr double kFiring = 2.304e-6, kSequence = 55.296e-6;
  Model model;
  model.name = "VLP-16";
  model.block_time = 2 * kSequence;
  for (std::size_t k = 0; k < kChannels; ++k) {
    const std::size_t laser = k % 16;
    const double degrees =
        laser % 2 == 0 ? static_cast<double>(laser) - 15.0 : static_cast<double>(laser);
    model.channels[k] =
        channel(laser % 2 == 0 ? laser / 2 : 8 + laser / 2, degrees,
                static_cast<double>(k / 16) * kSequence + static_cast<double>(laser) * kFiring);
  }
  return model;
}

/// HDL-32E manual, "Laser Firing Sequence" (angles: steps of 4/3 deg, the lower and the upper half
/// in turns) and App. E: 32 lasers fire every 1.152 us, a block is one sequence of 46.08 us; the
/// timestamp is written with the packet's last firing.
Model make_hdl32() noexcept {
  constexpr double kFiring = 1.152e-6, kSequence = 46.08e-6;
  // As printed in the manual: rounded to 1/100 deg, two of them downwards.
  constexpr std::array<double, kChannels> kDegrees{
      -30.67, -9.33,  -29.33, -8.00,  -28.00, -6.66,  -26.66, -5.33,  -25.33, -4.00,  -24.00,
      -2.67,  -22.67, -1.33,  -21.33, 0.00,   -20.00, 1.33,   -18.67, 2.67,   -17.33, 4.00,
      -16.00, 5.33,   -14.67, 6.67,   -13.33, 8.00,   -12.00, 9.33,   -10.67, 10.67};
  Model model;
  model.name = "HDL-32E";
  model.block_time = kSequence;
  model.stamp_block = 1.0;
  model.stamp_delay = 31 * kFiring;
  for (std::size_t k = 0; k < kChannels; ++k) {
    model.channels[k] =
        channel(k % 2 == 0 ? k / 2 : 16 + k / 2, kDegrees[k], static_cast<double>(k) * kFiring);
  }
  return model;
}

const Model kVlp16 = make_vlp16();
const Model kHdl32 = make_hdl32();

struct Product {
  std::uint8_t id;
  std::string_view name;
};
// VLP-16 manual, Table 9-2; the VLS-128 itself sends 0xA1. The data of a Puck LITE are those of a
// VLP-16.
constexpr std::array<Product, 5> kOtherProducts{{{0x24, "Puck Hi-Res"},
                                                 {0x28, "VLP-32C"},
                                                 {0x31, "Velarray"},
                                                 {0x63, "VLS-128"},
                                                 {0xA1, "VLS-128"}}};

std::uint16_t flag_of(std::string_view data, std::size_t block) noexcept {
  return number_at<std::uint16_t>(data.data() + block * kBlockSize);
}

/// The name in messages of a model that is not supported.
std::string other_model(std::string_view data) {
  // The last two bytes of an HDL-64E are changing status values; only its flags identify it.
  if (flag_of(data, 1) == kLowerFlag) {
    return flag_of(data, 2) == kFlag ? "an HDL-64E" : "a VLS-128 or another with several banks";
  }
  const auto id = static_cast<std::uint8_t>(data[kProductAt]);
  for (const Product& product : kOtherProducts) {
    if (product.id == id) return fmt::format("a {} (product 0x{:02X})", product.name, id);
  }
  return fmt::format("an unknown product 0x{:02X}", id);
}

const Model* model_of(std::string_view data) noexcept {
  if (flag_of(data, 1) == kLowerFlag) return nullptr;
  switch (static_cast<std::uint8_t>(data[kProductAt])) {
    case 0x21: return &kHdl32;
    case 0x22: return &kVlp16;
    default: return nullptr;
  }
}

/// How far the sensor turns in each column; the last column turns as far as the one before.
void fill_turns(DataPacket& packet) noexcept {
  double turn = 0.0;
  for (std::size_t i = 0; i < packet.size; ++i) {
    if (i + 1 < packet.size) {
      const std::int32_t step =
          (packet.columns[i + 1].azimuth - packet.columns[i].azimuth + kFullTurn) % kFullTurn;
      if (step <= kLargestTurn) turn = step;  // else firings are missing, or it turned back
    }
    packet.columns[i].turn = turn;
  }
}

}  // namespace

bool is_data_packet(std::string_view payload) noexcept {
  return payload.size() == kPacketSize && number_at<std::uint16_t>(payload.data()) == kFlag;
}

Result<DataPacket> parse_packet(const Packet& packet, const std::string& file) {
  const SourceLocation where{file, 0, 0};
  const std::string_view data = packet.data;
  if (data.size() != kPacketSize) {
    return fail(ErrorCode::corrupt_data,
                fmt::format("the packet at byte {} has {} bytes, expected {} of a Velodyne sensor",
                            packet.offset, data.size(), kPacketSize),
                where);
  }
  DataPacket parsed;
  parsed.model = model_of(data);
  if (parsed.model == nullptr) {
    return fail(ErrorCode::unsupported,
                fmt::format("the packet at byte {} is of {}, expected a VLP-16 (0x22) or HDL-32E "
                            "(0x21); convert the recording to PointCloud2 or PCD files with the "
                            "sensor's ROS driver",
                            packet.offset, other_model(data)),
                where);
  }
  const auto mode = static_cast<std::uint8_t>(data[kModeAt]);
  parsed.mode = static_cast<ReturnMode>(mode);
  if (mode < 0x37 || mode > 0x39) {
    return fail(ErrorCode::unsupported,
                fmt::format("the packet at byte {} has the return mode 0x{:02X}, expected 0x37 "
                            "(strongest), 0x38 (last) or 0x39 (dual)",
                            packet.offset, mode),
                where);
  }
  for (std::size_t i = 0; i < kBlocks; ++i) {
    const char* const block = data.data() + i * kBlockSize;
    const auto flag = number_at<std::uint16_t>(block);
    const auto azimuth = number_at<std::uint16_t>(block + 2);
    if (flag != kFlag || azimuth > kFullTurn) {
      return fail(ErrorCode::corrupt_data,
                  fmt::format("block {} of the packet at byte {} has the flag 0x{:04X} and azimuth "
                              "{}, expected 0xEEFF and at most 36000",
                              i, packet.offset, flag, azimuth),
                  where);
    }
    // VLP-16 manual sec. 9.3.2: the last return, then the strongest or second strongest.
    if (parsed.mode == ReturnMode::dual && i % 2 == 1) {
      parsed.columns[parsed.size - 1].second = block + kChannelsAt;
      continue;
    }
    parsed.columns[parsed.size++] = {.azimuth = azimuth % kFullTurn,
                                     .turn = 0.0,
                                     .first = block + kChannelsAt,
                                     .second = nullptr};
  }
  fill_turns(parsed);
  parsed.timestamp = number_at<std::uint32_t>(data.data() + kTimestampAt) % kHour;
  const auto blocks_before = static_cast<double>(parsed.size - 1) * parsed.model->stamp_block;
  parsed.first_delay = -(blocks_before * parsed.model->block_time + parsed.model->stamp_delay);
  return parsed;
}

PointDecoder::PointDecoder() : turns_(kFullTurn) {
  for (std::size_t i = 0; i < turns_.size(); ++i) {
    const double angle = static_cast<double>(i) * kRadians / 100.0;
    turns_[i] = {std::cos(angle), std::sin(angle)};
  }
}

void PointDecoder::decode(const DataPacket& packet, const Column& column, double after,
                          PointCloud& points, std::vector<float>& seconds,
                          std::vector<std::uint8_t>& rings) const {
  const Model& model = *packet.model;
  const double turn_rate = column.turn / model.block_time;
  // Room for every possible point, so that the capacity is not checked for each of them.
  std::size_t size = points.size();
  points.resize(size + 2 * kChannels);
  seconds.resize(points.size());
  rings.resize(points.size());
  for (std::size_t k = 0; k < kChannels; ++k) {
    const auto first = number_at<std::uint16_t>(column.first + k * kChannelSize);
    auto second = first;
    if (column.second != nullptr) {
      second = number_at<std::uint16_t>(column.second + k * kChannelSize);
    }
    if (first == 0 && second == 0) continue;
    const Model::Channel& channel = model.channels[k];
    const double azimuth = column.azimuth + turn_rate * channel.delay;
    const auto nearest = static_cast<std::int32_t>(azimuth + 0.5);
    const std::int32_t entry = nearest < kFullTurn ? nearest : nearest - kFullTurn;
    const auto [cosine, sine] = turns_[static_cast<std::size_t>(entry)];
    // To first order: the error is less than 1 um in 200 m for half of 1/100 deg.
    const double rest = (azimuth - nearest) * kRadians / 100.0;
    const Point direction(channel.cosine * (cosine - sine * rest),
                          -channel.cosine * (sine + cosine * rest), channel.sine);
    const auto add = [&](std::uint16_t distance) {
      points[size] = distance * kDistanceUnit * direction;
      seconds[size] = static_cast<float>(after + channel.delay);
      rings[size++] = channel.ring;
    };
    if (first != 0) add(first);
    if (second != 0 && second != first) add(second);
  }
  points.resize(size);
  seconds.resize(size);
  rings.resize(size);
}

}  // namespace vantage::io::velodyne
