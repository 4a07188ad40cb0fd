#include "io/velodyne/spins.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace vantage::io::velodyne {
namespace {

constexpr double kHourInSeconds = 3600.0;                    // [s]
constexpr std::int64_t kHourInMicroseconds = 3'600'000'000;  // [us]
constexpr double kSynchronised = 60.0;                       // clocks that differ by less agree [s]
constexpr double kClockJump = 1.0;                           // [s]
constexpr double kCentury = 3.2e9;                           // [s]
constexpr double kLargestStepBack = 9000.0;                  // [1/100 deg]
// An HDL-32E at 300 rpm, the slowest speed, fires 4340 columns per revolution.
constexpr std::size_t kMostColumns = 16384;

/// `value` plus the multiple of `period` that is nearest to `expected`.
double nearest_to(double expected, double value, double period) noexcept {
  return value + period * std::round((expected - value) / period);
}

}  // namespace

void SensorClock::begin(const Packet& packet, const DataPacket& parsed) noexcept {
  const double past_hour = parsed.timestamp * 1e-6;
  start_ = nearest_to(packet.stamp, past_hour, kHourInSeconds);
  synchronised_ = std::abs(start_ - packet.stamp) < kSynchronised;
  if (!synchronised_) start_ = packet.stamp;
  elapsed_ = 0;
  begun_ = true;
}

double SensorClock::first_firing(const Packet& packet, const DataPacket& parsed) noexcept {
  if (begun_) {
    const double expected = packet.stamp - last_receipt_;
    const auto step = static_cast<std::int64_t>(parsed.timestamp) - last_timestamp_;
    const double seconds = nearest_to(expected, static_cast<double>(step) * 1e-6, kHourInSeconds);
    // No recording is longer than a century; the limits keep the sum from overflowing.
    const bool sound = std::abs(seconds - expected) < kClockJump && std::abs(seconds) < kCentury &&
                       std::abs(static_cast<double>(elapsed_)) < kCentury * 1e6;
    if (sound) {
      elapsed_ +=
          step + kHourInMicroseconds *
                     std::llround((seconds - static_cast<double>(step) * 1e-6) / kHourInSeconds);
    } else {
      begin(packet, parsed);
    }
  } else {
    begin(packet, parsed);
  }
  last_timestamp_ = parsed.timestamp;
  last_receipt_ = packet.stamp;
  return start_ + static_cast<double>(elapsed_) * 1e-6 + parsed.first_delay;
}

std::string SensorClock::rule() const {
  if (synchronised_) {
    return "time of a revolution's first firing by the sensor's clock, which is within a minute "
           "of the time of receipt";
  }
  return "time of a revolution's first firing by the sensor's clock, which is not synchronised: it "
         "counts from the time at which the first packet was received";
}

SpinAssembler::SpinAssembler(std::string file, double from) : file_(std::move(file)), from_(from) {}

Result<void> SpinAssembler::add(const Packet& packet) {
  VANTAGE_TRY(const DataPacket parsed, parse_packet(packet, file_));
  const double time = clock_.first_firing(packet, parsed);
  for (std::size_t i = 0; i < parsed.size; ++i) {
    place(parsed, parsed.columns[i], time + static_cast<double>(i) * parsed.model->block_time,
          packet.offset);
  }
  return {};
}

void SpinAssembler::place(const DataPacket& packet, const Column& column, double time,
                          std::uint64_t offset) {
  if (!open_) {
    begin(column.azimuth, time, offset, false);
  } else {
    // Packets may be missing: of all turns that lead to this azimuth, take the one that fits the
    // time.
    const double expected = std::clamp(rate_ * (time - time_), -1e9, 1e9);
    const double step = nearest_to(expected, column.azimuth - azimuth_, kFullTurn);
    turned_ += step;
    const bool jumped =
        std::abs(step) >= kFullTurn || turned_ < -kLargestStepBack || columns_ >= kMostColumns;
    if (jumped) {
      end(false);
      begin(column.azimuth, time, offset, false);
    } else if (turned_ >= kFullTurn) {
      end(true);
      begin(column.azimuth, time, offset, true);
    }
  }
  azimuth_ = column.azimuth;
  time_ = time;
  rate_ = column.turn / packet.model->block_time;
  ++columns_;
  if (open_->stamp >= from_) {
    decoder_.decode(packet, column, time - open_->stamp, open_->points, open_->seconds,
                    open_->rings);
  }
}

void SpinAssembler::begin(std::int32_t azimuth, double time, std::uint64_t offset, bool at_cut) {
  open_.emplace();
  open_->stamp = time;
  open_->offset = offset;
  from_cut_ = at_cut;
  turned_ = azimuth;
  columns_ = 0;
  if (time < from_) return;
  // Revolutions are alike, so a little more than the size of the last one is seldom too small.
  const std::size_t room = last_size_ + last_size_ / 16 + 4 * kChannels;
  open_->points.reserve(room);
  open_->seconds.reserve(room);
  open_->rings.reserve(room);
}

void SpinAssembler::end(bool at_cut) {
  open_->complete = from_cut_ && at_cut;
  if (open_->stamp >= from_) {
    last_size_ = open_->points.size();
    ended_.push_back(*std::move(open_));
  }
  open_.reset();
}

void SpinAssembler::finish() {
  if (open_) end(false);
}

std::optional<Spin> SpinAssembler::take() {
  if (ended_.empty()) return std::nullopt;
  Spin spin = std::move(ended_.front());
  ended_.pop_front();
  return spin;
}

}  // namespace vantage::io::velodyne
