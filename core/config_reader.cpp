#include "core/config_reader.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/plugin_rows.h"
#include "core/printable.h"
#include "core/registry.h"

namespace terracast::core {

namespace {

std::string section_text(const std::string& name) {
  return name.empty() ? "the top level" : "[" + name + "]";
}

bool is_bare_key(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '-';
  });
}

/// "1 to 2000", "at least 1", "at most 5".
std::string range_text(double lowest, double highest) {
  if (std::isinf(highest)) return fmt::format("at least {}", lowest);
  if (std::isinf(lowest)) return fmt::format("at most {}", highest);
  return fmt::format("{} to {}", lowest, highest);
}

template <class T>
void check_range(T value, const ConfigNode& node, const std::string& name,
                 const Constraint& constraint) {
  // long double holds every 64-bit integer and every double.
  const auto wide = static_cast<long double>(value);
  if (wide >= static_cast<long double>(constraint.lowest) &&
      wide <= static_cast<long double>(constraint.highest))
    return;
  const bool one_sided = std::isinf(constraint.lowest) || std::isinf(constraint.highest);
  fail_at(node.place, "{} = {} {} {}", name, node.shown(), one_sided ? "must be" : "is outside",
          range_text(constraint.lowest, constraint.highest));
}

void check_size(std::size_t size, const ConfigNode& node, const std::string& name,
                const Constraint& constraint) {
  if (size >= constraint.min_size && size <= constraint.max_size) return;
  const char* bound = "";
  std::size_t wanted = constraint.min_size;
  if (constraint.min_size != constraint.max_size) {
    const bool too_small = size < constraint.min_size;
    bound = too_small ? "at least " : "at most ";
    wanted = too_small ? constraint.min_size : constraint.max_size;
  }
  fail_at(node.place, "{} has {} value{}, but must have {}{}", name, size, size == 1 ? "" : "s",
          bound, wanted);
}

[[noreturn]] void refuse_type(const ConfigNode& node, const std::string& name, const char* wanted) {
  if (node.table() != nullptr || std::holds_alternative<ConfigList>(node.data))
    fail_at(node.place, "{} is {}, but must be {}", name, node.type_name(), wanted);
  fail_at(node.place, "{} = {} is {}, but must be {}", name, node.shown(), node.type_name(),
          wanted);
}

}  // namespace

ConfigReader::ConfigReader(const ConfigNode& root, ConfigLoader load)
    : root_(root), load_(std::move(load)) {
  frames_.push_back({&root, {}, {}, {}});
}

const ConfigNode* ConfigReader::find(std::string_view name) {
  Frame& frame = frames_.back();
  const bool is_taken =
      std::find(frame.known.begin(), frame.known.end(), name) != frame.known.end();
  if (is_taken || !is_bare_key(name))
    fail(ErrorKind::Internal, "the key \"{}\" of {} {}; give it another name in describe()",
         printable(name), section_text(frame.name),
         is_taken ? "is described twice" : "is not of letters, digits, _ and -");
  frame.known.emplace_back(name);
  return frame.table == nullptr ? nullptr : frame.table->find(name);
}

std::string ConfigReader::full_name(std::string_view name) const {
  const std::string& outer = frames_.back().name;
  return outer.empty() ? std::string(name) : fmt::format("{}.{}", outer, name);
}

void ConfigReader::visit_value(std::string_view name, ValueRef value, std::string_view meaning,
                               const Constraint& constraint) {
  const ConfigNode* node = find(name);
  if (node == nullptr) {
    if (constraint.required)
      frames_.back().missing.push_back(fmt::format("{} ({})", name, meaning));
    return;
  }
  std::visit([&](auto* out) { read_into(*out, *node, std::string(name), constraint); }, value);
}

bool ConfigReader::begin_section(std::string_view name, std::string_view) {
  const ConfigNode* node = find(name);
  if (node == nullptr) return false;
  push_table(*node, full_name(name));
  return true;
}

void ConfigReader::end_section() {
  check_keys(frames_.back());
  frames_.pop_back();
}

std::size_t ConfigReader::begin_list(std::string_view name, std::string_view,
                                     std::size_t current_size) {
  const ConfigNode* node = find(name);
  lists_.push_back({nullptr, full_name(name)});
  if (node == nullptr) return current_size;
  const auto* items = std::get_if<ConfigList>(&node->data);
  if (items == nullptr)
    refuse_type(*node, std::string(name), "a list of tables, or of paths of files that hold one");
  lists_.back().items = items;
  return items->size();
}

void ConfigReader::begin_item(std::size_t index) {
  const List& list = lists_.back();
  const std::string name = fmt::format("{}[{}]", list.name, index);
  if (list.items == nullptr)
    frames_.push_back({nullptr, name, {}, {}});
  else
    push_table((*list.items)[index], name);
}

void ConfigReader::push_table(const ConfigNode& node, const std::string& name) {
  ConfigNode loaded;
  const ConfigNode* table = &table_behind(node, root_, name, load_, loaded);
  if (table == &loaded) {
    loaded_.push_back(std::move(loaded));
    table = &loaded_.back();
  }
  frames_.push_back({table, name, {}, {}});
}

void ConfigReader::check_keys(const Frame& frame) const {
  if (frame.table == nullptr) return;
  // An unknown key is told first: it may be the missing one, misspelt.
  for (const ConfigEntry& entry : *frame.table->table()) {
    if (std::find(frame.known.begin(), frame.known.end(), entry.key) != frame.known.end()) continue;
    const auto hint = frame.hints.find(entry.key);
    if (hint != frame.hints.end())
      fail_at(entry.key_place, "key \"{}\" in {}: {}", entry.key, section_text(frame.name),
              hint->second);
    const std::string nearest = nearest_name(entry.key, frame.known);
    fail_at(entry.key_place, "unknown key \"{}\" in {}; {}known: {}", entry.key,
            section_text(frame.name),
            nearest.empty() ? "" : fmt::format("nearest: \"{}\"; ", nearest),
            frame.known.empty() ? "none" : fmt::format("{}", fmt::join(frame.known, ", ")));
  }
  if (!frame.missing.empty()) {
    ConfigPlace place = frame.table->place;
    if (frame.name.empty()) place.line = 0;  // the whole file
    fail_at(place, "{} lacks the required key {}", section_text(frame.name),
            fmt::join(frame.missing, " and the key "));
  }
}

void ConfigReader::locate(Error& error) const {
  const Frame& frame = frames_.back();
  check_keys(frame);  // a misspelt key explains more than the check that missed its value
  Error located(error.kind(), fmt::format("{}: {}: {}", frame.table->place.text(),
                                          section_text(frame.name), error.message()));
  for (const std::string& doing : error.context()) located.add_context(doing);
  error = located;
}

void ConfigReader::read_into(bool& out, const ConfigNode& node, const std::string& name,
                             const Constraint&) const {
  const auto* value = std::get_if<bool>(&node.data);
  if (value == nullptr) refuse_type(node, name, "true or false");
  out = *value;
}

void ConfigReader::read_into(std::int64_t& out, const ConfigNode& node, const std::string& name,
                             const Constraint& constraint) const {
  const auto* value = std::get_if<std::int64_t>(&node.data);
  if (value == nullptr) refuse_type(node, name, "a whole number");
  check_range(*value, node, name, constraint);
  out = *value;
}

void ConfigReader::read_into(double& out, const ConfigNode& node, const std::string& name,
                             const Constraint& constraint) const {
  if (const auto* integer = std::get_if<std::int64_t>(&node.data)) {
    constexpr std::int64_t kLargestExact = std::int64_t{1} << 53;
    if (*integer > kLargestExact || *integer < -kLargestExact)
      fail_at(node.place, "{} = {} has more digits than a number can hold", name, *integer);
    check_range(*integer, node, name, constraint);
    out = static_cast<double>(*integer);
    return;
  }
  const auto* value = std::get_if<double>(&node.data);
  if (value == nullptr) refuse_type(node, name, "a number");
  if (!std::isfinite(*value)) fail_at(node.place, "{} = {} is not a finite number", name, *value);
  check_range(*value, node, name, constraint);
  out = *value;
}

void ConfigReader::read_into(std::string& out, const ConfigNode& node, const std::string& name,
                             const Constraint& constraint) const {
  if (node.text() == nullptr) refuse_type(node, name, "text (in quotes)");
  std::string text = expand_text(node, root_).text;
  const std::vector<std::string>& choices = constraint.choices;
  if (!choices.empty() && std::find(choices.begin(), choices.end(), text) == choices.end()) {
    if (const std::string missing = missing_plugin(text); !missing.empty())
      fail_at(node.place, "{} = {}: {}", name, node.shown(), missing);
    const std::string nearest = nearest_name(text, choices);
    fail_at(node.place, "{} = {} is not one of {}{}", name, node.shown(),
            fmt::join(constraint.named_choices(), ", "),
            nearest.empty() ? "" : fmt::format(" (nearest: \"{}\")", nearest));
  }
  out = std::move(text);
}

void ConfigReader::read_into(Path& out, const ConfigNode& node, const std::string& name,
                             const Constraint&) const {
  if (node.text() == nullptr) refuse_type(node, name, "a path (text in quotes)");
  out = {*node.text(), expand_text(node, root_).path()};
}

void ConfigReader::read_into(AnyValue& out, const ConfigNode& node, const std::string&,
                             const Constraint&) const {
  out.node = std::make_shared<const ConfigNode>(node);
}

template <class T>
void ConfigReader::read_into(std::vector<T>& out, const ConfigNode& node, const std::string& name,
                             const Constraint& constraint) const {
  const auto* items = std::get_if<ConfigList>(&node.data);
  if (items == nullptr) refuse_type(node, name, "a list, such as [a, b]");
  // An empty list that stands for a list left out may be written, too.
  if (items->empty() && out.empty() && !constraint.required) return;
  check_size(items->size(), node, name, constraint);
  std::vector<T> values(items->size());
  for (std::size_t i = 0; i < items->size(); ++i)
    read_into(values[i], (*items)[i], fmt::format("{}[{}]", name, i), constraint);
  out = std::move(values);
}

}  // namespace terracast::core
