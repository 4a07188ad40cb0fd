#include "bags.hpp"

namespace vantage::test {
namespace {

using io::ros::open_mcap;

std::vector<TestMessage> samples() {
  return two_topics("sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/Imu");
}

const std::string kMagic("\x89MCAP0\r\n", 8);

/// A closed file without a summary.
std::string closed(const std::string& records) {
  return kMagic + records + mcap_record(0x0F, std::string(4, '\0')) +
         mcap_record(0x02, std::string(20, '\0')) + kMagic;
}
std::string chunk(const std::string& compression, const std::string& stored, std::uint64_t size,
                  std::uint32_t checksum = 0) {
  return mcap_record(0x06, std::string(16, '\0') + little(size) + little(checksum) +
                               sized(compression) + little(std::uint64_t{stored.size()}) + stored);
}
std::string schema(std::uint16_t number, const std::string& name = "t/msg/T") {
  return mcap_record(0x03, little(number) + sized(name) + sized("ros2msg") + sized(""));
}
std::string channel(std::uint16_t number, std::uint16_t type, const std::string& topic = "/a",
                    const std::string& encoding = "cdr") {
  return mcap_record(0x04,
                     little(number) + little(type) + sized(topic) + sized(encoding) + sized(""));
}
std::string message(std::uint16_t number, std::uint64_t time = 5) {
  return mcap_record(0x05,
                     little(number) + std::string(4, '\0') + little(time) + little(time) + "bytes");
}

}  // namespace

TEST_CASE("MCAP: topics, counts, order, selection and seeking, in any compression") {
  for (const std::string compression : {"", "lz4", "zstd"}) {
    const std::string name = compression.empty() ? "none" : compression;
    check_two_topics(open_mcap, mcap(samples(), {.compression = compression}),
                     "MCAP (" + name + ")");
    check_two_topics(open_mcap, mcap(samples(), {.compression = compression, .indexed = false}),
                     "MCAP (" + name + "), not indexed");
  }
  check_two_topics(open_mcap, mcap(samples(), {.chunked = false}), "MCAP, not indexed");
}

TEST_CASE("MCAP: messages outside of the chunks of an indexed file are not lost") {
  const std::string bag = mcap(samples());
  // Before the data end the offsets in the index stay right.
  const std::string end = mcap_record(0x0F, std::string(4, '\0'));
  const std::size_t at = bag.find(end);
  REQUIRE(at != std::string::npos);
  std::string more = bag;
  const std::string extra = message(1, 1'700'000'000'000'000'000);
  more.insert(at, extra);
  const std::size_t footer = more.size() - 8 - 20;
  more.replace(footer, 8, little(std::uint64_t{at + extra.size() + end.size()}));
  more.replace(footer + 16, 4, std::string(4, '\0'));  // the checksum of the summary
  const Reading reading = read_bytes(open_mcap, more);
  CHECK_FALSE(reading.ending.has_value());
  REQUIRE(reading.messages.size() == 11);
  CHECK(reading.messages.back().bytes == "bytes");
}

TEST_CASE("MCAP: topics that nobody parses are listed") {
  const std::string bag = closed(channel(3, 0, "/json", "json") + schema(2, "pkg/Type") +
                                 channel(4, 2, "/ros1", "ros1") + message(3) + message(4));
  const auto reader = open_mcap(io::InputFile::of_memory(bag, "test.bag"));
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  REQUIRE((*reader)->topics().size() == 2);
  CHECK_FALSE((*reader)->topics()[0].encoding.has_value());
  CHECK((*reader)->topics()[0].encoding_name == "json");
  CHECK((*reader)->topics()[1].encoding == io::ros::Encoding::ros1);
  CHECK((*reader)->topics()[1].type == "pkg/Type");
  CHECK(read_on(**reader).messages.size() == 2);
}

TEST_CASE("MCAP: other records and unknown ones are skipped") {
  const std::string others = mcap_record(0x09, "attachment") + mcap_record(0x0C, "metadata") +
                             mcap_record(0x80, "private") + mcap_record(0x42, "");
  const std::string bag = closed(others + schema(1) + channel(1, 1) + others + message(1) + others);
  const Reading reading = read_bytes(open_mcap, bag);
  CHECK_FALSE(reading.ending.has_value());
  CHECK(reading.messages.size() == 1);
}

TEST_CASE("MCAP: cut at every byte") {
  for (const std::string compression : {"", "lz4", "zstd"}) {
    check_cuts(open_mcap, mcap(samples(), {.compression = compression}), compression.empty());
  }
  check_cuts(open_mcap, mcap(samples(), {.chunked = false}), true);
}

TEST_CASE("MCAP: flipped bits") {
  check_flips(open_mcap, mcap(samples()), 1);
  check_flips(open_mcap, mcap(samples(), {.compression = "zstd", .indexed = false}), 1);
  check_flips(open_mcap, mcap(samples(), {.chunked = false}), 1);
}

TEST_CASE("MCAP: what is not read") {
  check_ends(open_mcap, "something else", 0, "begins with 'somethin'");
  check_ends(open_mcap, "\x89MCAP9\r\n", 0, "expected the magic of MCAP 0", ErrorCode::unsupported);
  check_ends(open_mcap, closed(""), 0, "the bag has no topic");
  check_ends(open_mcap, closed(chunk("xz", "abc", 3)), 0, "compression 'xz'",
             ErrorCode::unsupported);
}

TEST_CASE("MCAP: malformed records") {
  const std::string good = schema(1) + channel(1, 1) + message(1);
  CHECK(read_bytes(open_mcap, closed(good + good)).messages.size() == 2);  // said twice: no harm
  const auto refused = [&good](const std::string& records, const std::string& expected) {
    // In a chunk of their own, so that what is good before it is given.
    check_ends(open_mcap, closed(chunk("", good, good.size()) + chunk("", records, records.size())),
               1, expected);
  };
  refused(message(2), "channel 2, which is not there");
  refused(message(1, ~std::uint64_t{0}), "was logged at 18446744073709551615 ns");
  refused(mcap_record(0x05, "short"), "has 5 bytes, expected at least 22");
  refused(channel(2, 9), "has the schema 9, which is not there");
  refused(channel(1, 1, "/b"), "that of another topic: '/b' is not '/a'");
  refused(schema(1, "t/msg/U"), "that of another: 't/msg/U' is not 't/msg/T'");
  refused(schema(0), "has no number or no name");
  refused(mcap_record(0x04, "abc"), "has no number, schema, topic or encoding");
  refused(message(1).substr(0, 30), "goes on after the chunk's end");
  check_ends(open_mcap, closed(good + mcap_record(0x06, "short")), 1,
             "has 5 bytes, expected at least");
  std::string endless = mcap_record(0x09, "");
  endless.replace(1, 8, std::string(8, '\xFF'));
  check_ends(open_mcap, closed(good + endless), 1, "the records end at byte");
}

TEST_CASE("MCAP: chunks that do not hold what they say") {
  const std::string good = schema(1) + channel(1, 1) + message(1);
  for (const auto& [name, packed] :
       {std::pair<std::string, std::string>{"zstd", zstd_of(good)}, {"lz4", lz4_of(good)}}) {
    CHECK(read_bytes(open_mcap, closed(chunk(name, packed, good.size()))).messages.size() == 1);
    check_ends(open_mcap, closed(chunk(name, packed, good.size() - 1)), 0, "gives more than");
    check_ends(open_mcap, closed(chunk(name, packed, good.size() + 1)), 0, "decompressed, it says");
    check_ends(open_mcap, closed(chunk(name, packed, ~std::uint64_t{0})), 0,
               "claims 18446744073709551615 bytes, expected at most 67108864");
    check_ends(open_mcap, closed(chunk(name, packed.substr(0, packed.size() - 1), good.size())), 0,
               "cut off");
    check_ends(open_mcap, closed(chunk(name, "no stream at all", 9)), 0, "is damaged");
  }
  check_ends(open_mcap, closed(chunk("", good, good.size(), 17)), 0, "expected 00000011");
  // A megabyte of zeros in a few dozen bytes.
  check_ends(open_mcap, closed(chunk("zstd", zstd_of(std::string(1 << 20, '\0')), 100)), 0,
             "gives more than 100 bytes");
  std::string longer = chunk("", good, good.size());
  longer.replace(9 + 16 + 8 + 4 + 4, 8, little(std::uint64_t{1} << 40));
  check_ends(open_mcap, closed(longer), 0, "claims 1099511627776 bytes of records");
}

TEST_CASE("MCAP: chunks that together grow without measure are given up") {
  const std::string large =
      schema(1) + channel(1, 1) +
      mcap_record(0x05, little(std::uint16_t{1}) + std::string(63 << 20, '\0'));
  const std::string packed = chunk("zstd", zstd_of(large), large.size());
  std::string records;
  for (int i = 0; i < 6; ++i) records += packed;
  CHECK(records.size() < 64 << 10);
  check_ends(open_mcap, closed(records), 4, "the chunks to the one at byte");
}

TEST_CASE("MCAP: an index that lies is not believed") {
  const std::string bag = mcap(samples());
  const std::size_t footer = bag.size() - 8 - 20;
  const auto unchecked = [&](std::string changed) {
    return changed.replace(footer + 16, 4, std::string(4, '\0'));
  };
  const auto with_summary = [&](std::uint64_t at) {
    std::string changed = bag;
    return unchecked(changed.replace(footer, 8, little(at)));
  };
  std::string wrong = bag;
  wrong[footer + 16] = static_cast<char>(wrong[footer + 16] ^ 1);
  check_ends(open_mcap, wrong, 10, "the summary at byte");
  check_ends(open_mcap, with_summary(1), 10, "names a summary at byte 1");
  check_ends(open_mcap, with_summary(~std::uint64_t{0}), 10, "names a summary at byte");
  check_ends(open_mcap, with_summary(footer - 10), 10, "after the summary's end");

  // The last chunk index: first and last time, offset, length, ...
  const auto number_at = [&bag](std::size_t place) {
    std::uint64_t number = 0;
    std::memcpy(&number, bag.data() + place, sizeof(number));
    return static_cast<std::size_t>(number);
  };
  std::size_t at = 0;
  for (std::size_t record = number_at(footer); record < footer - 9;) {
    if (bag[record] == '\x08') at = record + 9;
    record += 9 + number_at(record + 1);
  }
  REQUIRE(at != 0);
  const auto changed = [&](std::size_t field, std::uint64_t value) {
    std::string lie = bag;
    return unchecked(lie.replace(at + field, 8, little(value)));
  };
  check_ends(open_mcap, changed(16, 9), 10, "where none is");
  check_ends(open_mcap, changed(24, ~std::uint64_t{0}), 10, "claims a chunk of");
  check_ends(open_mcap, changed(8, 1), 10, "claims a chunk of");
  // Found only when the chunk is read.
  check_ends(open_mcap, changed(8, 1'600'000'000'800'000'000), 8, "whose index says");
}

}  // namespace vantage::test
