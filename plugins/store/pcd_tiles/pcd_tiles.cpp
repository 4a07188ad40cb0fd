#include <memory>
#include <string>
#include <string_view>

#include "common/folder_store.hpp"
#include "format.hpp"
#include "vantage/plugin.hpp"

namespace vantage::pcd_tiles {
namespace {

/// One PCD file per region, and an index.
class PcdTiles final : public bundle_folder::FolderStore {
 public:
  struct Params : bundle_folder::FolderParams {
    static constexpr auto schema() { return folder_fields<Params>(); }
  };

  static Result<std::unique_ptr<MapStore>> create(const Params& params) {
    return std::make_unique<PcdTiles>(params);
  }
  explicit PcdTiles(const Params& params) : FolderStore(kFormat, params) {}

 private:
  [[nodiscard]] Result<RegionFile> write(bundle_folder::PartialFolder& folder, RegionId /*region*/,
                                         const std::string& name, const RegionMap& map) override {
    RegionFile file;
    VANTAGE_CHECK(folder.write_file(name, [&](const Sink& sink) -> Result<void> {
      VANTAGE_TRY(file, encode(map, sink));
      return {};
    }));
    return file;
  }
  [[nodiscard]] Result<RegionMap> read(std::string_view content, const RegionFile& file,
                                       const std::filesystem::path& path) const override {
    return decode(content, file, path.string());
  }
};

}  // namespace
}  // namespace vantage::pcd_tiles

VANTAGE_PLUGIN(vantage::MapStore, vantage::pcd_tiles::PcdTiles, "pcd_tiles",
               "a folder with one binary PCD file per region");
