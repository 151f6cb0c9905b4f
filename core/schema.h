#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/error.h"

/// Configuration keys are declared once, by a template member `describe(Visitor&)` of the struct
/// that uses them. The TOML reader, the dump of the resolved config, the manual, `config explain`
/// and the cache key are visitors.
///
///     struct CameraOptions {
///       std::string model = "pinhole";
///       double focal_length_mm = 24.0;
///       template <class Visitor> void describe(Visitor& visit) {
///         visit.key("model", model, "Camera model.", one_of({"pinhole"}));
///         visit.key("focal_length_mm", focal_length_mm, "Focal length.", between(1.0, 2000.0));
///       }
///       void validate() const;  // optional: checks across keys; throws Error(Config)
///     };
namespace terracast::core {

/// A path as a config writes it, and where it points: relative paths start at the file that holds
/// them, or at the working directory when they were given on the command line. Only `written` is
/// stored or hashed.
struct Path {
  std::string written;
  std::filesystem::path resolved;
  bool empty() const { return written.empty(); }
  bool operator==(const Path&) const = default;
};

struct ConfigNode;

/// A value of any type, which knows where it was written; what a text in it stands for is known only
/// where it is put.
struct AnyValue {
  std::shared_ptr<const ConfigNode> node;
  std::string toml() const;  ///< on one line
};

/// What values a key may take. Numbers: a closed range. Text: one of a list. Lists of numbers: the
/// range of each element, and how many elements.
struct Constraint {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
  std::vector<std::string> choices = {};  ///< "" among them: as if the key were left out
  std::size_t min_size = 0;
  std::size_t max_size = std::numeric_limits<std::size_t>::max();
  bool required = false;

  /// The choices to be written in a config.
  std::vector<std::string> named_choices() const {
    std::vector<std::string> named = choices;
    std::erase(named, "");
    return named;
  }
};

inline Constraint between(double lowest, double highest) {
  return {.lowest = lowest, .highest = highest};
}
inline Constraint at_least(double lowest) { return {.lowest = lowest}; }
inline Constraint one_of(std::vector<std::string> choices) {
  return {.choices = std::move(choices)};
}
inline Constraint size_of(std::size_t count) { return {.min_size = count, .max_size = count}; }
/// The key has no default: a config that leaves it out is refused.
inline Constraint required(Constraint base = {}) {
  base.required = true;
  return base;
}

/// A non-owning reference to the variable behind a key.
using ValueRef =
    std::variant<bool*, std::int64_t*, double*, std::string*, Path*, std::vector<double>*,
                 std::vector<std::int64_t>*, std::vector<std::string>*, std::vector<Path>*,
                 std::vector<AnyValue>*>;

/// Base of everything that walks a description. `key`, `section` and `list` are what describe()
/// calls.
class SchemaVisitor {
 public:
  virtual ~SchemaVisitor() = default;

  /// A value. Units are part of the name (`_m`, `_deg`, `_px`, `_s`, `_mm`, `_bytes`).
  template <class T>
  void key(std::string_view name, T& value, std::string_view meaning,
           const Constraint& constraint = {}) {
    visit_value(name, ValueRef(&value), meaning, constraint);
  }

  /// A nested struct; in TOML a table, or the path of a file that holds the table.
  template <class Struct>
  void section(std::string_view name, Struct& value, std::string_view meaning) {
    if (!begin_section(name, meaning)) return;
    value.describe(*this);
    if constexpr (requires { value.validate(); }) validate_section([&] { value.validate(); });
    end_section();
  }

  /// A section that what is written of a config leaves out while all its keys are at their defaults.
  template <class Struct>
  void optional_section(std::string_view name, Struct& value, std::string_view meaning) {
    if (!leaves_out_defaults() || value != Struct{}) section(name, value, meaning);
  }

  /// A list of structs; in TOML an array of tables (or of paths to files that hold one).
  template <class Struct>
  void list(std::string_view name, std::vector<Struct>& items, std::string_view meaning) {
    const std::size_t count = begin_list(name, meaning, items.size());
    if (replaces_items()) items.clear();
    items.resize(count);
    for (std::size_t i = 0; i < count; ++i) {
      begin_item(i);
      items[i].describe(*this);
      if constexpr (requires { items[i].validate(); })
        validate_section([&] { items[i].validate(); });
      end_item();
    }
    if (count == 0 && describes_empty_lists()) {  // the manual shows what an item would hold
      Struct example;
      begin_item(0);
      example.describe(*this);
      end_item();
    }
    end_list();
  }

 protected:
  virtual void visit_value(std::string_view name, ValueRef value, std::string_view meaning,
                           const Constraint& constraint) = 0;
  /// False: the section is left out (its defaults stay).
  virtual bool begin_section(std::string_view name, std::string_view meaning) = 0;
  virtual void end_section() = 0;
  /// Returns how many items the list shall have.
  virtual std::size_t begin_list(std::string_view name, std::string_view meaning,
                                 std::size_t current_size) = 0;
  /// True: the items start from their own defaults, not from those that the list held.
  virtual bool replaces_items() const { return false; }
  virtual void end_list() = 0;
  virtual void begin_item(std::size_t index) = 0;
  virtual void end_item() = 0;
  virtual bool describes_empty_lists() const { return false; }
  virtual bool leaves_out_defaults() const { return false; }

  /// Runs a struct's validate(); the reader adds file, line and section to what it throws.
  template <class Check>
  void validate_section(Check&& check) {
    if (!runs_validation()) return;
    try {
      check();
    } catch (Error& error) {
      locate(error);
      throw;
    }
  }
  virtual bool runs_validation() const { return false; }
  virtual void locate(Error&) const {}
};

}  // namespace terracast::core
