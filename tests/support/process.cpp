#include "support/process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

namespace vantage::test {

std::string read_text(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) throw std::runtime_error("cannot read " + path.string());
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream out(path, std::ios::binary);
  out << text;
  if (!out.flush()) throw std::runtime_error("cannot write " + path.string());
}

Running::Running(const std::string& program, const std::vector<std::string>& arguments) {
  const std::string path = (std::filesystem::path(VANTAGE_PROGRAM_DIR) / program).string();
  const std::string out = (folder_.path() / "out").string(),
                    err = (folder_.path() / "err").string();

  std::vector<char*> argv{const_cast<char*>(path.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT, 0600);
  const int failed = posix_spawn(&child_, path.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed != 0) throw std::runtime_error("cannot run " + path);
}

Running::~Running() {
  if (child_ == 0) return;
  kill(child_, SIGKILL);
  waitpid(child_, nullptr, 0);
}

void Running::signal(int number) const { kill(child_, number); }

std::string Running::err() const { return read_text(folder_.path() / "err"); }

bool Running::says(const std::string& text) const {
  while (true) {
    siginfo_t state{};
    waitid(P_PID, static_cast<id_t>(child_), &state, WEXITED | WNOHANG | WNOWAIT);
    const bool ended = state.si_pid == child_;
    if (err().find(text) != std::string::npos) return true;
    if (ended) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

Finished Running::wait() {
  int status = 0;
  rusage usage{};
  wait4(std::exchange(child_, 0), &status, 0, &usage);
  Finished finished;
  finished.peak_memory = 1024 * static_cast<std::uint64_t>(usage.ru_maxrss);
  finished.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  finished.out = read_text(folder_.path() / "out");
  finished.err = read_text(folder_.path() / "err");
  return finished;
}

Finished run(const std::string& program, const std::vector<std::string>& arguments) {
  return Running(program, arguments).wait();
}

}  // namespace vantage::test
