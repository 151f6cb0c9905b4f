#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <typeinfo>
#include <vector>

/// Rows that plug-ins add to the tables of kinds: sensors, cameras, layers, exporters, media, checks.
namespace terracast::core {

class Json;

/// A plug-in that the program has loaded.
struct Plugin {
  std::string name;  ///< the part before the dot of all its kinds' names
  std::string version;
  std::string licence;
  std::filesystem::path file;
  std::string content_hash;        ///< of the file
  std::vector<std::string> kinds;  ///< names of all its kinds, "mine.laser"
};

/// The loaded plug-ins in the order in which they were loaded. Threads: safe once tables are read.
std::span<const Plugin> plugins();

/// A row of a table, of whatever type the table's rows are.
struct PluginRow {
  const std::type_info* type;
  const void* info;  ///< lives as long as the program
};

/// Adds a plug-in and its rows. Tables do not change once one of them has been read.
/// throws   Internal: a table has been read
/// threads  one, before all others
void add_plugin(Plugin plugin, std::span<const PluginRow> rows);

/// All rows of a type that plug-ins added; no more can be added from then on.
std::vector<const void*> plugin_rows(const std::type_info& type);

/// A table: the program's own rows, then those of plug-ins, by name: the order of loading does not count.
template <class Info>
std::vector<Info> with_plugin_rows(std::vector<Info> own) {
  const auto num_own = static_cast<std::ptrdiff_t>(own.size());
  for (const void* row : plugin_rows(typeid(Info))) own.push_back(*static_cast<const Info*>(row));
  std::sort(own.begin() + num_own, own.end(),
            [](const Info& a, const Info& b) { return a.name < b.name; });
  return own;
}

/// In what follows a text names a kind where the kind's whole name stands between others than letters, digits, _, -, . and /.
///
/// A line "plugin NAME VERSION HASH" for each loaded plug-in of which `text` names a kind. It belongs into every hash of
/// what plug-ins take part in: what an edited plug-in has made is then made again.
std::string plugin_marks(std::string_view text);

/// The loaded plug-ins of which `text`, such as a config, names a kind, by name: the order of loading does not count.
std::vector<const Plugin*> plugins_named_in(std::string_view text);

/// [{"name", "version", "licence", "xxh3_128"}, …] of the loaded plug-ins of which `text` names a kind: what datasets and
/// reports say of who took part.
Json plugin_record(std::string_view text);

/// "--plugin", "/path/mine.so", …: the arguments with which another process of the program has the same plug-ins.
std::vector<std::string> plugin_arguments();

/// "terracast --plugin '/path/mine.so' …": the start of a command to suggest to a user, with the same plug-ins.
std::string program_with_plugins();

/// Whether a name fits a plug-in or one of its kinds: a to z, 0 to 9 and _, starting with a letter, at most 64.
bool is_plugin_name(std::string_view name);

/// "plug-in mine is not loaded; …" for a name "mine.laser" of a kind of a plug-in that is not loaded; empty for others.
std::string missing_plugin(std::string_view kind);

/// "; this is a bug of plug-in mine" for a kind of a plug-in; empty for the program's own.
std::string bug_of_plugin(std::string_view kind);

/// The failure of made().
[[noreturn]] void fail_nothing_made(std::string_view what, std::string_view kind);

/// The failure of a clone() that returned nothing.
[[noreturn]] void fail_nothing_copied(std::string_view kind);

/// Checks what the make() of a kind returned, and returns it.
/// what     in the message: "medium"
/// throws   Internal: it is null, a bug of the plug-in that the kind is of
template <class Product>
std::unique_ptr<Product> made(std::unique_ptr<Product> product, std::string_view what,
                              std::string_view kind) {
  if (product == nullptr) fail_nothing_made(what, kind);
  return product;
}

/// Whether a version fits a plug-in: numbers with dots.
bool is_plugin_version(std::string_view version);

/// That a plug-in is loaded which a config requires: "mine", or "mine >= 1.2"; versions are numbers with dots.
/// throws   Config: the plug-in is not loaded, or older; or the text is not of this form
void check_requirement(const std::string& requirement);

}  // namespace terracast::core
