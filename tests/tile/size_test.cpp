#include "terminal/size.hpp"

#include <doctest/doctest.h>

namespace vantage::cli {
namespace {

TEST_CASE("sizes of memory have a number and a binary unit") {
  CHECK(parse_memory("1GiB") == std::uint64_t{1} << 30U);
  CHECK(parse_memory("512 MiB") == std::uint64_t{512} << 20U);
  CHECK(parse_memory("1.5GiB") == std::uint64_t{1536} << 20U);
  for (const char* wrong : {"", "1", "GiB", "1GB", "1gib", "-1GiB", "0MiB", "nanGiB", "infGiB",
                            "1GiB ", "1  GiB", "1e30GiB", "0x1GiB"}) {
    CAPTURE(wrong);
    CHECK_FALSE(parse_memory(wrong));
  }
  CHECK(size_text(0) == "0.0 MB");
  CHECK(size_text(999'940'000) == "999.9 MB");
  CHECK(size_text(1'500'000'000) == "1.50 GB");
}

}  // namespace
}  // namespace vantage::cli
