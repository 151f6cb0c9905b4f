#include "cli/commands.h"
#include "core/stop.h"

int main(int argc, char** argv) {
  terracast::core::catch_stop_signals();
  return terracast::cli::run_command_line(argc, argv);
}
