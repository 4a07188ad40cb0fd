#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include "support/bags/bags.hpp"

namespace vantage::test {

std::string sized(std::string_view bytes) {
  return little(static_cast<std::uint32_t>(bytes.size())) + std::string(bytes);
}

std::string bz2_of(std::string_view bytes) {
  std::string source(bytes), packed(bytes.size() + bytes.size() / 100 + 700, '\0');
  auto size = static_cast<unsigned>(packed.size());
  BZ2_bzBuffToBuffCompress(packed.data(), &size, source.data(),
                           static_cast<unsigned>(source.size()), 9, 0, 0);
  packed.resize(size);
  return packed;
}

std::string lz4_of(std::string_view bytes) {
  std::string packed(LZ4F_compressFrameBound(bytes.size(), nullptr), '\0');
  packed.resize(
      LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
  return packed;
}

std::string zstd_of(std::string_view bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), 3));
  return packed;
}

std::string packed(const std::string& compression, const std::string& bytes) {
  if (compression == "bz2") return bz2_of(bytes);
  if (compression == "lz4") return lz4_of(bytes);
  if (compression == "zstd") return zstd_of(bytes);
  return bytes;
}

}  // namespace vantage::test
