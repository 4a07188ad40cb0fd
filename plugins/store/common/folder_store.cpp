#include "common/folder_store.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "common/attachment.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/plugin.hpp"

namespace vantage::bundle_folder {

namespace fs = std::filesystem;

namespace {

/// Reads a region when it is asked for.
class FolderDirectory final : public RegionDirectory {
 public:
  explicit FolderDirectory(std::shared_ptr<const OpenIndex> index) : index_(std::move(index)) {
    const RegionTotals& totals = index_->regions.totals();
    summary_ = {.regions = totals.regions,
                .empty_regions = totals.empty,
                .without_points = totals.without_points,
                .extent = totals.extent,
                .map_bounds = index_->head.map_bounds,
                .map_points = index_->head.map_points,
                .least_points = totals.least_points,
                .most_points = totals.most_points,
                .sum = {.points = totals.points,
                        .viewpoints = totals.viewpoints,
                        .elements = totals.elements,
                        .bytes = totals.bytes,
                        .max_views = static_cast<std::uint32_t>(totals.max_views)},
                .config = index_->head.config};
  }

  [[nodiscard]] const BundleSummary& summary() const noexcept override { return summary_; }
  [[nodiscard]] Result<DirectoryEntry> entry(RegionId region) const noexcept override {
    return guarded([&]() -> Result<DirectoryEntry> {
      if (region.value >= summary_.regions) {
        return fail(ErrorCode::not_found,
                    "the bundle has no region " + std::to_string(region.value));
      }
      VANTAGE_TRY(IndexedRegion one, index_->regions.entry(region.value));
      return DirectoryEntry{std::move(one.region), one.file.summary()};
    });
  }
  [[nodiscard]] Result<std::vector<RegionId>> meeting(const Bounds2& area) const noexcept override {
    return guarded([&] { return index_->regions.meeting(area); });
  }
  [[nodiscard]] Result<std::optional<RegionId>> find(
      std::string_view label) const noexcept override {
    return guarded([&] { return index_->regions.find(label); });
  }

 private:
  std::shared_ptr<const OpenIndex> index_;
  BundleSummary summary_;
};

BundleHead head_of(const MapIndex& index, const RegionsReference& regions) {
  return {.map_points = index.map_points,
          .map_bounds = index.map_bounds,
          .config = index.config,
          .regions = regions};
}

/// As long as any in a text.
constexpr auto kLongest = std::numeric_limits<std::uint64_t>::max();

}  // namespace

fs::path FolderParams::folder() const {
  const fs::path normal = root.lexically_normal();
  return normal.has_filename() ? normal : normal.parent_path();
}

Result<void> FolderParams::validate() const {
  const fs::path name = folder().filename();
  if (!name.empty() && name != "." && name != "..") return {};
  return fail_at({"root"}, "'root' must name a folder, not '" + root.string() + "'");
}

FolderStore::FolderStore(const BundleFormat& format, const FolderParams& params)
    : format_(format), root_(params.folder()), overwrite_(params.overwrite) {}

bool FolderStore::CachedIndex::is_of(const struct stat& file) const noexcept {
  return index && device == file.st_dev && inode == file.st_ino && size == file.st_size &&
         changed.tv_sec == file.st_ctim.tv_sec && changed.tv_nsec == file.st_ctim.tv_nsec &&
         modified.tv_sec == file.st_mtim.tv_sec && modified.tv_nsec == file.st_mtim.tv_nsec;
}

void FolderStore::start(const MapIndex& /*index*/) {}

Result<void> FolderStore::finish(PartialFolder& /*folder*/, std::vector<RegionFile>& /*files*/,
                                 const std::vector<std::string>& /*names*/) {
  return {};
}

Result<void> FolderStore::may_begin() const noexcept {
  return guarded([&]() -> Result<void> {
    VANTAGE_TRY(const fs::path root, resolved_root());
    return may_write(root);
  });
}

Result<void> FolderStore::begin(const MapIndex& index) noexcept {
  return guarded([&]() -> Result<void> {
    if (writing_) return fail(ErrorCode::invalid_input, "a bundle has already been begun");
    const std::size_t regions = index.partition.size();
    if (regions == 0) return fail(ErrorCode::invalid_input, "a bundle needs a region");
    VANTAGE_CHECK(to_json(format_, head_of(index, {kLongest, kLongest, kLongest})));

    VANTAGE_TRY(fs::path root, resolved_root());
    VANTAGE_CHECK(may_write(root));
    fs::path partial = root;
    partial += ".partial";
    VANTAGE_TRY(PartialFolder folder, PartialFolder::create(format_, partial));
    writing_ = std::make_unique<Writing>(Writing{.folder = std::move(folder),
                                                 .root = std::move(root),
                                                 .index = index,
                                                 .files = std::vector<RegionFile>(regions),
                                                 .done = std::vector<bool>(regions, false)});
    start(index);
    return {};
  });
}

Result<void> FolderStore::put(RegionId region, const RegionMap& map) noexcept {
  return guarded([&]() -> Result<void> {
    if (!writing_) return fail(ErrorCode::invalid_input, "put without begin");
    const Partition& partition = writing_->index.partition;
    const std::uint32_t r = region.value;
    if (r >= partition.size()) return unknown_region(r, partition.size());
    const Region& which = partition.regions()[r];
    if (writing_->done[r]) {
      return fail(ErrorCode::already_exists, "region '" + which.label + "' was already put");
    }
    auto file = write(writing_->folder, region, region_file_name(format_, which), map);
    if (!file) {
      return fail(std::move(file).error().during("storing region '" + which.label + "'"));
    }
    writing_->files[r] = *file;
    writing_->done[r] = true;
    return {};
  });
}

Result<void> FolderStore::attach(std::string_view name, std::span<const std::byte> bytes) noexcept {
  return guarded([&]() -> Result<void> {
    VANTAGE_TRY(const std::string file, attachment_name(name));
    const std::string content = encode_attachment(format_, bytes);
    if (writing_) return writing_->folder.write_file(file, content);
    return from_bundle([&](const OpenIndex& /*there has to be one*/) {
      return io::write_text_atomically(root_ / file, content);
    });
  });
}

Result<void> FolderStore::commit() noexcept {
  return guarded([&]() -> Result<void> {
    if (!writing_) return fail(ErrorCode::invalid_input, "commit without begin");
    const auto missing = std::find(writing_->done.begin(), writing_->done.end(), false);
    if (missing != writing_->done.end()) {
      const auto r = static_cast<std::size_t>(missing - writing_->done.begin());
      return fail(
          ErrorCode::invalid_input,
          "commit before region '" + writing_->index.partition.regions()[r].label + "' was put");
    }
    const fs::path& root = writing_->root;
    VANTAGE_CHECK(may_write(root));
    std::vector<std::string> names;
    for (const Region& region : writing_->index.partition.regions()) {
      names.push_back(region_file_name(format_, region));
    }
    VANTAGE_CHECK(finish(writing_->folder, writing_->files, names));
    const std::vector<Region>& regions = writing_->index.partition.regions();
    RegionsReference reference;
    VANTAGE_CHECK(writing_->folder.write_file(kRegionsFile, [&](const Sink& sink) -> Result<void> {
      VANTAGE_TRY(reference, write_packed(format_, regions, writing_->files, sink));
      return {};
    }));
    VANTAGE_TRY(const std::string json, to_json(format_, head_of(writing_->index, reference)));
    VANTAGE_CHECK(writing_->folder.finish(json));

    const fs::path partial = writing_->folder.path();
    if (there(root)) {
      VANTAGE_TRY(const auto replaced, files_of_bundle(format_, root));
      VANTAGE_CHECK(io::exchange(partial, root));
      const Result<void> kept = keep(root);
      // The new bundle is in place. It is not an error if parts of the old one cannot be removed.
      if (kept) (void)remove_files(partial, replaced);
      return kept;
    }
    VANTAGE_CHECK(io::rename_to_new(partial, root));
    return keep(root);
  });
}

/// The bundle has its name: makes the name survive a power cut, as its files do.
Result<void> FolderStore::keep(const fs::path& root) {
  writing_->folder.release();
  const fs::path place = root;  // it may be that of `writing_`
  writing_.reset();
  {
    // From now on this store reads what it has written, and nothing else.
    const std::scoped_lock lock(mutex_);
    cached_.index.reset();
  }
  VANTAGE_CHECK(io::flush_name(place / kIndex));
  return io::flush_name(place);
}

Result<MapIndex> FolderStore::index() const noexcept {
  return guarded([&]() -> Result<MapIndex> {
    VANTAGE_TRY(const Current bundle, current());
    return whole_index(*bundle.index);
  });
}

Result<RegionMap> FolderStore::get(RegionId region) const noexcept {
  return guarded([&] {
    return from_bundle([&](const OpenIndex& index) -> Result<RegionMap> {
      const std::uint64_t regions = index.regions.totals().regions;
      if (region.value >= regions) return unknown_region(region.value, regions);
      VANTAGE_TRY(const IndexedRegion one, index.regions.entry(region.value));
      const fs::path file = root_ / region_file_name(format_, one.region);
      const auto content = io::read_file(file, "a regular file", io::InputFile::Empty::accept);
      if (!content) {
        if (content.error().code != ErrorCode::not_found) return fail(content.error());
        return fail(ErrorCode::corrupt_data, "the index names this file, but it is missing",
                    at(file));
      }
      return read(content->view(), one.file, file);
    });
  });
}

Result<std::vector<std::byte>> FolderStore::attachment(std::string_view name) const noexcept {
  return guarded([&] {
    // Without a bundle there is nothing.
    return from_bundle([&](const OpenIndex& /*index*/) -> Result<std::vector<std::byte>> {
      const auto file_name = attachment_name(name);
      if (!file_name) return fail(ErrorCode::not_found, file_name.error().message, at(root_));
      const fs::path file = root_ / *file_name;
      VANTAGE_TRY(const auto content,
                  io::read_file(file, "a regular file", io::InputFile::Empty::accept));
      return decode_attachment(format_, content.view(), file);
    });
  });
}

tl::unexpected<Error> FolderStore::unknown_region(std::uint32_t r, std::size_t regions) const {
  return fail(ErrorCode::not_found,
              "the bundle has no region " + std::to_string(r) + ", only 0 to " +
                  std::to_string(regions - 1),
              at(root_));
}

/// Behind a symbolic link, the folder itself is replaced, not the link.
Result<fs::path> FolderStore::resolved_root() const {
  std::error_code error;
  fs::path root = fs::weakly_canonical(root_, error);
  if (error) return io::system_error(root_, "the path cannot be resolved", error.value());
  return root;
}

/// Whether a bundle may be written to a place. Errors: `already_exists`.
Result<void> FolderStore::may_write(const fs::path& root) const {
  if (!there(root)) return {};
  VANTAGE_CHECK(files_of_bundle(format_, root));
  if (overwrite_) return {};
  return fail(ErrorCode::already_exists,
              "there is a bundle already; overwrite = true (vantage build --overwrite) replaces it",
              at(root));
}

Result<std::unique_ptr<const RegionDirectory>> FolderStore::directory() const noexcept {
  return guarded([&]() -> Result<std::unique_ptr<const RegionDirectory>> {
    VANTAGE_TRY(Current bundle, current());
    return std::make_unique<const FolderDirectory>(std::move(bundle.index));
  });
}

Result<FolderStore::Current> FolderStore::current() const {
  struct stat file {};
  if (::stat((root_ / kIndex).c_str(), &file) == 0) {
    const std::scoped_lock lock(mutex_);
    if (cached_.is_of(file)) return Current{cached_.index, cached_.look};
  }
  VANTAGE_TRY(OpenIndex opened, open_index(format_, root_));
  auto index = std::make_shared<const OpenIndex>(std::move(opened));
  const std::scoped_lock lock(mutex_);
  if (cached_.index) {
    if (cached_.index->head.generation != index->head.generation) {
      return fail(ErrorCode::io_failure,
                  "another bundle has been put in the place of the one that was opened: open it "
                  "again",
                  at(root_));
    }
    index = cached_.index;  // copied or touched, but the same
  }
  cached_ = {file.st_dev,  file.st_ino, file.st_size,    file.st_ctim,
             file.st_mtim, index,       cached_.look + 1};
  return Current{std::move(index), cached_.look};
}

}  // namespace vantage::bundle_folder
