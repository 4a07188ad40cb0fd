#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/partial_folder.hpp"
#include "vantage/kit/file_system.hpp"
#include "vantage/result.hpp"

namespace vantage::shared_tiles {

/// A file that only a build has: what it cannot keep in memory.
class Scratch {
 public:
  struct Place {
    std::uint64_t offset = 0, bytes = 0;
  };

  /// @param name  of the file; it is made at the first write
  explicit Scratch(std::string name) : name_(std::move(name)) {}

  /// Errors: `io_failure`.
  [[nodiscard]] Result<Place> add(bundle_folder::PartialFolder& folder, std::string_view content);
  /// Errors: `io_failure`.
  [[nodiscard]] Result<std::string> read(const Place& place) const;
  /// What is there is not needed any more: its room on the disk is given back, where the file
  /// system can do that.
  void forget(const Place& place) noexcept;
  /// Removes the file. Errors: `io_failure`.
  [[nodiscard]] Result<void> remove(bundle_folder::PartialFolder& folder);

 private:
  std::string name_;
  std::filesystem::path path_;
  io::Descriptor file_;
  std::uint64_t size_ = 0;
};

}  // namespace vantage::shared_tiles
