#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/schema.h"

namespace terracast::core {

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
