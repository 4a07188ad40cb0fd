#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <utility>

#include "common/bundle_format.hpp"
#include "common/bundle_head.hpp"
#include "common/packed_index.hpp"
#include "vantage/kit/atomic_folder.hpp"
#include "vantage/map_store.hpp"
#include "vantage/result.hpp"

namespace vantage::bundle_folder {

inline constexpr const char* kIndex = "index.json";

/// Where an error is: in this file, or at this folder.
[[nodiscard]] inline SourceLocation at(const std::filesystem::path& path) {
  return {path.string(), 0, 0};
}

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

/// What the folder of a bundle holds.
[[nodiscard]] io::FolderKind kind_of(const BundleFormat& format);

/// The folder that a bundle is written into.
class PartialFolder {
 public:
  /// Errors: those of OutputFolder::create.
  [[nodiscard]] static Result<PartialFolder> create(const BundleFormat& format,
                                                    const std::filesystem::path& root,
                                                    io::OutputFolder::Existing existing);

  [[nodiscard]] const std::filesystem::path& path() const noexcept { return folder_.path(); }

  /// Writes a file piece by piece. Nothing is left of one that fails, and none is made before its
  /// first byte. Errors: those of `write`; `io_failure`.
  [[nodiscard]] Result<void> write_file(const std::string& name,
                                        const std::function<Result<void>(const Sink&)>& write);
  /// Writes a file whole, or leaves nothing. Errors: `already_exists` if it was written before;
  /// `io_failure`.
  [[nodiscard]] Result<void> write_file(const std::string& name, std::string_view content);
  /// Adds bytes to the end of a file that was written here. Errors: `io_failure`.
  [[nodiscard]] Result<void> append(const std::string& name, std::string_view content) const;
  /// Removes a file that was written here. Errors: `io_failure`.
  [[nodiscard]] Result<void> remove(const std::string& name);
  /// Puts the bundle in place. Errors: those of OutputFolder::commit.
  [[nodiscard]] Result<void> commit() { return folder_.commit(); }

 private:
  explicit PartialFolder(io::OutputFolder folder) : folder_(std::move(folder)) {}

  io::OutputFolder folder_;
};

}  // namespace vantage::bundle_folder
