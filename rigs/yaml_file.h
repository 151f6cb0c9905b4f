#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/ledger.h"
#include "geo/rigid3.h"
#include "rigs/key_record.h"

namespace YAML {
class Node;
}

namespace terracast::rigs {

/// A value of a YAML file, which knows where it stands. All values of a file share a record of the keys that were
/// taken; ledger() of any of them tells of the whole file.
/// throws   Input, from all that asks for a value of one kind: it is another, or not there; says file, line and
///          what would be right
/// threads  not safe
class YamlValue {
 public:
  /// The first document of a file, with or without OpenCV's first line; JSON, which is YAML; and XML of OpenCV's
  /// FileStorage, as the same file would be in YAML.
  /// throws   Io: no such file; Input: too large, no YAML
  static YamlValue read(const std::filesystem::path& file);

  bool is_map() const;
  bool is_list() const;
  /// Nothing stands after the key.
  bool is_null() const;

  /// Whether a map has a key; it is not yet taken by that.
  bool has(std::string_view key) const;
  /// Whether a map has a key, and a value for it.
  bool states(std::string_view key) const;
  /// The value of a key, which is taken.
  YamlValue at(std::string_view key) const;
  /// Keys of a map, in the file's order; none is taken by that.
  std::vector<std::string> keys() const;
  /// Items of a list.
  std::vector<YamlValue> items() const;

  std::string text() const;
  double number() const;
  /// At least 1, and no larger than an image can be.
  int size_px() const;
  /// A list of finite numbers, flat or of rows. count 0: any.
  std::vector<double> numbers(std::size_t count = 0) const;
  /// Numbers of a matrix with rows, cols and data, as OpenCV and ROS write them, row by row; or of a list.
  /// count 0: any
  std::vector<double> matrix(std::size_t count = 0) const;
  /// A rotation matrix with a translation, of 3 or 4 rows of 4. Rotations are within 1e-3 of one, as
  /// printed digits leave them, and made whole.
  geo::Rigid3d rigid() const;
  geo::Rigid3d rigid(const std::vector<double>& rotation,
                     const std::vector<double>& translation) const;

  /// For the ledger: nothing can be made of this value; of a part of it; it contradicts another.
  void pass_over(const std::string& why) const;
  void leave_out(const std::string& part, const std::string& why) const;
  void misunderstand(const std::string& value) const;
  /// Of the whole file, by what the reader knows.
  core::Ledger ledger(std::span<const core::KnownName> known,
                      std::string (*name)(const KeyRecord::Path&) = KeyRecord::name_of) const;

  /// "chain.yaml:12: cam0.intrinsics"
  std::string where() const;

 private:
  struct File {
    std::string path;
    std::size_t num_other_documents = 0;
    KeyRecord record;
  };
  YamlValue(std::shared_ptr<File> file, KeyRecord::Path path, const YAML::Node& node);
  void open() const;

  std::shared_ptr<File> file_;
  KeyRecord::Path path_;
  std::shared_ptr<const YAML::Node> node_;
};

/// Whether a file is a map in YAML, or in what YamlValue::read() takes for it, for formats that are told apart by their keys; nullptr: it is none.
/// throws   as YamlValue::read
std::unique_ptr<YamlValue> yaml_map_of(const std::filesystem::path& file);

}  // namespace terracast::rigs
