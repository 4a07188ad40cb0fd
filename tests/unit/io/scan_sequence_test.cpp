#include "io/scan_sequence.hpp"

#include <limits>
#include <vector>

#include "files.hpp"

namespace vantage {
namespace {

using io::ScanSequence;
using test::check_clear;
using test::put;
using test::raw;

std::string scan(float x) { return raw(x) + raw(2.F) + raw(3.F) + raw(0.F); }

std::vector<std::string> names(const ScanSequence& sequence) {
  std::vector<std::string> result;
  for (std::size_t i = 0; i < sequence.size(); ++i) {
    result.push_back(sequence.file(i).filename().string());
  }
  return result;
}

std::vector<double> stamps(const ScanSequence& sequence) {
  std::vector<double> result;
  for (std::size_t i = 0; i < sequence.size(); ++i) result.push_back(sequence.stamp(i));
  return result;
}

void check_not_opened(const std::filesystem::path& path, ErrorCode code, const std::string& file,
                      const std::string& expected) {
  const auto sequence = ScanSequence::open(path, 10.0);
  REQUIRE_FALSE(sequence.has_value());
  check_clear(sequence.error(), code, file, expected);
}

TEST_CASE("natural order is a strict total order in which numbers compare by value") {
  const std::vector<std::string> ordered{"",
                                         "0",
                                         "1.pcd",
                                         "01.pcd",
                                         "2.pcd",
                                         "10.pcd",
                                         "a",
                                         "a1",
                                         "a1b2",
                                         "a1b10",
                                         "a2",
                                         "a02",
                                         "a002",
                                         "a10",
                                         "b1c",
                                         "b18446744073709551615",
                                         "b18446744073709551616",
                                         "b99999999999999999999"};
  for (std::size_t i = 0; i < ordered.size(); ++i) {
    for (std::size_t k = 0; k < ordered.size(); ++k) {
      CAPTURE(ordered[i]);
      CAPTURE(ordered[k]);
      CHECK(io::less_by_natural_order(ordered[i], ordered[k]) == (i < k));
    }
  }
}

TEST_CASE("a directory of scans: name order, other files ignored, stamps by frame number") {
  const test::TemporaryFolder folder;
  for (const int i : {10, 9, 100, 2}) {
    put(folder.path() / (std::to_string(i) + ".bin"), scan(static_cast<float>(i)));
  }
  put(folder.path() / "readme.md", "text");
  put(folder.path() / ".hidden.bin", "x");
  std::filesystem::create_directory(folder.path() / "3.pcd");
  const auto sequence = ScanSequence::open(folder.path(), 10.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  CHECK(names(*sequence) == std::vector<std::string>{"2.bin", "9.bin", "10.bin", "100.bin"});
  CHECK(stamps(*sequence) == std::vector<double>{0.2, 0.9, 1.0, 10.0});
  CHECK(sequence->stamp_rule().find("frame / 10 Hz") != std::string::npos);

  const auto third = sequence->read(2);
  REQUIRE_MESSAGE(third, to_string(third.error()));
  CHECK(third->points == PointCloud{{10, 2, 3}});
  CHECK(third->stamp == 1.0);
  CHECK(third->dropped == 0);
  CHECK(third->name == folder.path() / "10.bin");
  const auto beyond = sequence->read(4);
  REQUIRE_FALSE(beyond.has_value());
  CHECK(beyond.error().code == ErrorCode::invalid_input);
}

TEST_CASE("stamps from nanoseconds in the names") {
  const test::TemporaryFolder folder;
  put(folder.path() / "1673400472138016708.bin", scan(2));
  put(folder.path() / "1673400471999999999.bin", scan(1));
  const auto sequence = ScanSequence::open(folder.path(), 10.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  CHECK(stamps(*sequence) == std::vector<double>{1673400471.999999999, 1673400472.138016708});
  CHECK(sequence->stamp_rule().find("nanoseconds") != std::string::npos);
}

TEST_CASE("stamps from names of 16 and 17 digits are microseconds") {
  const test::TemporaryFolder folder;
  for (const auto* name : {"1547120788090398", "1547120787640635"}) {
    put(folder.path() / (std::string(name) + ".bin"), "x");
  }
  const auto sequence = ScanSequence::open(folder.path(), 10.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  CHECK(stamps(*sequence) == std::vector<double>{1547120787.640635, 1547120788.090398});
  CHECK(sequence->stamp_rule().find("microseconds") != std::string::npos);
}

struct Named {
  std::vector<std::string> names;  // without their ending, in the order that is expected
  std::vector<double> stamps;
  const char* rule;
};

void check_named(const Named& expected) {
  const test::TemporaryFolder folder;
  std::vector<std::string> files;
  for (const std::string& name : expected.names) files.push_back(name + ".pcd");
  for (const std::string& file : files) put(folder.path() / file, "x");
  const auto sequence = ScanSequence::open(folder.path(), 10.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  CHECK(names(*sequence) == files);
  CHECK(stamps(*sequence) == expected.stamps);
  CHECK_MESSAGE(sequence->stamp_rule().find(expected.rule) != std::string::npos,
                sequence->stamp_rule());
}

TEST_CASE("names of decimal numbers are seconds, in the order of their values") {
  check_named({{"9.95", "10.0", "10.05", "10.1", "10.15"},
               {9.95, 10.0, 10.05, 10.1, 10.15},
               "seconds with a decimal fraction"});
  check_named({{"scan_10.0", "scan_10.05", "scan_10.1"}, {10.0, 10.05, 10.1}, "decimal"});
  // Nine digits beside more, or beside fewer that begin with a zero, are no whole nanoseconds.
  check_named({{"0.1", "0.123456789", "0.30000000000000004"},
               {0.1, 0.123456789, 0.30000000000000004},
               "decimal"});
  check_named({{"0.05", "0.123456789", "0.2"}, {0.05, 0.123456789, 0.2}, "decimal"});
}

TEST_CASE("names of seconds and nanoseconds, as the tools of ROS write them") {
  check_named({{"1418381798.086398000", "1418381798.186515000"},
               {1418381798.086398, 1418381798.186515},
               "seconds, a dot, nanoseconds"});
  // ROS 2 leaves out leading zeros.
  check_named({{"1418381797.986398000", "1418381798.0", "1418381798.86398000",
                "1418381798.186515000", "1418381799.5"},
               {1418381797.986398, 1418381798.0, 1418381798.086398, 1418381798.186515,
                1418381799.000000005},
               "seconds, a dot, nanoseconds"});
  check_named({{"cloud_7.9", "cloud_7.100000000"}, {7.000000009, 7.1}, "nanoseconds"});
}

TEST_CASE("names of 10 and 13 digits are seconds and milliseconds since 1970, unless padded") {
  check_named({{"1547120787", "1547120788"}, {1547120787.0, 1547120788.0}, "in seconds"});
  check_named(
      {{"1547120787640", "1547120788090"}, {1547120787.640, 1547120788.090}, "in milliseconds"});
  check_named({{"scan_1547120787640", "scan_1547120788090"},
               {1547120787.640, 1547120788.090},
               "in milliseconds"});
  // KITTI fills the numbers of its frames up to ten digits.
  check_named({{"0000000004", "0000000005"}, {0.4, 0.5}, "frame numbers"});
  check_named({{"0000000000004", "0000000000005"}, {0.4, 0.5}, "frame numbers"});
}

TEST_CASE("names that are numbers after a date, or versions, state no stamp") {
  check_named({{"20230101_120059.95", "20230101_120100.05", "20230101_120100.1"},
               {0.0, 0.1, 0.2},
               "position in name order"});
  check_named({{"1.2.3", "1.2.10"}, {0.0, 0.1}, "position in name order"});
  check_named({{"scan_9", "scan_10"}, {0.0, 0.1}, "position in name order"});
}

TEST_CASE("names of several kinds of numbers are refused, but not beside times.txt") {
  const test::TemporaryFolder folder;
  for (const auto* name : {"10.pcd", "10.05.pcd", "10.1.pcd"}) put(folder.path() / name, "x");
  check_not_opened(folder.path(), ErrorCode::corrupt_data, "10.05.pcd",
                   "is seconds (digits, a dot, digits) and that of 10.pcd is a frame number");
  put(folder.path() / "times.txt", "1\n2\n3\n");
  const auto sequence = ScanSequence::open(folder.path(), 10.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  CHECK(names(*sequence) == std::vector<std::string>{"10.pcd", "10.05.pcd", "10.1.pcd"});
  std::filesystem::remove(folder.path() / "times.txt");

  std::filesystem::remove(folder.path() / "10.pcd");
  put(folder.path() / "10.10.pcd", "x");
  check_not_opened(folder.path(), ErrorCode::corrupt_data, "10.10.pcd", "strictly increasing");
}

TEST_CASE("stamps from the position when names are not all numbers") {
  const test::TemporaryFolder folder;
  for (const auto* name : {"scan2.bin", "scan10.ply", "7.pcd"}) put(folder.path() / name, "x");
  const auto sequence = ScanSequence::open(folder.path(), 4.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  CHECK(names(*sequence) == std::vector<std::string>{"7.pcd", "scan2.bin", "scan10.ply"});
  CHECK(stamps(*sequence) == std::vector<double>{0.0, 0.25, 0.5});
  CHECK(sequence->stamp_rule().find("position in name order / 4 Hz") != std::string::npos);
}

TEST_CASE("stamps from times.txt, in the directory before its parent") {
  const test::TemporaryFolder folder;
  const auto scans = folder.path() / "velodyne";
  std::filesystem::create_directory(scans);
  for (const auto* name : {"000000.bin", "000001.bin", "000002.bin"}) put(scans / name, scan(1));
  put(folder.path() / "times.txt", "# s\n0.000000e+00\n1.037e-01\r\n2.076e-01\n\n");
  for (const auto& path : {scans, scans / "", folder.path() / "velodyne" / "."}) {
    const auto sequence = ScanSequence::open(path, 10.0);
    REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
    CHECK(stamps(*sequence) == std::vector<double>{0.0, 0.1037, 0.2076});
    CHECK(sequence->stamp_rule().find("times.txt") != std::string::npos);
  }

  put(scans / "times.txt", "5\n6\n7\n");
  const auto sequence = ScanSequence::open(scans, 10.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  CHECK(stamps(*sequence) == std::vector<double>{5, 6, 7});

  struct Row {
    const char *stamps, *where, *expected;
  };
  for (const Row& row : {
           Row{"5\n6\n", "times.txt", "2 stamps for 3 scans"},
           Row{"5\n6\n7\n8\n", "times.txt", "4 stamps for 3 scans"},
           Row{"5\n7\n7\n", "times.txt:3", "strictly increasing"},
           Row{"5\nsix\n7\n", "times.txt:2", "found 'six'"},
           Row{"5\n6\n1600000000000000000\n", "times.txt:3", "are these nanoseconds?"},
           Row{"5\n6 6\n7\n", "times.txt:2", "expected one stamp"},
           Row{"5\nnan\n7\n", "times.txt:2", "found 'nan'"},
           Row{"", "times.txt", "empty"},
       }) {
    put(scans / "times.txt", row.stamps);
    check_not_opened(scans, ErrorCode::corrupt_data, row.where, row.expected);
  }
}

TEST_CASE("a single file is a sequence of one") {
  const test::TemporaryFolder folder;
  put(folder.path() / "times.txt", "1\n2\n3\n");
  const auto sequence = ScanSequence::open(put(folder.path() / "000025.bin", scan(8)), 10.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  CHECK(sequence->size() == 1);
  CHECK(sequence->stamp(0) == 2.5);
  const auto only = sequence->read(0);
  REQUIRE_MESSAGE(only, to_string(only.error()));
  CHECK(only->points == PointCloud{{8, 2, 3}});
}

TEST_CASE("sequences that cannot be opened") {
  const test::TemporaryFolder folder;
  check_not_opened(folder.path(), ErrorCode::not_found, folder.path().string(), "holds no .pcd");
  check_not_opened(folder.path() / "absent", ErrorCode::not_found, "absent", "no such file");
  for (const double rate : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN(),
                            std::numeric_limits<double>::infinity()}) {
    const auto sequence = ScanSequence::open(folder.path(), rate);
    REQUIRE_FALSE(sequence.has_value());
    check_clear(sequence.error(), ErrorCode::invalid_input, folder.path().string(), "rate");
  }
  put(folder.path() / "1.bin", "x");
  put(folder.path() / "1673400472138016708.bin", "x");
  check_not_opened(folder.path(), ErrorCode::corrupt_data, "1673400472138016708.bin",
                   "is nanoseconds (18 digits or more) and that of 1.bin is a frame number");
  std::filesystem::remove(folder.path() / "1673400472138016708.bin");
  put(folder.path() / "01.pcd", "x");
  check_not_opened(folder.path(), ErrorCode::corrupt_data, "01.pcd", "strictly increasing");
  std::filesystem::remove(folder.path() / "01.pcd");
  std::filesystem::remove(folder.path() / "1.bin");
  put(folder.path() / "99999999999999999999999.bin", "x");
  check_not_opened(folder.path(), ErrorCode::corrupt_data, "999.bin", "64 bits");
}

TEST_CASE("a link that leads nowhere is a scan that cannot be read, not one that is not there") {
  const test::TemporaryFolder folder;
  put(folder.path() / "1.bin", scan(1));
  std::filesystem::create_symlink("/nowhere/2.bin", folder.path() / "2.bin");
  std::filesystem::create_directory(folder.path() / "3.bin");
  const auto sequence = ScanSequence::open(folder.path(), 10.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  REQUIRE(sequence->size() == 2);
  CHECK_FALSE(sequence->read(1).has_value());
}

TEST_CASE("a damaged scan is an error of that scan only") {
  const test::TemporaryFolder folder;
  put(folder.path() / "1.bin", scan(1));
  put(folder.path() / "2.bin", "cut");
  put(folder.path() / "3.bin", scan(3));
  const auto sequence = ScanSequence::open(folder.path(), 10.0);
  REQUIRE_MESSAGE(sequence, to_string(sequence.error()));
  CHECK(sequence->read(0).has_value());
  const auto damaged = sequence->read(1);
  REQUIRE_FALSE(damaged.has_value());
  check_clear(damaged.error(), ErrorCode::corrupt_data, "2.bin", "expected points of 16 bytes");
  CHECK(sequence->read(2).has_value());
}

}  // namespace
}  // namespace vantage
