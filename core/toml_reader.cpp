#include "core/toml_reader.h"

#include <toml++/toml.h>

#include <algorithm>
#include <sstream>

#include "core/atomic_file.h"
#include "core/config_reader.h"
#include "core/config_tree.h"

namespace terracast::core {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{16} << 20;
constexpr int kMaxDepth = 64;
constexpr std::size_t kMaxKeyParts = 32;

bool is_bare_key_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-' || static_cast<unsigned char>(c) >= 0x80;
}

/// The end of the string that starts at `begin` with a quote: one past its last quote, or the
/// text's end.
std::size_t end_of_string(std::string_view text, std::size_t begin) {
  const char quote = text[begin];
  const std::string triple(3, quote);
  const bool is_long = text.substr(begin, 3) == triple;
  std::size_t at = begin + (is_long ? 3 : 1);
  while (at < text.size()) {
    if (text[at] == '\\' && quote == '"') {
      at += 2;
    } else if (is_long ? text.substr(at, 3) == triple : text[at] == quote) {
      return at + (is_long ? 3 : 1);
    } else if (!is_long && text[at] == '\n') {
      return at;
    } else {
      ++at;
    }
  }
  return text.size();
}

/// toml++ bounds the nesting of values, but not the parts of a dotted key: each makes a table, and
/// those that nest a hundred thousand deep overflow the stack when they are destroyed. So a key's
/// parts are counted before it reads.
void check_key_lengths(std::string_view text, const std::string& name) {
  std::size_t num_parts = 0;
  std::size_t at = 0;
  bool after_dot = false;
  while (at < text.size()) {
    const char c = text[at];
    if (c == ' ' || c == '\t') {
      ++at;
    } else if (c == '.') {
      after_dot = true;
      ++at;
    } else if (c == '"' || c == '\'' || is_bare_key_letter(c)) {
      num_parts = after_dot ? num_parts + 1 : 1;
      after_dot = false;
      if (num_parts > kMaxKeyParts)
        fail(ErrorKind::Config, "{}:{}: a key has more than {} dotted parts", name,
             std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n') + 1,
             kMaxKeyParts);
      if (c == '"' || c == '\'')
        at = end_of_string(text, at);
      else
        while (at < text.size() && is_bare_key_letter(text[at])) ++at;
    } else if (c == '#') {
      at = std::min(text.find('\n', at), text.size());
    } else {
      num_parts = 0;
      after_dot = false;
      ++at;
    }
  }
}

/// Turns what toml++ read into a tree of ours.
class Converter {
 public:
  /// has_lines   false: the text is not a file's, its lines mean nothing
  Converter(std::shared_ptr<const ConfigSource> source, bool has_lines)
      : source_(std::move(source)), has_lines_(has_lines) {}

  ConfigNode convert(const toml::node& node, int depth = 0) const {
    ConfigNode result{false, place(node.source())};
    if (depth > kMaxDepth) fail_at(result.place, "nested deeper than {} levels", kMaxDepth);
    if (const toml::table* table = node.as_table()) {
      ConfigTable entries;
      for (const auto& [key, value] : *table)
        entries.push_back({std::string(key.str()), convert(value, depth + 1), place(key.source())});
      // toml++ sorts by name; messages and dumps follow the file.
      std::stable_sort(entries.begin(), entries.end(),
                       [](const ConfigEntry& a, const ConfigEntry& b) {
                         return std::pair(a.key_place.line, a.key_place.column) <
                                std::pair(b.key_place.line, b.key_place.column);
                       });
      result.data = std::move(entries);
    } else if (const toml::array* array = node.as_array()) {
      ConfigList items;
      items.reserve(array->size());
      for (const toml::node& item : *array) items.push_back(convert(item, depth + 1));
      result.data = std::move(items);
    } else if (const auto* text = node.as_string()) {
      result.data = text->get();
    } else if (const auto* integer = node.as_integer()) {
      result.data = std::int64_t{integer->get()};
    } else if (const auto* number = node.as_floating_point()) {
      result.data = number->get();
    } else if (const auto* boolean = node.as_boolean()) {
      result.data = boolean->get();
    } else {  // dates and times: the schema takes them as text
      std::ostringstream date;
      node.visit([&date](const auto& value) {
        if constexpr (toml::is_value<decltype(value)>) date << value.get();
      });
      result.data = date.str();
    }
    return result;
  }

 private:
  ConfigPlace place(const toml::source_region& region) const {
    if (!has_lines_) return {source_, 0, 0};
    return {source_, static_cast<std::int64_t>(region.begin.line),
            static_cast<std::int64_t>(region.begin.column)};
  }

  std::shared_ptr<const ConfigSource> source_;
  bool has_lines_;
};

/// Lays every table of a tree over the file that its key `extends` names.
void resolve_extends(ConfigNode& node, const std::shared_ptr<const ConfigSource>& source,
                     const ConfigLoader& load) {
  if (auto* items = std::get_if<ConfigList>(&node.data))
    for (ConfigNode& item : *items) resolve_extends(item, source, load);
  ConfigTable* entries = node.table();
  if (entries == nullptr) return;
  for (ConfigEntry& entry : *entries) resolve_extends(entry.value, source, load);
  const ConfigNode* base_name = node.find("extends");
  if (base_name == nullptr) return;
  if (base_name->text() == nullptr || base_name->text()->empty())
    fail_at(base_name->place, "extends = {}, but must be the path of a file (text)",
            base_name->shown());
  if (base_name->text()->find("${") != std::string::npos)
    fail_at(
        base_name->place,
        "extends = {}: a file is extended before its names are known; write the path without ${{}}",
        base_name->shown());
  ConfigNode base = with_context([&] { return load(source->folder / *base_name->text(), source); },
                                 fmt::format("reading what {} extends", base_name->place.text()));
  entries->erase(std::find_if(entries->begin(), entries->end(),
                              [](const ConfigEntry& entry) { return entry.key == "extends"; }));
  merge_config(base, std::move(node));
  node = std::move(base);
}

/// The tree of a TOML text, with what it extends.
ConfigNode parse_text(std::string_view text, const std::shared_ptr<const ConfigSource>& source,
                      const ConfigLoader& load) {
  if (text.size() > kMaxFileBytes)
    fail(ErrorKind::Config, "{}: {} bytes are more than the {} of a config", source->name,
         text.size(), kMaxFileBytes);
  check_key_lengths(text, source->name);
  ConfigNode tree;
  try {
    const toml::table table = toml::parse(text);
    tree = Converter(source, true).convert(table);
  } catch (const toml::parse_error& error) {
    fail(ErrorKind::Config, "{}:{}:{}: {}", source->name, error.source().begin.line,
         error.source().begin.column, error.description());
  }
  resolve_extends(tree, source, load);
  return tree;
}

std::shared_ptr<const ConfigSource> file_source(const fs::path& file,
                                                std::shared_ptr<const ConfigSource> included_by) {
  std::error_code ignored;
  return std::make_shared<const ConfigSource>(ConfigSource{file.string(), file.parent_path(),
                                                           fs::weakly_canonical(file, ignored),
                                                           std::move(included_by)});
}

/// The files of a config, each read once.
class ConfigFiles {
 public:
  explicit ConfigFiles(std::map<std::string, std::string> texts = {}) : texts_(std::move(texts)) {}

  ConfigNode load(const fs::path& file, const std::shared_ptr<const ConfigSource>& included_by) {
    const std::string path = fs::absolute(file).lexically_normal().string();
    const auto place = std::pair(path, included_by.get());
    const auto known = trees_.find(place);
    if (known != trees_.end()) return known->second;
    const std::shared_ptr<const ConfigSource> source = file_source(file, included_by);
    refuse_loop(*source);
    auto text = texts_.find(path);
    if (text == texts_.end())
      text = texts_.emplace(path, read_text_file(file, kMaxFileBytes)).first;
    // Its source keeps who includes it, so that the address stays that of the same one.
    return trees_.emplace(place, parse_text(text->second, source, loader())).first->second;
  }
  ConfigLoader loader() {
    return [this](const fs::path& file, const std::shared_ptr<const ConfigSource>& included_by) {
      return load(file, included_by);
    };
  }
  const std::map<std::string, std::string>& texts() const { return texts_; }

 private:
  static void refuse_loop(const ConfigSource& source) {
    std::string chain = source.name;
    for (const ConfigSource* at = source.included_by.get(); at != nullptr;
         at = at->included_by.get()) {
      if (at->identity.empty()) continue;
      chain.insert(0, at->name + " -> ");
      if (at->identity == source.identity)
        fail(ErrorKind::Config, "config files include each other in a loop: {}", chain);
    }
  }

  std::map<std::string, std::string> texts_;
  std::map<std::pair<std::string, const ConfigSource*>, ConfigNode> trees_;
};

/// The value of a --set: TOML where it is a whole TOML value, else the bare text.
ConfigNode parse_set_value(const std::string& text,
                           const std::shared_ptr<const ConfigSource>& source) {
  ConfigNode bare{text, {source, 0, 0}};
  if (text.find_first_of("\r\n") != std::string::npos || text.size() > kMaxFileBytes) return bare;
  const std::string line = "value = " + text;
  check_key_lengths(line, source->name);
  try {
    const toml::table table = toml::parse(line);
    const toml::node* value = table.get("value");
    const bool is_date = value->is_date() || value->is_time() || value->is_date_time();
    return is_date ? bare : Converter(source, false).convert(*value);
  } catch (const toml::parse_error&) {
    return bare;
  }
}

}  // namespace

struct TomlDocument::Impl {
  std::shared_ptr<ConfigFiles> files;
  ConfigInputs inputs;  ///< without the texts
  ConfigNode root;

  /// sets_folder   where relative paths of the sets start; empty: the working directory
  void apply_sets(const fs::path& sets_folder) {
    const std::shared_ptr<const ConfigSource> file = root.place.source;
    struct Set {
      std::string key;
      ConfigNode value;
    };
    std::vector<Set> parsed;
    for (const std::string& text : inputs.sets) {
      const auto source = std::make_shared<const ConfigSource>(
          ConfigSource{"--set " + text, sets_folder, {}, file});
      const std::size_t equals = text.find('=');
      if (equals == std::string::npos || equals == 0)
        fail(ErrorKind::Config,
             "--set {}: must be KEY=VALUE, such as rigs.0.cameras.0.focal_length_mm=35", text);
      parsed.push_back({text.substr(0, equals), parse_set_value(text.substr(equals + 1), source)});
    }
    // Top-level keys first: ${name} in the path of a file that a later key reaches into needs them.
    std::stable_partition(parsed.begin(), parsed.end(),
                          [](const Set& set) { return set.key.find('.') == std::string::npos; });
    for (Set& set : parsed) set_config_value(root, set.key, std::move(set.value), files->loader());
  }
};

TomlDocument::TomlDocument(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
TomlDocument::~TomlDocument() = default;
TomlDocument::TomlDocument(TomlDocument&&) noexcept = default;
TomlDocument& TomlDocument::operator=(TomlDocument&&) noexcept = default;

TomlDocument TomlDocument::load(const fs::path& file, const std::vector<std::string>& sets) {
  auto files = std::make_shared<ConfigFiles>();
  ConfigNode root = files->load(file, nullptr);
  auto impl = std::make_unique<Impl>(Impl{std::move(files),
                                          {.file = fs::absolute(file).lexically_normal(),
                                           .sets = sets,
                                           .sets_folder = fs::current_path(),
                                           .texts = {}},
                                          std::move(root)});
  impl->apply_sets({});
  return TomlDocument(std::move(impl));
}

TomlDocument TomlDocument::load(const ConfigInputs& inputs) {
  auto files = std::make_shared<ConfigFiles>(inputs.texts);
  ConfigNode root = files->load(inputs.file, nullptr);
  auto impl = std::make_unique<Impl>(Impl{std::move(files), inputs, std::move(root)});
  impl->inputs.texts.clear();
  impl->apply_sets(inputs.sets_folder);
  return TomlDocument(std::move(impl));
}

TomlDocument TomlDocument::parse(std::string_view text, const std::string& file_name,
                                 const std::vector<std::string>& sets) {
  auto files = std::make_shared<ConfigFiles>();
  ConfigNode root = parse_text(text, file_source(file_name, nullptr), files->loader());
  auto impl = std::make_unique<Impl>(
      Impl{std::move(files),
           {.file = file_name, .sets = sets, .sets_folder = fs::current_path(), .texts = {}},
           std::move(root)});
  impl->apply_sets({});
  return TomlDocument(std::move(impl));
}

TomlDocument TomlDocument::with(const std::vector<Change>& changes,
                                std::initializer_list<std::string_view> without) const {
  auto changed = std::make_unique<Impl>(*impl_);
  // Top-level keys first, as with --set.
  for (const bool is_top : {true, false})
    for (const Change& change : changes)
      if ((change.key.find('.') == std::string::npos) == is_top)
        set_config_value(changed->root, change.key, *change.value.node, impl_->files->loader());
  std::erase_if(*changed->root.table(), [&](const ConfigEntry& entry) {
    return std::find(without.begin(), without.end(), entry.key) != without.end();
  });
  return TomlDocument(std::move(changed));
}

bool TomlDocument::has(std::string_view key) const { return impl_->root.find(key) != nullptr; }

ConfigInputs TomlDocument::inputs() const {
  ConfigInputs inputs = impl_->inputs;
  inputs.texts = impl_->files->texts();
  return inputs;
}

Json ConfigInputs::json() const {
  Json files = Json::object();
  for (const auto& [path, text] : texts) files.set(path, text);
  return Json::object()
      .set("file", file.string())
      .set("sets", Json::array_of(sets))
      .set("sets_folder", sets_folder.string())
      .set("texts", std::move(files));
}

ConfigInputs ConfigInputs::from_json(const Json& json, const std::string& name) {
  return with_context(
      [&] {
        ConfigInputs inputs{.file = json.at("file").string(),
                            .sets = json.at("sets").strings(),
                            .sets_folder = json.at("sets_folder").string(),
                            .texts = {}};
        for (const auto& [path, text] : json.at("texts").members())
          inputs.texts.emplace(path, text.string());
        return inputs;
      },
      fmt::format("reading {}", name));
}

std::unique_ptr<SchemaVisitor> TomlDocument::reader() const {
  return std::make_unique<ConfigReader>(impl_->root, impl_->files->loader());
}

void TomlDocument::finish(SchemaVisitor& reader) const {
  static_cast<ConfigReader&>(reader).finish();
}

void TomlDocument::locate_root(Error& error) const {
  Error located(error.kind(),
                fmt::format("{}: {}", impl_->root.place.source->name, error.message()));
  for (const std::string& doing : error.context()) located.add_context(doing);
  error = located;
}

}  // namespace terracast::core
