#include "vantage/io/scan_source.hpp"

#include <doctest/doctest.h>

#include <memory>
#include <new>

#include "files.hpp"
#include "vantage/io/read_ahead.hpp"

namespace vantage {
namespace {

using test::check_clear;
using test::TemporaryFolder;

/// Files 0.bin to 4.bin, each with one point more than the one before, the first with one.
std::filesystem::path five_scans(const TemporaryFolder& folder) {
  std::string points;
  for (int i = 0; i < 5; ++i) {
    for (const float value : {static_cast<float>(i), 0.0F, 1.0F, 0.5F}) points += test::raw(value);
    test::put(folder.path() / (std::to_string(i) + ".bin"), points);
  }
  return folder.path();
}

std::vector<double> stamps_of(io::ScanSource& source) {
  std::vector<double> stamps;
  while (true) {
    const auto scan = source.next();
    REQUIRE_MESSAGE(scan, to_string(scan.error()));
    if (!*scan) return stamps;
    CHECK((*scan)->points.size() == static_cast<std::size_t>((*scan)->stamp + 1.5));
    stamps.push_back((*scan)->stamp);
  }
}

TEST_CASE("scan source: a folder's scans, from the beginning or a stamp on") {
  const TemporaryFolder folder;
  const io::ScanOptions options{.path = five_scans(folder), .topic = {}, .rate_hz = 1.0};
  for (const bool ahead : {false, true}) {
    CAPTURE(ahead);
    auto source = io::open_scans(options).value();
    if (ahead) source = io::read_ahead(std::move(source));
    CHECK(source->describe().format == "files (.bin)");
    CHECK(source->describe().scans == 5U);
    CHECK(stamps_of(*source) == std::vector<double>{0, 1, 2, 3, 4});
    CHECK_FALSE(source->next().value().has_value());
    REQUIRE(source->seek(2.5).has_value());
    CHECK(stamps_of(*source) == std::vector<double>{3, 4});
    REQUIRE(source->seek(1.0).has_value());
    REQUIRE(source->next().value()->stamp == 1.0);
    REQUIRE(source->seek(0.0).has_value());  // with scans that nobody has taken
    CHECK(stamps_of(*source) == std::vector<double>{0, 1, 2, 3, 4});
    REQUIRE(source->seek(9.0).has_value());
    CHECK_FALSE(source->next().value().has_value());
    CHECK(source->skipped().total() == 0);
  }
}

TEST_CASE("scan source: an error comes after the scans before it, and once") {
  const TemporaryFolder folder;
  five_scans(folder);
  test::put(folder.path() / "2.bin", "odd");
  for (const bool ahead : {false, true}) {
    CAPTURE(ahead);
    auto source = io::open_scans({.path = folder.path(), .topic = {}, .rate_hz = 1.0}).value();
    if (ahead) source = io::read_ahead(std::move(source));
    CHECK(source->next().value()->stamp == 0.0);
    CHECK(source->next().value()->stamp == 1.0);
    const auto broken = source->next();
    REQUIRE_FALSE(broken.has_value());
    check_clear(broken.error(), ErrorCode::corrupt_data, "2.bin", "ends at byte 3");
    CHECK_FALSE(source->next().value().has_value());
    REQUIRE(source->seek(3.0).has_value());
    CHECK(stamps_of(*source) == std::vector<double>{3, 4});
  }
}

TEST_CASE("scan source: a source that is left alone while it reads ends") {
  const TemporaryFolder folder;
  const auto path = five_scans(folder);
  for (int i = 0; i < 50; ++i) {
    auto source = io::read_ahead(io::open_scans({.path = path, .topic = {}}).value());
    if (i % 2 == 1) CHECK(source->next().value().has_value());
  }
}

/// A recording whose second scan does not fit into memory.
class TooLarge final : public io::ScanSource {
 public:
  Result<std::optional<io::StampedScan>> next() override {
    if (++read_ == 2) throw std::bad_alloc();
    return std::optional(io::StampedScan());
  }
  Result<void> seek(double /*stamp*/) override { return {}; }
  const io::ScanDescription& describe() const override { return description_; }
  io::SkippedScans skipped() const override { return {}; }

 private:
  int read_ = 0;
  io::ScanDescription description_;
};

TEST_CASE("scan source: a scan that does not fit into memory is an error, not the end") {
  const auto source = io::read_ahead(std::make_unique<TooLarge>());
  CHECK(source->next().value().has_value());
  const auto second = source->next();
  REQUIRE_FALSE(second);
  CHECK(second.error().message.find("not enough memory") != std::string::npos);
  CHECK_FALSE(source->next().value().has_value());
}

TEST_CASE("scan source: files of single scans have no topics") {
  const TemporaryFolder folder;
  const auto source = io::open_scans({.path = five_scans(folder), .topic = "/points"});
  REQUIRE_FALSE(source.has_value());
  check_clear(source.error(), ErrorCode::invalid_input, folder.path().string(), "no topics");
}

}  // namespace
}  // namespace vantage
