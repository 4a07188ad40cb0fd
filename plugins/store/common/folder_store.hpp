#pragma once

#include <sys/stat.h>

#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/bundle_format.hpp"
#include "common/partial_folder.hpp"
#include "vantage/map_store.hpp"
#include "vantage/params.hpp"
#include "vantage/region_directory.hpp"

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

/// A store that keeps a bundle in a folder. It does all but the files of the regions: index,
/// attachments, checks of what is put when, and the commit. A store derives from it and says how a
/// region is written and read.
class FolderStore : public MapStore {
 public:
  [[nodiscard]] Result<void> may_begin() const noexcept final;
  [[nodiscard]] Result<void> begin(const MapIndex& index) noexcept final;
  [[nodiscard]] Result<void> put(RegionId region, const RegionMap& map) noexcept final;
  [[nodiscard]] Result<void> attach(std::string_view name,
                                    std::span<const std::byte> bytes) noexcept final;
  [[nodiscard]] Result<void> commit() noexcept final;
  [[nodiscard]] Result<MapIndex> index() const noexcept final;
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept final;
  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept final;
  [[nodiscard]] Result<std::vector<std::byte>> attachment(
      std::string_view name) const noexcept final;

 protected:
  FolderStore(const BundleFormat& format, const FolderParams& params);

  /// A bundle is begun.
  virtual void start(const MapIndex& index);
  /// Writes a region's file, or nothing if it fails.
  /// Errors: `invalid_input` for a map that cannot be stored; `io_failure`.
  [[nodiscard]] virtual Result<RegionFile> write(PartialFolder& folder, RegionId region,
                                                 const std::string& name, const RegionMap& map) = 0;
  /// Every region is written, and the bundle is about to be committed. After a commit that fails it
  /// may be called again.
  /// @param files  what the index will say, by RegionId; may be changed
  /// @param names  of the regions' files
  [[nodiscard]] virtual Result<void> finish(PartialFolder& folder, std::vector<RegionFile>& files,
                                            const std::vector<std::string>& names);
  /// Thread safety: may run on one object from many threads at once.
  /// @param content  of the region's file
  /// @param path     of the region's file, for messages
  /// Errors: `corrupt_data`.
  [[nodiscard]] virtual Result<RegionMap> read(std::string_view content, const RegionFile& file,
                                               const std::filesystem::path& path) const = 0;

  [[nodiscard]] const std::filesystem::path& root() const noexcept { return root_; }

 private:
  /// A bundle under construction.
  struct Writing {
    PartialFolder folder;
    std::filesystem::path root;
    MapIndex index;
    std::vector<RegionFile> files;  // by RegionId
    std::vector<bool> done;         // by RegionId
  };

  /// The index that was read, and the identity of its file when it was last looked at.
  struct CachedIndex {
    dev_t device{};
    ino_t inode{};
    off_t size{};
    timespec changed{}, modified{};
    std::shared_ptr<const OpenIndex> index;
    std::uint64_t look = 0;  // counts the files of the bundle that were there

    [[nodiscard]] bool is_of(const struct stat& file) const noexcept;
  };

  [[nodiscard]] tl::unexpected<Error> unknown_region(std::uint32_t r, std::size_t regions) const;
  [[nodiscard]] Result<std::filesystem::path> resolved_root() const;
  [[nodiscard]] Result<void> keep(const std::filesystem::path& root);
  [[nodiscard]] Result<void> may_write(const std::filesystem::path& root) const;
  /// The bundle that was opened, if it is still there.
  struct Current {
    std::shared_ptr<const OpenIndex> index;
    std::uint64_t look = 0;  // equal ones: its files were the same ones in between
  };
  /// Errors: those of open_index; `io_failure` if another bundle is there by now.
  [[nodiscard]] Result<Current> current() const;
  /// What read(index) reads from the bundle's files, if they were the bundle's to the end.
  template <class Read>
  [[nodiscard]] auto from_bundle(const Read& read) const
      -> decltype(read(std::declval<const OpenIndex&>())) {
    VANTAGE_TRY(Current before, current());
    for (;;) {
      auto result = read(*before.index);
      VANTAGE_TRY(const Current after, current());
      if (after.look == before.look) return result;
      before = after;
    }
  }

  const BundleFormat& format_;
  std::filesystem::path root_;
  bool overwrite_;
  std::unique_ptr<Writing> writing_;
  mutable std::mutex mutex_;
  mutable CachedIndex cached_;
};

}  // namespace vantage::bundle_folder
