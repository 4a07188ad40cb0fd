// vantage-completion: prints the script with which a shell completes `vantage` and its commands.
#include <iostream>
#include <string>

#include "scripts.hpp"
#include "terminal/command_line.hpp"

int main(int argc, char** argv) {
  CLI::App app("Prints a script that completes jobs, options and their values in a shell.",
               "vantage completion");
  std::string shell;
  app.add_option("SHELL", shell, "the shell: source <(vantage completion bash)")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh"}));
  return vantage::cli::run_program(app, argc, argv, [&]() -> vantage::Result<void> {
    std::cout << (shell == "bash" ? vantage::completion::kBash : vantage::completion::kZsh);
    return {};
  });
}
