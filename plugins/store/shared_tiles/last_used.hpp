#pragma once

#include <cstdint>
#include <list>
#include <optional>
#include <unordered_map>
#include <utility>

namespace vantage::shared_tiles {

/// Values by number, of which those go first that were not used for the longest time.
template <class Value>
class LastUsed {
 public:
  /// @param limit  of the memory of all values [bytes]
  explicit LastUsed(std::uint64_t limit) noexcept : limit_(limit) {}

  /// Null if the value is not here. It counts as used.
  [[nodiscard]] Value* find(std::uint64_t number) {
    const auto found = by_number_.find(number);
    if (found == by_number_.end()) return nullptr;
    entries_.splice(entries_.begin(), entries_, found->second);
    return &entries_.front().value;
  }
  /// Precondition: there is no value of that number.
  /// @param memory  that it takes [bytes]
  Value& add(std::uint64_t number, Value value, std::uint64_t memory) {
    entries_.push_front({number, memory, std::move(value)});
    by_number_[number] = entries_.begin();
    memory_ += memory;
    return entries_.front().value;
  }
  /// Precondition: `number` was the last to be found or added.
  void resize(std::uint64_t memory) {
    memory_ += memory - entries_.front().memory;
    entries_.front().memory = memory;
  }
  std::optional<Value> take(std::uint64_t number) {
    const auto found = by_number_.find(number);
    if (found == by_number_.end()) return std::nullopt;
    std::optional<Value> value(std::move(found->second->value));
    memory_ -= found->second->memory;
    entries_.erase(found->second);
    by_number_.erase(found);
    return value;
  }
  /// If the values take too much, the number of the one that was not used for the longest time.
  [[nodiscard]] std::optional<std::uint64_t> one_too_many() const {
    if (memory_ <= limit_ || entries_.empty()) return std::nullopt;
    return entries_.back().number;
  }
  [[nodiscard]] std::uint64_t limit() const noexcept { return limit_; }

 private:
  struct Entry {
    std::uint64_t number, memory;
    Value value;
  };
  std::uint64_t limit_;
  std::uint64_t memory_ = 0;
  std::list<Entry> entries_;  // the last used first
  std::unordered_map<std::uint64_t, typename std::list<Entry>::iterator> by_number_;
};

}  // namespace vantage::shared_tiles
