#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "geo/rigid3.h"

namespace YAML {
class Node;
}

namespace terracast::rigs {

/// A value of a YAML file, which knows where it stands.
/// throws   Input, from all that asks for a value of one kind: it is another, or not there; says file, line and
///          what would be right
class YamlValue {
 public:
  /// throws   Io: no such file; Input: too large, no YAML
  static YamlValue read(const std::filesystem::path& file);

  bool has(std::string_view key) const;
  YamlValue at(std::string_view key) const;
  /// Keys of a map, in the file's order.
  std::vector<std::string> keys() const;
  /// Items of a list.
  std::vector<YamlValue> items() const;

  std::string text() const;
  double number() const;
  /// At least 1, and no larger than an image can be.
  int size_px() const;
  /// A list of finite numbers, flat or of rows. count 0: any.
  std::vector<double> numbers(std::size_t count = 0) const;
  /// A rotation matrix with a translation, of 3 or 4 rows of 4. Rotations are within 1e-3 of one, as
  /// printed digits leave them, and made whole.
  geo::Rigid3d rigid() const;
  geo::Rigid3d rigid(const std::vector<double>& rotation,
                     const std::vector<double>& translation) const;

  /// "chain.yaml:12: cam0.intrinsics"
  std::string where() const;

 private:
  YamlValue(std::string file, std::string path, const YAML::Node& node);
  std::string file_;
  std::string path_;
  std::shared_ptr<const YAML::Node> node_;
};

}  // namespace terracast::rigs
