#include "terminal/command_line.hpp"

#include <execinfo.h>
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <span>
#include <sstream>
#include <thread>

#include "terminal/completion.hpp"
#include "terminal/option_values.hpp"
#include "vantage/plugin.hpp"

namespace vantage::cli {
namespace {
constexpr const char* kColor = "--color";
constexpr const char* kUsageContext = "reading the command line; see --help";

/// Set while a program does its work: a call of exit() then does not come from the program itself.
std::atomic<bool> at_work{false};

struct AtWork {
  AtWork() { at_work = true; }
  ~AtWork() { at_work = false; }
};

void refuse_to_exit() {
  if (!at_work) return;
  std::cerr << "error: the program was ended by exit(), most likely by a plugin" << std::endl;
  std::_Exit(kFailed);
}

/// The exception at hand, with the plugin whose function is the innermost that is running, if any.
Error caught_here() {
  std::array<void*, 128> callers{};
  const int count = ::backtrace(callers.data(), static_cast<int>(callers.size()));
  for (const void* code : std::span(callers).first(static_cast<std::size_t>(std::max(count, 0)))) {
    if (const auto caught = caught_in(code); !caught.value().context.empty()) {
      return caught.value();
    }
  }
  return caught_in(nullptr).value();
}

/// The last message of a process in which an exception has left a noexcept function. The user needs
/// this message. Without it, the process would end with a signal and a core dump, or silently.
[[noreturn]] void end_with_message() {
  // Several threads may come here at once; one of them prints and ends the process.
  static std::atomic_flag speaking;
  while (speaking.test_and_set()) std::this_thread::sleep_for(std::chrono::seconds(1));
  if (!std::current_exception()) {
    std::cerr << "error: the program was ended from inside (std::terminate without an exception)"
              << std::endl;
    std::_Exit(kFailed);
  }
  Error error = caught_here();
  error.message = "an exception left a function that must not throw: " + error.message;
  std::cerr << to_string(error) << std::endl;
  std::_Exit(kFailed);
}

/// The value of `--color`, given to the program or to the subcommand.
std::string color_of(const CLI::App& app) {
  const CLI::Option* option = app.get_option_no_throw(kColor);
  if (option != nullptr && option->count() > 0) return option->results().front();
  for (const CLI::App* job : app.get_subcommands()) return color_of(*job);
  return "auto";
}

void print_error(const CLI::App& app, const Error& error) {
  std::cerr << to_string(error, Style::of(STDERR_FILENO, color_of(app))) << '\n';
}

void print_error(const CLI::App& app, std::string message) {
  print_error(
      app,
      Error{
          .code = ErrorCode::internal, .message = std::move(message), .where = {}, .context = {}});
}

/// Help that is the same for every version of CLI11: since 2.4, defaults stand in brackets.
class Help final : public CLI::Formatter {
 public:
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text = CLI::Formatter::make_option_opts(option);
    const std::string bracketed = " [" + option->get_default_str() + "] ";
    if (const auto at = text.find(bracketed); at != std::string::npos) {
      text.replace(at, bracketed.size(), "=" + option->get_default_str());
    }
    return text;
  }
};

void set_help(CLI::App& app, const std::shared_ptr<Help>& help) {
  app.formatter(help);
  for (CLI::App* const job : app.get_subcommands({})) set_help(*job, help);
}

}  // namespace

void CommonOptions::add_to(CLI::App& app) {
  app.add_option("--set", overrides, "override a key of the configuration: table.key=value")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  add_plugin_folders_option(app, plugin_dirs);
  constexpr std::uint64_t kMostJobs = 4096;
  app.add_option("--jobs,-j", jobs, "threads; 0 for all cores")
      ->check(whole_number(0, kMostJobs))
      ->capture_default_str();
  app.add_flag("--quiet,-q", quiet, "no progress on stderr");
  app.add_flag("--json", json, "results as JSON on stdout");
  add_color_option(app, color);
}

Style CommonOptions::style() const { return Style::of(STDOUT_FILENO, color); }

void add_plugin_folders_option(CLI::App& app, std::vector<std::filesystem::path>& folders,
                               const std::string& description) {
  app.add_option("--plugin-dir", folders, description)
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory)
      ->allow_extra_args(false);
}

void add_color_option(CLI::App& app, std::string& color) {
  app.add_option(kColor, color, "colours: auto means on a terminal, unless NO_COLOR is set")
      ->check(CLI::IsMember({"auto", "always", "never"}))
      ->capture_default_str();
}

struct ThreadLimit::Control {
  std::optional<tbb::global_control> limit;
};

Result<Pose> parse_pose(std::string_view option, const std::string& text,
                        std::string_view or_else) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = text.data() + text.size();
  while (at <= end) {
    double x = 0;
    const auto [stop, error] = std::from_chars(at, end, x);
    if (error != std::errc{} || !std::isfinite(x) || (stop != end && *stop != ',')) break;
    numbers.push_back(x);
    at = stop + 1;
  }
  if (at != end + 1 || numbers.size() != 6) {
    return usage_error(fmt::format("{} takes six numbers x,y,z,roll,pitch,yaw [m, rad]{}, not '{}'",
                                   option, or_else, text));
  }
  for (std::size_t i = 3; i < 6; ++i) {
    if (std::abs(numbers[i]) > 2.0 * M_PI) {
      return usage_error(
          fmt::format("{} takes angles in radians; {} is more than a turn", option, numbers[i]));
    }
  }
  return pose_from_xyz_rpy({numbers[0], numbers[1], numbers[2]},
                           {numbers[3], numbers[4], numbers[5]});
}

ThreadLimit::ThreadLimit(std::size_t jobs) : control_(std::make_unique<Control>()) {
  if (jobs > 0) control_->limit.emplace(tbb::global_control::max_allowed_parallelism, jobs);
}
ThreadLimit::~ThreadLimit() = default;

tl::unexpected<Error> usage_error(std::string message) {
  return fail(Error{.code = ErrorCode::invalid_input,
                    .message = std::move(message),
                    .where = {},
                    .context = {kUsageContext}});
}

std::string to_string(const Error& error, const Style& style) {
  constexpr std::string_view kWord = "error:";
  std::string text = vantage::to_string(error);
  std::size_t at = 0;
  if (error.where) {
    std::ostringstream where;
    where << *error.where << ": ";
    at = where.str().size();
  }
  return text.replace(at, kWord.size(), style.bad(kWord));
}

int run_program(CLI::App& app, int argc, char** argv, const std::function<Result<void>()>& run) {
  std::set_terminate(&end_with_message);
  if (argc == 2 && argv[1] == std::string_view(kCompletionQuery)) {
    std::cout << completion_table(app);
    return EXIT_SUCCESS;
  }
  set_help(app, std::make_shared<Help>());
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);  // --help
    print_error(app, usage_error(e.what()).value());
    return kUsage;
  }
  if (const auto sound = check_values(app); !sound) {
    print_error(app, sound.error());
    return kUsage;
  }
  std::atexit(&refuse_to_exit);
  try {
    const Result<void> done = [&] {
      const AtWork now;
      return run();
    }();
    if (done) {
      std::cout.flush();
      if (std::cout) return EXIT_SUCCESS;
      print_error(app, "cannot write to standard output");
      return kFailed;
    }
    print_error(app, done.error());
    const auto& context = done.error().context;
    return !context.empty() && context.front() == kUsageContext ? kUsage : kFailed;
  } catch (const std::bad_alloc&) {
    print_error(app, "out of memory");
  } catch (const std::exception& e) {
    print_error(app, e.what());
  }
  return kFailed;
}

}  // namespace vantage::cli
