#include "common/folder_store.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <limits>
#include <mutex>
#include <span>
#include <utility>

#include "common/attachment.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/plugin.hpp"
#include "vantage/region_directory.hpp"

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

tl::unexpected<Error> unknown_region(std::uint32_t r, std::uint64_t regions, const fs::path& root) {
  return fail(ErrorCode::not_found,
              "the bundle has no region " + std::to_string(r) + ", only 0 to " +
                  std::to_string(regions - 1),
              at(root));
}

BundleHead head_of(const MapIndex& index, const RegionsReference& regions) {
  return {.map_points = index.map_points,
          .map_bounds = index.map_bounds,
          .config = index.config,
          .regions = regions};
}

/// As long as any in a text.
constexpr auto kLongest = std::numeric_limits<std::uint64_t>::max();

/// A bundle under construction.
class FolderWriter final : public MapWriter {
 public:
  FolderWriter(const BundleFormat& format, fs::path root, const MapIndex& index,
               PartialFolder folder, std::unique_ptr<RegionFiles> regions)
      : format_(format),
        root_(std::move(root)),
        index_(index),
        folder_(std::move(folder)),
        regions_(std::move(regions)),
        files_(index.partition.size()),
        done_(index.partition.size(), false) {}

  [[nodiscard]] Result<void> put(RegionId region, const RegionMap& map) noexcept override {
    return guarded([&]() -> Result<void> {
      const std::uint32_t r = region.value;
      if (r >= done_.size()) return unknown_region(r, done_.size(), root_);
      const Region& which = index_.partition.regions()[r];
      if (done_[r]) {
        return fail(ErrorCode::already_exists, "region '" + which.label + "' was already put");
      }
      auto file = regions_->write(folder_, region, region_file_name(format_, which), map);
      if (!file) {
        return fail(std::move(file).error().during("storing region '" + which.label + "'"));
      }
      files_[r] = *file;
      done_[r] = true;
      return {};
    });
  }

  [[nodiscard]] Result<void> attach(std::string_view name,
                                    std::span<const std::byte> bytes) noexcept override {
    return guarded([&]() -> Result<void> {
      VANTAGE_TRY(const std::string file, attachment_name(name));
      return folder_.write_file(file, encode_attachment(format_, bytes));
    });
  }

  [[nodiscard]] Result<void> commit() && noexcept override {
    return guarded([&]() -> Result<void> {
      const auto missing = std::find(done_.begin(), done_.end(), false);
      if (missing != done_.end()) {
        const auto r = static_cast<std::size_t>(missing - done_.begin());
        return fail(ErrorCode::invalid_input,
                    "commit before region '" + index_.partition.regions()[r].label + "' was put");
      }
      VANTAGE_CHECK(finish_folder());
      return folder_.commit();
    });
  }

 private:
  /// All that the index names is written.
  [[nodiscard]] Result<void> finish_folder() {
    const std::vector<Region>& regions = index_.partition.regions();
    std::vector<std::string> names;
    for (const Region& region : regions) names.push_back(region_file_name(format_, region));
    VANTAGE_CHECK(regions_->finish(folder_, files_, names));
    RegionsReference reference;
    VANTAGE_CHECK(folder_.write_file(kRegionsFile, [&](const Sink& sink) -> Result<void> {
      VANTAGE_TRY(reference, write_packed(format_, regions, files_, sink));
      return {};
    }));
    VANTAGE_TRY(const std::string json, to_json(format_, head_of(index_, reference)));
    return folder_.write_file(kIndex, json);
  }

  const BundleFormat& format_;
  fs::path root_;
  MapIndex index_;
  PartialFolder folder_;
  std::unique_ptr<RegionFiles> regions_;
  std::vector<RegionFile> files_;  // by RegionId
  std::vector<bool> done_;         // by RegionId
};

/// Whether these are the same file, unchanged. No file is the same as none.
bool same_file(const struct stat& a, const struct stat& b) noexcept {
  const auto same = [](const timespec& x, const timespec& y) {
    return x.tv_sec == y.tv_sec && x.tv_nsec == y.tv_nsec;
  };
  return a.st_ino != 0 && a.st_dev == b.st_dev && a.st_ino == b.st_ino && a.st_size == b.st_size &&
         same(a.st_ctim, b.st_ctim) && same(a.st_mtim, b.st_mtim);
}

/// What the system says of a bundle's index now; all zeros if the folder holds no index.
struct stat stat_of_index(const fs::path& root) {
  struct stat file {};
  if (::stat((root / kIndex).c_str(), &file) != 0) file = {};
  return file;
}

class FolderReader final : public MapReader {
 public:
  FolderReader(const BundleFormat& format, fs::path root, ReadRegion read,
               std::shared_ptr<const OpenIndex> index, const struct stat& file)
      : format_(format),
        root_(std::move(root)),
        read_(read),
        index_(std::move(index)),
        file_(file) {}

  [[nodiscard]] Result<MapIndex> index() const noexcept override {
    return guarded([&] { return whole_index(*index_); });
  }
  [[nodiscard]] Result<std::unique_ptr<const RegionDirectory>> directory() const noexcept override {
    return guarded([&]() -> Result<std::unique_ptr<const RegionDirectory>> {
      return std::make_unique<const FolderDirectory>(index_);
    });
  }

  [[nodiscard]] Result<RegionMap> get(RegionId region) const noexcept override {
    return guarded([&] {
      return from_bundle([&]() -> Result<RegionMap> {
        const std::uint64_t regions = index_->regions.totals().regions;
        if (region.value >= regions) return unknown_region(region.value, regions, root_);
        VANTAGE_TRY(const IndexedRegion one, index_->regions.entry(region.value));
        const fs::path file = root_ / region_file_name(format_, one.region);
        const auto content = io::read_file(file, "a regular file", io::InputFile::Empty::accept);
        if (!content) {
          if (content.error().code != ErrorCode::not_found) return fail(content.error());
          return fail(ErrorCode::corrupt_data, "the index names this file, but it is missing",
                      at(file));
        }
        return read_(content->view(), one.file, file);
      });
    });
  }

  [[nodiscard]] Result<std::vector<std::byte>> attachment(
      std::string_view name) const noexcept override {
    return guarded([&] {
      return from_bundle([&]() -> Result<std::vector<std::byte>> {
        const auto file_name = attachment_name(name);
        if (!file_name) return fail(ErrorCode::not_found, file_name.error().message, at(root_));
        const fs::path file = root_ / *file_name;
        VANTAGE_TRY(const auto content,
                    io::read_file(file, "a regular file", io::InputFile::Empty::accept));
        return decode_attachment(format_, content.view(), file);
      });
    });
  }

  [[nodiscard]] Result<void> attach(std::string_view name,
                                    std::span<const std::byte> bytes) const noexcept override {
    return guarded([&]() -> Result<void> {
      VANTAGE_TRY(const std::string file, attachment_name(name));
      const std::string content = encode_attachment(format_, bytes);
      return from_bundle([&] { return io::write_text_atomically(root_ / file, content); });
    });
  }

 private:
  /// What `read` reads from the bundle's files, if they were the bundle's to the end.
  template <class Read>
  [[nodiscard]] auto from_bundle(const Read& read) const -> decltype(read()) {
    VANTAGE_TRY(std::uint64_t before, look());
    for (;;) {
      auto result = read();
      VANTAGE_TRY(const std::uint64_t after, look());
      if (after == before) return result;
      before = after;
    }
  }

  /// Counts how often the bundle's files were other ones: between equal numbers, they were the
  /// same. Errors: those of open_index; `io_failure` if another bundle is there by now.
  [[nodiscard]] Result<std::uint64_t> look() const {
    const struct stat file = stat_of_index(root_);
    {
      const std::scoped_lock lock(mutex_);
      if (same_file(file_, file)) return looks_;
    }
    VANTAGE_TRY(const OpenIndex now, open_index(format_, root_));
    if (now.head.generation != index_->head.generation) {
      return fail(ErrorCode::io_failure,
                  "another bundle has been put in the place of the one that was opened: open it "
                  "again",
                  at(root_));
    }
    const std::scoped_lock lock(mutex_);
    file_ = file;  // copied or touched, but the same
    return ++looks_;
  }

  const BundleFormat& format_;
  fs::path root_;
  ReadRegion read_;
  std::shared_ptr<const OpenIndex> index_;
  mutable std::mutex mutex_;
  mutable struct stat file_;         // when it was last looked at
  mutable std::uint64_t looks_ = 0;  // at another file
};

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

Result<void> RegionFiles::finish(PartialFolder& /*folder*/, std::vector<RegionFile>& /*files*/,
                                 const std::vector<std::string>& /*names*/) {
  return {};
}

FolderStore::FolderStore(const BundleFormat& format, const FolderParams& params, ReadRegion read)
    : format_(format), root_(params.folder()), overwrite_(params.overwrite), read_(read) {}

Result<void> FolderStore::may_begin() const noexcept {
  return guarded([&] {
    return io::OutputFolder::check(kind_of(format_), root_, io::OutputFolder::existing(overwrite_));
  });
}

Result<std::unique_ptr<MapWriter>> FolderStore::begin(const MapIndex& index) const noexcept {
  return guarded([&]() -> Result<std::unique_ptr<MapWriter>> {
    if (index.partition.size() == 0) {
      return fail(ErrorCode::invalid_input, "a bundle needs a region");
    }
    VANTAGE_CHECK(to_json(format_, head_of(index, {kLongest, kLongest, kLongest})));
    VANTAGE_TRY(PartialFolder folder,
                PartialFolder::create(format_, root_, io::OutputFolder::existing(overwrite_)));
    return std::make_unique<FolderWriter>(format_, root_, index, std::move(folder),
                                          region_files(index));
  });
}

Result<std::unique_ptr<const MapReader>> FolderStore::open() const noexcept {
  return guarded([&]() -> Result<std::unique_ptr<const MapReader>> {
    const struct stat file = stat_of_index(root_);
    VANTAGE_TRY(OpenIndex opened, open_index(format_, root_));
    return std::make_unique<const FolderReader>(
        format_, root_, read_, std::make_shared<const OpenIndex>(std::move(opened)), file);
  });
}

}  // namespace vantage::bundle_folder
