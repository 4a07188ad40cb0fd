#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>

namespace vantage::live {

/// What goes wrong again and again: each kind is told once, and counted.
class Notices {
 public:
  using Sink = std::function<void(const std::string&)>;
  explicit Notices(Sink sink) : sink_(std::move(sink)) {}

  /// @param kind  its name in diagnostics: "scans_out_of_order"
  void tell(std::string_view kind, const std::string& text) {
    if (++counts_[std::string(kind)] == 1) sink_(text);
  }
  /// Counts without a text.
  void count(std::string_view kind) { ++counts_[std::string(kind)]; }
  /// Says something that happens rarely.
  void say(const std::string& text) const { sink_(text); }
  /// By kind.
  [[nodiscard]] const std::map<std::string, std::uint64_t>& counts() const noexcept {
    return counts_;
  }

 private:
  Sink sink_;
  std::map<std::string, std::uint64_t> counts_;
};

}  // namespace vantage::live
