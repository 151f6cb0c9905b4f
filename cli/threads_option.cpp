#include "cli/threads_option.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>

namespace terracast::cli {

void add_threads_option(CLI::App& command, int& num_threads, const std::string& whose) {
  command
      .add_option("--threads", num_threads,
                  fmt::format("Threads{}; 0, the default, takes every core, or a container's CPU "
                              "limit. The result is the same.",
                              whose))
      ->check(CLI::Range(0, 4096));
}

}  // namespace terracast::cli
