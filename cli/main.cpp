#include "cli/commands.h"
#include "core/process_memory.h"
#include "core/stop.h"

int main(int argc, char** argv) {
  terracast::core::share_freed_memory();
  terracast::core::catch_stop_signals();
  return terracast::cli::run_command_line(argc, argv);
}
