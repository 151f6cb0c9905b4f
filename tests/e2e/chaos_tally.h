#pragma once

#include <map>
#include <string>

namespace terracast::test {

/// What happened in all rounds.
struct Tally {
  std::map<std::string, int> faults;
  std::map<std::string, int> stages;    ///< "killed in render"
  std::map<std::string, int> damages;   ///< "flipped tile"
  std::map<std::string, int> failures;  ///< messages without paths and numbers
  std::map<std::string, int> ends;      ///< "status 0"
};

/// A message in which all that differs from case to case is left out.
std::string general(std::string line);

/// The line that says what went wrong.
std::string error_line(const std::string& output);

}  // namespace terracast::test
