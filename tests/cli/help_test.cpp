#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "cli/commands.h"

namespace terracast::cli {
namespace {

std::string help_of(std::vector<const char*> command) {
  command.insert(command.begin(), "terracast");
  command.push_back("--help");
  testing::internal::CaptureStdout();
  EXPECT_EQ(run_command_line(static_cast<int>(command.size()), command.data()), 0);
  return testing::internal::GetCapturedStdout();
}

/// What the help says of an option, up to the next one; blanks and line ends as one blank.
std::string said_of(const std::string& option, const std::string& help) {
  const std::size_t end_of_line = help.find("\n  " + option);
  if (end_of_line == std::string::npos) return "";
  const std::size_t begin = end_of_line + 3;
  std::string said;
  for (const char c : help.substr(begin, help.find("\n  -", begin) - begin)) {
    const bool is_blank = c == ' ' || c == '\n';
    if (!is_blank || (!said.empty() && said.back() != ' ')) said += is_blank ? ' ' : c;
  }
  while (!said.empty() && said.back() == ' ') said.pop_back();
  return said;
}

// Seen in November 2026: world export and world check had a line of their own, with another bound.
TEST(Help, EveryCommandSaysTheSameOfItsThreads) {
  const std::string said = said_of("--threads", help_of({"run"}));
  EXPECT_NE(said.find("0, the default, takes every core"), std::string::npos) << said;
  for (const std::vector<const char*>& command :
       std::vector<std::vector<const char*>>{{"tile"},
                                             {"render"},
                                             {"label"},
                                             {"export"},
                                             {"validate"},
                                             {"evaluate"},
                                             {"world", "check"},
                                             {"world", "export"}})
    EXPECT_EQ(said_of("--threads", help_of(command)), said) << command.back();
  for (const char* command : {"plan", "run", "verify"}) {
    std::string of_processes = said_of("--threads", help_of({"batch", command}));
    const std::size_t whose = of_processes.find(" of each process");
    ASSERT_NE(whose, std::string::npos) << command << ": " << of_processes;
    of_processes.erase(whose, std::string(" of each process").size());
    EXPECT_EQ(of_processes, said) << command;
  }
}

}  // namespace
}  // namespace terracast::cli
