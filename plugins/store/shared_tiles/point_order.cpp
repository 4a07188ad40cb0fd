#include "point_order.hpp"

#include <algorithm>
#include <utility>

#include "bytes.hpp"

namespace vantage::shared_tiles {
namespace {

// A jump is a difference modulo 2^32 with the sign in the lowest bit.
std::uint32_t folded(std::uint32_t jump) noexcept {
  return jump << 1U ^ (jump >> 31U != 0 ? 0xffff'ffffU : 0U);
}
std::uint32_t unfolded(std::uint32_t code) noexcept {
  return code >> 1U ^ ((code & 1U) != 0 ? 0xffff'ffffU : 0U);
}

}  // namespace

void OrderWriter::add(std::uint32_t part, std::uint32_t pick) {
  if (piece_.count > 0 && part == piece_.part && pick == piece_.begin + piece_.count) {
    ++piece_.count;
    return;
  }
  write();
  piece_ = {.part = part, .begin = pick, .count = 1};
}

void OrderWriter::write() {
  if (piece_.count == 0) return;
  const std::uint32_t jump = piece_.begin - next_[piece_.part];
  append_leb(code_, std::uint64_t{piece_.part} << 1U | (jump != 0 ? 1U : 0U));
  if (jump != 0) append_leb(code_, folded(jump));
  append_leb(code_, piece_.count);
  next_[piece_.part] = piece_.begin + piece_.count;
}

std::string OrderWriter::code() && {
  write();
  return std::move(code_);
}

void TakenPoints::add(const StoredTile& tile, std::vector<Run> runs) {
  std::vector<std::uint32_t> begin{0};
  begin.reserve(runs.size() + 1);
  for (const Run& run : runs) begin.push_back(begin.back() + (run.end - run.begin));
  count_ += begin.back();
  parts_.push_back({.tile = &tile, .runs = std::move(runs), .begin = std::move(begin)});
}

std::optional<PointCloud> TakenPoints::in_order(std::string_view code) {
  PointCloud points(count_);
  Point* to = points.data();
  ByteReader reader(code);
  while (reader.left() > 0) {
    const std::uint64_t number = reader.leb();
    if (number >> 1U >= parts_.size()) return std::nullopt;
    Part& part = parts_[number >> 1U];
    std::uint32_t begin = part.next;
    if ((number & 1U) != 0) begin += unfolded(static_cast<std::uint32_t>(reader.leb()));
    const std::uint64_t count = reader.leb();
    const std::uint32_t taken = part.begin.back();
    const auto left = static_cast<std::uint64_t>(points.data() + points.size() - to);
    if (!reader.ok() || count == 0 || begin >= taken || count > taken - begin || count > left) {
      return std::nullopt;
    }
    to = copy(part, begin, begin + static_cast<std::uint32_t>(count), to);
  }
  if (to != points.data() + points.size()) return std::nullopt;
  return points;
}

Point* TakenPoints::copy(Part& part, std::uint32_t begin, std::uint32_t end, Point* to) {
  if (begin < part.begin[part.run] || begin > part.begin[part.run + 1]) {
    const auto after = std::ranges::upper_bound(part.begin, begin);
    part.run = static_cast<std::size_t>(after - part.begin.begin()) - 1;
  }
  part.next = end;
  while (begin < end) {
    if (part.begin[part.run + 1] <= begin) {
      ++part.run;
      continue;
    }
    const std::uint32_t until = std::min(end, part.begin[part.run + 1]);
    const std::uint32_t first = part.runs[part.run].begin + (begin - part.begin[part.run]);
    to = part.tile->copy(first, first + (until - begin), to);
    begin = until;
  }
  return to;
}

}  // namespace vantage::shared_tiles
