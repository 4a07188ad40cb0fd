#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "vantage/kit/file_system.hpp"
#include "vantage/result.hpp"

namespace vantage {

/// Columns of numbers of any length. Only their last numbers are in memory, the others in a file
/// without a name, which vanishes with the object.
class ColumnSpool {
 public:
  /// @param folder  for the file, which is made once a column is long; none: everything stays in
  ///                memory
  ColumnSpool(std::size_t columns, std::optional<std::filesystem::path> folder);

  /// Appends a number to a column. Errors: `io_failure`.
  [[nodiscard]] Result<void> push(std::size_t column, double x);
  [[nodiscard]] std::size_t size(std::size_t column) const noexcept;
  /// All numbers of a column. Errors: `io_failure`.
  [[nodiscard]] Result<std::vector<double>> read(std::size_t column) const;

  /// Reads single numbers; fast if their places in a column hardly go back.
  class Reader {
   public:
    /// @param spool  must outlive the reader, and get no more numbers
    explicit Reader(const ColumnSpool& spool) : spool_(&spool), blocks_(spool.columns_.size()) {}
    /// Errors: `io_failure`.
    [[nodiscard]] Result<double> at(std::size_t column, std::size_t row);

   private:
    struct Block {
      std::optional<std::size_t> number;
      std::vector<double> content;
    };
    const ColumnSpool* spool_;
    std::vector<Block> blocks_;  // the last that was read, of each column
  };

 private:
  struct Column {
    std::vector<std::size_t> blocks;  // in the file
    std::vector<double> last;
  };
  [[nodiscard]] Result<void> store(Column& column);
  /// Appends a block of the file to numbers.
  [[nodiscard]] Result<void> load(std::size_t block, std::vector<double>& to) const;

  std::optional<std::filesystem::path> folder_;
  io::Descriptor file_;
  std::size_t blocks_ = 0;  // in the file
  std::vector<Column> columns_;
};

}  // namespace vantage
