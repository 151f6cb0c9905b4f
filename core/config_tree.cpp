#include "core/config_tree.h"

#include <algorithm>
#include <charconv>

#include "core/registry.h"
#include "core/toml_value.h"

namespace terracast::core {

namespace {

/// Replacements within one text; with it names that name names cannot grow without end.
constexpr int kMaxReplacements = 1000;
constexpr std::size_t kMaxExpandedBytes = std::size_t{1} << 20;

std::vector<std::string> text_keys(const ConfigNode& root) {
  std::vector<std::string> names;
  for (const ConfigEntry& entry : *root.table())
    if (entry.value.text() != nullptr) names.push_back(entry.key);
  return names;
}

class Expander {
 public:
  explicit Expander(const ConfigNode& root) : root_(root) {}

  ExpandedText expand(const ConfigNode& node) {
    const std::string& text = *node.text();
    ExpandedText result{{}, node.place.source->folder};
    std::size_t done = 0;
    while (true) {
      const std::size_t begin = text.find("${", done);
      result.text.append(text, done, begin - done);
      if (begin == std::string::npos) break;
      const std::size_t end = text.find('}', begin);
      if (end == std::string::npos)
        fail_at(node.place, "{} has a ${{ without its closing brace", node.shown());
      ExpandedText replacement = replace(text.substr(begin + 2, end - begin - 2), node);
      if (begin == 0) result.folder = std::move(replacement.folder);
      result.text += replacement.text;
      done = end + 1;
    }
    if (result.text.size() > kMaxExpandedBytes)
      fail_at(node.place, "{} grows to more than {} bytes", node.shown(), kMaxExpandedBytes);
    return result;
  }

 private:
  ExpandedText replace(const std::string& name, const ConfigNode& user) {
    const ConfigNode* value = root_.find(name);
    if (value == nullptr)
      fail_at(user.place, "{}: {}; give it a value, as with --set {}=…", user.shown(),
              unknown_name_message("top-level key", name, text_keys(root_)), name);
    if (value->text() == nullptr)
      fail_at(user.place, "{}: {} is {}, but only text can be put in", user.shown(), name,
              value->type_name());
    if (std::find(active_.begin(), active_.end(), name) != active_.end())
      fail_at(user.place, "the texts {} -> {} hold each other in a loop",
              fmt::join(active_, " -> "), name);
    if (++num_replacements_ > kMaxReplacements)
      fail_at(user.place, "{} needs more than {} replacements", user.shown(), kMaxReplacements);
    active_.push_back(name);
    ExpandedText result = expand(*value);
    active_.pop_back();
    return result;
  }

  const ConfigNode& root_;
  std::vector<std::string> active_;
  int num_replacements_ = 0;
};

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

/// rigs[0].name as rigs.0.name.
std::string with_dots(std::string key) {
  std::replace(key.begin(), key.end(), '[', '.');
  std::erase(key, ']');
  return key;
}

}  // namespace

std::string ConfigPlace::text() const {
  return line > 0 ? fmt::format("{}:{}:{}", source->name, line, column) : source->name;
}

const ConfigNode* ConfigNode::find(std::string_view key) const {
  const ConfigTable* entries = table();
  if (entries == nullptr) return nullptr;
  for (const ConfigEntry& entry : *entries)
    if (entry.key == key) return &entry.value;
  return nullptr;
}

ConfigNode* ConfigNode::find(std::string_view key) {
  return const_cast<ConfigNode*>(static_cast<const ConfigNode*>(this)->find(key));
}

std::string ConfigNode::type_name() const {
  static constexpr const char* kNames[] = {"true or false", "a whole number", "a number",
                                           "text",          "a list",         "a table"};
  return kNames[data.index()];
}

std::string ConfigNode::shown() const {
  if (const auto* value = std::get_if<bool>(&data)) return *value ? "true" : "false";
  if (const auto* value = std::get_if<std::int64_t>(&data)) return fmt::to_string(*value);
  if (const auto* value = std::get_if<double>(&data)) return fmt::format("{}", *value);
  if (const std::string* value = text()) {
    constexpr std::size_t kLongest = 80;
    if (value->size() <= kLongest) return "\"" + *value + "\"";
    std::size_t end = kLongest;  // not within a letter of several bytes
    while (end > 0 && (static_cast<unsigned char>((*value)[end]) & 0xc0U) == 0x80U) --end;
    return "\"" + value->substr(0, end) + "…\"";
  }
  return type_name();
}

void merge_config(ConfigNode& base, ConfigNode&& over) {
  ConfigTable* entries = base.table();
  ConfigTable* added = over.table();
  if (entries == nullptr || added == nullptr) {
    base = std::move(over);
    return;
  }
  base.place = over.place;
  for (ConfigEntry& entry : *added) {
    const auto present = std::find_if(entries->begin(), entries->end(),
                                      [&](const ConfigEntry& e) { return e.key == entry.key; });
    if (present == entries->end()) {
      entries->push_back(std::move(entry));
    } else {
      present->key_place = entry.key_place;
      merge_config(present->value, std::move(entry.value));
    }
  }
}

std::filesystem::path ExpandedText::path() const {
  return text.empty() ? std::filesystem::path() : folder / text;
}

ExpandedText expand_text(const ConfigNode& text, const ConfigNode& root) {
  return Expander(root).expand(text);
}

const ConfigNode& table_behind(const ConfigNode& node, const ConfigNode& root,
                               const std::string& name, const ConfigLoader& load,
                               ConfigNode& loaded) {
  if (node.table() != nullptr) return node;
  if (node.text() == nullptr)
    fail_at(node.place, "{} = {}, but must be a table, or the path of a file that holds it", name,
            node.shown());
  if (node.text()->empty())
    fail_at(node.place, "{} = \"\" names no file; give a table, or the path of one", name);
  loaded = with_context([&] { return load(expand_text(node, root).path(), node.place.source); },
                        fmt::format("reading {} ({})", name, node.place.text()));
  return loaded;
}

void set_config_value(ConfigNode& root, const std::string& dotted_key, ConfigNode value,
                      const ConfigLoader& load) {
  constexpr std::size_t kMaxParts = 64;
  const ConfigPlace place = value.place;
  std::vector<std::string> parts(1);
  for (const char c : dotted_key) {
    const bool is_bare = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                         (c >= '0' && c <= '9') || c == '_' || c == '-';
    if (c == '.')
      parts.emplace_back();
    else if (is_bare)
      parts.back() += c;
    else if (c == '[' || c == ']')
      fail_at(place, "\"{}\" is not a dotted key; an item of a list is named by its number, as {}",
              dotted_key, with_dots(dotted_key));
    else
      fail_at(place, "\"{}\" is not a dotted key, such as camera.focal_length_mm or rigs.0.name",
              dotted_key);
  }
  if (std::find(parts.begin(), parts.end(), "") != parts.end() || parts.size() > kMaxParts)
    fail_at(place, "\"{}\" is not a dotted key, such as camera.focal_length_mm or rigs.0.name",
            dotted_key);

  ConfigNode* at = &root;
  std::string path;
  for (const std::string& part : parts) {
    if (at->text() != nullptr) {  // the file that holds the table takes the table's place
      ConfigNode loaded;
      table_behind(*at, root, path, load, loaded);
      *at = std::move(loaded);
    }
    path += (path.empty() ? "" : ".") + part;
    if (auto* items = std::get_if<ConfigList>(&at->data)) {
      std::size_t index = 0;
      if (!is_number(part))
        fail_at(place,
                "{}: a list of {} items holds no \"{}\"; name an item, counted from 0, as {}", path,
                items->size(), part, path.substr(0, path.size() - part.size()) + "0." + part);
      const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), index);
      if (error != std::errc() || end != part.data() + part.size() || index >= items->size())
        fail_at(place, "{}: the list has {} items, which are counted from 0", path, items->size());
      at = &(*items)[index];
    } else if (at->table() != nullptr) {
      ConfigNode* next = at->find(part);
      if (next == nullptr) {
        at->table()->push_back({part, ConfigNode{ConfigTable(), place}, place});
        next = &at->table()->back().value;
      }
      at = next;
    } else {
      fail_at(place, "{} is {} (from {}), which holds no \"{}\"",
              path.substr(0, path.size() - part.size() - 1), at->shown(), at->place.text(), part);
    }
  }
  *at = std::move(value);
}

std::string AnyValue::toml() const { return node ? toml_text(*node) : std::string("\"\""); }

std::string toml_text(const ConfigNode& node) {
  if (const ConfigTable* table = node.table()) {
    std::string text = "{";
    for (std::size_t i = 0; i < table->size(); ++i)
      text += fmt::format("{}{} = {}", i > 0 ? ", " : "", toml_value((*table)[i].key),
                          toml_text((*table)[i].value));
    return text + "}";
  }
  if (const auto* items = std::get_if<ConfigList>(&node.data)) {
    std::string text = "[";
    for (std::size_t i = 0; i < items->size(); ++i)
      text += (i > 0 ? ", " : "") + toml_text((*items)[i]);
    return text + "]";
  }
  if (const auto* text = node.text()) return toml_value(*text);
  if (const auto* number = std::get_if<double>(&node.data)) return toml_value(*number);
  if (const auto* integer = std::get_if<std::int64_t>(&node.data)) return toml_value(*integer);
  return toml_value(std::get<bool>(node.data));
}

}  // namespace terracast::core
