#pragma once

#include <string>

namespace CLI {
class App;
}

namespace terracast::cli {

/// Adds --threads, the same to every command that has it.
/// num_threads   0 until it is given: a thread for each core; must live as long as the command
/// whose         after "Threads", such as " of each process"
void add_threads_option(CLI::App& command, int& num_threads, const std::string& whose = "");

}  // namespace terracast::cli
