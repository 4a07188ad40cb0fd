#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/bundle_format.hpp"
#include "common/bundle_head.hpp"
#include "common/packed_index.hpp"
#include "vantage/kit/file_system.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage::bundle_folder {

inline constexpr const char* kIndex = "index.json";

/// Where an error is: in this file, or at this folder.
[[nodiscard]] inline SourceLocation at(const std::filesystem::path& path) {
  return {path.string(), 0, 0};
}

/// Whether there is anything of that name.
[[nodiscard]] bool there(const std::filesystem::path& path);

/// A bundle that is open for reading.
struct OpenIndex {
  BundleHead head;
  PackedIndex regions;
};

/// Errors: `not_found` if the folder holds no bundle; those of reading its files, of from_json and
/// of PackedIndex::open; `corrupt_data` for an `index.json` that is too large, and for regions that
/// are not those that it names.
[[nodiscard]] Result<OpenIndex> open_index(const BundleFormat& format,
                                           const std::filesystem::path& root);

/// All regions. Errors: those of PackedIndex::all; `corrupt_data` for regions that are no
/// partition.
[[nodiscard]] Result<MapIndex> whole_index(const OpenIndex& index);

/// The files of a bundle that may be replaced. Errors: `already_exists` if the folder is anything
/// but a whole bundle, or holds a file that is not the bundle's.
[[nodiscard]] Result<std::vector<std::string>> files_of_bundle(const BundleFormat& format,
                                                               const std::filesystem::path& folder);

/// Removes files and their folder, never what is below it. What says what this folder is goes last:
/// a removal that is cut off can be taken up again. Errors: `io_failure`.
[[nodiscard]] Result<void> remove_files(const std::filesystem::path& folder,
                                        std::vector<std::string> names);

/// The folder that a bundle is written into: created, locked, and removed again unless it is kept.
class PartialFolder {
 public:
  /// Errors: `already_exists` if another process writes there, or if the folder is not the remains
  /// of one that did; `io_failure`.
  [[nodiscard]] static Result<PartialFolder> create(const BundleFormat& format,
                                                    const std::filesystem::path& path);

  PartialFolder(PartialFolder&& other) noexcept;
  PartialFolder& operator=(PartialFolder&&) = delete;
  ~PartialFolder();

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

  /// Writes a file piece by piece. Nothing is left of one that fails, and none is made before its
  /// first byte. Errors: those of `write`; `io_failure`.
  [[nodiscard]] Result<void> write_file(const std::string& name,
                                        const std::function<Result<void>(const Sink&)>& write);
  /// Adds bytes to the end of a file that was written here. Errors: `io_failure`.
  [[nodiscard]] Result<void> append(const std::string& name, std::string_view content) const;
  /// Removes a file that was written here. Errors: `io_failure`.
  [[nodiscard]] Result<void> remove(const std::string& name);
  /// Writes a file whole, or leaves nothing. Errors: `already_exists`; `io_failure`.
  [[nodiscard]] Result<void> write_file(const std::string& name, std::string_view content);
  /// The index gets its name only when all is on the disk. Errors: `io_failure`.
  [[nodiscard]] Result<void> finish(std::string_view index);
  /// The folder has got its final name: it is no longer ours to remove.
  void release() noexcept;

 private:
  PartialFolder() = default;
  [[nodiscard]] Result<void> create_parents(const std::filesystem::path& folder);

  std::filesystem::path path_;
  std::vector<std::filesystem::path> parents_;  // created here, outermost first
  std::vector<std::string> files_;              // written here
  io::Descriptor lock_;
};

}  // namespace vantage::bundle_folder
