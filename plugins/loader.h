#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/plugin_rows.h"

namespace terracast::plugins {

/// A kind of which a plug-in has one more: "sensor", "mine.laser".
struct KindInPlugin {
  std::string_view type;
  std::string_view name;
  std::string_view summary;
};

/// Loads a plug-in: its rows join the tables, for the rest of the program. The file is kept open, and loaded once however
/// often it is named.
///
/// Nothing of the file is run before the build that it states is found to be the program's own.
/// returns  its name
/// throws   Input: not a plug-in, of another build (what differs, on both sides), a library that it needs is missing,
///          names that are not "NAME.kind", a name that is taken; Io
/// threads  one, before any table is read
std::string load_plugin(const std::filesystem::path& file);

/// A file on the path of plug-ins, or why an entry of the path has none.
struct FoundPlugin {
  std::filesystem::path file;
  std::string problem;  ///< empty: there is a file
};

/// The plug-ins `<folder>/<major.minor>/*.so` of the folders of a list as in PATH, in its order, in alphabetical order
/// within a folder; and the folders that are not there.
std::vector<FoundPlugin> plugins_on_path(std::string_view path_variable);

/// The kinds that the loaded plug-ins add, in the order of loading.
std::span<const KindInPlugin> kinds_in_plugins();

}  // namespace terracast::plugins
