#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "vantage/io/scan_source.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// Whether the beginning of a file is that of a pcap or pcapng file, of either byte order.
[[nodiscard]] bool looks_like_pcap(std::string_view head) noexcept;

/// The revolutions of a VLP-16 or HDL-32E from a pcap or pcapng capture of its UDP packets (see
/// velodyne::SpinAssembler). Packets that are not data packets (GPS, other traffic, fragments) are
/// skipped.
/// @param sensor  where its packets come from, "192.168.1.201:2368"; empty for the only sensor. It
///                is the `topic` of describe().
/// Errors (`where` is the file): `invalid_input` for a sensor that does not occur or that must be
/// chosen (also from next(), if a second sensor shows up late; the message lists the sensors);
/// `unsupported` for other models and link types; `corrupt_data`, also for a capture without data
/// packets (the message says what it contains) or without a complete revolution (from next());
/// `io_failure`.
[[nodiscard]] Result<std::unique_ptr<ScanSource>> open_velodyne_capture(InputFile file,
                                                                        const std::string& sensor);

}  // namespace vantage::io
