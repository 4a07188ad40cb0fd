#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <string_view>

namespace vantage::live {

/// Reports what goes wrong repeatedly: each kind once, and counts it. Any thread may report. The
/// sink is called by one thread at a time.
class Notices {
 public:
  using Sink = std::function<void(const std::string&)>;
  explicit Notices(Sink sink) : sink_(std::move(sink)) {}

  /// @param kind   its name in diagnostics: "scans_out_of_order"
  /// @param times  how often it happened since the last call
  void tell(std::string_view kind, const std::string& text, std::uint64_t times = 1) {
    if (times == 0) return;
    const std::scoped_lock lock(mutex_);
    std::uint64_t& count = counts_[std::string(kind)];
    if (count == 0) sink_(text);
    count += times;
  }
  /// Scans came faster than they are localized.
  void tell_dropped_scans(std::uint64_t times = 1) {
    tell("scans_dropped",
         "scans come faster than they are localized: the oldest that waits is dropped", times);
  }
  /// Counts without a text.
  void count(std::string_view kind) {
    const std::scoped_lock lock(mutex_);
    ++counts_[std::string(kind)];
  }
  /// Says something that happens rarely.
  void say(const std::string& text) const {
    const std::scoped_lock lock(mutex_);
    sink_(text);
  }
  [[nodiscard]] std::uint64_t count_of(std::string_view kind) const {
    const std::scoped_lock lock(mutex_);
    const auto found = counts_.find(std::string(kind));
    return found == counts_.end() ? 0 : found->second;
  }
  /// By kind.
  [[nodiscard]] std::map<std::string, std::uint64_t> counts() const {
    const std::scoped_lock lock(mutex_);
    return counts_;
  }

 private:
  Sink sink_;
  mutable std::mutex mutex_;
  std::map<std::string, std::uint64_t> counts_;
};

}  // namespace vantage::live
