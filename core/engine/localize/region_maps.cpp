#include "vantage/engine/region_maps.hpp"

#include <algorithm>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <thread>
#include <tuple>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "vantage/kit/stopwatch.hpp"

namespace vantage {
namespace {

using Ready = std::shared_ptr<const ReadyRegion>;

}  // namespace

Result<PluginPtr<MatchTarget>> target_in(const RegionMap& map,
                                         const PluginPtr<ScanMatcher>& matcher) {
  const bool is_prepared = !map.prepared.bytes.empty();
  if (!is_prepared && map.points.empty()) {
    return fail(ErrorCode::too_few_matches,
                "the bundle holds nothing for this region that a scan can be matched to");
  }
  VANTAGE_TRY(auto target,
              is_prepared ? matcher->restore(map.prepared.bytes) : matcher->prepare(map.points));
  return in_library_of(matcher, std::move(target));
}

Result<Ready> make_ready(const MapReader& bundle, const PluginPtr<ScanMatcher>& matcher,
                         RegionId region) {
  auto ready = std::make_shared<ReadyRegion>();
  Stopwatch stopwatch;
  VANTAGE_TRY(RegionMap map, bundle.get(region));
  ready->seconds_load = stopwatch.seconds();

  stopwatch = {};
  VANTAGE_TRY(ready->target, target_in(map, matcher));
  ready->seconds_prepare = stopwatch.seconds();

  ready->bytes_at_first = std::max(std::size_t{1}, ready->bytes());
  ready->bytes_read = map.points.size() * sizeof(Point) + map.prepared.bytes.size();
  ready->map_points = map.points.empty() ? ready->target->elements() : map.points.size();
  return ready;
}

struct RegionMaps::State {
  State(const MapReader& the_bundle, const PluginPtr<ScanMatcher>& the_matcher,
        const Options& the_options)
      : bundle(the_bundle), matcher(the_matcher), options(the_options) {}

  const MapReader& bundle;
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
  std::unordered_set<std::uint32_t> loading;  // which some thread is loading right now, to keep
  std::size_t lending = 0;                    // so many are being loaded to be borrowed
  std::size_t aside = 0;                      // of the limit [bytes]
  // Expected, but failed or did not fit; how many were to be loaded before it then.
  std::unordered_map<std::uint32_t, std::ptrdiff_t> given_up;
  std::vector<RegionId> expected;
  std::optional<std::uint32_t> taken_last;
  bool busy = false;  // whether the loader is loading or releasing a map
  std::uint64_t takes = 0;
  std::size_t most_of_one = 0;  // that a region took while it was loaded [bytes]
  double growth = 1.0;          // the largest ratio of a map's size to its first size
  Statistics counts;

  std::jthread loader;  // last, so that it ends before the members that it uses

  /// How many regions are expected before this one; nothing if it is not expected.
  [[nodiscard]] std::optional<std::ptrdiff_t> rank_of(std::uint32_t region) const {
    const auto place = std::ranges::find(expected, RegionId{region});
    if (place == expected.end()) return {};
    return place - expected.begin();
  }

  /// The map of a region, if it is kept, or if a caller borrowed it and still holds it; otherwise
  /// nullptr.
  [[nodiscard]] Ready held(std::uint32_t region) const {
    if (const auto kept = entries.find(region); kept != entries.end()) return kept->second.ready;
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

  /// Calls visit(map) for each map that is in memory.
  template <class Visit>
  void for_each_map(const Visit& visit) const {
    for (const auto& [region, entry] : entries) visit(entry.ready);
    for (const auto& [region, one] : lent) {
      if (entries.contains(region)) continue;
      if (const Ready ready = one.lock()) visit(ready);
    }
  }

  /// Counted anew each time: targets may have grown.
  [[nodiscard]] std::size_t bytes() const {
    std::size_t sum = 0;
    for_each_map([&](const Ready& ready) { sum += ready->bytes(); });
    return sum;
  }

  /// What the maps in use may still grow by, if each grows as much as any did so far.
  [[nodiscard]] std::size_t growth_to_expect() {
    const auto first = [](const Ready& ready) {
      return static_cast<double>(ready->bytes_at_first);
    };
    for_each_map([&](const Ready& ready) {
      growth = std::max(growth, static_cast<double>(ready->bytes()) / first(ready));
    });
    double sum = 0.0;
    for_each_map([&](const Ready& ready) {
      const double more = growth * first(ready) - static_cast<double>(ready->bytes());
      if (ready.use_count() > 1) sum += std::max(0.0, more);
    });
    return static_cast<std::size_t>(sum);
  }

  /// Makes room for a region, and loads it without the lock.
  [[nodiscard]] Result<Ready> load(RegionId region, std::unique_lock<std::mutex>& lock) {
    loading.insert(region.value);
    Result<Ready> ready = read(region, lock);
    loading.erase(region.value);
    changed.notify_all();
    return ready;
  }

  /// The same for a caller that borrows it. Other callers do not wait for it: this thread may run a
  /// task of theirs while it prepares the map.
  [[nodiscard]] Result<Ready> lend(RegionId region, std::unique_lock<std::mutex>& lock) {
    ++lending;
    Result<Ready> ready = read(region, lock);
    --lending;
    std::erase_if(lent, [](const auto& one) { return one.second.expired(); });
    if (ready) lent[region.value] = *ready;
    return ready;
  }

  [[nodiscard]] Result<Ready> read(RegionId region, std::unique_lock<std::mutex>& lock) {
    std::vector<Ready> dropped = shrink();
    lock.unlock();
    dropped.clear();
    Result<Ready> ready = make_ready(bundle, matcher, region);
    lock.lock();
    if (ready) most_of_one = std::max(most_of_one, (*ready)->bytes_read + (*ready)->bytes());
    return ready;
  }

  /// Takes entries out until the rest fits: first those used longest ago, then those expected last.
  /// The caller destroys them, without the lock.
  [[nodiscard]] std::vector<Ready> shrink() {
    std::vector<Ready> dropped;
    // Expected regions count by how soon they are needed, and more than all others.
    const auto worth = [&](const auto& entry) {
      const auto place = std::ranges::find(expected, RegionId{entry.first});
      return std::tuple(taken_last == entry.first, expected.end() - place, entry.second.used);
    };
    const std::size_t to_come = (loading.size() + lending) * most_of_one + growth_to_expect();
    for (;;) {
      const std::size_t held = aside + bytes();
      if (held + to_come <= options.memory) break;
      const auto least = std::ranges::min_element(entries, {}, worth);
      if (least == entries.end() || taken_last == least->first) break;
      if (const auto rank = rank_of(least->first)) {
        if (held <= options.memory) break;
        given_up[least->first] = *rank;
      }
      ++counts.dropped;
      if (least->second.ready.use_count() > 1) lent[least->first] = least->second.ready;
      dropped.push_back(std::move(least->second.ready));
      entries.erase(least);
    }
    return dropped;
  }

  /// Keeps a region, unless it was kept while this one was loaded.
  /// @return  as shrink()
  [[nodiscard]] std::vector<Ready> keep(std::uint32_t region, Ready ready) {
    if (entries.contains(region)) return {std::move(ready)};
    entries.emplace(region, Entry{std::move(ready), takes});
    return shrink();
  }

  void load_what_is_expected(const std::stop_token& stop) {
    std::unique_lock lock(mutex);
    while (changed.wait(lock, stop, [&] { return missing().has_value(); })) {
      busy = true;
      const RegionId region = *missing();
      Result<Ready> ready = load(region, lock);
      std::vector<Ready> dropped;
      if (ready) {
        ++counts.loaded_in_background;
        dropped = keep(region.value, *std::move(ready));
      } else {
        given_up[region.value] = 0;
      }
      lock.unlock();
      dropped.clear();
      lock.lock();
      busy = false;
      changed.notify_all();
    }
  }
};

RegionMaps::RegionMaps(const MapReader& bundle, const PluginPtr<ScanMatcher>& matcher,
                       const Options& options)
    : state_(std::make_unique<State>(bundle, matcher, options)) {
  if (!options.background) return;
  state_->loader = std::jthread(
      [state = state_.get()](const std::stop_token& stop) { state->load_what_is_expected(stop); });
}

RegionMaps::~RegionMaps() = default;

Result<RegionMaps::Taken> RegionMaps::take(RegionId region) {
  State& s = *state_;
  const std::uint32_t r = region.value;
  Taken taken;
  std::vector<Ready> dropped;  // destroyed after the lock
  std::unique_lock lock(s.mutex);
  const auto is_loading = [&] { return s.loading.contains(r); };
  while (!(taken.region = s.held(r)) && is_loading()) {
    taken.blocked = true;
    s.changed.wait(lock, std::not_fn(is_loading));
  }
  if (!taken.region) {
    taken.blocked = true;
    VANTAGE_TRY(taken.region, s.load(region, lock));
    ++s.counts.loaded_by_taker;
  }
  s.taken_last = r;
  State::Entry& entry = s.entries[r];
  if (!entry.ready) entry.ready = taken.region;  // another thread may have kept it meanwhile
  entry.used = ++s.takes;
  dropped = s.shrink();
  return taken;
}

Result<Ready> RegionMaps::borrow(RegionId region) const {
  std::unique_lock lock(state_->mutex);
  if (Ready ready = state_->held(region.value)) return ready;
  return state_->lend(region, lock);
}

void RegionMaps::set_aside(std::size_t bytes) const {
  const std::scoped_lock lock(state_->mutex);
  state_->aside = bytes;
}

void RegionMaps::expect(std::vector<RegionId> regions) {
  State& s = *state_;
  if (!s.options.background) return;
  const std::scoped_lock lock(s.mutex);
  if (regions == s.expected) return;
  s.expected = std::move(regions);
  // What is needed sooner now may fit.
  std::erase_if(s.given_up, [&](const auto& one) {
    const auto rank = s.rank_of(one.first);
    return !rank || *rank < one.second;
  });
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
