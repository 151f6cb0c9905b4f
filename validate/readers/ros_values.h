#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

/// Messages of ROS 2 (CDR), read by the definition of their type that stands beside them (ros2msg).
namespace terracast::validate {

/// A value of a message.
struct RosValue {
  double number = 0.0;  ///< of a number or bool; of an integer of 64 bits it may be rounded
  std::string text;
  std::vector<double> numbers;  ///< of an array of numbers but bytes
  std::vector<RosValue> items;  ///< of an array of all else
  /// Of an array of bytes: where it lies in the message.
  std::size_t bytes_at = 0, num_bytes = 0;
  std::vector<std::pair<std::string, RosValue>> fields;

  /// path     "header.stamp.sec"
  /// throws   Input: there is no such field
  const RosValue& at(std::string_view path) const;
};

/// A type with those that it is made of.
class RosDefinition {
 public:
  /// name     of the file and topic, for messages
  /// throws   Input: no definition of that form; one that is made of itself
  RosDefinition(std::string_view text, std::string name);

  /// message     its start at least: bytes at its end that belong to an array of bytes may be missing
  /// num_bytes   of the whole message
  /// throws      Input: no CDR of little-endian numbers; too short or too long for the definition; more than 200,000
  ///             values, or 2,000,000 numbers in arrays
  /// memory      up to 100 MB beside the texts, whatever the definition says
  RosValue read(std::span<const std::byte> message, std::uint64_t num_bytes) const;

 private:
  struct Field {
    std::string type, name;
    bool is_array = false;
    std::size_t length = 0;  ///< of an array; 0: as many as there are
  };
  class Decoder;
  void add_type(const std::string& type, std::string_view fields);
  /// How many types stand within each other.
  int depth_of(const std::string& type, std::map<std::string, int>& depths) const;

  std::string name_;
  std::map<std::string, std::vector<Field>> types_;  ///< by "package/Name"; the whole by ""
};

}  // namespace terracast::validate
