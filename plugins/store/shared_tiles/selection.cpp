#include "selection.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "bytes.hpp"

namespace vantage::shared_tiles {
namespace {

std::string runs_of(std::span<const std::uint32_t> picks) {
  std::string code;
  std::uint32_t end = 0;  // of the run before
  for (std::size_t i = 0; i < picks.size();) {
    const std::uint32_t begin = picks[i];
    std::uint32_t next = begin;
    while (i < picks.size() && picks[i] == next) ++i, ++next;
    append_leb(code, begin - end);
    append_leb(code, next - begin);
    end = next;
  }
  return code;
}

std::size_t bitmap_size(std::uint32_t points) { return (std::size_t{points} + 7) / 8; }

std::string bitmap_of(std::span<const std::uint32_t> picks, std::uint32_t points) {
  std::string bits(bitmap_size(points), '\0');
  for (const std::uint32_t i : picks) {
    bits[i / 8] = static_cast<char>(static_cast<unsigned char>(bits[i / 8]) | 1U << i % 8);
  }
  return bits;
}

std::optional<std::vector<Run>> read_bitmap(std::string_view bytes, std::uint32_t points) {
  if (bytes.size() != bitmap_size(points)) return std::nullopt;
  std::vector<Run> runs;
  for (std::size_t at = 0; at < bytes.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
    for (auto base = static_cast<std::uint32_t>(8 * at); word != 0;) {
      const int skipped = std::countr_zero(word);
      const int taken = std::countr_one(word >> skipped);
      const std::uint32_t begin = base + static_cast<std::uint32_t>(skipped);
      base = begin + static_cast<std::uint32_t>(taken);
      if (!runs.empty() && runs.back().end == begin) {
        runs.back().end = base;
      } else {
        runs.push_back({begin, base});
      }
      word = skipped + taken < 64 ? word >> skipped >> taken : 0;
    }
  }
  return runs;
}

std::optional<std::vector<Run>> read_runs(std::string_view bytes, std::uint32_t points) {
  ByteReader reader(bytes);
  std::vector<Run> runs;
  runs.reserve(bytes.size() / 2);
  std::uint64_t at = 0;
  while (reader.left() > 0) {
    const std::uint64_t skipped = reader.counted(), taken = reader.counted();
    if (!reader.ok() || skipped > points || taken > points) return std::nullopt;
    at += skipped;
    if (at + taken > points) return std::nullopt;
    runs.push_back({static_cast<std::uint32_t>(at), static_cast<std::uint32_t>(at + taken)});
    at += taken;
  }
  return runs;
}

std::optional<std::vector<Run>> read_any(std::string_view bytes, Coding coding,
                                         std::uint32_t points) {
  switch (coding) {
    case Coding::all:
      if (!bytes.empty()) return std::nullopt;
      return std::vector<Run>{{0, points}};
    case Coding::bitmap: return read_bitmap(bytes, points);
    case Coding::runs: return read_runs(bytes, points);
  }
  return std::nullopt;
}

}  // namespace

Coding append_selection(std::string& bytes, std::span<const std::uint32_t> picks,
                        std::uint32_t points) {
  if (picks.size() == points) return Coding::all;
  const std::string runs = runs_of(picks);
  if (runs.size() < bitmap_size(points)) {
    bytes += runs;
    return Coding::runs;
  }
  bytes += bitmap_of(picks, points);
  return Coding::bitmap;
}

std::optional<std::vector<Run>> read_selection(std::string_view bytes, Coding coding,
                                               std::uint32_t points, std::uint32_t count) {
  auto runs = read_any(bytes, coding, points);
  if (!runs || (!runs->empty() && runs->back().end > points)) return std::nullopt;
  std::uint64_t sum = 0;
  for (const Run& run : *runs) sum += run.end - run.begin;
  if (sum != count) return std::nullopt;
  return runs;
}

}  // namespace vantage::shared_tiles
