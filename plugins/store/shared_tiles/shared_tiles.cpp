#include <filesystem>
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
#include "vantage/kit/checksum.hpp"
#include "vantage/plugin.hpp"

namespace vantage::shared_tiles {
namespace {

namespace fs = std::filesystem;
using bundle_folder::PartialFolder, bundle_folder::RegionFile;

constexpr const char* kTilesFile = "tiles.bin";
constexpr const char* kScratchFile = "scratch.tmp";
constexpr bundle_folder::BundleFormat kFormat{.store = "shared_tiles",
                                              .version = 4,
                                              .extension = ".region",
                                              .shared = kTilesFile,
                                              .scratch = kScratchFile};

/// What is written of the regions before the commit, and of the tiles at it.
class SharedFiles final : public bundle_folder::RegionFiles {
 public:
  /// @param memory  for tiles [bytes]
  SharedFiles(double tile_width, std::uint64_t memory, std::size_t regions)
      : tiles_(tile_width, memory, scratch_), sums_(regions) {}

  [[nodiscard]] Result<RegionFile> write(PartialFolder& folder, RegionId region,
                                         const std::string& name, const RegionMap& map) override {
    VANTAGE_TRY(RegionFile file, bundle_folder::checked(map));
    for (const Point& p : map.points) {
      if (tiles_.fits(p)) continue;
      return fail(ErrorCode::invalid_input, "a point is too far from the map's origin for tiles");
    }
    if (failed_) return failed_before();
    failed_ = true;  // if it ends here, points were counted that are not kept
    const std::string head = encode_head(map, file);
    VANTAGE_CHECK(folder.write_file(name, head));
    VANTAGE_TRY(const std::string put, tiles_.put(folder, map.points));
    VANTAGE_TRY(const Scratch::Place place, scratch_.add(folder, put));
    puts_.push_back({region.value, place});
    sums_[region.value].add(head);
    failed_ = false;
    file.bytes = head.size();
    return file;
  }

  [[nodiscard]] Result<void> finish(PartialFolder& folder, std::vector<RegionFile>& files,
                                    const std::vector<std::string>& names) override {
    if (failed_) return failed_before();
    VANTAGE_CHECK(tiles_.finish(folder, kTilesFile));
    for (const Put& put : puts_) {
      VANTAGE_TRY(const std::string kept, scratch_.read(put.place));
      VANTAGE_TRY(const std::string parts, tiles_.parts_of(kept));
      VANTAGE_CHECK(folder.append(names[put.region], parts));
      files[put.region].bytes += parts.size();
      sums_[put.region].add(parts);
      files[put.region].checksum = sums_[put.region].value();
    }
    return scratch_.remove(folder);
  }

 private:
  struct Put {
    std::uint32_t region;
    Scratch::Place place;
  };

  [[nodiscard]] static tl::unexpected<Error> failed_before() {
    return fail(ErrorCode::io_failure, "a part of the bundle could not be written: begin it again");
  }

  Scratch scratch_{kScratchFile};
  GrowingTiles tiles_;
  std::vector<Put> puts_;       // in their order: neighbours mostly follow each other
  std::vector<Checksum> sums_;  // of the first parts of the files, by region
  bool failed_ = false;
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
      : FolderStore(kFormat, params,
                    [](std::string_view content, const RegionFile& file, const fs::path& path) {
                      return read_region(content, file, path, path.parent_path() / kTilesFile);
                    }),
        width_(params.tile_width),
        build_cache_(std::uint64_t{params.build_cache} * 1'000'000) {}

 private:
  [[nodiscard]] std::unique_ptr<bundle_folder::RegionFiles> region_files(
      const MapIndex& index) const override {
    return std::make_unique<SharedFiles>(width_, build_cache_, index.partition.size());
  }

  double width_;
  std::uint64_t build_cache_;  // [bytes]
};

}  // namespace
}  // namespace vantage::shared_tiles

VANTAGE_PLUGIN(vantage::MapStore, vantage::shared_tiles::SharedTiles, "shared_tiles",
               "a folder in which regions share the points that they both have");
