#include "vantage/kit/checksum.hpp"

#include <bit>
#include <type_traits>

// All of it becomes part of this file, so programs that link the kit do not link xxHash. Analyzers
// see no more of it than its types.
#ifdef __clang_analyzer__
#define XXH_STATIC_LINKING_ONLY
#else
#define XXH_INLINE_ALL
#endif
#include <xxhash.h>

namespace vantage {

static_assert(std::endian::native == std::endian::little, "numbers are added as they are");

Checksum::Checksum() noexcept : state_{} {
  static_assert(sizeof(XXH64_state_t) == sizeof state_ &&
                alignof(XXH64_state_t) <= alignof(Checksum));
  static_assert(std::is_trivially_copyable_v<XXH64_state_t>);
  XXH64_reset(reinterpret_cast<XXH64_state_t*>(state_.data()), 0);
}

void Checksum::add(std::string_view bytes) noexcept {
  XXH64_update(reinterpret_cast<XXH64_state_t*>(state_.data()), bytes.data(), bytes.size());
}

void Checksum::add(std::span<const std::byte> bytes) noexcept {
  add(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

void Checksum::add(std::uint64_t number) noexcept { add(std::as_bytes(std::span(&number, 1))); }

std::uint64_t Checksum::value() const noexcept {
  return XXH64_digest(reinterpret_cast<const XXH64_state_t*>(state_.data()));
}

std::uint64_t checksum_of(std::string_view bytes) noexcept {
  return XXH64(bytes.data(), bytes.size(), 0);
}

std::uint64_t checksum_of(std::span<const std::byte> bytes) noexcept {
  return checksum_of(std::string_view(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

}  // namespace vantage
