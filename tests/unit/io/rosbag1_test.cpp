#include "bags.hpp"

namespace vantage::test {
namespace {

using io::ros::open_rosbag1;

const std::string kNone = rosbag1(two_topics());
const std::string kOpen = rosbag1(two_topics(), {.indexed = false});
constexpr std::size_t kFirstChunk = 13 + 4096;

std::string op(char operation) { return "op=" + std::string(1, operation); }
std::string header(const std::string& more = "") {
  const std::string fields = sized(op(3)) + sized("index_pos=" + std::string(8, '\0')) +
                             sized("conn_count=" + std::string(4, '\0')) +
                             sized("chunk_count=" + std::string(4, '\0')) + more;
  return "#ROSBAG V2.0\n" + sized(fields) + sized("");
}
std::string chunk(const std::string& compression, const std::string& stored, std::size_t size) {
  return rosbag1_record({{"op", std::string(1, 5)},
                         {"compression", compression},
                         {"size", little(static_cast<std::uint32_t>(size))}},
                        stored);
}
std::string connection(std::uint32_t number, const std::string& topic = "/a") {
  return rosbag1_record({{"op", std::string(1, 7)}, {"topic", topic}, {"conn", little(number)}},
                        sized("type=t/T"));
}
std::string message(std::uint32_t number, std::uint32_t second = 1) {
  return rosbag1_record({{"op", std::string(1, 2)},
                         {"conn", little(number)},
                         {"time", little(second) + little(std::uint32_t{5})}},
                        "bytes");
}

}  // namespace

TEST_CASE("rosbag1: topics, counts, order, selection and seeking, in any compression") {
  for (const std::string compression : {"none", "bz2", "lz4"}) {
    check_two_topics(open_rosbag1, rosbag1(two_topics(), {.compression = compression}),
                     "rosbag1 2.0 (" + compression + ")");
    check_two_topics(open_rosbag1,
                     rosbag1(two_topics(), {.compression = compression, .indexed = false}),
                     "rosbag1 2.0 (" + compression + "), not indexed");
  }
}

TEST_CASE("rosbag1: several connections of one topic are one topic") {
  const std::string content = connection(0) + connection(7) + message(0, 2) + message(7, 1);
  const std::string bag = header() + chunk("none", content, content.size());
  const auto reader = open_rosbag1(io::InputFile::of_memory(bag, "test.bag"));
  REQUIRE_MESSAGE(reader, to_string(reader.error()));
  REQUIRE((*reader)->topics().size() == 1);
  CHECK((*reader)->topics().front().messages == 2);
  const Reading reading = read_on(**reader);
  REQUIRE(reading.messages.size() == 2);
  CHECK(reading.messages[0].log_time == 1'000'000'005);
  CHECK(reading.messages[1].log_time == 2'000'000'005);
}

TEST_CASE("rosbag1: a chunk that was being written has its records after it") {
  const std::string bag = header() + chunk("none", "", 0) + connection(0) + message(0) + message(0);
  CHECK(read_bytes(open_rosbag1, bag).messages.size() == 2);
  CHECK_FALSE(read_bytes(open_rosbag1, bag).ending.has_value());
  check_ends(open_rosbag1, bag.substr(0, bag.size() - 1), 1, "inside the record at byte");
}

TEST_CASE("rosbag1: where a message is in the file") {
  const auto reader = open_rosbag1(io::InputFile::of_memory(kNone, "test.bag"));
  REQUIRE(reader.has_value());
  for (auto message = (*reader)->next(); message && *message; message = (*reader)->next()) {
    CHECK(kNone.substr((*message)->offset, (*message)->bytes.size()) == (*message)->bytes);
  }
}

TEST_CASE("rosbag1: cut at every byte") {
  for (const std::string compression : {"none", "bz2", "lz4"}) {
    const std::string bag = rosbag1(two_topics(), {.compression = compression});
    check_cuts(open_rosbag1, bag, compression == "none");
  }
  check_cuts(open_rosbag1, kOpen, true);
}

TEST_CASE("rosbag1: flipped bits") {
  check_flips(open_rosbag1, kNone, 1);
  check_flips(open_rosbag1, rosbag1(two_topics(), {.compression = "bz2"}), 3);
  check_flips(open_rosbag1, rosbag1(two_topics(), {.compression = "lz4", .indexed = false}), 3);
}

TEST_CASE("rosbag1: what is not read") {
  check_ends(open_rosbag1, "#ROSBAG V1.2\nsomething", 0, "; `rosbag fix` converts",
             ErrorCode::unsupported);
  check_ends(open_rosbag1, "something else altogether", 0, "begins with 'something els");
  check_ends(open_rosbag1, header(sized("encryptor=rosbag/AesCbcEncryptor")), 0,
             "encrypted ('rosbag/AesCbcEncryptor')", ErrorCode::unsupported);
  check_ends(open_rosbag1, header() + chunk("xz", "abc", 3), 0, "compression 'xz'",
             ErrorCode::unsupported);
}

TEST_CASE("rosbag1: a bag without topics") {
  check_ends(open_rosbag1, header(), 0, "the bag has no topic");
}

TEST_CASE("rosbag1: malformed records") {
  const auto bag = [](const std::string& content) {
    return header() + chunk("none", content, content.size());
  };
  const std::string good = connection(0) + message(0);
  check_ends(open_rosbag1, "#ROSBAG V2.0\n" + connection(0), 0,
             "op 7 at byte 13, expected the bag header");
  check_ends(open_rosbag1, "#ROSBAG V2.0\n" + rosbag1_record({{"op", "\3"}}, ""), 0,
             "no index_pos");
  check_ends(open_rosbag1, "#ROSBAG V2.0\n" + sized("abc") + sized(""), 0,
             "expected a record at byte 13");
  check_ends(open_rosbag1, header() + rosbag1_record({{"op", "\1"}}, ""), 0, "op 1");
  check_ends(open_rosbag1, header() + chunk("none", good, good.size() + 1), 0,
             "which are not compressed");
  check_ends(open_rosbag1, bag(good) + bag(good).substr(13), 1, "op 3");
  check_ends(open_rosbag1, bag(message(0)), 0, "connection 0, which is not there");
  check_ends(open_rosbag1, bag(connection(0) + connection(0, "/b")), 0,
             "that of another topic: '/b' is not '/a'");
  check_ends(open_rosbag1, bag(good + chunk("none", "", 0)), 0, "expected a message (2)");
  check_ends(open_rosbag1, bag(good.substr(0, good.size() - 1)), 0, "after the chunk's end");
  check_ends(open_rosbag1, bag(good + rosbag1_record({{"op", "\2"}, {"conn", "1"}}, "")), 0,
             "no conn of 4");
  check_ends(open_rosbag1, bag(good + rosbag1_record({{"op", "\7"}}, "")), 0, "no type");
  check_ends(open_rosbag1, header() + rosbag1_record({{"op", "\5"}}, "abc"), 0, "no compression");
}

TEST_CASE("rosbag1: chunks that do not hold what they say") {
  const std::string good = connection(0) + message(0);
  const std::string half(500'000, 'a');
  for (const auto& [name, packed] :
       {std::pair<std::string, std::string>{"bz2", bz2_of(good)}, {"lz4", lz4_of(good)}}) {
    CHECK(read_bytes(open_rosbag1, header() + chunk(name, packed, good.size())).messages.size() ==
          1);
    check_ends(open_rosbag1, header() + chunk(name, packed, good.size() - 1), 0, "gives more than");
    check_ends(open_rosbag1, header() + chunk(name, packed, good.size() + 1), 0, "decompressed");
    check_ends(open_rosbag1, header() + chunk(name, packed, 0xFFFFFFFF), 0,
               "claims 4294967295 bytes, expected at most 67108864");
    check_ends(open_rosbag1,
               header() + chunk(name, packed.substr(0, packed.size() - 1), good.size()), 0,
               "cut off");
    check_ends(open_rosbag1, header() + chunk(name, "no stream", 9), 0, "is damaged");
  }
  check_ends(open_rosbag1, header() + chunk("bz2", bz2_of(good) + "x", good.size()), 0,
             "ends at its byte");
  check_ends(open_rosbag1, header() + chunk("lz4", lz4_of(good) + "x", good.size()), 0,
             "LZ4 stream");
  check_ends(open_rosbag1, header() + chunk("bz2", bz2_of(good), 1 << 30), 0,
             "claims 1073741824 bytes, expected at most 67108864");
  // What is stated as small may not grow: 500 kB in a few hundred bytes.
  check_ends(open_rosbag1, header() + chunk("lz4", lz4_of(half), 100), 0,
             "gives more than 100 bytes");
}

TEST_CASE("rosbag1: an index that lies is not believed") {
  const std::size_t at = kNone.find("index_pos=") + 10;
  const auto with_index = [&](std::uint64_t value) {
    std::string bag = kNone;
    return bag.replace(at, 8, little(value));
  };
  check_ends(open_rosbag1, with_index(1), 10, "expected the index at byte 1");
  check_ends(open_rosbag1, with_index(kNone.size() + 1), 10, "expected the index at byte");
  check_ends(open_rosbag1, with_index(kNone.size()), 10, "0 connections and 0 chunks");
  check_ends(open_rosbag1, with_index(kFirstChunk), 10, "op 5");
  check_ends(open_rosbag1, with_index(~std::uint64_t{0}), 10, "expected the index at byte");

  const auto broken = [](const std::string& field, std::size_t skip, const std::string& value) {
    std::string bag = kNone;
    return bag.replace(bag.rfind(field) + field.size() + skip, value.size(), value);
  };
  check_ends(open_rosbag1, broken("chunk_pos=", 0, little(std::uint64_t{5})), 10,
             "names a chunk at byte 5");
  check_ends(open_rosbag1, broken("chunk_pos=", 0, little(std::uint64_t{kFirstChunk})), 10,
             "twice");
  // These are found only when the chunk is read.
  check_ends(open_rosbag1, broken("chunk_pos=", 0, little(std::uint64_t{kFirstChunk + 4})), 8,
             "expected a record");
  check_ends(open_rosbag1, broken("end_time=", 0, std::string(8, '\0')), 8, "whose index says");
  std::string counts = kNone;
  counts[counts.size() - 4] = 9;
  check_ends(open_rosbag1, counts, 8, "its index says");
}

}  // namespace vantage::test
