#include "io/ros/wire_reader.hpp"

#include <fmt/format.h>

#include <utility>

#include "io/text.hpp"

namespace vantage::io::ros {
namespace {

constexpr std::size_t kCdrHeader = 4;  // the encapsulation [bytes]; members are aligned after it

}  // namespace

Result<WireReader> WireReader::open(std::string_view bytes, Encoding encoding,
                                    const SourceLocation& where) {
  WireReader reader(bytes, encoding, where);
  if (encoding == Encoding::ros1) return reader;
  VANTAGE_TRY(const auto header, reader.bytes(kCdrHeader, "the header of CDR"));
  const auto high = static_cast<unsigned char>(header[0]);
  const auto low = static_cast<unsigned char>(header[1]);
  if (high != 0 || low > 1) {
    return reader.error(
        fmt::format("the message starts with 0x{:02x}{:02x}, expected plain CDR: 0x0000 "
                    "(big endian) or 0x0001 (little endian)",
                    high, low));
  }
  reader.order_ = low == 0 ? ByteOrder::big : ByteOrder::little;
  return reader;
}

Result<std::string_view> WireReader::bytes(std::size_t count, std::string_view what) {
  if (count > left()) return ends(count, what);
  const std::string_view found = bytes_.substr(offset_, count);
  offset_ += count;
  return found;
}

Result<std::string_view> WireReader::text(std::string_view what) {
  VANTAGE_TRY(const auto length, number<std::uint32_t>(what));
  VANTAGE_TRY(auto found, bytes(length, what));
  if (encoding_ == Encoding::ros1 || found.empty()) return found;
  if (found.back() != '\0') {
    return error(fmt::format("byte {} ends {} with 0x{:02x}, expected a zero", offset_ - 1, what,
                             static_cast<unsigned char>(found.back())));
  }
  found.remove_suffix(1);
  return found;
}

Result<std::size_t> WireReader::count(std::size_t smallest, std::string_view what) {
  VANTAGE_TRY(const auto stated, number<std::uint32_t>(what));
  if (stated <= left() / smallest) return std::size_t{stated};
  return error(fmt::format(
      "byte {} says that there are {} {}, but only {} bytes follow, expected at least {} each",
      offset_ - sizeof(stated), stated, what, left(), smallest));
}

Result<Stamp> WireReader::time(std::string_view what) {
  double seconds = 0.0;
  if (encoding_ == Encoding::ros1) {
    VANTAGE_TRY(seconds, number<std::uint32_t>(what));
  } else {
    VANTAGE_TRY(seconds, number<std::int32_t>(what));
  }
  VANTAGE_TRY(const auto nanoseconds, number<std::uint32_t>(what));
  return Stamp(seconds, nanoseconds);
}

Result<Header> WireReader::header() {
  if (encoding_ == Encoding::ros1) VANTAGE_CHECK(number<std::uint32_t>("header.seq"));
  Header header;
  VANTAGE_TRY(header.stamp, time("header.stamp"));
  VANTAGE_TRY(header.frame, text("header.frame_id"));
  return header;
}

Result<void> WireReader::align(std::size_t size, std::string_view what) {
  if (encoding_ == Encoding::ros1) return {};
  const std::size_t past = (offset_ - kCdrHeader) % size;
  if (past != 0) VANTAGE_CHECK(bytes(size - past, what));
  return {};
}

tl::unexpected<Error> WireReader::error(std::string message) const {
  return fail(ErrorCode::corrupt_data, std::move(message), *where_);
}

tl::unexpected<Error> WireReader::ends(std::size_t needed, std::string_view what) const {
  return error(fmt::format("the message ends at byte {}, expected {} bytes of {} at byte {}",
                           bytes_.size(), needed, what, offset_));
}

}  // namespace vantage::io::ros
