#include "temporary_folder.hpp"

#include <doctest/doctest.h>
#include <stdlib.h>

#include <string>
#include <system_error>

namespace vantage::conformance {

TemporaryFolder::TemporaryFolder() {
  std::error_code error;
  const auto parent = std::filesystem::temp_directory_path(error);
  std::string name = (parent / "vantage-conformance-XXXXXX").string();
  if (error || ::mkdtemp(name.data()) == nullptr) FAIL("cannot make a folder in " << parent);
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  if (!path_.empty()) std::filesystem::remove_all(path_, ignored);
}

}  // namespace vantage::conformance
