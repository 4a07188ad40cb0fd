#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "vantage/io/scan_source.hpp"
#include "vantage/kit/file_content.hpp"
#include "vantage/result.hpp"

namespace vantage::io {

/// Whether a file's beginning is that of a pcap or pcapng file, of either byte order.
[[nodiscard]] bool looks_like_pcap(std::string_view head) noexcept;

/// The revolutions of a VLP-16 or HDL-32E from a pcap or pcapng capture of its UDP packets (see
/// velodyne::SpinAssembler). Packets that are no data packets (GPS, other traffic, fragments) are
/// skipped.
/// @param sensor  where its packets come from, "192.168.1.201:2368"; empty for the only one. It is
///                the `topic` of describe().
/// Errors (`where` is the file): `invalid_input` for a sensor that is not there or that must be
/// chosen (also from next(), where a second one shows up late; the message lists what there is);
/// `unsupported` for other models and link types; `corrupt_data`, also for a capture without data
/// packets (the message says what it holds) or without a whole revolution (from next());
/// `io_failure`.
[[nodiscard]] Result<std::unique_ptr<ScanSource>> open_velodyne_capture(InputFile file,
                                                                        const std::string& sensor);

}  // namespace vantage::io
