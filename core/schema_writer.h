#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/schema.h"

namespace terracast::core {

/// One key of a description, as `config explain` and the manual show it.
struct KeyInfo {
  std::string name;   ///< dotted; items of lists as `rigs[].name`
  std::string type;   ///< bool, integer, number, text, path, list of numbers, …
  std::string unit;   ///< from the name's suffix: m, deg, s, px, mm, bytes; empty without one
  std::string range;  ///< "1 to 2000", "one of a, b", "required", or empty
  std::string default_value;  ///< as TOML
  std::string meaning;
};

std::unique_ptr<SchemaVisitor> make_toml_writer(std::string& output);
std::unique_ptr<SchemaVisitor> make_key_lister(std::vector<KeyInfo>& output);

/// The value as TOML that reads back to an equal value (doubles round-trip; paths as written).
template <class Struct>
std::string toml_text(const Struct& value) {
  std::string text;
  auto visitor = make_toml_writer(text);
  Struct copy = value;
  copy.describe(*visitor);
  return text;
}

/// Every key of a described struct with its default.
template <class Struct>
std::vector<KeyInfo> list_keys(const Struct& defaults = {}) {
  std::vector<KeyInfo> keys;
  auto visitor = make_key_lister(keys);
  Struct copy = defaults;
  copy.describe(*visitor);
  return keys;
}

/// A Markdown table of keys: key, unit, default, range, meaning.
std::string markdown_table(const std::vector<KeyInfo>& keys);

}  // namespace terracast::core
