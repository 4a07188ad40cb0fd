#include "io/ros/mcap_writer.hpp"
#include "io/ros/crc32.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "files.hpp"
#include "io/ros/ros_time.hpp"
#include "support/mcap.hpp"

namespace vantage {
namespace {

using namespace io::ros;
using test::check_clear;
using test::content_of;

constexpr std::string_view kMagic = "\x89MCAP0\r\n";

// Opcodes of the MCAP specification.
enum : std::uint8_t {
  kHeader = 1,
  kFooter = 2,
  kSchema = 3,
  kChannel = 4,
  kMessage = 5,
  kChunk = 6,
  kMessageIndex = 7,
  kChunkIndex = 8,
  kStatistics = 11,
  kMetadataRecord = 12,
  kMetadataIndex = 13,
  kSummaryOffset = 14,
  kDataEnd = 15
};

/// Takes the members of a record one after the other.
class Members {
 public:
  explicit Members(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  T number() {
    T value{};
    const std::string_view bytes = take(sizeof(T));
    std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
  }
  std::string_view take(std::size_t size) {
    REQUIRE(size <= rest_.size());
    const std::string_view bytes = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return bytes;
  }
  std::string_view sized() { return take(number<std::uint32_t>()); }
  [[nodiscard]] bool done() const { return rest_.empty(); }

 private:
  std::string_view rest_;
};

struct Record {
  std::uint8_t opcode = 0;
  std::size_t start = 0, length = 0;  // with opcode and size
  std::string_view content;
};

std::vector<Record> records_of(std::string_view bytes) {
  std::vector<Record> records;
  for (std::size_t at = 0; at < bytes.size();) {
    Members head(bytes.substr(at));
    const auto opcode = head.number<std::uint8_t>();
    const auto size = head.number<std::uint64_t>();
    records.push_back({opcode, at, 9 + size, head.take(size)});
    at += 9 + size;
  }
  return records;
}

/// The records of a file; `start` is from its first byte.
std::vector<Record> records_of_file(std::string_view file) {
  REQUIRE(file.size() > 2 * kMagic.size());
  REQUIRE(file.substr(0, kMagic.size()) == kMagic);
  REQUIRE(file.substr(file.size() - kMagic.size()) == kMagic);
  auto records = records_of(file.substr(kMagic.size(), file.size() - 2 * kMagic.size()));
  for (Record& record : records) record.start += kMagic.size();
  return records;
}

std::string opcodes_of(const std::vector<Record>& records) {
  std::string opcodes;
  for (const Record& record : records) opcodes += std::to_string(record.opcode) + ' ';
  return opcodes;
}

/// Bit by bit, unlike the writer's.
std::uint32_t slow_crc(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char byte : bytes) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      const bool differs = ((crc ^ (static_cast<unsigned char>(byte) >> bit)) & 1U) != 0;
      crc = (crc >> 1U) ^ (differs ? 0xEDB88320U : 0U);
    }
  }
  return ~crc;
}

struct Chunk {
  std::uint64_t first = 0, last = 0;
  std::string_view compression;
  std::uint64_t compressed = 0;
  std::string records;
};

std::string decompressed(std::string_view bytes, std::string_view compression, std::size_t size) {
  if (compression.empty()) return std::string(bytes);
  std::string out(size, '\0');
  if (compression == "zstd") {
    REQUIRE(ZSTD_decompress(out.data(), size, bytes.data(), bytes.size()) == size);
    return out;
  }
  REQUIRE(compression == "lz4");
  LZ4F_dctx* context = nullptr;
  REQUIRE(LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION)) == 0U);
  std::size_t written = size, read = bytes.size();
  const std::size_t left =
      LZ4F_decompress(context, out.data(), &written, bytes.data(), &read, nullptr);
  LZ4F_freeDecompressionContext(context);
  REQUIRE(left == 0);
  REQUIRE(written == size);
  REQUIRE(read == bytes.size());
  return out;
}

Chunk chunk_of(const Record& record) {
  REQUIRE(record.opcode == kChunk);
  Members members(record.content);
  Chunk chunk;
  chunk.first = members.number<std::uint64_t>();
  chunk.last = members.number<std::uint64_t>();
  const auto size = members.number<std::uint64_t>();
  const auto crc = members.number<std::uint32_t>();
  chunk.compression = members.sized();
  chunk.compressed = members.number<std::uint64_t>();
  chunk.records = decompressed(members.take(chunk.compressed), chunk.compression, size);
  CHECK(members.done());
  CHECK(chunk.records.size() == size);
  CHECK(crc == slow_crc(chunk.records));
  return chunk;
}

McapWriter new_writer(const std::filesystem::path& path,
                      McapCompression compression = McapCompression::zstd) {
  auto writer = McapWriter::create(path, compression);
  REQUIRE_MESSAGE(writer, to_string(writer.error()));
  return *std::move(writer);
}

McapWriter::ChannelId add_channel(McapWriter& writer, const std::string& topic,
                                  std::string_view type) {
  const auto schema = schema_of(type);
  REQUIRE(schema);
  const auto channel = writer.add_channel(topic, *schema);
  REQUIRE(channel);
  return *channel;
}

void write(McapWriter& writer, McapWriter::ChannelId channel, double stamp,
           std::string_view bytes) {
  const auto written = writer.write(channel, stamp, bytes);
  REQUIRE_MESSAGE(written, to_string(written.error()));
}

/// Two topics of one type and one of another, metadata, and two chunks: 3 MiB fit into the first.
std::string small_file(McapCompression compression) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "run.mcap";
  McapWriter writer = new_writer(path, compression);
  REQUIRE(writer.add_metadata("vantage", {{"origin_x", "500000"}, {"config", "c.toml"}}));
  const auto a = add_channel(writer, "/a", "std_msgs/String");
  const auto b = add_channel(writer, "/b", "tf2_msgs/TFMessage");
  add_channel(writer, "/silent", "std_msgs/String");
  write(writer, a, 2.5, "first");
  write(writer, b, 0.1, std::string(3U << 20U, 'x'));
  write(writer, a, 1.0, std::string(2U << 20U, 'y'));
  write(writer, b, 3.0, "");
  REQUIRE(writer.commit());
  return content_of(path);
}

TEST_CASE("crc32: the check value of the standard, in one piece and in parts") {
  CHECK(crc32("123456789") == 0xCBF43926U);
  CHECK(crc32("") == 0U);
  CHECK(crc32("56789", crc32("", crc32("1234"))) == 0xCBF43926U);
}

TEST_CASE("time_of: whole nanoseconds, and stamps that are no time") {
  const auto check = [](double stamp, std::int32_t sec, std::uint32_t nanosec) {
    const auto time = time_of(stamp);
    REQUIRE(time);
    CHECK(time->sec == sec);
    CHECK(time->nanosec == nanosec);
  };
  check(0.0, 0, 0);
  check(-0.0, 0, 0);
  check(0.1, 0, 100'000'000);
  check(1.5, 1, 500'000'000);
  check(0.9999999999, 1, 0);
  check(2147483647.5, 2147483647, 500'000'000);
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double stamp : {-1e-9, -1.0, 2147483648.0, 1e300, infinity, -infinity, std::nan("")}) {
    CAPTURE(stamp);
    const auto time = time_of(stamp);
    REQUIRE_FALSE(time);
    CHECK(time.error().code == ErrorCode::invalid_input);
    CHECK(time.error().message.find("is no ROS time") != std::string::npos);
  }
  CHECK(time_of(2147483647.5)->nanoseconds() == 2'147'483'647'500'000'000U);
}

TEST_CASE("McapWriter: the records of a file, in their order") {
  for (const auto compression :
       {McapCompression::none, McapCompression::lz4, McapCompression::zstd}) {
    const std::string file = small_file(compression);
    const auto records = records_of_file(file);
    // Header, data (two chunks), summary in groups, their offsets, footer.
    CHECK(opcodes_of(records) ==
          "1 12 3 4 3 4 4 6 7 7 6 7 15 3 3 4 4 4 11 8 8 13 14 14 14 14 14 2 ");
    Members header(records[0].content);
    CHECK(header.sized() == "ros2");
    CHECK(header.sized() == "vantage");
    CHECK(header.done());
    Members metadata(records[1].content);
    CHECK(metadata.sized() == "vantage");
    Members entries(metadata.sized());
    for (const auto* const text : {"config", "c.toml", "origin_x", "500000"}) {
      CHECK(entries.sized() == text);
    }
    CHECK(entries.done());
  }
}

TEST_CASE("McapWriter: schemas and channels, the same in the data and in the summary") {
  const std::string file = small_file(McapCompression::zstd);
  const auto records = records_of_file(file);
  const std::array<std::size_t, 5> in_data{2, 4, 3, 5, 6}, in_summary{13, 14, 15, 16, 17};
  for (std::size_t i = 0; i < 5; ++i) {
    CHECK(records[in_data[i]].content == records[in_summary[i]].content);
  }
  Members schema(records[4].content);
  CHECK(schema.number<std::uint16_t>() == 2);
  CHECK(schema.sized() == "tf2_msgs/msg/TFMessage");
  CHECK(schema.sized() == "ros2msg");
  CHECK(schema.sized().starts_with("geometry_msgs/TransformStamped[] transforms\n====="));
  CHECK(schema.done());
  const auto check = [&](std::size_t record, std::uint16_t id, std::uint16_t schema_id,
                         std::string_view topic) {
    Members channel(records[record].content);
    CHECK(channel.number<std::uint16_t>() == id);
    CHECK(channel.number<std::uint16_t>() == schema_id);
    CHECK(channel.sized() == topic);
    CHECK(channel.sized() == "cdr");
    Members metadata(channel.sized());
    CHECK(metadata.sized() == "offered_qos_profiles");
    CHECK(metadata.sized().empty());
    CHECK(channel.done());
  };
  check(3, 1, 1, "/a");
  check(5, 2, 2, "/b");
  check(6, 3, 1, "/silent");
}

TEST_CASE("McapWriter: messages come out of their chunks, and the indexes point at them") {
  for (const auto& [compression, name] :
       {std::pair(McapCompression::none, ""), std::pair(McapCompression::lz4, "lz4"),
        std::pair(McapCompression::zstd, "zstd")}) {
    CAPTURE(name);
    const std::string file = small_file(compression);
    const auto records = records_of_file(file);
    const Chunk first = chunk_of(records[7]), second = chunk_of(records[10]);
    CHECK(first.compression == name);
    CHECK((first.compressed < 100'000) == (compression != McapCompression::none));
    CHECK(first.first == 100'000'000U);
    CHECK(first.last == 2'500'000'000U);
    CHECK(second.first == 3'000'000'000U);
    CHECK(second.last == 3'000'000'000U);
    const auto messages = records_of(first.records);
    REQUIRE(opcodes_of(messages) == "5 5 5 ");
    REQUIRE(opcodes_of(records_of(second.records)) == "5 ");
    Members message(messages[2].content);
    CHECK(message.number<std::uint16_t>() == 1);               // channel
    CHECK(message.number<std::uint32_t>() == 1);               // its second message
    CHECK(message.number<std::uint64_t>() == 1'000'000'000U);  // recorded
    CHECK(message.number<std::uint64_t>() == 1'000'000'000U);  // published
    CHECK(message.take(2U << 20U) == std::string(2U << 20U, 'y'));
    CHECK(message.done());

    Members index(records[8].content);
    CHECK(index.number<std::uint16_t>() == 1);
    Members entries(index.sized());
    CHECK(entries.number<std::uint64_t>() == 2'500'000'000U);
    CHECK(entries.number<std::uint64_t>() == messages[0].start);
    CHECK(entries.number<std::uint64_t>() == 1'000'000'000U);
    CHECK(entries.number<std::uint64_t>() == messages[2].start);
    CHECK(entries.done());
    Members other(records[9].content);
    CHECK(other.number<std::uint16_t>() == 2);
    Members other_entries(other.sized());
    CHECK(other_entries.number<std::uint64_t>() == 100'000'000U);
    CHECK(other_entries.number<std::uint64_t>() == messages[1].start);
    CHECK(other_entries.done());
  }
}

TEST_CASE("McapWriter: the summary's offsets point at what they say, and the checksums agree") {
  const std::string file = small_file(McapCompression::lz4);
  const auto records = records_of_file(file);
  std::map<std::size_t, const Record*> at;
  for (const Record& record : records) at[record.start] = &record;

  const Record& footer = records.back();
  Members end(footer.content);
  const auto summary = end.number<std::uint64_t>(), offsets = end.number<std::uint64_t>();
  CHECK(summary == records[13].start);
  CHECK(offsets == records[22].start);
  const std::size_t crc_at = footer.start + footer.length - sizeof(std::uint32_t);
  CHECK(end.number<std::uint32_t>() ==
        slow_crc(std::string_view(file).substr(summary, crc_at - summary)));
  CHECK(end.done());
  Members data_end(records[12].content);
  CHECK(data_end.number<std::uint32_t>() ==
        slow_crc(std::string_view(file).substr(0, records[12].start)));
  CHECK(data_end.done());

  std::size_t grouped = summary;
  for (std::size_t i = 22; i < 27; ++i) {
    Members offset(records[i].content);
    const auto opcode = offset.number<std::uint8_t>();
    CHECK(offset.number<std::uint64_t>() == grouped);
    const auto length = offset.number<std::uint64_t>();
    for (const Record& record : records_of(std::string_view(file).substr(grouped, length))) {
      CHECK(record.opcode == opcode);
    }
    grouped += length;
  }
  CHECK(grouped == offsets);

  for (const std::size_t i : {19U, 20U}) {
    Members index(records[i].content);
    const Record& chunk = records[i == 19 ? 7 : 10];
    const Chunk content = chunk_of(chunk);
    CHECK(index.number<std::uint64_t>() == content.first);
    CHECK(index.number<std::uint64_t>() == content.last);
    CHECK(index.number<std::uint64_t>() == chunk.start);
    CHECK(index.number<std::uint64_t>() == chunk.length);
    Members channels(index.sized());
    std::size_t length = 0;
    while (!channels.done()) {
      const auto channel = channels.number<std::uint16_t>();
      const auto place = channels.number<std::uint64_t>();
      REQUIRE(at.contains(place));
      CHECK(at[place]->opcode == kMessageIndex);
      CHECK(Members(at[place]->content).number<std::uint16_t>() == channel);
      length += at[place]->length;
    }
    CHECK(index.number<std::uint64_t>() == length);
    CHECK(index.sized() == "lz4");
    CHECK(index.number<std::uint64_t>() == content.compressed);
    CHECK(index.number<std::uint64_t>() == content.records.size());
    CHECK(index.done());
  }

  Members metadata(records[21].content);
  CHECK(metadata.number<std::uint64_t>() == records[1].start);
  CHECK(metadata.number<std::uint64_t>() == records[1].length);
  CHECK(metadata.sized() == "vantage");
}

TEST_CASE("McapWriter: statistics, also of a file without messages") {
  const auto check = [](const std::string& file, std::uint64_t messages, std::uint16_t schemas,
                        std::uint32_t channels, std::uint32_t metadata, std::uint32_t chunks,
                        std::uint64_t first, std::uint64_t last,
                        const std::vector<std::uint64_t>& counts) {
    for (const Record& record : records_of_file(file)) {
      if (record.opcode != kStatistics) continue;
      Members statistics(record.content);
      CHECK(statistics.number<std::uint64_t>() == messages);
      CHECK(statistics.number<std::uint16_t>() == schemas);
      CHECK(statistics.number<std::uint32_t>() == channels);
      CHECK(statistics.number<std::uint32_t>() == 0);
      CHECK(statistics.number<std::uint32_t>() == metadata);
      CHECK(statistics.number<std::uint32_t>() == chunks);
      CHECK(statistics.number<std::uint64_t>() == first);
      CHECK(statistics.number<std::uint64_t>() == last);
      Members entries(statistics.sized());
      for (std::uint16_t i = 0; i < counts.size(); ++i) {
        CHECK(entries.number<std::uint16_t>() == i + 1);
        CHECK(entries.number<std::uint64_t>() == counts[i]);
      }
      CHECK(entries.done());
      CHECK(statistics.done());
      return;
    }
    FAIL("there are no statistics");
  };
  check(small_file(McapCompression::zstd), 4, 2, 3, 1, 2, 100'000'000U, 3'000'000'000U, {2, 2, 0});
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "empty.mcap";
  REQUIRE(test::write_mcap(path, {}));
  check(content_of(path), 0, 0, 0, 0, 0, 0, 0, {});
  CHECK(opcodes_of(records_of_file(content_of(path))) == "1 15 11 14 2 ");
}

TEST_CASE("McapWriter: the same messages give the same bytes; none without a commit") {
  for (const auto compression :
       {McapCompression::none, McapCompression::lz4, McapCompression::zstd}) {
    CHECK(small_file(compression) == small_file(compression));
  }
  const test::TemporaryFolder folder;
  {
    McapWriter writer = new_writer(folder.path() / "run.mcap");
    const auto channel = add_channel(writer, "/a", "std_msgs/String");
    write(writer, channel, 1.0, std::string(9U << 20U, 'x'));
  }
  CHECK(std::filesystem::is_empty(folder.path()));
}

TEST_CASE("McapWriter: what cannot be written") {
  const test::TemporaryFolder folder;
  McapWriter writer = new_writer(folder.path() / "run.mcap");
  const auto channel = add_channel(writer, "/a", "std_msgs/String");
  const auto refused = [&](const Result<void>& done, const std::string& expected) {
    REQUIRE_FALSE(done);
    check_clear(done.error(), ErrorCode::invalid_input, "run.mcap", expected);
  };
  refused(writer.write(0, 1.0, "x"), "channel 0, which was not added");
  refused(writer.write(2, 1.0, "x"), "channel 2, which was not added");
  refused(writer.write(channel, std::nan(""), "x"), "the stamp nan s is no ROS time");
  refused(writer.write(channel, -1.0, "x"), "the stamp -1 s is no ROS time");
  refused(writer.write(channel, 3e9, "x"), "is no ROS time");
  const auto twice = writer.add_channel("/a", *schema_of("tf2_msgs/TFMessage"));
  REQUIRE_FALSE(twice);
  check_clear(twice.error(), ErrorCode::invalid_input, "run.mcap", "/a exists already");
  // None of it is in the file.
  REQUIRE(writer.commit());
  CHECK(opcodes_of(records_of_file(content_of(folder.path() / "run.mcap"))) ==
        "1 3 4 15 3 4 11 14 14 14 2 ");
  CHECK_FALSE(writer.commit());

  const auto nowhere = McapWriter::create(folder.path() / "absent" / "run.mcap");
  REQUIRE_FALSE(nowhere);
  check_clear(nowhere.error(), ErrorCode::not_found, "run.mcap", "cannot be written");
}

TEST_CASE("schema_of: a type's definition, then each type in it once") {
  const auto schema = schema_of("geometry_msgs/PoseStamped");
  REQUIRE(schema);
  CHECK(schema->name == "geometry_msgs/msg/PoseStamped");
  const std::string line(80, '=');
  CHECK(schema->text ==
        "std_msgs/Header header\ngeometry_msgs/Pose pose\n" + line +
            "\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n" + line +
            "\nMSG: geometry_msgs/Pose\ngeometry_msgs/Point position\n"
            "geometry_msgs/Quaternion orientation\n" +
            line + "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" + line +
            "\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n" + line +
            "\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\n"
            "float64 w 1\n");
  CHECK(schema_of("std_msgs/String")->text == "string data\n");
  for (const auto* const type : {"", "my_msgs/Own", "std_msgs/msg/String", "String"}) {
    CAPTURE(type);
    const auto unknown = schema_of(type);
    REQUIRE_FALSE(unknown);
    CHECK(unknown.error().code == ErrorCode::invalid_input);
  }
}

}  // namespace
}  // namespace vantage
