#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bundle_index.hpp"
#include "files.hpp"
#include "tile.hpp"
#include "vantage/plugin.hpp"

namespace vantage::pcd_tiles {
namespace {

namespace fs = std::filesystem;

constexpr const char* kIndex = "index.json";
constexpr const char* kNewIndex = "index.json.tmp";
constexpr const char* kMarker = ".vantage-partial";  // no label begins with '.'

SourceLocation at(const fs::path& path) { return {path.string(), 0, 0}; }

bool there(const fs::path& path) {
  std::error_code ignored;
  return fs::symlink_status(path, ignored).type() != fs::file_type::not_found;
}

Result<BundleIndex> read_index(const fs::path& root) {
  const fs::path file = root / kIndex;
  auto text = read_file(file);
  if (!text) {
    if (text.error().code != ErrorCode::not_found) return fail(std::move(text).error());
    return fail(ErrorCode::not_found,
                std::string("there is no bundle of region maps here: no ") + kIndex, at(root));
  }
  return from_json(*text, file.string());
}

Result<std::vector<std::string>> names_in(const fs::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
    names.push_back(it->path().filename().string());
  }
  if (error) return system_error(folder, "the folder cannot be listed", error.value());
  std::sort(names.begin(), names.end());
  return names;
}

/// Removes files and their folder, but nothing below it. `last` is the file that identifies the
/// folder. It is removed last, so that an interrupted removal can be continued.
Result<void> remove_files(const fs::path& folder, std::vector<std::string> names) {
  std::stable_partition(names.begin(), names.end(),
                        [](const std::string& name) { return name != kIndex && name != kMarker; });
  std::error_code error;
  for (const std::string& name : names) {
    fs::remove(folder / name, error);
    if (error) return system_error(folder / name, "the file cannot be removed", error.value());
  }
  fs::remove(folder, error);
  if (error) return system_error(folder, "the folder cannot be removed", error.value());
  return {};
}

/// The files of a bundle that may be replaced. Errors: `already_exists` if the folder is not a
/// complete bundle, or holds a file that does not belong to the bundle.
Result<std::vector<std::string>> files_of_bundle(const fs::path& folder) {
  const auto keep = [&](const std::string& reason) {
    return fail(ErrorCode::already_exists,
                "this is not a bundle of region maps that could be replaced (" + reason +
                    "); it is left alone",
                at(folder));
  };
  const auto index = read_index(folder);
  if (!index) return keep(to_string(index.error()));
  std::vector<std::string> known{kIndex};
  for (const Region& region : index->map.partition.regions()) known.push_back(tile_name(region));
  std::sort(known.begin(), known.end());
  VANTAGE_TRY(std::vector<std::string> names, names_in(folder));
  for (const std::string& name : names) {
    if (!std::binary_search(known.begin(), known.end(), name)) {
      return keep("it also holds '" + name + "'");
    }
  }
  return names;
}

/// The folder that a bundle is written into. It is created, locked, and removed again unless it is
/// kept.
class PartialFolder {
 public:
  /// Errors: `already_exists` if another process writes there, or if the folder is not what such a
  /// process left behind; `io_failure`.
  [[nodiscard]] static Result<PartialFolder> create(const fs::path& path) {
    if (there(path)) VANTAGE_CHECK(remove_stale(path));
    PartialFolder folder;
    VANTAGE_CHECK(folder.create_parents(path.parent_path()));
    std::error_code error;
    if (!fs::create_directory(path, error)) {
      return system_error(path, "the folder cannot be created", error ? error.value() : EEXIST);
    }
    auto lock = locked(path / kMarker, O_CREAT);
    if (!lock) {
      ::rmdir(path.c_str());
      return fail(std::move(lock).error());
    }
    folder.path_ = path;
    folder.lock_ = *std::move(lock);
    return folder;
  }

  PartialFolder(PartialFolder&& other) noexcept
      : path_(std::exchange(other.path_, {})),
        parents_(std::exchange(other.parents_, {})),
        files_(std::exchange(other.files_, {})),
        lock_(std::move(other.lock_)) {}
  PartialFolder& operator=(PartialFolder&&) = delete;
  ~PartialFolder() {
    try {
      if (!path_.empty()) {
        files_.emplace_back(kMarker);
        (void)remove_files(path_, files_);
      }
      std::error_code ignored;
      for (auto parent = parents_.rbegin(); parent != parents_.rend(); ++parent) {
        ::rmdir(parent->c_str());
      }
    } catch (...) {  // a destructor can do nothing more
    }
  }

  [[nodiscard]] const fs::path& path() const noexcept { return path_; }

  [[nodiscard]] Result<void> write(const std::string& name, std::string_view content) {
    VANTAGE_TRY(OutputFile file, create_file(name));
    VANTAGE_CHECK(file.write(content));
    file.keep();
    return {};
  }
  [[nodiscard]] Result<TileInfo> write_tile(const std::string& name, const RegionMap& map) {
    std::optional<OutputFile> file;  // opened at the first byte, so that a refused map leaves no
                                     // file
    VANTAGE_TRY(const TileInfo info, encode(map, [&](std::string_view bytes) -> Result<void> {
                  if (!file) {
                    VANTAGE_TRY(OutputFile created, create_file(name));
                    file.emplace(std::move(created));
                  }
                  return file->write(bytes);
                }));
    file->keep();
    return info;
  }
  /// Gives the index its name only when everything is on the disk.
  [[nodiscard]] Result<void> finish(std::string_view index) {
    VANTAGE_CHECK(write(kNewIndex, index));
    VANTAGE_CHECK(flush_folder(path_));
    files_.emplace_back(kIndex);
    std::error_code error;
    fs::rename(path_ / kNewIndex, path_ / kIndex, error);
    if (!error) fs::remove(path_ / kMarker, error);
    if (error) {
      return system_error(path_ / kIndex, "the index cannot be put in place", error.value());
    }
    return {};
  }
  /// The folder has its final name, so this object no longer removes it.
  void release() noexcept {
    path_.clear();
    parents_.clear();
  }

 private:
  PartialFolder() = default;

  [[nodiscard]] Result<OutputFile> create_file(const std::string& name) {
    files_.push_back(name);
    return OutputFile::create(path_ / name);
  }

  [[nodiscard]] static Result<Descriptor> locked(const fs::path& marker, int flags) {
    Descriptor file(::open(marker.c_str(), O_RDWR | O_CLOEXEC | flags, 0666));
    if (!file.open()) return system_error(marker, "the file cannot be opened", errno);
    if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
      if (errno != EWOULDBLOCK) return system_error(marker, "the file cannot be locked", errno);
      return fail(ErrorCode::already_exists, "another program is writing a bundle here right now",
                  at(marker.parent_path()));
    }
    return file;
  }

  /// Removes what a killed run left behind: a folder marked as such, or a bundle that was about to
  /// get its name.
  [[nodiscard]] static Result<void> remove_stale(const fs::path& path) {
    const auto keep = [&](const std::string& reason) {
      return fail(
          ErrorCode::already_exists,
          "a bundle is written here first, but this is not what an interrupted run leaves (" +
              reason + "); remove it or choose another root",
          at(path));
    };
    std::error_code error;
    if (fs::symlink_status(path, error).type() != fs::file_type::directory) {
      return keep("it is no folder");
    }
    VANTAGE_TRY(const auto names, names_in(path));
    const auto holds = [&](const char* name) {
      return std::find(names.begin(), names.end(), name) != names.end();
    };
    Descriptor lock;
    if (holds(kMarker)) {
      VANTAGE_TRY(lock, locked(path / kMarker, 0));
      for (const std::string& name : names) {
        if (name != kMarker && name != kIndex && name != kNewIndex && !name.ends_with(".pcd")) {
          return keep("it holds '" + name + "'");
        }
      }
    } else if (!names.empty()) {
      if (const auto bundle = files_of_bundle(path); !bundle) return keep(bundle.error().message);
    }
    return remove_files(path, names);
  }

  [[nodiscard]] Result<void> create_parents(const fs::path& folder) {
    if (folder.empty() || there(folder)) return {};
    VANTAGE_CHECK(create_parents(folder.parent_path()));
    std::error_code error;
    if (fs::create_directory(folder, error)) parents_.push_back(folder);
    if (error) return system_error(folder, "the folder cannot be created", error.value());
    return {};
  }

  fs::path path_;
  std::vector<fs::path> parents_;   // created here, outermost first
  std::vector<std::string> files_;  // written here
  Descriptor lock_;
};

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
          optional("overwrite", &Params::overwrite, "",
                   "a build may replace a bundle that is there"),
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
      if (error) return system_error(root_, "the path cannot be resolved", error.value());
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
        VANTAGE_CHECK(exchange(partial, root));
        writing_->folder.release();
        writing_.reset();
        // The new bundle is in place. It is not an error if parts of the old one cannot be removed.
        (void)remove_files(partial, replaced);
        return {};
      }
      VANTAGE_CHECK(rename_to_new(partial, root));
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
      auto content = read_file(file);
      if (!content) {
        if (content.error().code != ErrorCode::not_found) return fail(std::move(content).error());
        return fail(ErrorCode::corrupt_data, "the index names this file, but it is missing",
                    at(file));
      }
      return decode(*content, current->tiles[r], file.string());
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
               "a folder with one binary PCD file a region");
