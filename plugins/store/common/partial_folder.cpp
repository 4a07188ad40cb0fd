#include "common/partial_folder.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>

#include "common/attachment.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::bundle_folder {
namespace {

namespace fs = std::filesystem;
using io::Descriptor, io::system_error;

/// A file that is created or replaced, and removed again unless it was written whole. Nothing is
/// flushed to the disk: that is done once, for the folder.
class NewFile {
 public:
  /// Errors: `io_failure`.
  [[nodiscard]] static Result<NewFile> create(const fs::path& path) {
    Descriptor file = Descriptor::of(path, O_WRONLY | O_CREAT | O_TRUNC);
    if (!file.open()) return system_error(path, "the file cannot be created", errno);
    return NewFile(path, std::move(file));
  }
  NewFile(NewFile&& other) noexcept
      : path_(std::exchange(other.path_, {})), file_(std::move(other.file_)) {}
  NewFile& operator=(NewFile&&) = delete;
  ~NewFile() {
    if (!path_.empty()) ::unlink(path_.c_str());
  }

  /// Errors: `io_failure`.
  [[nodiscard]] Result<void> write(std::string_view content) const {
    const int reason = io::write_all(file_, content);
    if (reason != 0) return system_error(path_, "the file cannot be written", reason);
    return {};
  }
  /// That was all: the file stays. Errors: `io_failure`.
  [[nodiscard]] Result<void> keep() {
    const int reason = file_.finish();
    if (reason != 0) return system_error(path_, "the file cannot be written", reason);
    path_.clear();
    return {};
  }

 private:
  NewFile(fs::path path, Descriptor file) : path_(std::move(path)), file_(std::move(file)) {}

  fs::path path_;
  Descriptor file_;
};

Result<io::FileContent> text_of_index(const fs::path& root) {
  const fs::path path = root / kIndex;
  const auto file = io::InputFile::open(path, "a regular file", io::InputFile::Empty::accept);
  if (!file) {
    if (file.error().code != ErrorCode::not_found) return fail(file.error());
    return fail(ErrorCode::not_found,
                std::string("there is no bundle of region maps here: no ") + kIndex, at(root));
  }
  if (file->size() > kMostHeadBytes) {
    return fail(ErrorCode::corrupt_data,
                "the index has " + std::to_string(file->size()) + " bytes, expected at most " +
                    std::to_string(kMostHeadBytes) +
                    ": it is damaged, or an older version built it; build the bundle again",
                at(path));
  }
  return file->content();
}

Result<PackedIndex> regions_of(const BundleFormat& format, const fs::path& root,
                               const RegionsReference& named) {
  const fs::path path = root / kRegionsFile;
  auto file = io::InputFile::open(path, "the regions of a bundle");
  if (!file && file.error().code == ErrorCode::not_found) {
    return fail(ErrorCode::corrupt_data, "the index names this file, but it is missing", at(path));
  }
  VANTAGE_TRY(io::InputFile opened, std::move(file));
  VANTAGE_TRY(PackedIndex regions, PackedIndex::open(format, std::move(opened)));
  if (regions.reference() == named) return regions;
  return fail(ErrorCode::corrupt_data, "these are not the regions that the index names", at(path));
}

}  // namespace

Result<OpenIndex> open_index(const BundleFormat& format, const fs::path& root) {
  VANTAGE_TRY(io::FileContent text, text_of_index(root));
  for (;;) {
    VANTAGE_TRY(BundleHead head, from_json(format, text.view(), (root / kIndex).string()));
    auto regions = regions_of(format, root, head.regions);
    if (regions) return OpenIndex{std::move(head), *std::move(regions)};
    // Another bundle may have come in between: then its own regions are there.
    VANTAGE_TRY(io::FileContent now, text_of_index(root));
    if (now.view() == text.view()) return fail(std::move(regions).error());
    text = std::move(now);
  }
}

Result<MapIndex> whole_index(const OpenIndex& index) {
  VANTAGE_TRY(std::vector<IndexedRegion> all, index.regions.all());
  MapIndex map{.partition = {},
               .regions = {},
               .map_bounds = index.head.map_bounds,
               .map_points = index.head.map_points,
               .config = index.head.config};
  std::vector<Region> regions;
  for (IndexedRegion& one : all) {
    map.regions.push_back(one.file.summary());
    regions.push_back(std::move(one.region));
  }
  auto partition = Partition::from(std::move(regions));
  if (!partition) {
    return fail(ErrorCode::corrupt_data,
                "the regions are not a partition: " + partition.error().message,
                at(index.regions.name()));
  }
  map.partition = *std::move(partition);
  return map;
}

io::FolderKind kind_of(const BundleFormat& format) {
  return {
      .what = "a bundle of region maps",
      .overwrite = "overwrite = true (vantage build --overwrite)",
      .check = [&format](const fs::path& folder, auto names) -> Result<void> {
        VANTAGE_TRY(const MapIndex index, open_index(format, folder).and_then(whole_index));
        std::vector<std::string> known{kIndex, kRegionsFile};
        known.emplace_back(format.shared);
        for (const Region& region : index.partition.regions()) {
          known.push_back(region_file_name(format, region));
        }
        std::ranges::sort(known);
        for (const std::string& name : names) {
          if (!std::ranges::binary_search(known, name) && !is_attachment(format, folder / name)) {
            return io::it_holds(name);
          }
        }
        return {};
      },
      .may_hold =
          [&format](std::string_view name) {
            return name.find('/') == std::string_view::npos &&
                   (name == kIndex || name == kRegionsFile || name == format.shared ||
                    name == format.scratch || name.ends_with(format.extension) ||
                    name.ends_with(kAttachment));
          }};
}

Result<PartialFolder> PartialFolder::create(const BundleFormat& format, const fs::path& root,
                                            io::OutputFolder::Existing existing) {
  VANTAGE_TRY(io::OutputFolder folder, io::OutputFolder::create(kind_of(format), root, existing));
  return PartialFolder(std::move(folder));
}

Result<void> PartialFolder::write_file(const std::string& name,
                                       const std::function<Result<void>(const Sink&)>& write) {
  std::optional<NewFile> file;  // from the first byte on: nothing for what is refused
  VANTAGE_CHECK(write([&](std::string_view bytes) -> Result<void> {
    if (!file) {
      VANTAGE_TRY(NewFile created, NewFile::create(path() / name));
      file.emplace(std::move(created));
    }
    return file->write(bytes);
  }));
  return file ? file->keep() : Result<void>();
}

Result<void> PartialFolder::append(const std::string& name, std::string_view content) const {
  const Descriptor file = Descriptor::of(path() / name, O_WRONLY | O_APPEND);
  if (!file.open()) return system_error(path() / name, "the file cannot be opened", errno);
  const int reason = io::write_all(file, content);
  if (reason != 0) return system_error(path() / name, "the file cannot be written", reason);
  return {};
}

Result<void> PartialFolder::remove(const std::string& name) {
  std::error_code error;
  fs::remove(path() / name, error);
  if (error) return system_error(path() / name, "the file cannot be removed", error.value());
  return {};
}

Result<void> PartialFolder::write_file(const std::string& name, std::string_view content) {
  std::error_code ignored;
  if (fs::is_regular_file(path() / name, ignored)) {
    return fail(ErrorCode::already_exists, "'" + name + "' was already written", at(path()));
  }
  VANTAGE_TRY(NewFile file, NewFile::create(path() / name));
  VANTAGE_CHECK(file.write(content));
  return file.keep();
}

}  // namespace vantage::bundle_folder
