#pragma once

#include <atomic>
#include <cstddef>

#include "vantage/visibility.hpp"

namespace vantage::test {

/// Counts what a scene reports.
class Reports final : public VisibilityProgress {
 public:
  void advanced(std::size_t viewpoints) const noexcept override {
    ++calls_;
    viewpoints_ += viewpoints;
  }
  [[nodiscard]] std::size_t calls() const noexcept { return calls_; }
  [[nodiscard]] std::size_t viewpoints() const noexcept { return viewpoints_; }

 private:
  mutable std::atomic<std::size_t> calls_ = 0, viewpoints_ = 0;
};

}  // namespace vantage::test
