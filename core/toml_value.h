#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/schema.h"

/// Single values as TOML that reads back to the same value.
namespace terracast::core {

std::string toml_value(bool value);
std::string toml_value(std::int64_t value);
/// The shortest text that reads back to the same bits.
std::string toml_value(double value);
std::string toml_value(const std::string& value);
std::string toml_value(const Path& value);
std::string toml_value(const AnyValue& value);

template <class T>
std::string toml_value(const std::vector<T>& values) {
  std::string text = "[";
  for (std::size_t i = 0; i < values.size(); ++i)
    text += (i > 0 ? ", " : "") + toml_value(values[i]);
  return text + "]";
}

}  // namespace terracast::core
