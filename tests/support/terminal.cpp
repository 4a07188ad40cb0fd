#include "support/terminal.hpp"

#include <pty.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iostream>
#include <stdexcept>

namespace vantage::test {

bool terminals_exist() {
  int terminal = -1, other_end = -1;
  if (::openpty(&terminal, &other_end, nullptr, nullptr, nullptr) != 0) {
    std::cout << "SKIPPED: there is no pseudo-terminal: " << std::strerror(errno)
              << " (is /dev/pts mounted?)\n";
    return false;
  }
  ::close(terminal);
  ::close(other_end);
  return true;
}

std::string on_terminal(const std::string& program, std::vector<std::string> arguments,
                        unsigned short columns,
                        const std::map<std::string, std::string>& environment) {
  const winsize size{24, columns, 0, 0};
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, &size);
  if (child < 0) throw std::runtime_error("there is no pseudo-terminal");
  if (child == 0) {
    ::unsetenv("NO_COLOR");
    for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
    const std::string path = (std::filesystem::path(VANTAGE_PROGRAM_DIR) / program).string();
    std::vector<char*> argv{const_cast<char*>(path.c_str())};
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    ::execv(path.c_str(), argv.data());
    ::_exit(127);
  }
  std::string text;
  std::array<char, 4096> buffer{};
  while (true) {
    const ssize_t n = ::read(terminal, buffer.data(), buffer.size());
    if (n <= 0) break;
    text.append(buffer.data(), static_cast<std::size_t>(n));
  }
  ::close(terminal);
  int status = 0;
  ::waitpid(child, &status, 0);
  std::erase(text, '\r');
  return text;
}

}  // namespace vantage::test
