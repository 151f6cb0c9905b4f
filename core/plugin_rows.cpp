#include "core/plugin_rows.h"

#include <algorithm>
#include <atomic>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <utility>

#include "core/error.h"
#include "core/json.h"
#include "core/program.h"

namespace terracast::core {
namespace {

struct Loaded {
  std::vector<Plugin> plugins;
  std::vector<PluginRow> rows;
  std::atomic<bool> is_read = false;
};

Loaded& loaded() {
  static Loaded& all = *new Loaded;  // what runs at the end of the process asks too
  return all;
}

bool ends_a_name(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) == 0 &&
         std::string_view("_-./").find(c) == std::string_view::npos;
}

bool names(std::string_view text, std::string_view kind) {
  for (std::size_t at = text.find(kind); at != std::string_view::npos;
       at = text.find(kind, at + 1)) {
    const std::size_t end = at + kind.size();
    if ((at == 0 || ends_a_name(text[at - 1])) && (end == text.size() || ends_a_name(text[end])))
      return true;
  }
  return false;
}

/// Parts of a version: 1.12 > 1.9. Empty: it is none.
std::vector<std::uint64_t> version_parts(std::string_view text) {
  std::vector<std::uint64_t> parts;
  while (true) {
    std::uint64_t part = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), part);
    if (error != std::errc()) return {};
    parts.push_back(part);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (text.empty()) return parts;
    if (text.front() != '.') return {};
    text.remove_prefix(1);
  }
}

}  // namespace

bool is_plugin_version(std::string_view version) { return !version_parts(version).empty(); }

bool is_plugin_name(std::string_view name) {
  return !name.empty() && name.size() <= 64 && name.front() >= 'a' && name.front() <= 'z' &&
         std::all_of(name.begin(), name.end(), [](char c) {
           return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
         });
}

std::span<const Plugin> plugins() { return loaded().plugins; }

void add_plugin(Plugin plugin, std::span<const PluginRow> rows) {
  TERRACAST_CHECK(!loaded().is_read, "plug-in {} comes after a table was read", plugin.name);
  loaded().plugins.push_back(std::move(plugin));
  loaded().rows.insert(loaded().rows.end(), rows.begin(), rows.end());
}

std::vector<const void*> plugin_rows(const std::type_info& type) {
  loaded().is_read = true;
  std::vector<const void*> rows;
  for (const PluginRow& row : loaded().rows)
    if (*row.type == type) rows.push_back(row.info);
  return rows;
}

std::string plugin_marks(std::string_view text) {
  std::string marks;
  for (const Plugin* plugin : plugins_named_in(text))
    marks += fmt::format("plugin {} {} {}\n", plugin->name, plugin->version, plugin->content_hash);
  return marks;
}

std::vector<const Plugin*> plugins_named_in(std::string_view text) {
  std::vector<const Plugin*> named;
  for (const Plugin& plugin : plugins())
    if (std::any_of(plugin.kinds.begin(), plugin.kinds.end(),
                    [&](const std::string& kind) { return names(text, kind); }))
      named.push_back(&plugin);
  std::sort(named.begin(), named.end(),
            [](const Plugin* a, const Plugin* b) { return a->name < b->name; });
  return named;
}

Json plugin_record(std::string_view text) {
  Json list = Json::array();
  for (const Plugin* plugin : plugins_named_in(text))
    list.push(Json::object()
                  .set("name", plugin->name)
                  .set("version", plugin->version)
                  .set("licence", plugin->licence)
                  .set("xxh3_128", plugin->content_hash));
  return list;
}

std::vector<std::string> plugin_arguments() {
  std::vector<std::string> arguments;
  for (const Plugin& plugin : plugins())
    arguments.insert(arguments.end(), {"--plugin", plugin.file.string()});
  return arguments;
}

std::string program_with_plugins() {
  std::string text = "terracast";
  for (const Plugin& plugin : plugins()) text += " --plugin " + shell_quoted(plugin.file.string());
  return text;
}

std::string missing_plugin(std::string_view kind) {
  const std::size_t dot = kind.find('.');
  const std::string_view name = kind.substr(0, dot);
  if (dot == std::string_view::npos || !is_plugin_name(name)) return {};
  const std::span<const Plugin> present = plugins();
  if (std::any_of(present.begin(), present.end(),
                  [&](const Plugin& one) { return one.name == name; }))
    return {};
  return fmt::format(
      "plug-in {} is not loaded; name its file by --plugin FILE, or its folder in "
      "TERRACAST_PLUGIN_PATH",
      name);
}

std::string bug_of_plugin(std::string_view kind) {
  const std::size_t dot = kind.find('.');
  if (dot == std::string_view::npos) return {};
  return fmt::format("; this is a bug of plug-in {}", kind.substr(0, dot));
}

void fail_nothing_made(std::string_view what, std::string_view kind) {
  fail(ErrorKind::Internal, "{} {}: its make() returned nothing{}", what, kind,
       bug_of_plugin(kind));
}

void fail_nothing_copied(std::string_view kind) {
  fail(ErrorKind::Internal, "{}: its clone() returned nothing{}", kind, bug_of_plugin(kind));
}

void check_requirement(const std::string& requirement) {
  const std::size_t space = requirement.find(' ');
  const std::string name = requirement.substr(0, space);
  const std::string rest = space == std::string::npos ? "" : requirement.substr(space + 1);
  if (!is_plugin_name(name) ||
      (!rest.empty() && (!rest.starts_with(">= ") || version_parts(rest.substr(3)).empty())))
    fail(ErrorKind::Config,
         "requires: \"{}\" is not \"NAME\" or \"NAME >= VERSION\", as \"mine >= 1.2\"",
         requirement);
  const std::span<const Plugin> present_plugins = plugins();
  const auto plugin = std::find_if(present_plugins.begin(), present_plugins.end(),
                                   [&](const Plugin& one) { return one.name == name; });
  if (plugin == present_plugins.end())
    fail(ErrorKind::Config, "requires = [\"{}\"]: {}", requirement, missing_plugin(name + "."));
  if (rest.empty()) return;
  std::vector<std::uint64_t> wanted = version_parts(rest.substr(3));
  std::vector<std::uint64_t> present = version_parts(plugin->version);
  const std::size_t num_parts = std::max(wanted.size(), present.size());
  wanted.resize(num_parts);  // 1.2 is 1.2.0
  present.resize(num_parts);
  if (present < wanted)
    fail(ErrorKind::Config, "plug-in {} {} ({}) is older than the config requires: {}", name,
         plugin->version, plugin->file.string(), requirement);
}

}  // namespace terracast::core
