#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "vantage/plugin.hpp"

/// Reads a plugin file as data. Nothing of an ELF file can be called before its manifest has been
/// read, and the dynamic linker runs its constructors: so what can be told from the bytes is.
namespace vantage::elf {

/// What the dynamic linker would die of (SIGBUS where the file is shorter than its headers
/// promise); "" for a file it can take.
[[nodiscard]] std::string defect(const std::filesystem::path& file);

/// The members of PluginManifest that never move.
struct ManifestHead {
  std::uint64_t magic, size;
  AbiTag abi;
};

/// What a file says of its manifest.
struct Inspection {
  bool has_symbols = false;  ///< false for a file without section headers: nothing is known
  bool has_manifest = false;
  std::optional<ManifestHead> head;
};

/// Precondition: `defect(file)` is "".
[[nodiscard]] Inspection inspect(const std::filesystem::path& file);

/// The name behind a mangled symbol, for people: "defined_nowhere()".
[[nodiscard]] std::string demangled(const std::string& symbol);

}  // namespace vantage::elf
