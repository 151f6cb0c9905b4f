#include "tests/e2e/started_program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>

namespace terracast::test {

StartedProgram::StartedProgram(const std::string& program,
                               const std::vector<std::string>& arguments,
                               const std::vector<std::pair<std::string, std::string>>& environment,
                               std::filesystem::path output)
    : output_(std::move(output)) {
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const auto& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  process_ = ::fork();
  if (process_ != 0) return;
  for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
  const int file = ::open(output_.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
  ::dup2(file, STDOUT_FILENO);
  ::dup2(file, STDERR_FILENO);
  ::execv(program.c_str(), argv.data());
  ::_exit(127);
}

StartedProgram::~StartedProgram() {
  if (has_ended()) return;
  ::kill(process_, SIGKILL);
  ::waitpid(process_, nullptr, 0);
}

bool StartedProgram::has_ended() {
  int state = 0;
  if (!has_ended_ && ::waitpid(process_, &state, WNOHANG) == process_) {
    has_ended_ = true;
    status_ = WIFEXITED(state) ? WEXITSTATUS(state) : -WTERMSIG(state);
  }
  return has_ended_;
}

void StartedProgram::send(int signal) const {
  if (!has_ended_) ::kill(process_, signal);
}

std::string StartedProgram::output() const {
  std::ifstream file(output_, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace terracast::test
