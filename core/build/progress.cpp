#include "build/progress.hpp"

#include <algorithm>

namespace vantage {

Meter::Meter(const BuildProgress& start, const std::function<void(const BuildProgress&)>& listener)
    : step_(std::max<std::size_t>(1, start.viewpoints / 100)), now_(start), listener_(listener) {
  say();
}

void Meter::viewpoints_done(std::size_t more) noexcept {
  if (!listener_) return;
  viewpoints_done_ += more;
  if (!due()) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || !due()) return;  // another thread reports it
  try {
    say();
  } catch (...) {
    thrown_ = std::current_exception();
  }
}

void Meter::region_done() {
  const std::scoped_lock lock(mutex_);
  if (thrown_) std::rethrow_exception(thrown_);
  ++now_.regions_done;
  say();
}

bool Meter::due() const noexcept {
  return viewpoints_done_ >= said_ + step_ ||
         Clock::now().time_since_epoch() - said_at_.load() >= std::chrono::milliseconds(100);
}

void Meter::say() {
  if (!listener_ || thrown_) return;
  now_.viewpoints_done = viewpoints_done_;
  said_ = now_.viewpoints_done;
  listener_(now_);
  said_at_ = Clock::now().time_since_epoch();
}

void RegionProgress::advanced(std::size_t viewpoints) const noexcept {
  std::size_t left = left_, more = 0;
  do {
    more = std::min(left, viewpoints);
  } while (!left_.compare_exchange_weak(left, left - more));
  if (more > 0) meter_.viewpoints_done(more);
}

}  // namespace vantage
