#include <memory>
#include <string>
#include <string_view>

#include "common/folder_store.hpp"
#include "format.hpp"
#include "vantage/plugin.hpp"

namespace vantage::pcd_tiles {
namespace {

class PcdFiles final : public bundle_folder::RegionFiles {
 public:
  [[nodiscard]] Result<RegionFile> write(bundle_folder::PartialFolder& folder, RegionId /*region*/,
                                         const std::string& name, const RegionMap& map) override {
    RegionFile file;
    VANTAGE_CHECK(folder.write_file(name, [&](const Sink& sink) -> Result<void> {
      VANTAGE_TRY(file, encode(map, sink));
      return {};
    }));
    return file;
  }
};

/// One PCD file per region, and an index.
class PcdTiles final : public bundle_folder::FolderStore {
 public:
  struct Params : bundle_folder::FolderParams {
    static constexpr auto schema() { return folder_fields<Params>(); }
  };

  static Result<std::unique_ptr<MapStore>> create(const Params& params) {
    return std::make_unique<PcdTiles>(params);
  }
  explicit PcdTiles(const Params& params) : FolderStore(kFormat, params, &decode) {}

 private:
  [[nodiscard]] std::unique_ptr<bundle_folder::RegionFiles> region_files(
      const MapIndex& /*index*/) const override {
    return std::make_unique<PcdFiles>();
  }
};

}  // namespace
}  // namespace vantage::pcd_tiles

VANTAGE_PLUGIN(vantage::MapStore, vantage::pcd_tiles::PcdTiles, "pcd_tiles",
               "a folder with one binary PCD file per region");
