#pragma once

namespace CLI {
class App;
}

namespace terracast::cli {

/// `terracast rig show`, `rig import` and `rig export`.
/// status   of the command, when it has run; must live as long as the parent
void add_rig_command(CLI::App& app, int& status);

}  // namespace terracast::cli
