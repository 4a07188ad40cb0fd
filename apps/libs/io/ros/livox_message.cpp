#include <array>
#include <cstdint>

#include "io/point_fields.hpp"
#include "io/ros/messages.hpp"
#include "io/ros/wire_reader.hpp"

namespace vantage::io::ros {
namespace {

// livox_ros_driver(2)/CustomPoint: uint32 offset_time, float32 x, y, z, uint8 reflectivity, tag,
// line.
constexpr std::size_t kPoint = 19;       // [bytes]
constexpr std::size_t kPointInCdr = 20;  // from one to the next: the time is aligned [bytes]
constexpr std::size_t kTime = 0, kX = 4, kTag = 17;  // in a point [bytes]

template <ByteOrder order>
PointColumns columns_of(const char* first, std::size_t stride) {
  PointColumns columns;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    columns.axes[axis] = {first + kX + axis * sizeof(float), stride, read_coordinate<float, order>};
  }
  columns.time = {first + kTime, stride, read_coordinate<std::uint32_t, order>};
  columns.tag = {first + kTag, stride, read_coordinate<std::uint8_t, order>};
  return columns;
}

}  // namespace

// livox_ros_driver(2)/CustomMsg: Header header, uint64 timebase, uint32 point_num, uint8 lidar_id,
// uint8[3] rsvd, CustomPoint[] points.
Result<CloudMessage> parse_livox(std::string_view bytes, Encoding encoding,
                                 const SourceLocation& where) {
  VANTAGE_TRY(auto reader, WireReader::open(bytes, encoding, where));
  CloudMessage message;
  VANTAGE_TRY(message.header, reader.header());
  VANTAGE_CHECK(reader.number<std::uint64_t>("timebase"));
  // Programs that leave out points keep the old number: the length of the array tells.
  VANTAGE_CHECK(reader.number<std::uint32_t>("point_num"));
  VANTAGE_CHECK(reader.bytes(4, "lidar_id and rsvd"));
  VANTAGE_TRY(const auto count, reader.count(kPoint, "points"));
  message.fields = {"offset_time uint32", "x float32", "y float32", "z float32",
                    "reflectivity uint8", "tag uint8", "line uint8"};
  message.width = static_cast<std::uint32_t>(count);
  message.height = 1;
  if (count == 0) return message;
  const std::size_t stride = encoding == Encoding::ros1 ? kPoint : kPointInCdr;
  VANTAGE_TRY(const auto points, reader.bytes((count - 1) * stride + kPoint, "points"));
  message.cloud.times.field = "offset_time";
  message.cloud.times.format =
      *time_format(message.cloud.times.field, false, sizeof(std::uint32_t));
  add_columns(message.cloud,
              reader.order() == ByteOrder::little
                  ? columns_of<ByteOrder::little>(points.data(), stride)
                  : columns_of<ByteOrder::big>(points.data(), stride),
              count);
  return message;
}

}  // namespace vantage::io::ros
