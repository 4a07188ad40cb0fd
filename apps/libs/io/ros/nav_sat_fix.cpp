#include <fmt/format.h>

#include "io/ros/messages.hpp"
#include "io/ros/wire_reader.hpp"

namespace vantage::io::ros {

// sensor_msgs/NavSatFix: Header header, NavSatStatus status (int8 status, uint16 service), float64
// latitude, longitude, altitude, float64[9] position_covariance, uint8 position_covariance_type.
Result<FixMessage> parse_nav_sat_fix(std::string_view bytes, Encoding encoding,
                                     const SourceLocation& where) {
  constexpr std::size_t kAxes = 3;
  constexpr std::uint8_t kUnknown = 0, kLastType = 3;
  VANTAGE_TRY(auto reader, WireReader::open(bytes, encoding, where));
  FixMessage fix;
  VANTAGE_TRY(fix.header, reader.header());
  VANTAGE_TRY(const auto status, reader.number<std::int8_t>("status.status"));
  fix.has_fix = status >= 0;
  VANTAGE_CHECK(reader.number<std::uint16_t>("status.service"));
  VANTAGE_TRY(fix.position.latitude, reader.number<double>("latitude"));
  VANTAGE_TRY(fix.position.longitude, reader.number<double>("longitude"));
  VANTAGE_TRY(fix.position.altitude, reader.number<double>("altitude"));
  std::array<double, kAxes> variances{};
  for (std::size_t row = 0; row < kAxes; ++row) {
    for (std::size_t column = 0; column < kAxes; ++column) {
      VANTAGE_TRY(const double number, reader.number<double>("position_covariance"));
      if (row == column) variances[row] = number;
    }
  }
  VANTAGE_TRY(const auto type, reader.number<std::uint8_t>("position_covariance_type"));
  if (type > kLastType) {
    return reader.error(fmt::format("byte {} is position_covariance_type {}, expected 0 to {}",
                                    reader.offset() - 1, type, kLastType));
  }
  if (type != kUnknown) fix.variances = variances;
  return fix;
}

}  // namespace vantage::io::ros
