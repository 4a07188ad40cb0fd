#pragma once

#include <cstdint>
#include <string_view>

#include "dds/participant.hpp"

namespace vantage::live {

/// Sees all that a session localizes and answers: a recording, a viewer.
class Observer {
 public:
  Observer() = default;
  virtual ~Observer() = default;
  Observer(const Observer&) = delete;
  Observer& operator=(const Observer&) = delete;

  /// Called from several threads, and must return at once: a scan waits for it.
  /// @param time     when the message came or went [ns since the epoch]
  /// @param message  CDR with its header; of a latched topic, the observer keeps it for those who
  ///                 come later
  virtual void see(const dds::Topic& topic, std::int64_t time, std::string_view message) = 0;
};

}  // namespace vantage::live
