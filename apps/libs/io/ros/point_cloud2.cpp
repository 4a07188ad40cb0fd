#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>

#include "io/point_fields.hpp"
#include "io/ros/messages.hpp"
#include "io/ros/wire_reader.hpp"

namespace vantage::io::ros {
namespace {

/// The type that sensor_msgs/PointField.datatype stands for; the number is the position in
/// kDatatypes.
struct Datatype {
  std::string_view name;
  std::size_t size = 0;  // [bytes]; 0 for an unknown type
  ReadCoordinate little = nullptr, big = nullptr;
};

template <class Stored>
constexpr Datatype datatype(std::string_view name) {
  return {name, sizeof(Stored), read_coordinate<Stored, ByteOrder::little>,
          read_coordinate<Stored, ByteOrder::big>};
}

constexpr std::array<Datatype, 9> kDatatypes{
    Datatype{},
    datatype<std::int8_t>("int8"),
    datatype<std::uint8_t>("uint8"),
    datatype<std::int16_t>("int16"),
    datatype<std::uint16_t>("uint16"),
    datatype<std::int32_t>("int32"),
    datatype<std::uint32_t>("uint32"),
    datatype<float>("float32"),
    datatype<double>("float64"),
};
constexpr std::uint8_t kUint8 = 2, kFirstFloatingPoint = 7;

struct Field {
  std::string_view name;
  std::uint32_t offset = 0;  // in a point [bytes]
  std::uint8_t datatype = 0;
  std::uint32_t count = 0;

  [[nodiscard]] const Datatype& type() const noexcept {
    return kDatatypes[datatype < kDatatypes.size() ? datatype : 0];
  }
};

/// The members of the message, undecoded.
struct Raw {
  Header header;
  std::uint32_t height = 0, width = 0;
  std::vector<Field> fields;
  bool is_big_endian = false;
  std::uint32_t point_step = 0, row_step = 0;
  std::string_view data;
  std::size_t data_offset = 0;
};

Result<std::vector<Field>> read_fields(WireReader& reader) {
  constexpr std::size_t kShortest = 4 + 4 + 1 + 4;  // without a letter in the name [bytes]
  VANTAGE_TRY(const auto count, reader.count(kShortest, "fields"));
  std::vector<Field> fields(count);
  for (Field& field : fields) {
    VANTAGE_TRY(field.name, reader.text("fields.name"));
    VANTAGE_TRY(field.offset, reader.number<std::uint32_t>("fields.offset"));
    VANTAGE_TRY(field.datatype, reader.number<std::uint8_t>("fields.datatype"));
    VANTAGE_TRY(field.count, reader.number<std::uint32_t>("fields.count"));
  }
  return fields;
}

// sensor_msgs/PointCloud2: Header header, uint32 height, uint32 width, PointField[] fields,
// bool is_bigendian, uint32 point_step, uint32 row_step, uint8[] data, bool is_dense.
Result<Raw> read_raw(WireReader& reader) {
  Raw raw;
  VANTAGE_TRY(raw.header, reader.header());
  VANTAGE_TRY(raw.height, reader.number<std::uint32_t>("height"));
  VANTAGE_TRY(raw.width, reader.number<std::uint32_t>("width"));
  VANTAGE_TRY(raw.fields, read_fields(reader));
  VANTAGE_TRY(const auto is_big_endian, reader.number<std::uint8_t>("is_bigendian"));
  raw.is_big_endian = is_big_endian != 0;
  VANTAGE_TRY(raw.point_step, reader.number<std::uint32_t>("point_step"));
  VANTAGE_TRY(raw.row_step, reader.number<std::uint32_t>("row_step"));
  VANTAGE_TRY(const auto size, reader.count(1, "bytes of data"));
  raw.data_offset = reader.offset();
  VANTAGE_TRY(raw.data, reader.bytes(size, "data"));
  // Points that are not finite are found, whatever this says.
  VANTAGE_CHECK(reader.number<std::uint8_t>("is_dense"));
  return raw;
}

std::string description(const Field& field) {
  const std::string type = field.type().size > 0 ? std::string(field.type().name)
                                                 : fmt::format("(unknown type {})", field.datatype);
  if (field.count <= 1) return fmt::format("{} {}", field.name, type);
  return fmt::format("{} {}[{}]", field.name, type, field.count);
}

/// Checks that a point has exactly one number there.
Result<void> check_number(const WireReader& reader, const Raw& raw, const Field& field) {
  if (field.type().size == 0) {
    return reader.error(
        fmt::format("field {} has the datatype {}, expected 1 (INT8) to 8 (FLOAT64)", field.name,
                    field.datatype));
  }
  if (field.count > 1) {  // old versions of PCL wrote 0 and meant 1
    return reader.error(fmt::format("field {} has {} values, expected 1", field.name, field.count));
  }
  const std::uint64_t end = std::uint64_t{field.offset} + field.type().size;
  if (end > raw.point_step) {
    return reader.error(fmt::format("field {} ends at byte {} of a point, but point_step is {}",
                                    field.name, end, raw.point_step));
  }
  return {};
}

Result<Field> find_axis(const WireReader& reader, const Raw& raw, std::size_t axis) {
  for (const std::string_view name : {kAxisNames[axis], kUpperAxisNames[axis]}) {
    const auto is_it = [&](const Field& field) { return field.name == name; };
    const auto found = std::find_if(raw.fields.begin(), raw.fields.end(), is_it);
    if (found == raw.fields.end()) continue;
    if (std::find_if(found + 1, raw.fields.end(), is_it) != raw.fields.end()) {
      return reader.error(fmt::format("two fields are named {}", name));
    }
    VANTAGE_CHECK(check_number(reader, raw, *found));
    return *found;
  }
  return reader.error(
      fmt::format("no field {} or {} among the {} fields; a point cloud needs x, y and z",
                  kAxisNames[axis], kUpperAxisNames[axis], raw.fields.size()));
}

/// The fields that hold the coordinates, the times and the tags of the points.
struct Layout {
  std::array<Field, 3> axes;
  std::optional<Field> time;
  TimeFormat time_format;
  std::optional<Field> tag;
};

Result<Layout> find_layout(const WireReader& reader, const Raw& raw) {
  Layout layout;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    VANTAGE_TRY(layout.axes[axis], find_axis(reader, raw, axis));
  }
  for (const Field& field : raw.fields) {
    if (field.name == "tag" && field.datatype == kUint8 && field.count <= 1) layout.tag = field;
    if (field.type().size == 0) continue;
    const auto format =
        time_format(field.name, field.datatype >= kFirstFloatingPoint, field.type().size);
    if (!format || (layout.time && layout.time_format.preference <= format->preference)) continue;
    layout.time = field;
    layout.time_format = *format;
  }
  for (const auto& field : {layout.time, layout.tag}) {
    if (field) VANTAGE_CHECK(check_number(reader, raw, *field));
  }
  return layout;
}

/// The columns of the points that begin at `first`.
PointColumns columns_of(const Layout& layout, const Raw& raw, const char* first) {
  const auto column = [&](const Field& field) {
    const Datatype& type = field.type();
    return CoordinateColumn{first + field.offset, raw.point_step,
                            raw.is_big_endian ? type.big : type.little};
  };
  PointColumns columns;
  std::transform(layout.axes.begin(), layout.axes.end(), columns.axes.begin(), column);
  if (layout.time) columns.time = column(*layout.time);
  if (layout.tag) columns.tag = column(*layout.tag);
  return columns;
}

/// The distance of the rows in the data [bytes]. Some drivers state 0, or the size of all rows; if
/// the data are exactly as large as the points, the rows follow each other.
std::uint64_t row_step_of(const Raw& raw) {
  const std::uint64_t row = std::uint64_t{raw.width} * raw.point_step;
  std::uint64_t all = 0;
  if (__builtin_mul_overflow(row, raw.height, &all) || all != raw.data.size()) return raw.row_step;
  return raw.row_step == 0 || raw.row_step == all ? row : raw.row_step;
}

/// Checks that the data hold as many points as the message says.
Result<void> check_size(const WireReader& reader, const Raw& raw, std::uint64_t row_step) {
  const std::uint64_t row = std::uint64_t{raw.width} * raw.point_step;
  if (raw.height > 1 && row_step < row) {
    return reader.error(
        fmt::format("row_step is {}, expected at least width * point_step = {} * "
                    "{} = {}",
                    raw.row_step, raw.width, raw.point_step, row));
  }
  // Neither factor is above 2^32 - 1, and a row is not larger than row_step, so nothing overflows.
  // A cloud of one row does not use row_step, which some drivers leave at 0.
  const std::uint64_t needed = std::uint64_t{raw.height - 1} * row_step;
  if (row <= raw.data.size() && needed <= raw.data.size() - row) return {};
  return reader.error(fmt::format(
      "there are {} bytes of data from byte {} on, expected {} rows of {} points of {} "
      "bytes, a row every {} bytes",
      raw.data.size(), raw.data_offset, raw.height, raw.width, raw.point_step, raw.row_step));
}

Result<LoadedCloud> read_points(const WireReader& reader, const Raw& raw) {
  LoadedCloud cloud;
  if (raw.width == 0 || raw.height == 0) return cloud;  // such a cloud need not have fields
  VANTAGE_TRY(const auto layout, find_layout(reader, raw));
  const std::uint64_t row_step = row_step_of(raw);
  VANTAGE_CHECK(check_size(reader, raw, row_step));
  if (layout.time) {
    cloud.times.field = layout.time->name;
    cloud.times.format = layout.time_format;
  }
  const bool is_one_row = raw.height == 1 || row_step == std::uint64_t{raw.width} * raw.point_step;
  const std::size_t rows = is_one_row ? 1 : raw.height;
  const std::size_t points = std::size_t{raw.width} * raw.height;
  for (std::size_t row = 0; row < rows; ++row) {
    add_columns(cloud, columns_of(layout, raw, raw.data.data() + row * row_step), points / rows);
  }
  return cloud;
}

}  // namespace

Result<CloudMessage> parse_point_cloud2(std::string_view bytes, Encoding encoding,
                                        const SourceLocation& where) {
  VANTAGE_TRY(auto reader, WireReader::open(bytes, encoding, where));
  VANTAGE_TRY(const auto raw, read_raw(reader));
  CloudMessage message;
  VANTAGE_TRY(message.cloud, read_points(reader, raw));
  message.header = raw.header;
  message.width = raw.width;
  message.height = raw.height;
  for (const Field& field : raw.fields) message.fields.push_back(description(field));
  return message;
}

}  // namespace vantage::io::ros
