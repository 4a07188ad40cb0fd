#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bytes.hpp"
#include "common/folder_store.hpp"
#include "growing_tiles.hpp"
#include "region_content.hpp"
#include "region_reader.hpp"
#include "scratch.hpp"
#include "vantage/plugin.hpp"

namespace vantage::shared_tiles {
namespace {

using bundle_folder::PartialFolder, bundle_folder::RegionFile;

constexpr const char* kTilesFile = "tiles.bin";
constexpr const char* kScratchFile = "scratch.tmp";
constexpr bundle_folder::BundleFormat kFormat{.store = "shared_tiles",
                                              .version = 3,
                                              .extension = ".region",
                                              .shared = kTilesFile,
                                              .scratch = kScratchFile};

/// What a build knows of its regions before the commit.
struct Build {
  struct Put {
    std::uint32_t region;
    Scratch::Place place;
  };

  Scratch scratch{kScratchFile};
  GrowingTiles tiles;
  std::vector<Put> puts;    // in their order: neighbours mostly follow each other
  std::vector<Fnv1a> sums;  // of the first parts of the files, by region
  enum class State { putting, finished, failed } state = State::putting;

  Build(double width, std::uint64_t memory, std::size_t regions)
      : tiles(width, memory, scratch), sums(regions) {}
};

/// Every point once, in square tiles; a region says which points of which tiles it has.
class SharedTiles final : public bundle_folder::FolderStore {
 public:
  struct Params : bundle_folder::FolderParams {
    double tile_width = 20.0;
    std::uint32_t build_cache = 512;
    static constexpr auto schema() {
      return std::tuple_cat(
          folder_fields<Params>(),
          std::tuple{optional("tile_width", &Params::tile_width, "m",
                              "width of the square tiles of a new bundle", positive),
                     optional("build_cache", &Params::build_cache, "MB",
                              "memory for tiles while a bundle is written; the others wait in a "
                              "file. The bundle does not depend on it")});
    }
  };

  static Result<std::unique_ptr<MapStore>> create(const Params& params) {
    return std::make_unique<SharedTiles>(params);
  }
  explicit SharedTiles(const Params& params)
      : FolderStore(kFormat, params),
        width_(params.tile_width),
        build_cache_(std::uint64_t{params.build_cache} * 1'000'000) {}

 private:
  void start(const MapIndex& index) override {
    build_ = std::make_unique<Build>(width_, build_cache_, index.partition.size());
  }

  [[nodiscard]] Result<RegionFile> write(PartialFolder& folder, RegionId region,
                                         const std::string& name, const RegionMap& map) override {
    VANTAGE_TRY(RegionFile file, bundle_folder::checked(map));
    for (const Point& p : map.points) {
      if (build_->tiles.fits(p)) continue;
      return fail(ErrorCode::invalid_input, "a point is too far from the map's origin for tiles");
    }
    if (build_->state != Build::State::putting) return failed_before();
    build_->state = Build::State::failed;  // if it ends here, points were counted that are not kept
    const std::string head = encode_head(map, file);
    VANTAGE_CHECK(folder.write_file(name, head));
    VANTAGE_TRY(const std::string put, build_->tiles.put(folder, map.points));
    VANTAGE_TRY(const Scratch::Place place, build_->scratch.add(folder, put));
    build_->puts.push_back({region.value, place});
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
    VANTAGE_CHECK(build_->tiles.finish(folder, kTilesFile));
    for (const Build::Put& put : build_->puts) {
      VANTAGE_TRY(const std::string kept, build_->scratch.read(put.place));
      VANTAGE_TRY(const std::string parts, build_->tiles.parts_of(kept));
      VANTAGE_CHECK(folder.append(names[put.region], parts));
      files[put.region].bytes += parts.size();
      files[put.region].checksum = sum_of(parts, build_->sums[put.region]).value();
    }
    VANTAGE_CHECK(build_->scratch.remove(folder));
    build_ = std::make_unique<Build>(width_, 0, 0);  // frees the memory
    build_->state = Build::State::finished;
    return {};
  }

  [[nodiscard]] Result<RegionMap> read(std::string_view content, const RegionFile& file,
                                       const std::filesystem::path& path) const override {
    return read_region(content, file, path, root() / kTilesFile);
  }

  [[nodiscard]] static tl::unexpected<Error> failed_before() {
    return fail(ErrorCode::io_failure, "a part of the bundle could not be written: begin it again");
  }

  double width_;
  std::uint64_t build_cache_;  // [bytes]
  std::unique_ptr<Build> build_;
};

}  // namespace
}  // namespace vantage::shared_tiles

VANTAGE_PLUGIN(vantage::MapStore, vantage::shared_tiles::SharedTiles, "shared_tiles",
               "a folder in which regions share the points that they both have");
