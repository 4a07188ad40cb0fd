#include "vantage/build/sharded_build.hpp"
#include "vantage/kit/map_parts.hpp"

#include <fcntl.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "build/blocks.hpp"
#include "build/build_identity.hpp"
#include "build/bundle_writer.hpp"
#include "build/condense.hpp"
#include "build/parts.hpp"
#include "build/plan.hpp"
#include "build/plan_file.hpp"
#include "build/regions.hpp"
#include "build/sight.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/kit/file_system.hpp"
#include "vantage/kit/marked_folder.hpp"
#include "vantage/kit/stopwatch.hpp"

namespace vantage {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlan = "plan";

// What a point of a block takes with the point itself while regions are put together [bytes].
constexpr std::uint64_t kBytesAMergedPoint = 64;

tl::unexpected<Error> folder_error(ErrorCode code, std::string message, const fs::path& path) {
  return fail(code, std::move(message), SourceLocation{path.string(), 0, 0});
}

/// Removes what builds wrote, and the folder if nothing else is in it. The bundle is there by now:
/// what cannot be removed does no harm.
void remove_parts(const fs::path& folder, const Parts& parts) {
  std::error_code ignored;
  for (const fs::path& file : parts.files()) fs::remove(file, ignored);
  fs::remove(folder / kPlan, ignored);
  if (const auto names = io::names_in(folder)) {
    for (const std::string& name : *names) {
      if (io::is_temporary(name)) fs::remove(folder / name, ignored);  // of a killed planner
    }
  }
  io::release_folder(folder, kPartsMarker);
}

}  // namespace

struct ShardedBuild::State {
  const MapParts* map = nullptr;
  BuildPlugins* plugins = nullptr;
  const BuildParams* params = nullptr;
  ShardedBuildOptions options;
  std::uint64_t key = 0;
  BuildPlan plan;
  std::vector<Bounds2> areas;        // what each region needs
  std::vector<std::uint32_t> order;  // of regions: neighbours in the plan follow each other
  std::vector<double> cost;          // by region
  std::uint64_t most_points = 0;     // that a region needs
  double seconds_plan = 0, seconds_building = 0, core_seconds_building = 0;  // of this process
  double core_seconds_selection = 0;

  Result<void> make_plan(PointsView trajectory);
  void lay_out();
  [[nodiscard]] Result<std::vector<std::uint32_t>> regions_of(const Shard& shard) const;
  [[nodiscard]] Result<Parts> parts() const {
    return Parts::in(options.parts, key, plan.partition.size());
  }
  [[nodiscard]] Result<std::vector<RegionBlock>> blocks(const std::vector<std::uint32_t>& regions,
                                                        std::uint64_t bytes_a_point) const;
  using Keep = std::function<Result<void>(std::uint32_t, StoredPart&&)>;
  /// Returns the processor time of choosing elements [s].
  Result<double> build_block(const RegionBlock& block, Meter& meter, const Keep& keep) const;
  Result<void> merge_block(const RegionBlock& block, const Parts& parts, Meter& meter,
                           BundleWriter& writer);
};

Result<void> ShardedBuild::State::make_plan(PointsView trajectory) {
  VANTAGE_TRY(const BuildIdentity identity,
              identity_of(options.map_key, trajectory, *plugins, *params));
  key = identity.key();
  VANTAGE_CHECK(io::claim_folder(options.parts, kPartsMarker, "a folder of parts"));
  // One process makes the plan, and others wait for it. Where locks do not work, several make it:
  // they get the same bytes, and each puts them in place as a whole.
  const io::Descriptor lock = io::Descriptor::of(options.parts / kPartsMarker, O_RDWR);
  if (lock.open()) (void)io::lock_file(lock, io::Wait::yes);
  const fs::path file = options.parts / kPlan;
  std::error_code error;
  if (!fs::exists(file, error)) {
    VANTAGE_TRY(const BuildPlan made, plan_of(*map, trajectory, *plugins, *params, options.memory));
    const std::vector<std::byte> bytes = encode_plan(made, identity);
    VANTAGE_CHECK(io::write_text_atomically(
        file, {reinterpret_cast<const char*>(bytes.data()), bytes.size()}));
  }
  // Even of one that was just made: another build may have put its own there.
  VANTAGE_TRY(const io::FileContent content, io::read_file(file, "the plan of a build"));
  auto known = decode_plan(std::as_bytes(std::span(content.bytes.get(), content.size)), identity);
  if (!known) return folder_error(known.error().code, known.error().message, file);
  plan = *std::move(known);
  return {};
}

/// Finds what each region needs, and an order in which neighbours follow each other.
void ShardedBuild::State::lay_out() {
  const double reach = reach_of(*plugins, *params, plan.limits);
  order = every_region(plan.partition.size());
  std::vector<Eigen::Vector2d> middles;
  for (const std::uint32_t r : order) {
    const Bounds2 own = bounds_of(plan.partition[RegionId{r}].footprint);
    areas.push_back(needed_area(plan, r, params->scope, reach));
    middles.emplace_back(0.5 * (own.min + own.max));
    // Something for reading and preparing, too.
    const std::uint64_t points = plan.viewpoints[r].empty() ? 0 : map->points_in(areas[r]);
    most_points = std::max(most_points, points);
    cost.push_back(static_cast<double>(points) *
                   (1.0 + static_cast<double>(plan.viewpoints[r].size())));
  }
  halve(order, middles, [&](std::span<const std::uint32_t> some) -> std::optional<Bounds2> {
    if (some.size() < 2) return std::nullopt;
    Bounds2 box;
    for (const std::uint32_t r : some) box.extend(middles[r]);
    return box;
  });
}

Result<std::vector<std::uint32_t>> ShardedBuild::State::regions_of(const Shard& shard) const {
  if (shard.number < 1 || shard.number > shard.count) {
    return fail(ErrorCode::invalid_input, "there is no shard " + std::to_string(shard.number) +
                                              " of " + std::to_string(shard.count) +
                                              ": shards count from 1");
  }
  double total = 0.0;
  for (const double of_region : cost) total += of_region;
  std::vector<std::uint32_t> regions;
  double before = 0.0;
  for (const std::uint32_t r : order) {
    const double middle = total > 0.0 ? (before + 0.5 * cost[r]) / total : 0.0;
    before += cost[r];
    const auto owner = std::min(
        shard.count - 1, static_cast<std::size_t>(middle * static_cast<double>(shard.count)));
    if (owner + 1 == shard.number) regions.push_back(r);
  }
  return regions;
}

Result<std::vector<RegionBlock>> ShardedBuild::State::blocks(
    const std::vector<std::uint32_t>& regions, std::uint64_t bytes_a_point) const {
  return blocks_of(*map, plan.partition, regions, areas, options.memory, bytes_a_point);
}

Result<double> ShardedBuild::State::build_block(const RegionBlock& block, Meter& meter,
                                                const Keep& keep) const {
  VANTAGE_TRY(const MapPart part, map->read(block.area));
  Sight sight(part.points(), plan.limits, plugins->visibility, *params);
  VANTAGE_TRY(const Condenser condenser,
              Condenser::over(part.points(), *plugins, *params, Condenser::Sparse::accept));
  VANTAGE_CHECK(vantage::build_block(block, plan, params->scope, sight, condenser, meter,
                                     [&](std::uint32_t region, BuiltRegion built) {
                                       auto ranks =
                                           ranks_of(part, std::exchange(built.stored.points, {}));
                                       return keep(region, {std::move(ranks), std::move(built)});
                                     }));
  return condenser.core_seconds_selection();
}

Result<void> ShardedBuild::State::merge_block(const RegionBlock& block, const Parts& parts,
                                              Meter& meter, BundleWriter& writer) {
  VANTAGE_TRY(const MapPart around, map->read(block.area));
  for (const std::uint32_t r : block.regions) {
    VANTAGE_TRY(StoredPart stored, parts.read(r));
    VANTAGE_TRY(stored.region.stored.points, indices_of(around, stored.ranks));
    VANTAGE_CHECK(writer.take(r, around.points(), std::move(stored.region)));
    meter.viewpoints_done(plan.viewpoints[r].size());
    meter.region_done();
  }
  return {};
}

ShardedBuild::ShardedBuild(std::unique_ptr<State> state) noexcept : state_(std::move(state)) {}
ShardedBuild::ShardedBuild(ShardedBuild&&) noexcept = default;
ShardedBuild::~ShardedBuild() = default;

Result<ShardedBuild> ShardedBuild::open(const MapParts& map, PointsView trajectory,
                                        BuildPlugins& plugins, const BuildParams& params,
                                        ShardedBuildOptions options) {
  if (params.effective_config.empty()) {
    return fail(ErrorCode::invalid_input,
                "a build in parts needs the text of its configuration, by which its processes know "
                "that they make the same bundle");
  }
  auto state = std::make_unique<State>();
  state->map = &map;
  state->plugins = &plugins;
  state->params = &params;
  state->options = std::move(options);
  const Stopwatch stopwatch;
  VANTAGE_CHECK(state->make_plan(trajectory));
  state->lay_out();
  state->seconds_plan = stopwatch.seconds();
  return ShardedBuild(std::move(state));
}

const Partition& ShardedBuild::partition() const noexcept { return state_->plan.partition; }
std::uint64_t ShardedBuild::map_points() const noexcept { return state_->plan.map_points; }
std::uint64_t ShardedBuild::ground_points() const noexcept { return state_->plan.ground_points; }

std::uint64_t ShardedBuild::least_memory() const noexcept {
  return kBytesASeenPoint * state_->most_points;
}

Result<ShardStatus> ShardedBuild::status(const Shard& shard) const {
  VANTAGE_TRY(const auto regions, state_->regions_of(shard));
  VANTAGE_TRY(const Parts parts, state_->parts());
  ShardStatus status{.regions = regions.size()};
  for (const std::uint32_t r : regions) {
    if (parts.has(r)) ++status.finished;
    status.viewpoints += state_->plan.viewpoints[r].size();
    status.points_times_viewpoints += state_->cost[r];
  }
  return status;
}

Result<BuildEstimate> ShardedBuild::estimate() const {
  constexpr std::size_t kSample = 16;  // regions
  const State& state = *state_;
  VANTAGE_TRY(const Parts parts, state.parts());
  BuildEstimate estimate;
  std::vector<std::uint32_t> left;
  double cost = 0.0;
  for (const std::uint32_t r : state.order) {
    if (parts.has(r) || state.plan.viewpoints[r].empty()) continue;
    left.push_back(r);
    cost += state.cost[r];
  }
  if (left.empty()) return estimate;
  // From the middle of the map, because its border is not like the rest.
  const std::size_t first = left.size() > kSample ? (left.size() - kSample) / 2 : 0;
  const std::vector<std::uint32_t> sample(
      left.begin() + static_cast<std::ptrdiff_t>(first),
      left.begin() + static_cast<std::ptrdiff_t>(std::min(left.size(), first + kSample)));
  VANTAGE_TRY(const auto blocks, state.blocks(sample, kBytesASeenPoint));
  const std::function<void(const BuildProgress&)> nobody;
  Meter meter({}, nobody);
  const CpuStopwatch cpu;
  double of_sample = 0.0;
  for (const RegionBlock& block : blocks) {
    VANTAGE_CHECK(state.build_block(
        block, meter, [](std::uint32_t, StoredPart&&) -> Result<void> { return {}; }));
  }
  for (const std::uint32_t r : sample) of_sample += state.cost[r];
  estimate.sampled = sample.size();
  estimate.core_seconds = cpu.seconds() * cost / std::max(of_sample, 1.0);
  return estimate;
}

Result<std::size_t> ShardedBuild::build(const Shard& shard, const Progress& progress) {
  VANTAGE_TRY(auto regions, state_->regions_of(shard));
  {
    VANTAGE_TRY(const Parts parts, state_->parts());
    std::erase_if(regions, [&](std::uint32_t r) { return parts.has(r); });
  }
  if (regions.empty()) return 0;
  VANTAGE_TRY(PartWriter writer, PartWriter::create(state_->options.parts, shard, state_->key));
  VANTAGE_TRY(const auto blocks, state_->blocks(regions, kBytesASeenPoint));
  BuildProgress start{.regions = regions.size()};
  for (const std::uint32_t r : regions) start.viewpoints += state_->plan.viewpoints[r].size();
  Meter meter(start, progress);
  const Stopwatch stopwatch;
  const CpuStopwatch cpu;
  for (const RegionBlock& block : blocks) {
    VANTAGE_TRY(const double selection,
                state_->build_block(block, meter, [&](std::uint32_t region, StoredPart&& part) {
                  return writer.add(region, part);
                }));
    state_->core_seconds_selection += selection;
  }
  VANTAGE_CHECK(std::move(writer).finish());
  state_->seconds_building += stopwatch.seconds();
  state_->core_seconds_building += cpu.seconds();
  return regions.size();
}

Result<BuildReport> ShardedBuild::merge(const Progress& progress) {
  State& state = *state_;
  VANTAGE_TRY(const Parts parts, state.parts());
  if (const std::size_t missing = parts.missing(); missing > 0) {
    return folder_error(ErrorCode::not_found,
                        std::to_string(missing) + " of " +
                            std::to_string(state.plan.partition.size()) +
                            " regions are not built yet: run the shards that are missing",
                        state.options.parts);
  }
  VANTAGE_TRY(const auto blocks, state.blocks(state.order, kBytesAMergedPoint));
  const Stopwatch stopwatch;
  const CpuStopwatch cpu;
  VANTAGE_TRY(BundleWriter writer, BundleWriter::begin(state.plan, *state.plugins, *state.params));
  Meter meter(meter_start(state.plan), progress);
  for (const RegionBlock& block : blocks) {
    VANTAGE_CHECK(state.merge_block(block, parts, meter, writer));
  }
  VANTAGE_TRY(BuildReport report, std::move(writer).commit());
  report.seconds_partition = state.seconds_plan;
  report.seconds_visibility = stopwatch.seconds() + state.seconds_building;
  report.core_seconds_selection = state.core_seconds_selection;
  report.core_seconds_visibility =
      cpu.seconds() + state.core_seconds_building - state.core_seconds_selection;
  remove_parts(state.options.parts, parts);
  return report;
}

}  // namespace vantage
