#pragma once

#include <string>
#include <string_view>

namespace terracast::core {

/// This process among all that share a file system, for names of files: machine (this boot of it, and
/// the space in which its process numbers count), number and time of start, "1f9c03ab-4711-20043".
std::string this_process();

/// Whether a process of such a name has ended; nothing is known of processes on other machines.
enum class ProcessState { Lives, Ended, Elsewhere };
ProcessState process_state(std::string_view process);

/// What this machine is called; "unknown" where it does not say.
std::string host_name();

/// 64 random bits in 16 hexadecimal digits, for names that nobody else takes.
/// throws Io
std::string random_name();

}  // namespace terracast::core
