#include <algorithm>
#include <bit>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bytes.hpp"
#include "common/folder_store.hpp"
#include "point_ids.hpp"
#include "point_order.hpp"
#include "region_content.hpp"
#include "region_sequences.hpp"
#include "tile_cache.hpp"
#include "tile_writer.hpp"
#include "vantage/plugin.hpp"

namespace vantage::shared_tiles {
namespace {

using bundle_folder::PartialFolder, bundle_folder::RegionFile;

constexpr const char* kTilesFile = "tiles.bin";
constexpr const char* kSequencesFile = "sequences.tmp";
constexpr bundle_folder::BundleFormat kFormat{.store = "shared_tiles",
                                              .version = 1,
                                              .extension = ".region",
                                              .shared = kTilesFile,
                                              .scratch = kSequencesFile};

/// What a build knows of its regions before the commit.
struct Build {
  PointIds ids;
  RegionSequences sequences;
  std::vector<Fnv1a> sums;  // of the first parts of the files, by region
  enum class State { putting, finished, failed } state = State::putting;

  Build(std::uint64_t map_points, std::size_t regions)
      : ids(map_points), sequences(kSequencesFile, regions), sums(regions) {}
};

/// Puts a region's points into their order; nothing if two of them have one rank.
/// @param picks  of all parts, one after another
std::optional<PointCloud> merged(const std::vector<TilePart>& parts,
                                 const std::vector<TileCache::TilePtr>& tiles,
                                 const std::vector<std::uint32_t>& picks) {
  std::uint32_t least = 0xffff'ffff, greatest = 0;
  for (const auto& tile : tiles) {
    least = std::min(least, tile->ranks.front());
    greatest = std::max(greatest, tile->ranks.back());
  }
  if (tiles.empty()) return PointCloud();
  least &= ~63U;
  // A bit for every rank, and how many are set before each word: so many points come before.
  std::vector<std::uint64_t> bits((greatest - least) / 64 + 1);
  std::vector<std::uint32_t> before(bits.size());
  const std::uint32_t* pick = picks.data();
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    const std::uint32_t* const ranks = tiles[t]->ranks.data();
    for (const std::uint32_t* const end = pick + parts[t].count; pick != end; ++pick) {
      const std::uint32_t rank = ranks[*pick] - least;
      bits[rank / 64] |= std::uint64_t{1} << rank % 64;
    }
  }
  std::uint32_t sum = 0;
  for (std::size_t w = 0; w < bits.size(); ++w) {
    before[w] = sum;
    sum += static_cast<std::uint32_t>(std::popcount(bits[w]));
  }
  if (sum != picks.size()) return std::nullopt;
  PointCloud points(picks.size());
  pick = picks.data();
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    const StoredTile& tile = *tiles[t];
    for (const std::uint32_t* const end = pick + parts[t].count; pick != end; ++pick) {
      const std::uint32_t rank = tile.ranks[*pick] - least;
      const std::uint64_t below = (std::uint64_t{1} << rank % 64) - 1;
      const auto at = static_cast<std::size_t>(before[rank / 64]) +
                      static_cast<std::size_t>(std::popcount(bits[rank / 64] & below));
      points[at] = tile.point(*pick);
    }
  }
  return points;
}

/// Every point once, in square tiles; a region says which points of which tiles it has.
class SharedTiles final : public bundle_folder::FolderStore {
 public:
  struct Params : bundle_folder::FolderParams {
    double tile_width = 20.0;
    std::uint32_t cache = 256;
    static constexpr auto schema() {
      return std::tuple_cat(
          folder_fields<Params>(),
          std::tuple{optional("tile_width", &Params::tile_width, "m",
                              "width of the square tiles of a new bundle", positive),
                     optional("cache", &Params::cache, "MB",
                              "memory for tiles that were read; a switch to a region that overlaps "
                              "reads only the others")});
    }
  };

  static Result<std::unique_ptr<MapStore>> create(const Params& params) {
    return std::make_unique<SharedTiles>(params);
  }
  explicit SharedTiles(const Params& params)
      : FolderStore(kFormat, params),
        width_(params.tile_width),
        cache_(std::uint64_t{params.cache} * 1'000'000) {}

 private:
  void start(const MapIndex& index) override {
    build_ = std::make_unique<Build>(index.map_points, index.partition.size());
  }

  [[nodiscard]] Result<RegionFile> write(PartialFolder& folder, RegionId region,
                                         const std::string& name, const RegionMap& map) override {
    VANTAGE_TRY(RegionFile file, bundle_folder::checked(map));
    for (const Point& p : map.points) {
      if (TileWriter::fits(p, width_)) continue;
      return fail(ErrorCode::invalid_input, "a point is too far from the map's origin for tiles");
    }
    VANTAGE_TRY(const auto ids, build_->ids.of(map.points, region.value));
    VANTAGE_CHECK(build_->sequences.add(folder, region.value, ids));
    const std::string head = encode_head(map, file);
    VANTAGE_CHECK(folder.write_file(name, head));
    build_->sums[region.value] = sum_of(head);
    file.bytes = head.size();
    return file;
  }

  [[nodiscard]] Result<void> finish(PartialFolder& folder, std::vector<RegionFile>& files,
                                    const std::vector<std::string>& names) override {
    if (build_->state == Build::State::finished) return {};
    if (build_->state == Build::State::failed) {
      return fail(ErrorCode::io_failure, "the bundle could not be written before");
    }
    build_->state = Build::State::failed;
    build_->ids.finish();
    VANTAGE_CHECK(build_->sequences.open(folder));
    const PointOrder order(build_->sequences, build_->ids.uses());
    TileWriter tiles(build_->ids.points(), order, width_);
    VANTAGE_CHECK(tiles.write(folder, kTilesFile));
    for (std::uint32_t r = 0; r < files.size(); ++r) {
      const std::string parts = tiles.parts_of(build_->sequences.of(r));
      VANTAGE_CHECK(folder.append(names[r], parts));
      files[r].bytes += parts.size();
      files[r].checksum = sum_of(parts, build_->sums[r]).value();
    }
    VANTAGE_CHECK(build_->sequences.remove(folder));
    build_ = std::make_unique<Build>(0, 0);  // frees the points
    build_->state = Build::State::finished;
    return {};
  }

  [[nodiscard]] Result<RegionMap> read(std::string_view content, const RegionFile& file,
                                       const std::filesystem::path& path) const override {
    VANTAGE_TRY(RegionContent region, decode_region(content, file, path.string()));
    std::optional<io::InputFile> tiles_file;
    std::vector<TileCache::TilePtr> tiles;
    std::vector<std::uint32_t> picks;
    tiles.reserve(region.parts.size());
    picks.reserve(file.points);
    for (const TilePart& part : region.parts) {
      auto tile = cache_.get(part.place, root() / kTilesFile, tiles_file);
      if (!tile) {
        return fail(
            std::move(tile).error().during("reading region '" + path.stem().string() + "'"));
      }
      if (!read_selection(part.selection, part.coding, (*tile)->points(), part.count, picks)) {
        return fail(ErrorCode::corrupt_data, "the points of a tile are damaged",
                    SourceLocation{path.string(), 0, 0});
      }
      tiles.push_back(*std::move(tile));
    }
    auto points = merged(region.parts, tiles, picks);
    if (!points) {
      return fail(ErrorCode::corrupt_data, "the order of the points is damaged",
                  SourceLocation{path.string(), 0, 0});
    }
    region.map.points = *std::move(points);
    return std::move(region.map);
  }

  double width_;
  std::unique_ptr<Build> build_;
  mutable TileCache cache_;
};

}  // namespace
}  // namespace vantage::shared_tiles

VANTAGE_PLUGIN(vantage::MapStore, vantage::shared_tiles::SharedTiles, "shared_tiles",
               "a folder in which regions share the points that they both have");
