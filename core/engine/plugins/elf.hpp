#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "vantage/plugin.hpp"

/// Reads a plugin file as data. Nothing in an ELF file may be called before its manifest has been
/// read, but the dynamic linker runs its constructors. So everything that the bytes can tell is
/// read from the bytes.
namespace vantage::elf {

/// What would crash the dynamic linker (SIGBUS if the file is shorter than its headers promise); ""
/// for a file that it can open.
[[nodiscard]] std::string defect(const std::filesystem::path& file);

/// The members of PluginManifest that never move.
struct ManifestHead {
  std::uint64_t magic, size;
  AbiTag abi;
};

/// What a file says about its manifest.
struct Inspection {
  bool has_symbols = false;  ///< false for a file without section headers
  bool has_manifest = false;
  std::optional<ManifestHead> head;
};

/// Precondition: `defect(file)` is "".
[[nodiscard]] Inspection inspect(const std::filesystem::path& file);

/// The name behind a mangled symbol, for people: "defined_nowhere()".
[[nodiscard]] std::string demangled(const std::string& symbol);

}  // namespace vantage::elf
