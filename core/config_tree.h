#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/error.h"

/// A config as read and merged: values that know where they were written. The TOML reader fills it,
/// and the schema visitor of toml_reader.h reads it; nothing else needs it.
namespace terracast::core {

/// A file (or a --set) that values come from.
struct ConfigSource {
  std::string name;                ///< for messages: the file, or "--set KEY=VALUE"
  std::filesystem::path folder;    ///< where its relative paths start
  std::filesystem::path identity;  ///< canonical; empty for what is no file
  std::shared_ptr<const ConfigSource> included_by;  ///< the source that names this file
};

struct ConfigPlace {
  std::shared_ptr<const ConfigSource> source;
  std::int64_t line = 0;  ///< from 1; 0 when it is not in a file
  std::int64_t column = 0;
  /// "demo.toml:12:19"
  std::string text() const;
};

struct ConfigEntry;
struct ConfigNode;
using ConfigList = std::vector<ConfigNode>;
using ConfigTable = std::vector<ConfigEntry>;  ///< in the order of the file

struct ConfigNode {
  std::variant<bool, std::int64_t, double, std::string, ConfigList, ConfigTable> data;
  ConfigPlace place;

  const std::string* text() const { return std::get_if<std::string>(&data); }
  const ConfigTable* table() const { return std::get_if<ConfigTable>(&data); }
  ConfigTable* table() { return std::get_if<ConfigTable>(&data); }
  /// The value of a key of a table; null without one.
  const ConfigNode* find(std::string_view key) const;
  ConfigNode* find(std::string_view key);

  std::string type_name() const;  ///< "text", "a whole number", …
  std::string shown() const;      ///< the value for a message, shortened
};

struct ConfigEntry {
  std::string key;
  ConfigNode value;
  ConfigPlace key_place;
};

/// A node on one line, as TOML: tables and lists inline.
std::string toml_text(const ConfigNode& node);

/// Throws a Config error that starts with the place.
template <class... Args>
[[noreturn]] void fail_at(const ConfigPlace& place, fmt::format_string<Args...> format,
                          Args&&... args) {
  fail(ErrorKind::Config, "{}: {}", place.text(), fmt::format(format, std::forward<Args>(args)...));
}

/// Lays `over` on `base`: tables merge, all else is replaced. What is replaced keeps its rank in
/// the order.
void merge_config(ConfigNode& base, ConfigNode&& over);

/// Reads a file that a config names, with what it extends.
using ConfigLoader = std::function<ConfigNode(const std::filesystem::path& file,
                                              std::shared_ptr<const ConfigSource> included_by)>;

/// A text with each ${name} replaced, and the folder in which it is a path: that of the file that
/// holds it, or that of the key whose value it starts with.
struct ExpandedText {
  std::string text;
  std::filesystem::path folder;
  std::filesystem::path path() const;
};

/// root   the whole config, whose top-level text keys are the names
/// throws Config: an unknown name, a loop, no closing brace
ExpandedText expand_text(const ConfigNode& text, const ConfigNode& root);

/// The table that a section or item stands for: itself, or the file that its text names, read into
/// `loaded`.
/// name   of the section, for messages
const ConfigNode& table_behind(const ConfigNode& node, const ConfigNode& root,
                               const std::string& name, const ConfigLoader& load,
                               ConfigNode& loaded);

/// Puts a value at a dotted key, as --set does; `root` also holds the names for ${…}.
void set_config_value(ConfigNode& root, const std::string& dotted_key, ConfigNode value,
                      const ConfigLoader& load);

}  // namespace terracast::core
