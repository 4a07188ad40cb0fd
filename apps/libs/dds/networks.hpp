#pragma once

#include <set>
#include <string>

namespace vantage::dds {

/// The network interfaces that are up, with their addresses: "eth0 10.0.0.2". The loopback is not
/// among them: it reaches no other computer.
[[nodiscard]] std::set<std::string> networks();

}  // namespace vantage::dds
