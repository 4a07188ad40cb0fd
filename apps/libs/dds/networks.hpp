#pragma once

#include <set>
#include <string>

namespace vantage::dds {

/// The interfaces of networks that are up, with their addresses: "eth0 10.0.0.2". Without the
/// loopback, which leads to nobody else.
[[nodiscard]] std::set<std::string> networks();

}  // namespace vantage::dds
