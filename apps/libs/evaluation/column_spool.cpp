#include "vantage/evaluation/column_spool.hpp"

#include <fcntl.h>
#include <stdlib.h>  // mkstemp is of POSIX
#include <unistd.h>

#include <cerrno>
#include <string>
#include <string_view>
#include <utility>

namespace vantage {
namespace {

constexpr std::size_t kBlock = 512;  // numbers

/// A file that has no name.
Result<io::Descriptor> nameless_file(const std::filesystem::path& folder) {
  std::string name = (folder / ".vantage-XXXXXX").string();
  io::Descriptor file(::mkostemp(name.data(), O_CLOEXEC));
  if (!file.open()) return io::system_error(folder, "cannot create a temporary file", errno);
  ::unlink(name.c_str());
  return file;
}

}  // namespace

ColumnSpool::ColumnSpool(std::size_t columns, std::optional<std::filesystem::path> folder)
    : folder_(std::move(folder)), columns_(columns) {}

Result<void> ColumnSpool::push(std::size_t column, double x) {
  Column& to = columns_[column];
  if (folder_ && to.last.size() == kBlock) VANTAGE_CHECK(store(to));
  to.last.push_back(x);
  return {};
}

std::size_t ColumnSpool::size(std::size_t column) const noexcept {
  return kBlock * columns_[column].blocks.size() + columns_[column].last.size();
}

Result<void> ColumnSpool::store(Column& column) {
  if (!file_.open()) {
    VANTAGE_TRY(file_, nameless_file(*folder_));
  }
  const std::string_view bytes(reinterpret_cast<const char*>(column.last.data()),
                               kBlock * sizeof(double));
  if (const int error = io::write_all(file_, bytes); error != 0) {
    return io::system_error(*folder_, "cannot write a temporary file", error);
  }
  column.blocks.push_back(blocks_++);
  column.last.clear();
  return {};
}

Result<void> ColumnSpool::load(std::size_t block, std::vector<double>& to) const {
  constexpr std::size_t kBytes = kBlock * sizeof(double);
  const std::size_t before = to.size();
  to.resize(before + kBlock);
  std::size_t done = 0;
  const int error = io::read_all(file_, block * kBytes,
                                 {reinterpret_cast<char*>(to.data() + before), kBytes}, done);
  if (error != 0 || done < kBytes) {
    return io::system_error(*folder_, "cannot read a temporary file", error != 0 ? error : EIO);
  }
  return {};
}

Result<std::vector<double>> ColumnSpool::read(std::size_t column) const {
  const Column& from = columns_[column];
  std::vector<double> all;
  all.reserve(size(column));
  for (const std::size_t block : from.blocks) VANTAGE_CHECK(load(block, all));
  all.insert(all.end(), from.last.begin(), from.last.end());
  return all;
}

Result<double> ColumnSpool::Reader::at(std::size_t column, std::size_t row) {
  const Column& from = spool_->columns_[column];
  const std::size_t number = row / kBlock;
  if (number >= from.blocks.size()) return from.last[row - kBlock * from.blocks.size()];
  Block& block = blocks_[column];
  if (block.number != number) {
    block.content.clear();
    VANTAGE_CHECK(spool_->load(from.blocks[number], block.content));
    block.number = number;
  }
  return block.content[row % kBlock];
}

}  // namespace vantage
