#include "terminal/completion.hpp"

#include <doctest/doctest.h>

#include <filesystem>

using namespace vantage::cli;

TEST_CASE("what can follow a program: names, values, choices, jobs") {
  CLI::App app("A program.", "program");
  std::filesystem::path file;
  std::vector<std::string> many;
  std::string color, text;
  double number = 0;
  bool flag = false;
  app.add_option("FILE", file, "a file");
  app.add_option("--color", color, "a\tcolour\nof two")->check(CLI::IsMember({"red", "blue"}));
  app.add_option("--number,-n", number, "[m]")->check(CLI::PositiveNumber);
  app.add_option("--key", text, "")->type_name("KEY=VALUE");
  app.add_flag("--flag,-f", flag, "on");
  CLI::App* job = app.add_subcommand("job", "a job");
  job->add_option("NAME", many, "names")->type_name("PLUGIN");
  job->add_option("--to", text, "where")->type_name("DIR");

  CHECK(completion_table(app) ==
        ".\tflag\t--help,-h\tnone\tone\tPrint this help message and exit\n"
        ".\targument\tFILE\tfile\tone\ta file\n"
        ".\toption\t--color\t{red,blue}\tone\ta colour of two\n"
        ".\toption\t--number,-n\tword\tone\t[m]\n"
        ".\toption\t--key\tword\tone\t-\n"
        ".\tflag\t--flag,-f\tnone\tone\ton\n"
        ".\tcommand\tjob\tnone\tone\ta job\n"
        "job\tflag\t--help,-h\tnone\tone\tPrint this help message and exit\n"
        "job\targument\tNAME\tplugin\tmany\tnames\n"
        "job\toption\t--to\tdir\tone\twhere\n");
}
