#include "common/stored_bytes.hpp"

#include <cstring>

namespace vantage::matching {

std::uint64_t checksum_of(std::span<const std::byte> bytes) noexcept {
  std::uint64_t sum = 0xCBF29CE484222325U;
  const auto mix = [&](std::uint64_t word) {
    sum = (sum ^ word) * 0x9E3779B97F4A7C15U;
    sum ^= sum >> 32U;
  };
  std::size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + i, 8);
    mix(word);
  }
  std::uint64_t rest = 0;
  for (unsigned shift = 0; i < bytes.size(); ++i, shift += 8) {
    rest |= std::to_integer<std::uint64_t>(bytes[i]) << shift;
  }
  mix(rest);
  mix(bytes.size());
  return sum;
}

ByteWriter StoredFormat::begun(std::uint16_t form, std::size_t size) const {
  ByteWriter out(header + size + kChecksum);
  out.raw(std::string_view(letters.data(), letters.size()));
  out.number(version);
  out.number(form);
  return out;
}

Result<std::pair<ByteReader, std::uint16_t>> StoredFormat::opened(std::span<const std::byte> bytes,
                                                                  std::uint16_t last_form) const {
  if (bytes.size() < header + kChecksum) return corrupt("it is cut short");
  const std::span<const std::byte> body = bytes.first(bytes.size() - kChecksum);
  if (ByteReader(bytes.last(kChecksum)).number<std::uint64_t>() != checksum_of(body)) {
    return corrupt("its checksum is wrong");
  }
  ByteReader in(body);
  for (const char c : letters) {
    if (in.number<char>() != c) {
      return corrupt("it does not begin with " + std::string(letters.begin(), letters.end()) +
                     "; another matcher may have made it");
    }
  }
  if (const auto found = in.number<std::uint16_t>(); found != version) {
    return corrupt("its format is " + std::to_string(found) + ", not " + std::to_string(version));
  }
  const auto form = in.number<std::uint16_t>();
  if (form > last_form) return corrupt("its form is " + std::to_string(form));
  return std::pair(in, form);
}

}  // namespace vantage::matching
