#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace vantage {

/// How long answers took, in steps of 0.1 ms.
class Delays {
 public:
  void add(double seconds) {
    const double step = std::clamp(seconds * 1e4, 0.0, static_cast<double>(counts_.size() - 1));
    ++counts_[static_cast<std::size_t>(step)];
    ++count_;
  }
  /// [ms]
  [[nodiscard]] double quantile(double share) const {
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
      below += counts_[i];
      if (static_cast<double>(below) >= share * static_cast<double>(count_)) {
        return static_cast<double>(i + 1) * 0.1;
      }
    }
    return 0.0;
  }

 private:
  std::array<std::uint64_t, 50'000> counts_{};
  std::uint64_t count_ = 0;
};

}  // namespace vantage
