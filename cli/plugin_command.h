#pragma once

#include <vector>

namespace CLI {
class App;
}

namespace terracast::cli {

/// Loads the plug-ins of TERRACAST_PLUGIN_PATH, and those of `--plugin FILE` and `--plugin=FILE` among a command line's
/// arguments: before it is read, since plug-ins add to what it may say.
/// returns  the other arguments
/// throws   Usage; as plugins::load_plugin
std::vector<const char*> load_named_plugins(int argc, const char* const* argv);

/// `terracast plugin list` and `terracast plugin check`.
void add_plugin_command(CLI::App& app, int& status);

}  // namespace terracast::cli
