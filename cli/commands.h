#pragma once

namespace terracast::cli {

/// The program: parses the command line, runs one command, turns an Error into its message and exit
/// status.
/// returns   0, or the exit status of what failed; 1 when a check of `validate` or `run` does not
///           hold
int run_command_line(int argc, const char* const* argv);

}  // namespace terracast::cli
