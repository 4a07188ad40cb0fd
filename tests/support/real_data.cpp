#include "support/real_data.hpp"

#include <cstdlib>
#include <iostream>
#include <stdexcept>

namespace vantage::test {

std::optional<std::filesystem::path> real_data(const std::string& relative) {
  const char* folder = std::getenv("VANTAGE_DATA_DIR");
  const std::filesystem::path path =
      std::filesystem::path(folder != nullptr ? folder : VANTAGE_DEFAULT_DATA_DIR) / relative;
  if (std::filesystem::exists(path)) return path;
  std::cout << "SKIPPED: no recorded data at " << path.string()
            << " (set VANTAGE_DATA_DIR to the folder that holds it)\n";
  return std::nullopt;
}

TemporaryFolder::TemporaryFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "vantage-test-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot create " + name);
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace vantage::test
