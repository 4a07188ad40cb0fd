#include "io/tiles/state.hpp"

#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "io/tiles/index.hpp"
#include "io/tiles/words.hpp"
#include "vantage/kit/file_system.hpp"

namespace vantage::io::tiles {
namespace {

constexpr std::uint64_t kStateMagic = 0x5453454c49544756ULL;  // "VGTILEST"
constexpr std::uint64_t kStateVersion = 2;

void put_text(WordWriter& words, const std::string& text) {
  words.put(std::uint64_t{text.size()});
  for (std::size_t at = 0; at < text.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, text.data() + at, std::min<std::size_t>(8, text.size() - at));
    words.put(word);
  }
}

Result<std::string> get_text(WordReader64& words) {
  VANTAGE_TRY(const std::uint64_t size, words.get());
  if (size > 8 * words.size()) return words.error("a text is longer than the file");
  std::string text(size, '\0');
  for (std::size_t at = 0; at < text.size(); at += 8) {
    VANTAGE_TRY(const std::uint64_t word, words.get());
    std::memcpy(text.data() + at, &word, std::min<std::size_t>(8, text.size() - at));
  }
  return text;
}

Result<std::uint64_t> get_count(WordReader64& words) {
  VANTAGE_TRY(const std::uint64_t count, words.get());
  if (count > words.size()) return words.error("a list is longer than the file");
  return count;
}

Result<void> get_list(WordReader64& words, std::vector<std::uint64_t>& list) {
  VANTAGE_TRY(const std::uint64_t count, get_count(words));
  list.resize(count);
  for (std::uint64_t& word : list) {
    VANTAGE_TRY(word, words.get());
  }
  return {};
}

}  // namespace

Result<void> write_state(const std::filesystem::path& file, const State& state,
                         std::span<const Cell> cells) {
  VANTAGE_TRY(WordWriter words, WordWriter::create(file));
  words.put(kStateMagic);
  words.put(kStateVersion);
  words.put(state.job.cells_a_side);
  words.put(state.job.pack_size);
  words.put(std::uint64_t{state.job.inputs.size()});
  for (const Input& input : state.job.inputs) {
    put_text(words, input.path);
    words.put(input.size);
    words.put(static_cast<std::uint64_t>(input.modified));
  }
  words.put(static_cast<std::uint64_t>(state.stage));
  for (const std::uint64_t word : {state.input, state.position, state.counted, state.dropped,
                                   std::uint64_t{state.needs_float64}}) {
    words.put(word);
  }
  for (const Point& corner : {state.bounds.min, state.bounds.max}) {
    for (const double coordinate : corner) words.put(coordinate);
  }
  const auto full =
      std::count_if(cells.begin(), cells.end(), [](const Cell& cell) { return cell.points != 0; });
  words.put(static_cast<std::uint64_t>(full));
  for (const Cell& cell : cells) {
    if (cell.points == 0) continue;
    words.put(packed(cell.x, cell.y));
    words.put(cell.points);
  }
  for (const auto* list : {&state.placed, &state.checksums}) {
    words.put(std::uint64_t{list->size()});
    for (const std::uint64_t word : *list) words.put(word);
  }
  return words.commit();
}

Result<LoadedState> read_state(const std::filesystem::path& file) {
  VANTAGE_TRY(WordReader64 words, WordReader64::open(file, "the state of a tiling"));
  VANTAGE_TRY(const std::uint64_t magic, words.get());
  VANTAGE_TRY(const std::uint64_t version, words.get());
  if (magic != kStateMagic || version != kStateVersion) {
    return words.error("this is not the state of a tiling that this version has begun");
  }
  LoadedState loaded;
  State& state = loaded.state;
  VANTAGE_TRY(state.job.cells_a_side, words.get());
  VANTAGE_TRY(state.job.pack_size, words.get());
  VANTAGE_TRY(const std::uint64_t inputs, get_count(words));
  for (std::uint64_t i = 0; i < inputs; ++i) {
    Input input;
    VANTAGE_TRY(input.path, get_text(words));
    VANTAGE_TRY(input.size, words.get());
    VANTAGE_TRY(const std::uint64_t modified, words.get());
    input.modified = static_cast<std::int64_t>(modified);
    state.job.inputs.push_back(std::move(input));
  }
  VANTAGE_TRY(const std::uint64_t stage, words.get());
  state.stage = stage == 0 ? TilingStage::counting : TilingStage::placing;
  for (std::uint64_t* word : {&state.input, &state.position, &state.counted, &state.dropped}) {
    VANTAGE_TRY(*word, words.get());
  }
  VANTAGE_TRY(const std::uint64_t needs_float64, words.get());
  state.needs_float64 = needs_float64 != 0;
  for (Point* corner : {&state.bounds.min, &state.bounds.max}) {
    for (double& coordinate : *corner) {
      VANTAGE_TRY(const std::uint64_t word, words.get());
      coordinate = std::bit_cast<double>(word);
    }
  }
  VANTAGE_TRY(const std::uint64_t cells, get_count(words));
  loaded.cells.resize(cells);
  for (Cell& cell : loaded.cells) {
    VANTAGE_TRY(const std::uint64_t place, words.get());
    VANTAGE_TRY(cell.points, words.get());
    cell.x = low(place);
    cell.y = high(place);
  }
  VANTAGE_CHECK(get_list(words, state.placed));
  VANTAGE_CHECK(get_list(words, state.checksums));
  VANTAGE_CHECK(words.finish());
  return loaded;
}

Result<Input> examine(const std::filesystem::path& path) {
  std::error_code failed;
  const std::filesystem::path whole = std::filesystem::canonical(path, failed);
  const std::filesystem::path file = is_tiled_map(path) ? whole / kIndexFile : whole;
  struct stat status {};
  if (failed || ::stat(file.c_str(), &status) != 0) {
    return system_error(path, "the file cannot be examined", failed ? failed.value() : errno);
  }
  return Input{
      .path = whole.string(),
      .size = static_cast<std::uint64_t>(status.st_size),
      .modified = std::int64_t{status.st_mtim.tv_sec} * 1'000'000'000 + status.st_mtim.tv_nsec};
}

}  // namespace vantage::io::tiles
