#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "vantage/kit/byte_io.hpp"

/// The records of rosbag1 2.0: http://wiki.ros.org/Bags/Format/2.0
namespace vantage::io::ros::rosbag1 {

enum Operation : std::uint8_t {
  kMessage = 2,
  kBagHeader = 3,
  kIndexData = 4,
  kChunk = 5,
  kChunkInfo = 6,
  kConnection = 7,
};

inline constexpr std::string_view kMagic = "#ROSBAG V2.0\n";

/// "name=value" after their number of bytes, one after the other.
class Fields {
 public:
  Fields() = default;
  [[nodiscard]] static std::optional<Fields> parse(std::string_view bytes) {
    ByteReader reader(bytes);
    while (reader.left() != 0) {
      const std::string_view field = reader.text<std::uint32_t>();
      if (!reader.ok() || field.find('=') == std::string_view::npos) return std::nullopt;
    }
    Fields fields;
    fields.bytes_ = bytes;
    return fields;
  }

  [[nodiscard]] std::optional<std::string_view> text(std::string_view name) const {
    ByteReader reader(bytes_);
    while (reader.left() != 0) {
      const std::string_view field = reader.text<std::uint32_t>();
      if (field.starts_with(name) && field.substr(name.size()).starts_with('=')) {
        return field.substr(name.size() + 1);
      }
    }
    return std::nullopt;
  }
  template <class Integer>
  [[nodiscard]] std::optional<Integer> integer(std::string_view name) const {
    const auto value = text(name);
    if (!value || value->size() != sizeof(Integer)) return std::nullopt;
    return ByteReader(*value).number<Integer>();
  }
  /// Seconds and nanoseconds [ns].
  [[nodiscard]] std::optional<std::int64_t> time(std::string_view name) const {
    const auto value = integer<std::uint64_t>(name);
    if (!value) return std::nullopt;
    const std::uint64_t seconds = *value & 0xFFFFFFFFU;
    return static_cast<std::int64_t>(seconds * 1'000'000'000U + (*value >> 32));
  }

 private:
  std::string_view bytes_;
};

/// A record without its data, which may be large.
struct RecordHead {
  Fields fields;
  std::uint8_t operation = 0;
  std::uint64_t data_offset = 0, data_size = 0;  // data_offset is from the record's beginning
  [[nodiscard]] std::uint64_t size() const noexcept { return data_offset + data_size; }
};

enum class Reading : std::uint8_t { good, cut, damaged };

/// Returns `cut` if the head extends beyond `bytes`.
[[nodiscard]] inline Reading read_head(std::string_view bytes, RecordHead& head) {
  ByteReader reader(bytes);
  const std::string_view header = reader.text<std::uint32_t>();
  head.data_size = reader.number<std::uint32_t>();
  head.data_offset = reader.offset();
  if (!reader.ok()) return Reading::cut;
  const auto fields = Fields::parse(header);
  const auto operation = fields ? fields->integer<std::uint8_t>("op") : std::nullopt;
  if (!operation) return Reading::damaged;
  head.fields = *fields;
  head.operation = *operation;
  return Reading::good;
}

}  // namespace vantage::io::ros::rosbag1
