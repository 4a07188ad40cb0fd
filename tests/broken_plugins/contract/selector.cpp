// Orders elements at random, but for the clause to be broken.
#include <algorithm>
#include <atomic>
#include <mutex>
#include <optional>
#include <utility>

#include "breaks.hpp"

namespace vantage::broken {
namespace {

class Broken final : public Selector {
 public:
  using Params = OneParam;
  static Result<std::unique_ptr<Selector>> create(const Params& /*params*/) {
    VANTAGE_TRY(auto selector, sound<Selector>("random", {}));
    return std::make_unique<Broken>(std::move(selector));
  }
  explicit Broken(PluginPtr<Selector> selector) : selector_(std::move(selector)) {}

  [[nodiscard]] Result<std::vector<std::uint32_t>> order(const RegionElements& region,
                                                         std::size_t most) const noexcept override {
    return guarded([&]() -> Result<std::vector<std::uint32_t>> {
      if (breaks("E4") && region.scans.empty()) {
        return fail(ErrorCode::invalid_input, "no scans");
      }
      VANTAGE_TRY(auto order, selector_->order(region, most));
      // The first again, as if drawn with replacement.
      if (breaks("E1") && order.size() > 1) order[1] = order[0];
      if (breaks("E2") && order.size() < most && !order.empty()) order.pop_back();
      // The best of those that are kept, in the order of the map.
      if (breaks("E3") && most > 20) std::ranges::sort(order);
      if (breaks("E5") && !is_first(region) && order.size() > 1) std::swap(order[0], order[1]);
      if (breaks("E7") && threads_are_unusual()) std::ranges::reverse(order);
      if (breaks("E6") && Crowded(inside_)) std::ranges::reverse(order);
      return order;
    });
  }

 private:
  /// Keeps something of the first region that it is ever asked about.
  [[nodiscard]] bool is_first(const RegionElements& region) const {
    const std::scoped_lock lock(mutex_);
    if (region.elements.empty()) return true;
    if (!first_) first_ = region.elements.front().middle;
    return *first_ == region.elements.front().middle;
  }

  PluginPtr<Selector> selector_;
  mutable std::atomic<int> inside_ = 0;
  mutable std::mutex mutex_;
  mutable std::optional<Point> first_;
};

}  // namespace
}  // namespace vantage::broken

VANTAGE_BROKEN_PLUGIN(vantage::Selector);
