#include "common/partial_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <optional>
#include <system_error>
#include <utility>

#include "common/attachment.hpp"
#include "vantage/kit/atomic_file.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::bundle_folder {
namespace {

namespace fs = std::filesystem;
using io::Descriptor, io::names_in, io::system_error;

constexpr const char* kNewIndex = "index.json.tmp";
constexpr const char* kMarker = ".vantage-partial";  // no label begins with '.'

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

Result<Descriptor> locked(const fs::path& marker, int flags) {
  Descriptor file = Descriptor::of(marker, O_RDWR | flags);
  if (!file.open()) return system_error(marker, "the file cannot be opened", errno);
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return system_error(marker, "the file cannot be locked", errno);
    return fail(ErrorCode::already_exists, "another program is writing a bundle here right now",
                at(marker.parent_path()));
  }
  return file;
}

/// What a killed run has left: marked as such, or a bundle that was about to get its name.
Result<void> remove_stale(const BundleFormat& format, const fs::path& path) {
  const auto keep = [&](const std::string& reason) {
    return fail(ErrorCode::already_exists,
                "a bundle is written here first, but this is not what an interrupted run leaves (" +
                    reason + "); remove it or choose another root",
                at(path));
  };
  std::error_code error;
  if (fs::symlink_status(path, error).type() != fs::file_type::directory) {
    return keep("it is not a folder");
  }
  VANTAGE_TRY(const auto names, names_in(path));
  const auto holds = [&](const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  Descriptor lock;
  if (holds(kMarker)) {
    VANTAGE_TRY(lock, locked(path / kMarker, 0));
    for (const std::string& name : names) {
      if (name != kMarker && name != kIndex && name != kNewIndex && name != kRegionsFile &&
          name != format.shared && name != format.scratch && !name.ends_with(format.extension) &&
          !name.ends_with(kAttachment)) {
        return keep("it holds '" + name + "'");
      }
    }
  } else if (!names.empty()) {
    if (const auto bundle = files_of_bundle(format, path); !bundle)
      return keep(bundle.error().message);
  }
  return remove_files(path, names);
}

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

bool there(const fs::path& path) {
  std::error_code ignored;
  return fs::symlink_status(path, ignored).type() != fs::file_type::not_found;
}

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

Result<std::vector<std::string>> files_of_bundle(const BundleFormat& format,
                                                 const fs::path& folder) {
  const auto keep = [&](const std::string& reason) {
    return fail(ErrorCode::already_exists,
                "this is not a bundle of region maps that could be replaced (" + reason +
                    "); it is left alone",
                at(folder));
  };
  const auto index = open_index(format, folder).and_then(whole_index);
  if (!index) return keep(to_string(index.error()));
  std::vector<std::string> known{kIndex, kRegionsFile};
  for (const Region& region : index->partition.regions()) {
    known.push_back(region_file_name(format, region));
  }
  if (!format.shared.empty()) known.emplace_back(format.shared);
  std::sort(known.begin(), known.end());
  VANTAGE_TRY(std::vector<std::string> names, names_in(folder));
  for (const std::string& name : names) {
    // What is left of an attachment whose writing was killed.
    if (!std::binary_search(known.begin(), known.end(), name) && !io::is_temporary(name) &&
        !is_attachment(format, folder / name)) {
      return keep("it also holds '" + name + "'");
    }
  }
  return names;
}

Result<PartialFolder> PartialFolder::create(const BundleFormat& format, const fs::path& path) {
  if (there(path)) VANTAGE_CHECK(remove_stale(format, path));
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

PartialFolder::PartialFolder(PartialFolder&& other) noexcept
    : path_(std::exchange(other.path_, {})),
      parents_(std::exchange(other.parents_, {})),
      files_(std::exchange(other.files_, {})),
      lock_(std::move(other.lock_)) {}

PartialFolder::~PartialFolder() {
  try {
    if (!path_.empty()) {
      files_.emplace_back(kMarker);
      (void)remove_files(path_, files_);
    }
    std::error_code ignored;
    for (auto parent = parents_.rbegin(); parent != parents_.rend(); ++parent) {
      ::rmdir(parent->c_str());
    }
  } catch (...) {  // nothing more can be done in a destructor
  }
}

Result<void> PartialFolder::write_file(const std::string& name,
                                       const std::function<Result<void>(const Sink&)>& write) {
  std::optional<NewFile> file;  // from the first byte on: nothing for what is refused
  VANTAGE_CHECK(write([&](std::string_view bytes) -> Result<void> {
    if (!file) {
      files_.push_back(name);
      VANTAGE_TRY(NewFile created, NewFile::create(path_ / name));
      file.emplace(std::move(created));
    }
    return file->write(bytes);
  }));
  return file ? file->keep() : Result<void>();
}

Result<void> PartialFolder::append(const std::string& name, std::string_view content) const {
  const Descriptor file = Descriptor::of(path_ / name, O_WRONLY | O_APPEND);
  if (!file.open()) return system_error(path_ / name, "the file cannot be opened", errno);
  const int reason = io::write_all(file, content);
  if (reason != 0) return system_error(path_ / name, "the file cannot be written", reason);
  return {};
}

Result<void> PartialFolder::remove(const std::string& name) {
  std::error_code error;
  fs::remove(path_ / name, error);
  if (error) return system_error(path_ / name, "the file cannot be removed", error.value());
  std::erase(files_, name);
  return {};
}

Result<void> PartialFolder::write_file(const std::string& name, std::string_view content) {
  if (std::find(files_.begin(), files_.end(), name) != files_.end()) {
    return fail(ErrorCode::already_exists, "'" + name + "' was already written", at(path_));
  }
  files_.push_back(name);
  VANTAGE_TRY(NewFile file, NewFile::create(path_ / name));
  VANTAGE_CHECK(file.write(content));
  return file.keep();
}

Result<void> PartialFolder::finish(std::string_view index) {
  files_.emplace_back(kNewIndex);
  {
    VANTAGE_TRY(NewFile file, NewFile::create(path_ / kNewIndex));
    VANTAGE_CHECK(file.write(index));
    VANTAGE_CHECK(file.keep());
  }
  VANTAGE_CHECK(io::flush_folder(path_));
  files_.emplace_back(kIndex);
  std::error_code error;
  fs::rename(path_ / kNewIndex, path_ / kIndex, error);
  if (!error) fs::remove(path_ / kMarker, error);
  if (error) {
    return system_error(path_ / kIndex, "the index cannot be put in place", error.value());
  }
  return {};
}

void PartialFolder::release() noexcept {
  path_.clear();
  parents_.clear();
}

Result<void> PartialFolder::create_parents(const fs::path& folder) {
  if (folder.empty() || there(folder)) return {};
  VANTAGE_CHECK(create_parents(folder.parent_path()));
  std::error_code error;
  if (fs::create_directory(folder, error)) parents_.push_back(folder);
  if (error) return system_error(folder, "the folder cannot be created", error.value());
  return {};
}

}  // namespace vantage::bundle_folder
