#include "core/schema_writer.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/toml_value.h"

namespace terracast::core {

namespace {

/// Writes keys before sub-tables, as TOML wants it, whatever the order of the description.
class TomlWriter : public SchemaVisitor {
 public:
  explicit TomlWriter(std::string& output) : output_(output) { output_.clear(); }

 protected:
  void visit_value(std::string_view name, ValueRef value, std::string_view,
                   const Constraint& constraint) override {
    const bool is_empty = std::visit(
        [](const auto* v) {
          if constexpr (requires { v->front(); }) return v->empty();
          return false;
        },
        value);
    if (is_empty && constraint.min_size > 0) return;  // a list that may also be left out
    add_key(name, std::visit([](const auto* v) { return toml_value(*v); }, value));
  }
  bool begin_section(std::string_view name, std::string_view) override {
    const std::string full = full_name(name);
    tables_.push_back({full, "\n[" + full + "]\n", {}});
    return true;
  }
  void end_section() override {
    const Table table = std::move(tables_.back());
    tables_.pop_back();
    (tables_.empty() ? output_ : tables_.back().sub_tables) += table.keys + table.sub_tables;
  }
  std::size_t begin_list(std::string_view name, std::string_view,
                         std::size_t current_size) override {
    if (current_size == 0) add_key(name, "[]");
    lists_.push_back(full_name(name));
    return current_size;
  }
  void end_list() override { lists_.pop_back(); }
  void begin_item(std::size_t) override {
    tables_.push_back({lists_.back(), "\n[[" + lists_.back() + "]]\n", {}});
  }
  void end_item() override { end_section(); }
  bool leaves_out_defaults() const override { return true; }

 private:
  struct Table {
    std::string name;
    std::string keys;  ///< with the header
    std::string sub_tables;
  };

  std::string full_name(std::string_view name) const {
    return tables_.empty() ? std::string(name) : fmt::format("{}.{}", tables_.back().name, name);
  }
  void add_key(std::string_view name, const std::string& value) {
    const std::string line = fmt::format("{} = {}\n", name, value);
    if (!tables_.empty()) {
      tables_.back().keys += line;
    } else {
      output_.insert(top_keys_end_, line);
      top_keys_end_ += line.size();
    }
  }

  std::string& output_;
  std::size_t top_keys_end_ = 0;
  std::vector<Table> tables_;
  std::vector<std::string> lists_;
};

const char* type_name(const bool*) { return "bool"; }
const char* type_name(const std::int64_t*) { return "integer"; }
const char* type_name(const double*) { return "number"; }
const char* type_name(const std::string*) { return "text"; }
const char* type_name(const Path*) { return "path"; }
const char* type_name(const std::vector<double>*) { return "list of numbers"; }
const char* type_name(const std::vector<std::int64_t>*) { return "list of integers"; }
const char* type_name(const std::vector<std::string>*) { return "list of texts"; }
const char* type_name(const std::vector<Path>*) { return "list of paths"; }
const char* type_name(const std::vector<AnyValue>*) { return "list of values"; }

/// The unit in a name's suffix: `focal_length_mm` is in mm, `speed_m_per_s` and `speed_mps` in m/s.
std::string unit_of(std::string_view name) {
  static constexpr std::string_view kUnits[] = {
      "bytes", "cm",  "db", "deg", "h",   "hz", "kg", "km",      "km2", "m",       "m2",
      "m3",    "min", "mm", "ms",  "nm",  "ns", "pa", "percent", "ppb", "ppm",     "px",
      "rad",   "s",   "um", "us",  "lux", "k",  "dn", "e",       "ev",  "permille"};
  const auto last_word = [](std::string_view text) {
    return text.substr(text.rfind('_') + 1);  // npos + 1 is 0
  };
  const auto is_unit = [](std::string_view word) {
    return std::find(std::begin(kUnits), std::end(kUnits), word) != std::end(kUnits);
  };
  const std::string_view unit = last_word(name);
  // Endings of names whose unit is a compound one.
  static constexpr std::pair<std::string_view, std::string_view> kCompounds[] = {
      {"_radps_per_sqrt_hz", "rad/s/√Hz"},
      {"_mps2_per_sqrt_hz", "m/s²/√Hz"},
      {"_radps_per_s_per_sqrt_hz", "rad/s²/√Hz"},
      {"_mps2_per_s_per_sqrt_hz", "m/s³/√Hz"},
      {"_nt_per_sqrt_hz", "nT/√Hz"},
      {"_nt_per_s_per_sqrt_hz", "nT/s/√Hz"},
      {"_nt", "nT"},
      {"_pa_per_sqrt_s", "Pa/√s"},
      {"_radps", "rad/s"},
      {"_n_s2_per_rad2", "N/(rad/s)²"},
      {"_nm_s2_per_rad2", "N m/(rad/s)²"},
      {"_n_s2_per_m2", "N/(m/s)²"},
      {"_cd_per_m2", "cd/m²"},
      {"_kg_m2", "kg m²"},
      {"_n_s2_per_rad_m", "N/(rad/s)/(m/s)"},
      {"_mps3", "m/s³"},
      {"_mps2", "m/s²"},
      {"_mps", "m/s"},
      {"_mrad", "mrad"}};
  for (const auto& [ending, compound] : kCompounds)
    if (name.ends_with(ending)) return std::string(compound);
  if (unit.size() == name.size() || !is_unit(unit)) return {};
  const std::string_view rest = name.substr(0, name.size() - unit.size() - 1);
  if (!rest.ends_with("_per")) return std::string(unit);
  const std::string_view above = last_word(rest.substr(0, rest.size() - 4));
  return fmt::format("{}/{}", is_unit(above) ? above : "1", unit);
}

/// "1 to 2000", "one of a, b", "3 values, each at least 0, required".
std::string range_of(const Constraint& constraint) {
  const double lowest = constraint.lowest;
  const double highest = constraint.highest;
  std::vector<std::string> parts;
  if (constraint.min_size == constraint.max_size)
    parts.push_back(
        fmt::format("{} value{}", constraint.min_size, constraint.min_size == 1 ? "" : "s"));
  else if (constraint.max_size != std::numeric_limits<std::size_t>::max())
    parts.push_back(fmt::format("{} to {} values", constraint.min_size, constraint.max_size));
  else if (constraint.min_size > 1 || (constraint.min_size == 1 && constraint.required))
    // One that may be left out may be empty.
    parts.push_back(fmt::format("at least {} value{}", constraint.min_size,
                                constraint.min_size == 1 ? "" : "s"));
  if (std::isfinite(lowest) && std::isfinite(highest))
    parts.push_back(fmt::format("{} to {}", lowest, highest));
  else if (std::isfinite(lowest))
    parts.push_back(fmt::format("at least {}", lowest));
  else if (std::isfinite(highest))
    parts.push_back(fmt::format("at most {}", highest));
  const std::vector<std::string> named = constraint.named_choices();
  if (!named.empty()) parts.push_back(fmt::format("one of {}", fmt::join(named, ", ")));
  if (constraint.required) parts.emplace_back("required");
  return fmt::format("{}", fmt::join(parts, "; "));
}

class KeyLister : public SchemaVisitor {
 public:
  explicit KeyLister(std::vector<KeyInfo>& output) : output_(output) { output_.clear(); }

 protected:
  void visit_value(std::string_view name, ValueRef value, std::string_view meaning,
                   const Constraint& constraint) override {
    output_.push_back(
        {.name = prefix_ + std::string(name),
         .type = std::visit([](const auto* v) { return type_name(v); }, value),
         .unit = unit_of(name),
         .range = range_of(constraint),
         .default_value = std::visit([](const auto* v) { return toml_value(*v); }, value),
         .meaning = std::string(meaning)});
    if (constraint.required) output_.back().default_value.clear();
  }
  bool begin_section(std::string_view name, std::string_view) override {
    open(std::string(name) + ".");
    return true;
  }
  void end_section() override { close(); }
  std::size_t begin_list(std::string_view name, std::string_view, std::size_t) override {
    open(std::string(name) + "[].");
    return 0;  // what is shown is a fresh item, whatever the defaults hold
  }
  void end_list() override { close(); }
  void begin_item(std::size_t) override {}
  void end_item() override {}
  bool describes_empty_lists() const override { return true; }

 private:
  void open(const std::string& step) {
    outer_sizes_.push_back(prefix_.size());
    prefix_ += step;
  }
  void close() {
    prefix_.resize(outer_sizes_.back());
    outer_sizes_.pop_back();
  }

  std::vector<KeyInfo>& output_;
  std::string prefix_;
  std::vector<std::size_t> outer_sizes_;
};

/// Text for a cell of a Markdown table.
std::string cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '|') escaped += '\\';
    escaped += c == '\n' ? ' ' : c;
  }
  return escaped;
}

std::string code_cell(const std::string& text) {
  return text.empty() ? std::string() : "`" + cell(text) + "`";
}

}  // namespace

std::unique_ptr<SchemaVisitor> make_toml_writer(std::string& output) {
  return std::make_unique<TomlWriter>(output);
}

std::unique_ptr<SchemaVisitor> make_key_lister(std::vector<KeyInfo>& output) {
  return std::make_unique<KeyLister>(output);
}

std::string markdown_table(const std::vector<KeyInfo>& keys) {
  std::string text =
      "| key | unit | default | range | meaning |\n| --- | --- | --- | --- | --- |\n";
  for (const KeyInfo& key : keys)
    text += fmt::format("| {} | {} | {} | {} | {} |\n", code_cell(key.name), cell(key.unit),
                        code_cell(key.default_value), cell(key.range), cell(key.meaning));
  return text;
}

}  // namespace terracast::core
