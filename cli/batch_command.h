#pragma once

namespace CLI {
class App;
}

namespace terracast::cli {

/// Adds the command `batch` with its own commands.
/// status   set by the command that runs: the program's exit status; must live as long as the app
void add_batch_command(CLI::App& app, int& status);

}  // namespace terracast::cli
