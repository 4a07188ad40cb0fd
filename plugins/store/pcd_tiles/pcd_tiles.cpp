#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "attachment.hpp"
#include "bundle_index.hpp"
#include "partial_folder.hpp"
#include "tile.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/plugin.hpp"

namespace vantage::pcd_tiles {
namespace {

namespace fs = std::filesystem;

/// A bundle under construction.
struct Writing {
  PartialFolder folder;
  fs::path root;
  BundleIndex index;
  std::vector<bool> done;  // by RegionId
};

/// An index that was read, and the identity of its file.
struct CachedIndex {
  dev_t device{};
  ino_t inode{};
  off_t size{};
  timespec changed{}, modified{};
  std::shared_ptr<const BundleIndex> index;

  [[nodiscard]] bool is_of(const struct stat& file) const noexcept {
    return index && device == file.st_dev && inode == file.st_ino && size == file.st_size &&
           changed.tv_sec == file.st_ctim.tv_sec && changed.tv_nsec == file.st_ctim.tv_nsec &&
           modified.tv_sec == file.st_mtim.tv_sec && modified.tv_nsec == file.st_mtim.tv_nsec;
  }
};

/// One PCD file per region, and an index.
class PcdTiles final : public MapStore {
 public:
  struct Params {
    fs::path root;
    bool overwrite = false;
    static constexpr auto schema() {
      return std::tuple{
          required("root", &Params::root, "", "folder of the bundle; created by a build"),
          optional("overwrite", &Params::overwrite, "", "a build may replace an existing bundle"),
      };
    }
    [[nodiscard]] fs::path folder() const {
      const fs::path normal = root.lexically_normal();
      return normal.has_filename() ? normal : normal.parent_path();
    }
    [[nodiscard]] Result<void> validate() const {
      const fs::path name = folder().filename();
      if (!name.empty() && name != "." && name != "..") return {};
      return fail_at({"root"}, "'root' must name a folder, not '" + root.string() + "'");
    }
  };

  static Result<std::unique_ptr<MapStore>> create(const Params& params) {
    return std::make_unique<PcdTiles>(params.folder(), params.overwrite);
  }

  PcdTiles(fs::path root, bool overwrite) : root_(std::move(root)), overwrite_(overwrite) {}

  [[nodiscard]] Result<void> begin(const MapIndex& index) noexcept override {
    return guarded([&]() -> Result<void> {
      if (writing_) return fail(ErrorCode::invalid_input, "a bundle has already been begun");
      BundleIndex started{.map = index, .tiles = {}};
      started.map.regions.assign(index.partition.size(), {});
      started.tiles.assign(index.partition.size(), {});
      if (index.partition.size() == 0) {
        return fail(ErrorCode::invalid_input, "a bundle needs a region");
      }
      VANTAGE_CHECK(check_writable(index));

      // Behind a symbolic link, the folder itself is replaced, not the link.
      std::error_code error;
      fs::path root = fs::weakly_canonical(root_, error);
      if (error) return io::system_error(root_, "the path cannot be resolved", error.value());
      VANTAGE_CHECK(may_write(root));
      fs::path partial = root;
      partial += ".partial";
      VANTAGE_TRY(PartialFolder folder, PartialFolder::create(partial));
      std::vector<bool> done(index.partition.size(), false);
      writing_ = std::make_unique<Writing>(
          Writing{std::move(folder), std::move(root), std::move(started), std::move(done)});
      return {};
    });
  }

  [[nodiscard]] Result<void> put(RegionId region, const RegionMap& map) noexcept override {
    return guarded([&]() -> Result<void> {
      if (!writing_) return fail(ErrorCode::invalid_input, "put without begin");
      const Partition& partition = writing_->index.map.partition;
      const std::uint32_t r = region.value;
      if (r >= partition.size()) return unknown_region(r, partition.size());
      const Region& which = partition.regions()[r];
      if (writing_->done[r]) {
        return fail(ErrorCode::already_exists, "region '" + which.label + "' was already put");
      }
      auto tile = writing_->folder.write_tile(tile_name(which), map);
      if (!tile) {
        return fail(std::move(tile).error().during("storing region '" + which.label + "'"));
      }
      writing_->index.tiles[r] = *tile;
      writing_->index.map.regions[r] = tile->summary();
      writing_->done[r] = true;
      return {};
    });
  }

  [[nodiscard]] Result<void> attach(std::string_view name,
                                    std::span<const std::byte> bytes) noexcept override {
    return guarded([&]() -> Result<void> {
      if (!writing_) return fail(ErrorCode::invalid_input, "attach without begin");
      VANTAGE_TRY(const std::string file, attachment_name(name));
      return writing_->folder.write_file(file, encode_attachment(bytes));
    });
  }

  [[nodiscard]] Result<void> commit() noexcept override {
    return guarded([&]() -> Result<void> {
      if (!writing_) return fail(ErrorCode::invalid_input, "commit without begin");
      const auto missing = std::find(writing_->done.begin(), writing_->done.end(), false);
      if (missing != writing_->done.end()) {
        const auto r = static_cast<std::size_t>(missing - writing_->done.begin());
        return fail(ErrorCode::invalid_input, "commit before region '" +
                                                  writing_->index.map.partition.regions()[r].label +
                                                  "' was put");
      }
      const fs::path& root = writing_->root;
      VANTAGE_CHECK(may_write(root));
      VANTAGE_TRY(const std::string json, to_json(writing_->index));
      VANTAGE_CHECK(writing_->folder.finish(json));

      const fs::path partial = writing_->folder.path();
      if (there(root)) {
        VANTAGE_TRY(const auto replaced, files_of_bundle(root));
        VANTAGE_CHECK(io::exchange(partial, root));
        writing_->folder.release();
        writing_.reset();
        // The new bundle is in place. It is not an error if parts of the old one cannot be removed.
        (void)remove_files(partial, replaced);
        return {};
      }
      VANTAGE_CHECK(io::rename_to_new(partial, root));
      writing_->folder.release();
      writing_.reset();
      return {};
    });
  }

  [[nodiscard]] Result<MapIndex> index() const noexcept override {
    return guarded([&]() -> Result<MapIndex> {
      VANTAGE_TRY(const auto current, current_index());
      return current->map;
    });
  }

  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override {
    return guarded([&]() -> Result<RegionMap> {
      VANTAGE_TRY(const auto current, current_index());
      const std::uint32_t r = region.value;
      if (r >= current->tiles.size()) return unknown_region(r, current->tiles.size());
      const fs::path file = root_ / tile_name(current->map.partition.regions()[r]);
      const auto content = io::read_file(file, "a regular file", io::InputFile::Empty::accept);
      if (!content) {
        if (content.error().code != ErrorCode::not_found) return fail(content.error());
        return fail(ErrorCode::corrupt_data, "the index names this file, but it is missing",
                    at(file));
      }
      return decode(content->view(), current->tiles[r], file.string());
    });
  }

  [[nodiscard]] Result<std::vector<std::byte>> attachment(
      std::string_view name) const noexcept override {
    return guarded([&]() -> Result<std::vector<std::byte>> {
      VANTAGE_TRY(const auto current, current_index());  // without a bundle there is nothing
      const auto file_name = attachment_name(name);
      if (!file_name) return fail(ErrorCode::not_found, file_name.error().message, at(root_));
      const fs::path file = root_ / *file_name;
      VANTAGE_TRY(const auto content,
                  io::read_file(file, "a regular file", io::InputFile::Empty::accept));
      return decode_attachment(content.view(), file);
    });
  }

 private:
  [[nodiscard]] tl::unexpected<Error> unknown_region(std::uint32_t r, std::size_t regions) const {
    return fail(ErrorCode::not_found,
                "the bundle has no region " + std::to_string(r) + ", only 0 to " +
                    std::to_string(regions - 1),
                at(root_));
  }

  /// Whether a bundle may be written to a place. Errors: `already_exists`.
  [[nodiscard]] Result<void> may_write(const fs::path& root) const {
    if (!there(root)) return {};
    VANTAGE_CHECK(files_of_bundle(root));
    if (overwrite_) return {};
    return fail(ErrorCode::already_exists,
                "there is a bundle already; choose another root or set overwrite = true", at(root));
  }

  [[nodiscard]] Result<std::shared_ptr<const BundleIndex>> current_index() const {
    struct stat file {};
    if (::stat((root_ / kIndex).c_str(), &file) == 0) {
      const std::scoped_lock lock(mutex_);
      if (cached_.is_of(file)) return cached_.index;
    }
    VANTAGE_TRY(BundleIndex read, read_index(root_));
    auto index = std::make_shared<const BundleIndex>(std::move(read));
    const std::scoped_lock lock(mutex_);
    cached_ = {file.st_dev, file.st_ino, file.st_size, file.st_ctim, file.st_mtim, index};
    return index;
  }

  fs::path root_;
  bool overwrite_;
  std::unique_ptr<Writing> writing_;
  mutable std::mutex mutex_;
  mutable CachedIndex cached_;
};

}  // namespace
}  // namespace vantage::pcd_tiles

VANTAGE_PLUGIN(vantage::MapStore, vantage::pcd_tiles::PcdTiles, "pcd_tiles",
               "a folder with one binary PCD file per region");
