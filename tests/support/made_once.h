#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace terracast::test {

/// A folder in the build tree that the first test to need it makes, and all others read: worlds, captures and jobs
/// that several tests, processes and runs of ctest have in common. It is made anew when the program or the inputs
/// have changed. Readers copy what they change.
/// name      of the folder
/// inputs    everything that determines its content beside the program: configs, arguments
/// make      fills an empty folder; what it records as a failure of the running test, or throws, leaves no folder
/// returns   the folder; the same for all that ask while neither program nor inputs change
/// cost      a hash of the program, and the time and size of each file; making, once
/// throws    logic_error: a test has changed the folder; it is made anew next time
/// threads   safe, processes too: all but the first wait
std::filesystem::path made_once(const std::string& name, const std::string& inputs,
                                const std::function<void(const std::filesystem::path&)>& make);

}  // namespace terracast::test
