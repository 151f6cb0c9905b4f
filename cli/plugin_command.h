#pragma once

#include <vector>

namespace CLI {
class App;
}

namespace terracast::cli {

/// Loads the plug-ins of `--plugin FILE` and `--plugin=FILE` among a command line's arguments, and those of
/// TERRACAST_PLUGIN_PATH: before the line is read, since plug-ins add to what it may say. Of the latter, what cannot be
/// loaded is left out with a warning.
/// returns  the other arguments
/// throws   Usage; of the former, as plugins::load_plugin
std::vector<const char*> load_named_plugins(int argc, const char* const* argv);

/// `terracast plugin list` and `terracast plugin check`.
void add_plugin_command(CLI::App& app, int& status);

}  // namespace terracast::cli
