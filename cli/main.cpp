#include "cli/apart_readers.h"
#include "cli/commands.h"
#include "core/environment.h"
#include "core/process_memory.h"
#include "core/reading_apart.h"
#include "core/stop.h"

int main(int argc, char** argv) {
  terracast::core::settle_environment();
  if (terracast::core::is_reading_apart(argc, argv))
    return terracast::core::serve_reading(terracast::cli::apart_readers(), argc, argv);
  terracast::core::share_freed_memory();
  terracast::core::catch_stop_signals();
  return terracast::cli::run_command_line(argc, argv);
}
