#include "vantage/engine/region_maps.hpp"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "vantage/kit/stopwatch.hpp"

namespace vantage {
namespace {

using Ready = std::shared_ptr<const ReadyRegion>;

}  // namespace

Result<Ready> make_ready(const PluginPtr<MapStore>& store, const PluginPtr<ScanMatcher>& matcher,
                         RegionId region) {
  auto ready = std::make_shared<ReadyRegion>();
  Stopwatch stopwatch;
  VANTAGE_TRY(RegionMap map, store->get(region));
  ready->seconds_load = stopwatch.seconds();

  stopwatch = {};
  const bool stored = !map.prepared.bytes.empty();
  auto target = stored ? matcher->restore(map.prepared.bytes) : matcher->prepare(map.points);
  if (!target) return fail(std::move(target).error());
  ready->target = in_library_of(matcher, *std::move(target));
  ready->seconds_prepare = stopwatch.seconds();

  ready->bytes_read = map.points.size() * sizeof(Point) + map.prepared.bytes.size();
  ready->map_points = map.points.empty() ? ready->target->elements() : map.points.size();
  ready->viewpoints = std::move(map.viewpoints);
  return ready;
}

struct RegionMaps::State {
  State(const PluginPtr<MapStore>& the_store, const PluginPtr<ScanMatcher>& the_matcher,
        const Options& the_options)
      : store(the_store), matcher(the_matcher), options(the_options) {}

  const PluginPtr<MapStore>& store;
  const PluginPtr<ScanMatcher>& matcher;
  Options options;

  struct Entry {
    Ready ready;
    std::uint64_t used = 0;  // the number of the `take` that used it last
  };

  mutable std::mutex mutex;  // guards the members below
  mutable std::condition_variable_any changed;
  std::unordered_map<std::uint32_t, Entry> entries;
  std::unordered_map<std::uint32_t, std::weak_ptr<const ReadyRegion>> lent;  // not in `entries`
  std::unordered_set<std::uint32_t> loading;   // which some thread is loading right now
  std::unordered_set<std::uint32_t> given_up;  // expected, but failed or did not fit
  std::vector<RegionId> expected;
  std::optional<std::uint32_t> taken_last;
  bool busy = false;  // whether the loader is loading or releasing a map
  std::uint64_t takes = 0;
  std::size_t most_of_one = 0;  // that a region took while it was loaded [bytes]
  Statistics counts;

  std::jthread loader;  // last, so that it ends before the members that it uses

  [[nodiscard]] bool is_expected(std::uint32_t region) const {
    return std::find(expected.begin(), expected.end(), RegionId{region}) != expected.end();
  }

  /// The map of a region, if a caller borrowed it and still holds it; otherwise nullptr.
  [[nodiscard]] Ready borrowed(std::uint32_t region) const {
    const auto one = lent.find(region);
    return one == lent.end() ? nullptr : one->second.lock();
  }

  /// The next region for the loader.
  [[nodiscard]] std::optional<RegionId> missing() const {
    for (const RegionId region : expected) {
      const std::uint32_t r = region.value;
      if (!entries.contains(r) && !loading.contains(r) && !given_up.contains(r)) return region;
    }
    return {};
  }

  /// Counted anew each time: targets may have grown.
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    for (const auto& [region, entry] : entries) sum += entry.ready->bytes();
    for (const auto& [region, one] : lent) {
      if (entries.contains(region)) continue;
      if (const Ready ready = one.lock()) sum += ready->bytes();
    }
    return sum;
  }

  /// Marks a region as being loaded, and makes room for it.
  /// @return  as shrink()
  [[nodiscard]] std::vector<Ready> begin_loading(RegionId region) {
    loading.insert(region.value);
    return shrink();
  }
  void end_loading(RegionId region, const Result<Ready>& ready) {
    loading.erase(region.value);
    if (ready) most_of_one = std::max(most_of_one, (*ready)->bytes_read + (*ready)->bytes());
  }

  /// Takes entries out until the rest fits: first those used longest ago, then those expected last.
  /// The caller destroys them, without the lock.
  [[nodiscard]] std::vector<Ready> shrink() {
    std::vector<Ready> dropped;
    for (;;) {
      const std::size_t held = bytes();
      if (held + loading.size() * most_of_one <= options.memory) break;
      // Expected regions count by how soon they are needed, and more than all others.
      const auto worth = [&](std::uint32_t r,
                             const Entry& entry) -> std::pair<std::size_t, std::uint64_t> {
        const auto place = std::find(expected.begin(), expected.end(), RegionId{r});
        return {static_cast<std::size_t>(expected.end() - place), entry.used};
      };
      auto least = entries.end();
      for (auto entry = entries.begin(); entry != entries.end(); ++entry) {
        if (taken_last == entry->first) continue;
        if (least == entries.end() ||
            worth(entry->first, entry->second) < worth(least->first, least->second)) {
          least = entry;
        }
      }
      if (least == entries.end()) break;
      if (is_expected(least->first)) {
        if (held <= options.memory) break;
        given_up.insert(least->first);
      }
      ++counts.dropped;
      dropped.push_back(std::move(least->second.ready));
      entries.erase(least);
    }
    return dropped;
  }

  /// @return  the entries that made room for it; destroy them without the lock
  [[nodiscard]] std::vector<Ready> keep(std::uint32_t region, Ready ready) {
    // A map that was borrowed may have been taken while it was loaded.
    if (entries.contains(region)) return {std::move(ready)};
    entries[region] = {std::move(ready), takes};
    return shrink();
  }

  void load_what_is_expected(const std::stop_token& stop) {
    std::unique_lock lock(mutex);
    while (changed.wait(lock, stop, [&] { return missing().has_value(); })) {
      const RegionId region = *missing();
      std::vector<Ready> dropped = begin_loading(region);
      busy = true;
      lock.unlock();
      dropped.clear();
      Result<Ready> ready = make_ready(store, matcher, region);
      lock.lock();
      end_loading(region, ready);
      if (ready) {
        ++counts.loaded_in_background;
        dropped = keep(region.value, *std::move(ready));
      } else {
        given_up.insert(region.value);
      }
      changed.notify_all();
      lock.unlock();
      dropped.clear();
      lock.lock();
      busy = false;
      changed.notify_all();
    }
  }
};

RegionMaps::RegionMaps(const PluginPtr<MapStore>& store, const PluginPtr<ScanMatcher>& matcher,
                       const Options& options)
    : state_(std::make_unique<State>(store, matcher, options)) {
  if (!options.background) return;
  state_->loader = std::jthread(
      [state = state_.get()](const std::stop_token& stop) { state->load_what_is_expected(stop); });
}

RegionMaps::~RegionMaps() = default;

Result<RegionMaps::Taken> RegionMaps::take(RegionId region) {
  State& s = *state_;
  const std::uint32_t r = region.value;
  bool blocked = false;
  std::vector<Ready> dropped;  // destroyed after the lock
  std::unique_lock lock(s.mutex);
  for (;;) {
    if (const auto entry = s.entries.find(r); entry != s.entries.end()) {
      entry->second.used = ++s.takes;
      s.taken_last = r;
      Taken taken{entry->second.ready, blocked};
      dropped = s.shrink();
      return taken;
    }
    if (Ready ready = s.borrowed(r)) {
      s.taken_last = r;
      ++s.takes;
      dropped = s.keep(r, ready);
      return Taken{std::move(ready), blocked};
    }
    blocked = true;
    if (!s.loading.contains(r)) break;
    s.changed.wait(lock, [&] { return !s.loading.contains(r); });
  }
  dropped = s.begin_loading(region);
  lock.unlock();
  dropped.clear();
  Result<Ready> ready = make_ready(s.store, s.matcher, region);
  lock.lock();
  s.end_loading(region, ready);
  s.changed.notify_all();
  if (!ready) return fail(std::move(ready).error());
  ++s.counts.loaded_by_taker;
  s.taken_last = r;
  ++s.takes;
  dropped = s.keep(r, *ready);
  lock.unlock();
  return Taken{*std::move(ready), true};
}

Result<Ready> RegionMaps::borrow(RegionId region) const {
  {
    const std::scoped_lock lock(state_->mutex);
    const auto entry = state_->entries.find(region.value);
    if (entry != state_->entries.end()) return entry->second.ready;
    if (Ready ready = state_->borrowed(region.value)) return ready;
  }
  auto ready = make_ready(state_->store, state_->matcher, region);
  if (ready) {
    const std::scoped_lock lock(state_->mutex);
    std::erase_if(state_->lent, [](const auto& one) { return one.second.expired(); });
    state_->lent[region.value] = *ready;
  }
  return ready;
}

void RegionMaps::expect(std::vector<RegionId> regions) {
  State& s = *state_;
  if (!s.options.background) return;
  const std::scoped_lock lock(s.mutex);
  if (regions == s.expected) return;
  s.expected = std::move(regions);
  std::erase_if(s.given_up, [&](std::uint32_t r) { return !s.is_expected(r); });
  if (s.missing()) s.changed.notify_all();
}

void RegionMaps::wait_until_idle() const {
  const State& s = *state_;
  if (!s.options.background) return;
  std::unique_lock lock(s.mutex);
  s.changed.wait(lock, [&] { return !s.busy && !s.missing(); });
}

RegionMaps::Statistics RegionMaps::statistics() const {
  const std::scoped_lock lock(state_->mutex);
  Statistics counts = state_->counts;
  counts.bytes = state_->bytes();
  counts.regions = state_->entries.size();
  return counts;
}

}  // namespace vantage
