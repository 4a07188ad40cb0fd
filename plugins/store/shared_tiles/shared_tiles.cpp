#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bytes.hpp"
#include "common/folder_store.hpp"
#include "merged_points.hpp"
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

/// Every point once, in square tiles; a region says which points of which tiles it has.
class SharedTiles final : public bundle_folder::FolderStore {
 public:
  struct Params : bundle_folder::FolderParams {
    double tile_width = 20.0;
    std::uint32_t cache = 128;
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
    if (build_->state != Build::State::putting) return failed_before();
    build_->state = Build::State::failed;  // if it ends here, points were counted that are not kept
    const std::string head = encode_head(map, file);
    VANTAGE_CHECK(folder.write_file(name, head));
    VANTAGE_TRY(const auto ids, build_->ids.of(map.points, region.value));
    VANTAGE_CHECK(build_->sequences.add(folder, region.value, ids));
    build_->sums[region.value] = sum_of(head);
    build_->state = Build::State::putting;
    file.bytes = head.size();
    return file;
  }

  [[nodiscard]] Result<void> finish(PartialFolder& folder, std::vector<RegionFile>& files,
                                    const std::vector<std::string>& names) override {
    if (build_->state == Build::State::finished) return {};
    if (build_->state == Build::State::failed) return failed_before();
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
    MergedPoints merged;
    tiles.reserve(region.parts.size());
    for (const TilePart& part : region.parts) {
      auto tile = cache_.get(part.place, root() / kTilesFile, tiles_file);
      if (!tile) {
        return fail(
            std::move(tile).error().during("reading region '" + path.stem().string() + "'"));
      }
      const auto runs = read_selection(part.selection, part.coding, (*tile)->points, part.count);
      if (!runs) return corrupt("the selection from a tile is damaged", path);
      merged.add(**tile, *runs);
      tiles.push_back(*std::move(tile));  // until the points are there
    }
    auto points = merged.points();
    if (!points) return corrupt("the order of the points is damaged", path);
    region.map.points = *std::move(points);
    return std::move(region.map);
  }

  [[nodiscard]] static tl::unexpected<Error> failed_before() {
    return fail(ErrorCode::io_failure, "a part of the bundle could not be written: begin it again");
  }
  [[nodiscard]] static tl::unexpected<Error> corrupt(const char* reason,
                                                     const std::filesystem::path& path) {
    return fail(ErrorCode::corrupt_data, reason, SourceLocation{path.string(), 0, 0});
  }

  double width_;
  std::unique_ptr<Build> build_;
  mutable TileCache cache_;
};

}  // namespace
}  // namespace vantage::shared_tiles

VANTAGE_PLUGIN(vantage::MapStore, vantage::shared_tiles::SharedTiles, "shared_tiles",
               "a folder in which regions share the points that they both have");
