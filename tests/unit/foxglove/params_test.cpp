#include <doctest/doctest.h>

#include "live/live_params.hpp"
#include "vantage/config_value.hpp"
#include "vantage/params.hpp"

namespace vantage::live {
namespace {

TEST_CASE("[live.foxglove]: no server by default, and none but of this machine") {
  const FoxgloveParams params;
  CHECK_FALSE(params.port);
  CHECK(params.address == "127.0.0.1");
  CHECK(params.validate());
}

TEST_CASE("[live.foxglove]: an address is one of IPv4 or IPv6") {
  for (const char* const good : {"0.0.0.0", "192.168.1.7", "::1", "::", "fe80::1"}) {
    CAPTURE(good);
    FoxgloveParams params;
    params.address = good;
    CHECK(params.validate());
  }
  for (const char* const bad : {"", "localhost", "1.2.3", "1.2.3.400", "127.0.0.1:8765", ":::"}) {
    CAPTURE(bad);
    FoxgloveParams params;
    params.address = bad;
    const auto valid = params.validate();
    REQUIRE_FALSE(valid);
    CHECK(valid.error().message.find("is no address") != std::string::npos);
  }
}

TEST_CASE("[live.foxglove]: a layout needs a server") {
  FoxgloveParams params;
  params.layout = "layout.json";
  const auto valid = params.validate();
  REQUIRE_FALSE(valid);
  CHECK(valid.error().message == "'layout' needs a 'port': there is no server");
  params.port = 8765;
  CHECK(params.validate());
}

TEST_CASE("[live.foxglove]: ports and limits have bounds") {
  const auto parsed = [](const char* key, std::int64_t value) {
    Table table;
    table.entries.push_back({key, Value{value, {}}, {}});
    return parse<FoxgloveParams>(table);
  };
  CHECK(parsed("port", 8765)->port == 8765);
  CHECK_FALSE(parsed("port", 0));
  CHECK_FALSE(parsed("port", 65'536));
  CHECK_FALSE(parsed("clients", 0));
  CHECK_FALSE(parsed("buffer", 0));
  CHECK_FALSE(parsed("prot", 8765));
}

}  // namespace
}  // namespace vantage::live
