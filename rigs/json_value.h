#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/json.h"
#include "core/ledger.h"
#include "rigs/key_record.h"

namespace terracast::rigs {

/// A value of a JSON file, which records the members that are taken; ledger() of any of them tells of the whole file.
/// throws   Input, from all that asks for a value of one kind: it is another, or not there; says file and member
/// threads  not safe
class JsonValue {
 public:
  /// throws   Io: no such file; Input: larger than `most_bytes`, no JSON
  static JsonValue read(const std::filesystem::path& file, std::size_t most_bytes);

  const core::Json& json() const { return *json_; }  ///< with nothing taken
  /// Whether an object has a member; it is not yet taken by that.
  bool has(std::string_view member) const;
  /// The value of a member, which is taken.
  JsonValue at(std::string_view member) const;
  std::vector<JsonValue> items() const;

  /// For the ledger: nothing can be made of this value.
  void pass_over(const std::string& why) const;
  /// A value of which nothing could be made, by the value itself.
  void misunderstand(const std::string& value) const;
  core::Ledger ledger(std::span<const core::KnownName> known) const;

  /// "rig_config.json: [0].cameras[1]"
  std::string where() const;

 private:
  struct File {
    std::string path;
    core::Json root;
    KeyRecord record;
  };
  JsonValue(std::shared_ptr<File> file, KeyRecord::Path path, const core::Json* json);
  void open() const;

  std::shared_ptr<File> file_;
  KeyRecord::Path path_;
  const core::Json* json_;
};

}  // namespace terracast::rigs
