#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>

#include "vantage/build/build.hpp"
#include "vantage/visibility.hpp"

namespace vantage {

/// Reports the progress of a build: after every region, and in between after each hundredth of the
/// viewpoints or tenth of a second.
class Meter {
 public:
  Meter(const BuildProgress& start, const std::function<void(const BuildProgress&)>& listener);

  /// May run from many threads at once. Plugins call this function. An exception of the listener is
  /// therefore kept until `region_done` throws it.
  void viewpoints_done(std::size_t more) noexcept;
  void region_done();

 private:
  using Clock = std::chrono::steady_clock;

  [[nodiscard]] bool due() const noexcept;
  void say();

  const std::size_t step_;
  std::atomic<std::size_t> viewpoints_done_{0}, said_{0};
  std::atomic<Clock::duration> said_at_{Clock::duration::zero()};
  std::mutex mutex_;  // guards the members below
  BuildProgress now_;
  std::exception_ptr thrown_;
  const std::function<void(const BuildProgress&)>& listener_;
};

/// Counts the viewpoints of one region: never more than it has, whatever a plugin reports.
class RegionProgress final : public VisibilityProgress {
 public:
  RegionProgress(Meter& meter, std::size_t viewpoints) : meter_(meter), left_(viewpoints) {}

  void advanced(std::size_t viewpoints) const noexcept override;

 private:
  Meter& meter_;
  mutable std::atomic<std::size_t> left_;
};

}  // namespace vantage
