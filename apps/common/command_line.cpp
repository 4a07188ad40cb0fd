#include "common/command_line.hpp"

#include <tbb/global_control.h>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <optional>
#include <thread>

#include "common/completion.hpp"

namespace vantage::cli {
namespace {
constexpr const char* kUsageContext = "reading the command line; see --help";

/// Set while a program does its job: who calls exit() then is not the program.
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

/// The last words of a process in which an exception has left a noexcept function. The message is
/// what its user needs; without this, it would end with a signal and a core dump, or with nothing.
[[noreturn]] void end_with_message() {
  // Several threads may come here at once; one speaks, and ends them all.
  static std::atomic_flag speaking;
  while (speaking.test_and_set()) std::this_thread::sleep_for(std::chrono::seconds(1));
  const std::exception_ptr exception = std::current_exception();
  if (!exception) {
    std::cerr << "error: the program was ended from inside (std::terminate without an exception)"
              << std::endl;
    std::_Exit(kFailed);
  }
  std::string what = "an exception of unknown type";
  try {
    std::rethrow_exception(exception);
  } catch (const std::exception& e) {
    what = e.what();
  } catch (...) {  // its type is all that is not known
  }
  std::cerr << "error: an exception left a function that must not throw, most likely a plugin's: "
            << what << std::endl;
  std::_Exit(kFailed);
}

}  // namespace

void CommonOptions::add_to(CLI::App& app) {
  app.add_option("--set", overrides, "override a key of the configuration: table.key=value")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--plugin-dir", plugin_dirs,
                 "look for plugins here first (then $VANTAGE_PLUGIN_PATH, then beside the library)")
      ->type_name("DIR")
      ->check(CLI::ExistingDirectory)
      ->allow_extra_args(false);
  app.add_option("--jobs,-j", jobs, "threads; 0 for all cores")->capture_default_str();
  app.add_flag("--quiet,-q", quiet, "no progress on stderr");
  app.add_flag("--json", json, "results as JSON on stdout");
}

struct ThreadLimit::Control {
  std::optional<tbb::global_control> limit;
};

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

int run_program(CLI::App& app, int argc, char** argv, const std::function<Result<void>()>& run) {
  std::set_terminate(&end_with_message);
  if (argc == 2 && argv[1] == std::string_view(kCompletionQuery)) {
    std::cout << completion_table(app);
    return EXIT_SUCCESS;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? EXIT_SUCCESS : kUsage;
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
      std::cerr << "error: cannot write to standard output\n";
      return kFailed;
    }
    std::cerr << done.error() << '\n';
    const auto& context = done.error().context;
    return !context.empty() && context.front() == kUsageContext ? kUsage : kFailed;
  } catch (const std::bad_alloc&) {
    std::cerr << "error: out of memory\n";
  } catch (const std::exception& e) {
    std::cerr << "error: " << e.what() << '\n';
  }
  return kFailed;
}

}  // namespace vantage::cli
