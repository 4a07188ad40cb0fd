#include "vantage/error.hpp"

#include <dlfcn.h>

#include <exception>
#include <filesystem>
#include <new>
#include <ostream>
#include <sstream>
#include <utility>

#include "vantage/plugin.hpp"

namespace vantage {

Error Error::during(std::string activity) && {
  context.push_back(std::move(activity));
  return std::move(*this);
}

const char* to_string(ErrorCode code) noexcept {
  switch (code) {
    case ErrorCode::invalid_input: return "invalid_input";
    case ErrorCode::invalid_config: return "invalid_config";
    case ErrorCode::not_found: return "not_found";
    case ErrorCode::already_exists: return "already_exists";
    case ErrorCode::io_failure: return "io_failure";
    case ErrorCode::corrupt_data: return "corrupt_data";
    case ErrorCode::incompatible_plugin: return "incompatible_plugin";
    case ErrorCode::too_few_matches: return "too_few_matches";
    case ErrorCode::unsupported: return "unsupported";
    case ErrorCode::internal: return "internal";
  }
  return "unknown";
}

std::ostream& operator<<(std::ostream& out, const SourceLocation& where) {
  out << where.file;
  if (where.line > 0) out << ':' << where.line;
  if (where.line > 0 && where.column > 0) out << ':' << where.column;
  return out;
}

std::ostream& operator<<(std::ostream& out, const Error& error) {
  if (error.where) out << *error.where << ": ";
  out << "error: " << error.message;
  for (std::size_t i = 0; i < error.context.size(); ++i) {
    out << (i == 0 ? " (while " : "; while ") << error.context[i];
  }
  if (!error.context.empty()) out << ')';
  return out;
}

std::string to_string(const Error& error) {
  std::ostringstream out;
  out << error;
  return out.str();
}

tl::unexpected<Error> caught_in(const void* code) noexcept {
  Error error{.code = ErrorCode::internal, .message = {}, .where = {}, .context = {}};
  try {
    Dl_info library{};
    const char* const path = dladdr(code, &library) != 0 ? library.dli_fname : "";
    const std::string file = std::filesystem::path(path).filename();
    if (file.starts_with("vantage_")) error.context.push_back("running " + file);
    throw;
  } catch (const std::bad_alloc&) {
    error.message = "out of memory";  // so short that it needs none
  } catch (const std::exception& e) {
    error.message = e.what();
  } catch (...) {
    error.message = "an exception of unknown type";
  }
  return fail(std::move(error));
}

}  // namespace vantage
