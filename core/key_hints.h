#pragma once

#include <string>
#include <string_view>

namespace terracast::core {

/// What a SchemaVisitor that refuses unknown keys is besides: it can be told of keys that a section takes only with
/// another choice, and says so where such a key is given.
class KeyHints {
 public:
  virtual ~KeyHints() = default;
  /// key    not of the section at hand as it is chosen
  /// hint   whose it is: "models that have it are radial, opencv"
  virtual void hint(std::string_view key, const std::string& hint) = 0;
};

}  // namespace terracast::core
