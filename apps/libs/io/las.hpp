#pragma once

#include <string_view>

#include "io/point_fields.hpp"
#include "vantage/kit/file_content.hpp"

namespace vantage::io {

/// Whether the content starts like a LAS file (also one compressed as LAZ or COPC), or an E57 file.
[[nodiscard]] bool looks_like_las(std::string_view content) noexcept;
[[nodiscard]] bool looks_like_e57(std::string_view content) noexcept;

/// Where the points of a LAS file are: versions 1.0 to 1.4, point formats 0 to 10, points of any
/// length from the format's on (ASPRS LAS 1.4 R15). Waveforms and GPS times are left alone; points
/// that are withheld or noise by their classification are points like all others.
/// Errors (`where` is the file, the message has the byte): `corrupt_data` for a header that
/// contradicts itself or the file's size, also for variable length records that run into the
/// points; `unsupported` for LAZ and COPC, with a converter; `io_failure`.
[[nodiscard]] Result<Records> las_records(const InputFile& file);

/// What its header says of the points; of what goes beyond the point format the size.
/// Errors: those of las_records for a header that contradicts itself.
[[nodiscard]] Result<CloudLayout> las_layout(const InputFile& file);

/// That E57 files are not read, and with what they can be converted.
[[nodiscard]] tl::unexpected<Error> refuse_e57(const InputFile& file);

}  // namespace vantage::io
