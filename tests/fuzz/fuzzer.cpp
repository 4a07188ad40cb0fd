// A libFuzzer program for one of the targets: VANTAGE_FUZZ_TARGET is its name. With --seeds DIR it
// writes the target's seeds there instead.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

#include "targets.hpp"

namespace {

const vantage::test::FuzzTarget& target() {
  static const auto& found = [&]() -> const vantage::test::FuzzTarget& {
    for (const auto& candidate : vantage::test::fuzz_targets()) {
      if (candidate.name == VANTAGE_FUZZ_TARGET) return candidate;
    }
    std::fputs("no target is called " VANTAGE_FUZZ_TARGET "\n", stderr);
    std::abort();
  }();
  return found;
}

void write_seeds(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  int number = 0;
  for (const std::string& seed : target().seeds()) {
    std::ofstream(folder / ("seed" + std::to_string(number++)), std::ios::binary) << seed;
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  if (*argc == 3 && std::strcmp((*argv)[1], "--seeds") == 0) {
    write_seeds((*argv)[2]);
    std::exit(0);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto error = target().run({reinterpret_cast<const char*>(data), size});
  // An error that does not say where, or that would break a line of output, is a finding too.
  if (error && (to_string(*error).find(vantage::test::kFuzzedFile) == std::string::npos ||
                to_string(*error).find('\n') != std::string::npos)) {
    std::fprintf(stderr, "not a clear error: %s\n", to_string(*error).c_str());
    std::abort();
  }
  return 0;
}
