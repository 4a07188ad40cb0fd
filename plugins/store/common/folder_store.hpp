#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/bundle_format.hpp"
#include "common/partial_folder.hpp"
#include "vantage/map_store.hpp"
#include "vantage/params.hpp"

namespace vantage::bundle_folder {

/// The parameters of every store of folders. A store's Params derive from this struct.
struct FolderParams {
  std::filesystem::path root;
  bool overwrite = false;

  /// @tparam Params  the struct that derives from this one
  template <class Params>
  [[nodiscard]] static constexpr auto folder_fields() {
    const auto of = []<class T>(T FolderParams::*member) -> T Params::* { return member; };
    return std::tuple{
        required("root", of(&FolderParams::root), "", "folder of the bundle; created by a build"),
        optional("overwrite", of(&FolderParams::overwrite), "",
                 "a build may replace an existing bundle"),
    };
  }
  /// `root` without a slash at its end.
  [[nodiscard]] std::filesystem::path folder() const;
  /// Errors: `invalid_input` for a root that names no folder.
  [[nodiscard]] Result<void> validate() const;
};

/// Writes the files of a bundle's regions.
class RegionFiles {
 public:
  virtual ~RegionFiles() = default;

  /// Writes a region's file, or nothing if it fails.
  /// Errors: `invalid_input` for a map that cannot be stored; `io_failure`.
  [[nodiscard]] virtual Result<RegionFile> write(PartialFolder& folder, RegionId region,
                                                 const std::string& name, const RegionMap& map) = 0;
  /// Every region is written, and the bundle is about to be committed.
  /// @param files  what the index will say, by RegionId; may be changed
  /// @param names  of the regions' files
  [[nodiscard]] virtual Result<void> finish(PartialFolder& folder, std::vector<RegionFile>& files,
                                            const std::vector<std::string>& names);
};

/// Reads a region's map. Thread safety: may run in many threads at once.
/// @param content  of the region's file
/// @param path     of the region's file
/// Errors: `corrupt_data`.
using ReadRegion = Result<RegionMap> (*)(std::string_view content, const RegionFile& file,
                                         const std::filesystem::path& path);

/// A store that keeps a bundle in a folder. It writes the index and the attachments, checks each
/// put, and commits. A store derives from it and says how a region is written and read.
class FolderStore : public MapStore {
 public:
  [[nodiscard]] Result<void> may_begin() const noexcept final;
  [[nodiscard]] Result<std::unique_ptr<MapWriter>> begin(
      const MapIndex& index) const noexcept final;
  [[nodiscard]] Result<std::unique_ptr<const MapReader>> open() const noexcept final;

 protected:
  FolderStore(const BundleFormat& format, const FolderParams& params, ReadRegion read);

  /// For a bundle that is begun.
  [[nodiscard]] virtual std::unique_ptr<RegionFiles> region_files(const MapIndex& index) const = 0;

 private:
  const BundleFormat& format_;
  std::filesystem::path root_;
  bool overwrite_;
  ReadRegion read_;
};

}  // namespace vantage::bundle_folder
