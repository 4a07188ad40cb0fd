// vantage-conformance: holds a plugin to the contract of its kind. Every clause runs in a process
// of its own, so one that crashes or hangs fails and the others are still checked.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "common/command_line.hpp"
#include "vantage/conformance.hpp"

namespace vantage {
namespace {

using conformance::Clause;
using conformance::Subject;

struct Options {
  std::filesystem::path plugin, params;
  std::uint32_t seed = conformance::kDefaultSeed;
  std::vector<std::string> only;
  double timeout = 300.0;  // [s]
  bool json = false, list = false;
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

/// What this process checks, for doctest's test case, which takes no arguments.
struct Job {
  const Subject* subject;
  const Clause* clause;
};
Job job{};

/// In the child: one clause through doctest, and the end of the process.
[[noreturn]] void run_clause_and_exit(const Subject& subject, const Clause& clause) {
  job = {&subject, &clause};
  doctest::Context context;
  context.setOption("no-intro", true);
  context.setOption("no-version", true);
  context.setOption("no-path-filenames", true);
  context.setOption("colors", "false");
  const int failed = context.run();
  std::cout.flush();
  std::_Exit(failed);
}

/// What a process writes until it closes its end; none if it goes on for longer than `seconds`.
std::optional<std::string> read_all(int descriptor, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  std::string text;
  std::array<char, 4096> buffer{};
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now());
    if (left.count() <= 0) return std::nullopt;
    pollfd waiting{descriptor, POLLIN, 0};
    const int ready = poll(&waiting, 1, static_cast<int>(std::min<long>(left.count(), 1 << 30)));
    if (ready < 0 && errno != EINTR) return text;
    if (ready <= 0) continue;
    const ssize_t n = read(descriptor, buffer.data(), buffer.size());
    if (n <= 0) return text;
    text.append(buffer.data(), static_cast<std::size_t>(n));
  }
}

/// doctest's report of one test case, without its head, its rule lines and its totals.
std::string failures_in(const std::string& report) {
  std::istringstream in(report);
  std::string text;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("===") || line.starts_with("[doctest]") || line.empty()) continue;
    if (line.starts_with("TEST CASE:") || line.starts_with("(0)") || line == "(0):") continue;
    text += line + "\n";
  }
  return text;
}

Result<ClauseResult> run_clause(const Subject& subject, const Clause& clause, double timeout) {
  if (clause.exemption) {
    if (std::string reason = clause.exemption(subject); !reason.empty()) {
      return ClauseResult{clause, Outcome::skipped, std::move(reason)};
    }
  }
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return fail(ErrorCode::io_failure, std::string("pipe: ") + std::strerror(errno));
  }
  std::cout.flush();
  const pid_t child = fork();
  if (child < 0) return fail(ErrorCode::io_failure, std::string("fork: ") + std::strerror(errno));
  if (child == 0) {
    dup2(ends[1], STDOUT_FILENO);
    dup2(ends[1], STDERR_FILENO);
    run_clause_and_exit(subject, clause);
  }
  close(ends[1]);
  const auto report = read_all(ends[0], timeout);
  close(ends[0]);
  if (!report) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!report) {
    return ClauseResult{clause, Outcome::failed, fmt::format("did not end within {} s\n", timeout)};
  }
  if (WIFSIGNALED(status)) {
    return ClauseResult{
        clause, Outcome::failed,
        failures_in(*report) + fmt::format("ended by signal {} ({})\n", WTERMSIG(status),
                                           strsignal(WTERMSIG(status)))};
  }
  const bool ok = WEXITSTATUS(status) == 0;
  return ClauseResult{clause, ok ? Outcome::ok : Outcome::failed, ok ? "" : failures_in(*report)};
}

void print(const ClauseResult& result) {
  std::cout << fmt::format("{:<8} {:<4} {}\n", to_string(result.outcome), result.clause.id,
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
  for (std::size_t kind = 0; kind < kPluginKinds; ++kind) {
    const auto name = to_string(static_cast<PluginKind>(kind));
    for (const Clause& clause : conformance::clauses_of(static_cast<PluginKind>(kind))) {
      const bool common = clause.id.starts_with('C');
      if (common && kind > 0) continue;
      all.push_back(
          {{"id", clause.id}, {"kind", common ? "every kind" : name}, {"text", clause.text}});
    }
  }
  if (options.json) {
    std::cout << all.dump(2) << '\n';
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
  VANTAGE_TRY(const Subject subject, Subject::from(options.plugin, options.params, options.seed));
  const auto clauses = conformance::clauses_of(subject.info().kind);
  std::vector<std::string> ids;
  for (const Clause& clause : clauses) ids.emplace_back(clause.id);
  for (const std::string& id : options.only) {
    if (std::find(ids.begin(), ids.end(), id) == ids.end()) {
      return cli::usage_error(std::string("a ") + to_string(subject.info().kind) +
                              " has no clause '" + id + "'" + did_you_mean(id, ids));
    }
  }
  if (!options.json) {
    std::cout << to_string(subject.info().kind) << " '" << subject.info().name << "', "
              << subject.info().path.string() << "\nparameters of " << options.params.string()
              << ", random cases from --seed " << subject.seed() << "\n\n";
  }
  std::vector<ClauseResult> results;
  for (const Clause& clause : clauses) {
    if (!options.only.empty() &&
        std::find(options.only.begin(), options.only.end(), clause.id) == options.only.end()) {
      continue;
    }
    VANTAGE_TRY(const auto& result, run_clause(subject, clause, options.timeout));
    results.push_back(result);
    if (!options.json) print(results.back());
  }
  const auto count = [&](Outcome outcome) {
    return std::count_if(results.begin(), results.end(),
                         [&](const ClauseResult& r) { return r.outcome == outcome; });
  };
  if (options.json) {
    std::cout << to_json(subject, results).dump(2) << '\n';
  } else {
    std::cout << fmt::format("\n{} clauses: {} ok, {} failed, {} skipped\n", results.size(),
                             count(Outcome::ok), count(Outcome::failed), count(Outcome::skipped));
  }
  if (const auto failed = count(Outcome::failed); failed > 0) {
    return fail(ErrorCode::invalid_input,
                fmt::format("{} '{}' breaks {} of {} clauses", to_string(subject.info().kind),
                            subject.info().name, failed, results.size()));
  }
  return {};
}

}  // namespace
}  // namespace vantage

TEST_CASE("conformance") {
  vantage::conformance::check(*vantage::job.subject, *vantage::job.clause);
}

int main(int argc, char** argv) {
  CLI::App app("Holds a plugin to the contract of its kind, clause by clause.",
               "vantage-conformance");
  vantage::Options options;
  app.add_option("PLUGIN", options.plugin, "plugin file (.so)");
  app.add_option("PARAMS", options.params, "TOML file: [params] of the plugin and its [claims]");
  app.add_option("--seed", options.seed, "seed of the random cases")->capture_default_str();
  app.add_option("--clause", options.only, "check only this clause; may be given again")
      ->type_name("ID")
      ->allow_extra_args(false);
  app.add_option("--timeout", options.timeout, "a clause that takes longer has failed [s]")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_flag("--list", options.list, "list the clauses of every kind and check nothing");
  app.add_flag("--json", options.json, "results as JSON on stdout");
  return vantage::cli::run_program(app, argc, argv, [&] { return vantage::run(options); });
}
