// vantage-conformance: tests a plugin against the contract of its kind. Every clause runs in a
// process of its own. A clause that crashes or hangs fails, and the others are still checked.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "terminal/command_line.hpp"
#include "terminal/counts.hpp"
#include "vantage/conformance.hpp"
#include "vantage/kit/json_text.hpp"

namespace vantage {
namespace {

using conformance::Clause;
using conformance::Subject;

struct Options {
  std::filesystem::path plugin, params;
  std::uint32_t seed = conformance::kDefaultSeed;
  std::vector<std::string> only;
  double timeout = 300.0;  // [s]
  bool json = false, list = false, quiet = false;
  std::string color = "auto";
};

enum class Outcome { ok, failed, skipped };

const char* to_string(Outcome outcome) {
  switch (outcome) {
    case Outcome::ok: return "ok";
    case Outcome::failed: return "FAILED";
    case Outcome::skipped: return "skipped";
  }
  return "";
}

struct ClauseResult {
  Clause clause;
  Outcome outcome;
  std::string detail;  // why it failed or was skipped
};

/// What this process checks and why it does not apply, stored for doctest's test case, which takes
/// no arguments.
struct Job {
  const Subject* subject;
  const Clause* clause;
  std::string does_not_apply;
};
Job job{};

/// An open file descriptor, closed at the end.
class Descriptor {
 public:
  explicit Descriptor(int value) : value_(value) {}
  ~Descriptor() {
    if (value_ >= 0) close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const noexcept { return value_; }
  [[nodiscard]] bool good() const noexcept { return value_ >= 0; }

 private:
  int value_;
};

/// The mark that a process leaves after it has run a clause to its end. A plugin that ends the
/// process has broken the clause, whatever the exit code.
constexpr char kFinished = 'F';

/// What work in a process of its own tells.
struct Told {
  bool ok;
  std::string why;  // it did not apply
};

/// Runs one clause through doctest.
Told check_clause(const Subject& subject, const Clause& clause) {
  job = {&subject, &clause, ""};
  doctest::Context context;
  context.setOption("no-intro", true);
  context.setOption("no-version", true);
  context.setOption("no-path-filenames", true);
  context.setOption("colors", "false");
  const bool ok = context.run() == 0;
  return {ok, job.does_not_apply};
}

/// Whether a process ends within so many seconds.
bool ends_within(const Descriptor& process, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0) return false;
    pollfd waiting{process.get(), POLLIN, 0};
    if (poll(&waiting, 1, static_cast<int>(left.count())) > 0) return true;
  }
}

/// The whole content of a file.
std::string content(const Descriptor& file) {
  std::string text;
  std::array<char, 4096> buffer{};
  off_t at = 0;
  while (true) {
    const ssize_t n = pread(file.get(), buffer.data(), buffer.size(), at);
    if (n <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(n));
    at += n;
  }
}

/// doctest's report of one test case, without its head, its rule lines and its totals, and without
/// the clause, which stands above it.
std::string failures_in(const std::string& report, const std::string& name) {
  std::istringstream in(report);
  std::string text;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("main.cpp:") || line.starts_with("  " + name)) continue;
    if (line.starts_with("===") || line.starts_with("[doctest]") || line.empty()) continue;
    if (line.starts_with("TEST CASE:") || line.starts_with("(0)") || line == "(0):") continue;
    text += line + "\n";
  }
  return text;
}

/// The outcome of work in a process of its own.
struct Finished {
  bool ok;
  std::string why;             // the work did not apply
  std::string output, defect;  // why it is not ok, if the work did not say so itself
};

/// Runs `work` in a process of its own; ok if the work is and the process ends in time.
Result<Finished> in_process(const std::function<Told()>& work, double timeout) {
  // Files in memory, not pipes: otherwise a process that keeps a pipe's end open, or closes it,
  // would decide when this ends.
  const Descriptor output(memfd_create("output", MFD_CLOEXEC));
  const Descriptor verdict(memfd_create("verdict", MFD_CLOEXEC));
  std::cout.flush();
  const pid_t child = output.good() && verdict.good() ? fork() : -1;
  if (child == 0) {
    setpgid(0, 0);  // so that processes that the plugin starts end with it
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(output.get(), STDOUT_FILENO);
    dup2(output.get(), STDERR_FILENO);
    const Told told = work();
    std::cout.flush();
    const std::string mark = kFinished + told.why;
    const bool written =
        write(verdict.get(), mark.data(), mark.size()) == static_cast<ssize_t>(mark.size());
    std::_Exit(written && told.ok ? EXIT_SUCCESS : EXIT_FAILURE);
  }
  const Descriptor process(child > 0 ? static_cast<int>(syscall(SYS_pidfd_open, child, 0)) : -1);
  if (!process.good()) {
    return fail(ErrorCode::io_failure,
                std::string("cannot start a process: ") + std::strerror(errno));
  }
  const bool ended = ends_within(process, timeout);
  kill(-child, SIGKILL);
  kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  Finished finished{false, "", content(output), ""};
  const std::string mark = content(verdict);
  if (!ended) {
    finished.defect = fmt::format("did not end within {} s", timeout);
  } else if (WIFSIGNALED(status)) {
    finished.defect =
        fmt::format("ended by signal {} ({})", WTERMSIG(status), strsignal(WTERMSIG(status)));
  } else if (!mark.starts_with(kFinished)) {
    finished.defect =
        fmt::format("the plugin ended the process, with exit code {}", WEXITSTATUS(status));
  } else {
    finished.ok = WEXITSTATUS(status) == 0;
    finished.why = mark.substr(1);
  }
  return finished;
}

/// Opening a plugin runs its constructors, so a separate process opens it first, where they can do
/// no harm.
Result<Subject> load(const Options& options) {
  const auto open = [&] { return Subject::from(options.plugin, options.params, options.seed); };
  VANTAGE_TRY(const Finished tried, in_process(
                                        [&] {
                                          // The second call reports any error.
                                          static_cast<void>(open());
                                          return Told{true, ""};
                                        },
                                        options.timeout));
  if (!tried.ok) {
    return fail(ErrorCode::incompatible_plugin,
                options.plugin.string() + ": cannot be loaded: " + tried.defect);
  }
  return open();
}

Result<ClauseResult> run_clause(const Subject& subject, const Clause& clause, double timeout) {
  VANTAGE_TRY(const Finished finished,
              in_process([&] { return check_clause(subject, clause); }, timeout));
  if (finished.ok) {
    const Outcome outcome = finished.why.empty() ? Outcome::ok : Outcome::skipped;
    return ClauseResult{clause, outcome, finished.why};
  }
  std::string detail = failures_in(finished.output, conformance::subcase_name(clause));
  if (!finished.defect.empty()) detail += finished.defect + "\n";
  if (detail.empty()) detail = "failed without saying why\n";
  return ClauseResult{clause, Outcome::failed, std::move(detail)};
}

std::string styled(Outcome outcome, const cli::Style& style) {
  const std::string text = fmt::format("{:<8}", to_string(outcome));
  switch (outcome) {
    case Outcome::ok: return style.good(text);
    case Outcome::failed: return style.bad(text);
    case Outcome::skipped: return style.dim(text);
  }
  return text;
}

void print(const ClauseResult& result, const cli::Style& style) {
  std::cout << fmt::format("{} {:<4} {}\n", styled(result.outcome, style), result.clause.id,
                           result.clause.text);
  std::istringstream lines(result.detail);
  for (std::string line; std::getline(lines, line);) std::cout << "              " << line << '\n';
  std::cout.flush();
}

nlohmann::ordered_json to_json(const Subject& subject, const std::vector<ClauseResult>& results) {
  nlohmann::ordered_json clauses = nlohmann::ordered_json::array();
  for (const ClauseResult& r : results) {
    nlohmann::ordered_json clause{
        {"id", r.clause.id},
        {"text", r.clause.text},
        {"outcome", r.outcome == Outcome::failed ? "failed" : to_string(r.outcome)}};
    if (!r.detail.empty()) clause["detail"] = r.detail;
    clauses.push_back(std::move(clause));
  }
  return {{"kind", to_string(subject.info().kind)},
          {"name", subject.info().name},
          {"file", subject.info().path.string()},
          {"seed", subject.seed()},
          {"clauses", std::move(clauses)}};
}

Result<void> list_clauses(const Options& options) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for_each_kind([&](const auto& kind) {
    for (const Clause& clause : conformance::clauses_of(kind.kind)) {
      const bool common = clause.id.starts_with('C');
      if (common && kind.kind != PluginKind{}) continue;  // listed with the first kind
      all.push_back(
          {{"id", clause.id}, {"kind", common ? "every kind" : kind.name}, {"text", clause.text}});
    }
  });
  if (options.json) {
    std::cout << json_text(all);
  } else {
    for (const auto& clause : all) {
      std::cout << fmt::format("{:<4} {:<12} {}\n", clause["id"].get<std::string>(),
                               clause["kind"].get<std::string>(),
                               clause["text"].get<std::string>());
    }
  }
  return {};
}

Result<void> run(const Options& options) {
  if (options.list) return list_clauses(options);
  if (options.plugin.empty() || options.params.empty()) {
    return cli::usage_error("PLUGIN and PARAMS are required");
  }
  VANTAGE_TRY(const Subject subject, load(options));
  const auto clauses = conformance::clauses_of(subject.info().kind);
  std::vector<std::string> ids;
  for (const Clause& clause : clauses) ids.emplace_back(clause.id);
  for (const std::string& id : options.only) {
    if (std::find(ids.begin(), ids.end(), id) == ids.end()) {
      return cli::usage_error(std::string("a ") + to_string(subject.info().kind) +
                              " has no clause '" + id + "'" + did_you_mean(id, ids));
    }
  }
  if (!options.json && !options.quiet) {
    std::cout << to_string(subject.info().kind) << " '" << subject.info().name << "', "
              << subject.info().path.string() << "\nparameters of " << options.params.string()
              << ", random cases from --seed " << subject.seed() << "\n\n";
  }
  const cli::Style style = cli::Style::of(STDOUT_FILENO, options.color);
  std::vector<ClauseResult> results;
  for (const Clause& clause : clauses) {
    if (!options.only.empty() &&
        std::find(options.only.begin(), options.only.end(), clause.id) == options.only.end()) {
      continue;
    }
    VANTAGE_TRY(const auto& result, run_clause(subject, clause, options.timeout));
    results.push_back(result);
    const bool told = !options.quiet || results.back().outcome == Outcome::failed;
    if (told && !options.json) print(results.back(), style);
  }
  const auto count = [&](Outcome outcome) {
    return std::count_if(results.begin(), results.end(),
                         [&](const ClauseResult& r) { return r.outcome == outcome; });
  };
  if (options.json) {
    std::cout << json_text(to_json(subject, results));
  } else {
    std::cout << fmt::format("\n{}: {} ok, {} failed, {} skipped\n",
                             cli::counted(results.size(), "clause"), count(Outcome::ok),
                             count(Outcome::failed), count(Outcome::skipped));
  }
  if (const auto failed = count(Outcome::failed); failed > 0) {
    return fail(ErrorCode::invalid_input,
                fmt::format("{} '{}' breaks {} of {}", to_string(subject.info().kind),
                            subject.info().name, failed, cli::counted(results.size(), "clause")));
  }
  return {};
}

}  // namespace
}  // namespace vantage

TEST_CASE("conformance") {
  vantage::job.does_not_apply =
      vantage::conformance::check(*vantage::job.subject, *vantage::job.clause);
}

int main(int argc, char** argv) {
  CLI::App app("Checks a plugin against the contract of its kind, clause by clause.",
               "vantage-conformance");
  vantage::Options options;
  app.add_option("PLUGIN", options.plugin, "plugin file (.so)");
  app.add_option("PARAMS", options.params, "TOML file: [params] of the plugin and its [claims]");
  app.add_option("--seed", options.seed, "seed of the random cases")->capture_default_str();
  app.add_option("--clause", options.only, "check only this clause; can be repeated")
      ->type_name("ID")
      ->allow_extra_args(false);
  app.add_option("--timeout", options.timeout,
                 "time limit of a clause [s]; a clause that takes longer fails")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1e6));
  app.add_flag("--list", options.list, "list the clauses of every kind and check nothing");
  app.add_flag("--quiet,-q", options.quiet, "print only failed clauses and their number");
  app.add_flag("--json", options.json, "results as JSON on stdout");
  vantage::cli::add_color_option(app, options.color);
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
