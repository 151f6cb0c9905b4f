#pragma once

#include <filesystem>
#include <initializer_list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "core/json.h"
#include "core/schema.h"

namespace terracast::core {

/// What a config was read from: it reads again to the same values, whoever changes its files
/// meanwhile and from whatever working directory.
struct ConfigInputs {
  std::filesystem::path file;  ///< absolute
  std::vector<std::string> sets;
  std::filesystem::path sets_folder;         ///< absolute; where relative paths of the sets start
  std::map<std::string, std::string> texts;  ///< of every file that was read, by absolute path

  Json json() const;
  /// throws Input: a member is missing; `name` is the file's, for messages
  static ConfigInputs from_json(const Json& json, const std::string& name);
};

/// A config file with what it extends, the files its sections name, and the `--set KEY=VALUE` of
/// the command line.
///
/// - `extends = "base.toml"` in a file or in any table: the base's keys, overridden by the table's
///   own (tables merge, all else is replaced). A loop of `extends`, or of sections that name files,
///   is an error that lists the files.
/// - A section or list item given as text is the path of a file that holds the table.
/// - `${name}` in any text is replaced by the whole config's top-level key `name` (text or a path).
/// - A relative path starts at the file it is written in; one from --set at the working directory.
/// - --set values are TOML values, or bare text where that does not parse; keys are dotted, items
///   by index (`rigs.0.name=left`).
class TomlDocument {
 public:
  /// throws Io (file missing), Config (syntax, loops; with file:line:column)
  static TomlDocument load(const std::filesystem::path& file,
                           const std::vector<std::string>& sets = {});
  static TomlDocument parse(std::string_view text, const std::string& file_name,
                            const std::vector<std::string>& sets = {});
  /// Files that the inputs do not hold are read from where they lie.
  static TomlDocument load(const ConfigInputs& inputs);

  /// A value for a dotted key.
  struct Change {
    std::string key;
    AnyValue value;
  };
  /// The same document with other values, and without some top-level keys.
  /// throws Config: as --set
  TomlDocument with(const std::vector<Change>& changes,
                    std::initializer_list<std::string_view> without = {}) const;

  /// Whether there is a top-level key.
  bool has(std::string_view key) const;
  /// With the files that were read so far: those that sections name are read with the sections.
  ConfigInputs inputs() const;

  ~TomlDocument();
  TomlDocument(TomlDocument&&) noexcept;
  TomlDocument& operator=(TomlDocument&&) noexcept;

  /// Fills `value` from the document.
  /// throws   Config: an unknown key (naming the nearest known one), a wrong type, a value outside
  ///          its constraint, a missing required key, a failed validate(): each with
  ///          file:line:column
  template <class Struct>
  void read(Struct& value) const {
    auto visitor = reader();
    value.describe(*visitor);
    finish(*visitor);
    if constexpr (requires { value.validate(); }) {
      try {
        value.validate();
      } catch (Error& error) {
        locate_root(error);
        throw;
      }
    }
  }

  /// Fills `value` from one section; its defaults stay where there is none.
  /// throws   as read()
  template <class Struct>
  void read_section(std::string_view name, Struct& value) const {
    reader()->section(name, value, {});
  }

 private:
  struct Impl;
  explicit TomlDocument(std::unique_ptr<Impl> impl);
  std::unique_ptr<SchemaVisitor> reader() const;
  void finish(SchemaVisitor& reader) const;
  void locate_root(Error& error) const;
  std::unique_ptr<Impl> impl_;
};

/// Reads a whole file into a described struct.
template <class Struct>
Struct read_toml(const std::filesystem::path& file, const std::vector<std::string>& sets = {}) {
  Struct value;
  TomlDocument::load(file, sets).read(value);
  return value;
}

}  // namespace terracast::core
