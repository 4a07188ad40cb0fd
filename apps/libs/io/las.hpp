#pragma once

#include <string_view>

#include "io/point_fields.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {

/// Whether the content starts like a LAS file (including LAZ and COPC, which are compressed), or
/// like an E57 file.
[[nodiscard]] bool looks_like_las(std::string_view content) noexcept;
[[nodiscard]] bool looks_like_e57(std::string_view content) noexcept;

/// Where the points of a LAS file are: versions 1.0 to 1.4, point formats 0 to 10, points at least
/// as long as their format (ASPRS LAS 1.4 R15). Waveforms and GPS times are ignored. Points
/// classified as withheld or noise are read like all others.
/// Errors (`where` is the file, the message gives the byte): `corrupt_data` for a header that
/// contradicts itself or the file's size, or for variable length records that run into the points;
/// `unsupported` for LAZ and COPC, with the name of a converter; `io_failure`.
[[nodiscard]] Result<Records> las_records(const InputFile& file);

}  // namespace vantage::io
