#include "terminal/completion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "terminal/table.hpp"

namespace vantage::cli {
namespace {

std::string value_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t open = type.find('{'), close = type.find('}');
  if (open != std::string::npos && close != std::string::npos && open < close) {
    return type.substr(open, close - open + 1);
  }
  const std::string name = type.substr(0, type.find_first_of(":("));
  if (name == "DIR" || name == "PLUGIN") return name == "DIR" ? "dir" : "plugin";
  return name.empty() || name == "FILE" || name == "TEXT" || name == "PATH" ? "file" : "word";
}

std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  return names;
}

std::string line(const std::string& job, const std::string& what, const std::string& names,
                 const std::string& value, bool many, const std::string& help) {
  return fmt::format("{}\t{}\t{}\t{}\t{}\t{}\n", job, what, names, value, many ? "many" : "one",
                     help.empty() ? "-" : one_line(help));
}

std::string lines_of(const CLI::App& app, const std::string& job) {
  std::string text;
  for (const CLI::Option* option : app.get_options()) {
    const bool flag = option->get_items_expected_max() == 0;
    const std::string value = flag ? "none" : value_of(*option);
    if (option->get_positional()) {
      text += line(job, "argument", option->get_name(true), value,
                   option->get_items_expected_max() > 1, option->get_description());
    } else {
      text +=
          line(job, flag ? "flag" : "option", fmt::format("{}", fmt::join(names_of(*option), ",")),
               value, false, option->get_description());
    }
  }
  return text;
}

}  // namespace

std::string completion_table(const CLI::App& app) {
  std::string text = lines_of(app, ".");
  const auto any = [](const CLI::App*) { return true; };
  for (const CLI::App* job : app.get_subcommands(any)) {
    text += line(".", "command", job->get_name(), "none", false, job->get_description());
  }
  for (const CLI::App* job : app.get_subcommands(any)) text += lines_of(*job, job->get_name());
  return text;
}

}  // namespace vantage::cli
