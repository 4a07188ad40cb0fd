#include "region_sequences.hpp"

#include <fcntl.h>
#include <sys/mman.h>

#include <cerrno>
#include <utility>

#include "bytes.hpp"
#include "vantage/kit/file_system.hpp"

namespace vantage::shared_tiles {

// A number is kept as its distance from the one before plus one, with the sign in the lowest bit:
// a run of numbers takes one byte each.
void RegionSequences::Cursor::next() noexcept {
  ended_ = at_ == end_;
  std::uint64_t code = 0;
  for (unsigned shift = 0; at_ != end_; shift += 7) {
    const auto byte = static_cast<unsigned char>(*at_++);
    code |= static_cast<std::uint64_t>(byte & 127U) << shift;
    if (byte < 128) break;
  }
  const auto half = static_cast<std::uint32_t>(code >> 1U);
  id_ += 1U + ((code & 1U) != 0 ? ~half : half);
}

RegionSequences::RegionSequences(std::string file, std::size_t regions)
    : file_(std::move(file)), parts_(regions) {}

RegionSequences::~RegionSequences() { close(); }

Result<void> RegionSequences::add(bundle_folder::PartialFolder& folder, std::uint32_t region,
                                  const std::vector<std::uint32_t>& ids) {
  std::string bytes;
  bytes.reserve(ids.size() + ids.size() / 4);
  std::int64_t expected = 0;
  for (const std::uint32_t id : ids) {
    const std::int64_t step = static_cast<std::int64_t>(id) - expected;
    append_leb(bytes, step >= 0 ? static_cast<std::uint64_t>(step) << 1U
                                : (static_cast<std::uint64_t>(-step - 1) << 1U) | 1U);
    expected = static_cast<std::int64_t>(id) + 1;
  }
  if (!std::exchange(created_, true)) VANTAGE_CHECK(folder.write_file(file_, std::string_view()));
  VANTAGE_CHECK(folder.append(file_, bytes));
  parts_[region] = {size_, bytes.size()};
  size_ += bytes.size();
  return {};
}

Result<void> RegionSequences::open(const bundle_folder::PartialFolder& folder) {
  close();
  if (size_ == 0) return {};
  const auto path = folder.path() / file_;
  const io::Descriptor file = io::Descriptor::of(path, O_RDONLY);
  if (!file.open()) return io::system_error(path, "the file cannot be opened", errno);
  void* const mapped = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file.get(), 0);
  if (mapped == MAP_FAILED) return io::system_error(path, "the file cannot be mapped", errno);
  mapped_ = mapped;
  return {};
}

Result<void> RegionSequences::remove(bundle_folder::PartialFolder& folder) {
  close();
  if (!std::exchange(created_, false)) return {};
  return folder.remove(file_);
}

RegionSequences::Cursor RegionSequences::of(std::uint32_t region) const noexcept {
  const Part& part = parts_[region];
  if (part.bytes == 0) return {};
  return Cursor({static_cast<const char*>(mapped_) + part.offset, part.bytes});
}

void RegionSequences::close() noexcept {
  if (mapped_ != nullptr) ::munmap(std::exchange(mapped_, nullptr), size_);
}

}  // namespace vantage::shared_tiles
