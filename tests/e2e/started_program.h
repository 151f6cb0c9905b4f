#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace terracast::test {

/// A program that runs beside the test.
class StartedProgram {
 public:
  /// environment   what is added to the test's own
  /// output        where its stdout and stderr go
  StartedProgram(const std::string& program, const std::vector<std::string>& arguments,
                 const std::vector<std::pair<std::string, std::string>>& environment,
                 std::filesystem::path output);
  ~StartedProgram();  ///< kills it
  StartedProgram(const StartedProgram&) = delete;
  StartedProgram& operator=(const StartedProgram&) = delete;

  bool has_ended();
  /// Of one that has ended: its exit status; -signal when one ended it.
  int status() const { return status_; }
  void send(int signal) const;
  std::string output() const;
  pid_t process() const { return process_; }

 private:
  pid_t process_ = -1;
  bool has_ended_ = false;
  int status_ = 0;
  std::filesystem::path output_;
};

}  // namespace terracast::test
