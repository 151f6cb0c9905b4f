#pragma once

namespace CLI {
class App;
}

namespace terracast::cli {

/// `terracast world check`.
/// status   of the command, when it has run; must live as long as the parent
void add_world_check_command(CLI::App& world_command, int& status);

}  // namespace terracast::cli
