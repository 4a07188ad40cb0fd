#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/partial_folder.hpp"
#include "vantage/result.hpp"

namespace vantage::shared_tiles {

/// The numbers of each region's points, in order, in a file that only the build has: all of them
/// together are many times as long as the map.
class RegionSequences {
 public:
  /// Goes through the numbers of one region.
  class Cursor {
   public:
    Cursor() = default;
    explicit Cursor(std::string_view bytes) noexcept : at_(bytes.data()), end_(at_ + bytes.size()) {
      next();
    }
    [[nodiscard]] bool at_end() const noexcept { return ended_; }
    [[nodiscard]] std::uint32_t id() const noexcept { return id_; }
    void next() noexcept;

   private:
    const char* at_ = nullptr;
    const char* end_ = nullptr;
    std::uint32_t id_ = 0xffff'ffff;
    bool ended_ = true;
  };

  RegionSequences(std::string file, std::size_t regions);
  RegionSequences(RegionSequences&&) = delete;
  RegionSequences& operator=(RegionSequences&&) = delete;
  ~RegionSequences();

  /// Errors: `io_failure`.
  [[nodiscard]] Result<void> add(bundle_folder::PartialFolder& folder, std::uint32_t region,
                                 const std::vector<std::uint32_t>& ids);
  /// Makes what was added readable. Errors: `io_failure`.
  [[nodiscard]] Result<void> open(const bundle_folder::PartialFolder& folder);
  /// Removes the file. Errors: `io_failure`.
  [[nodiscard]] Result<void> remove(bundle_folder::PartialFolder& folder);

  [[nodiscard]] std::uint32_t regions() const noexcept {
    return static_cast<std::uint32_t>(parts_.size());
  }
  /// Precondition: it is open.
  [[nodiscard]] Cursor of(std::uint32_t region) const noexcept;

 private:
  struct Part {
    std::uint64_t offset = 0, bytes = 0;
  };
  void close() noexcept;

  std::string file_;
  std::vector<Part> parts_;  // by region
  std::uint64_t size_ = 0;
  bool created_ = false;
  void* mapped_ = nullptr;
};

}  // namespace vantage::shared_tiles
