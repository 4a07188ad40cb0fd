#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string_view>

#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

namespace vantage::io::velodyne {

/// A captured frame.
struct Frame {
  double stamp = 0.0;        ///< of its receipt [s]
  std::string_view bytes;    ///< from the link header on; valid until the next call
  std::uint64_t offset = 0;  ///< of its record in the file [bytes]
};

/// The frames of a pcap or pcapng file, read by libpcap. Memory use is that of one frame.
class PcapFile {
 public:
  /// Errors (`where` is the file): `corrupt_data`, `io_failure`.
  [[nodiscard]] static Result<PcapFile> open(InputFile file);
  PcapFile(PcapFile&&) noexcept;
  PcapFile& operator=(PcapFile&&) noexcept;
  ~PcapFile();

  [[nodiscard]] const std::string& name() const noexcept;
  /// libpcap's DLT_ number.
  [[nodiscard]] int link_type() const noexcept;
  /// The next frame; nothing at the end.
  /// Errors: `corrupt_data` with the byte, also for a record that the end of the file cuts off;
  /// `io_failure`.
  [[nodiscard]] Result<std::optional<Frame>> next();
  /// Makes next() continue with the first frame. Errors: those of open().
  [[nodiscard]] Result<void> rewind();

 private:
  struct State;
  explicit PcapFile(std::unique_ptr<State> state) noexcept;

  std::unique_ptr<State> state_;
};

}  // namespace vantage::io::velodyne
