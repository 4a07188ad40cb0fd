#include "selection.hpp"

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

/// A writer of picks that stops at their number.
class Picks {
 public:
  Picks(std::vector<std::uint32_t>& to, std::uint32_t count) : to_(to), begin_(to.size()) {
    to.resize(begin_ + count);
    at_ = to.data() + begin_;
    end_ = at_ + count;
  }
  [[nodiscard]] bool room_for(std::uint64_t count) const noexcept {
    return static_cast<std::uint64_t>(end_ - at_) >= count;
  }
  [[nodiscard]] bool full() const noexcept { return at_ == end_; }
  void add(std::uint32_t pick) noexcept { *at_++ = pick; }

 private:
  std::vector<std::uint32_t>& to_;
  std::size_t begin_;
  std::uint32_t* at_;
  std::uint32_t* end_;
};

bool read_bitmap(std::string_view bytes, std::uint32_t points, Picks& picks) {
  if (bytes.size() != bitmap_size(points)) return false;
  for (std::size_t at = 0; at < bytes.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
    if (!picks.room_for(static_cast<std::uint64_t>(std::popcount(word)))) return false;
    const auto base = static_cast<std::uint32_t>(8 * at);
    for (; word != 0; word &= word - 1) {
      picks.add(base + static_cast<std::uint32_t>(std::countr_zero(word)));
    }
  }
  // Bits behind the last point would be picks of no point.
  return points % 8 == 0 || static_cast<unsigned char>(bytes.back()) >> points % 8 == 0;
}

bool read_runs(std::string_view bytes, std::uint32_t points, Picks& picks) {
  ByteReader reader(bytes);
  std::uint64_t at = 0;
  while (reader.left() > 0) {
    const std::uint64_t skipped = reader.leb(), taken = reader.leb();
    if (!reader.ok() || skipped > points || taken > points || at + skipped + taken > points ||
        !picks.room_for(taken)) {
      return false;
    }
    at += skipped;
    for (const std::uint64_t end = at + taken; at != end; ++at) {
      picks.add(static_cast<std::uint32_t>(at));
    }
  }
  return true;
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

bool read_selection(std::string_view bytes, Coding coding, std::uint32_t points,
                    std::uint32_t count, std::vector<std::uint32_t>& picks) {
  if (count > points) return false;
  Picks to(picks, count);
  switch (coding) {
    case Coding::all:
      if (!bytes.empty() || count != points) return false;
      for (std::uint32_t i = 0; i < points; ++i) to.add(i);
      return true;
    case Coding::bitmap: return read_bitmap(bytes, points, to) && to.full();
    case Coding::runs: return read_runs(bytes, points, to) && to.full();
  }
  return false;
}

}  // namespace vantage::shared_tiles
