#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::validate {

/// The keys of a YAML file of maps in maps, as calibrations are written: values are words, numbers, and lists of numbers, in
/// brackets over one or several lines or as rows that begin with a dash. Threads: safe.
class YamlKeys {
 public:
  /// path   for messages
  /// throws Input: a line that holds no key, a key that stands twice, a list without an end
  YamlKeys(std::string_view text, std::string path);

  bool has(const std::string& key) const { return values_.contains(key); }
  /// key      with those of the maps around it: "cam0.T_cam_imu"
  /// throws   Input: no such key
  const std::string& word(const std::string& key) const;
  /// throws   Input: the same; not so many numbers
  std::vector<double> numbers(const std::string& key, std::size_t count) const;
  double number(const std::string& key) const { return numbers(key, 1)[0]; }
  /// "FILE: KEY"
  std::string where(const std::string& key) const { return path_ + ": " + key; }

 private:
  std::string path_;
  std::map<std::string, std::string> values_;
};

}  // namespace terracast::validate
