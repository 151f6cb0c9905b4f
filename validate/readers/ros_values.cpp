#include "validate/readers/ros_values.h"

#include <algorithm>
#include <cstring>

#include "core/error.h"
#include "core/printable.h"
#include "validate/text.h"

namespace terracast::validate {
namespace {

using core::ErrorKind;
using core::fail;

/// Bytes of a number; 0: it is none.
std::size_t size_of_number(std::string_view type) {
  if (type == "bool" || type == "byte" || type == "char" || type == "int8" || type == "uint8")
    return 1;
  if (type == "int16" || type == "uint16") return 2;
  if (type == "int32" || type == "uint32" || type == "float32") return 4;
  if (type == "int64" || type == "uint64" || type == "float64") return 8;
  return 0;
}

template <class Number>
double as_double(const std::byte* at) {
  Number number;
  std::memcpy(&number, at, sizeof(Number));
  return static_cast<double>(number);
}

double number_of(std::string_view type, const std::byte* at) {
  if (type == "float64") return as_double<double>(at);
  if (type == "float32") return as_double<float>(at);
  if (type == "int8") return as_double<std::int8_t>(at);
  if (type == "int16") return as_double<std::int16_t>(at);
  if (type == "uint16") return as_double<std::uint16_t>(at);
  if (type == "int32") return as_double<std::int32_t>(at);
  if (type == "uint32") return as_double<std::uint32_t>(at);
  if (type == "int64") return as_double<std::int64_t>(at);
  if (type == "uint64") return as_double<std::uint64_t>(at);
  return as_double<std::uint8_t>(at);
}

constexpr std::size_t kMostTypes = 100;
constexpr std::size_t kMostFields = 100;
constexpr std::size_t kMostLength = 10000;    // of arrays that the type fixes
constexpr std::size_t kMostName = 255;        // letters of a field's name, which each value repeats
constexpr std::size_t kMostValues = 200'000;  // of a message, each about 200 bytes in memory
constexpr std::size_t kMostNumbers = 2'000'000;  // of a message's arrays

}  // namespace

const RosValue& RosValue::at(std::string_view path) const {
  const std::size_t dot = path.find('.');
  for (const auto& [name, value] : fields)
    if (name == path.substr(0, dot))
      return dot == std::string_view::npos ? value : value.at(path.substr(dot + 1));
  fail(ErrorKind::Input, "the message's definition has no field {}", path);
}

RosDefinition::RosDefinition(std::string_view text, std::string name) : name_(std::move(name)) {
  std::string type, fields;
  for (const TextLine& line : split_lines(text)) {
    if (line.text.starts_with("====")) continue;
    if (line.text.starts_with("MSG: ")) {
      add_type(type, fields);
      type = std::string(trimmed(line.text.substr(5)));
      fields.clear();
    } else {
      fields += std::string(line.text) + "\n";
    }
  }
  add_type(type, fields);
  std::map<std::string, int> depths;
  depth_of("", depths);
}

void RosDefinition::add_type(const std::string& type, std::string_view fields) {
  std::vector<Field> list;
  for (const TextLine& line : split_lines(fields)) {
    const std::string_view words = trimmed(line.text.substr(0, line.text.find('#')));
    const std::size_t blank = words.find(' ');
    if (words.empty() || words.find('=') != std::string_view::npos) continue;  // a constant
    if (blank == std::string_view::npos)
      fail(ErrorKind::Input, "{}: a definition has the line \"{}\"", name_,
           core::first_letters(words, 60));
    Field field;
    field.type = std::string(words.substr(0, blank));
    const std::string_view rest = trimmed(words.substr(blank));
    field.name = std::string(rest.substr(0, rest.find(' ')));
    if (field.name.size() > kMostName)
      fail(ErrorKind::Input,
           "{}: a definition has a field whose name is of {} letters; up to {} are right", name_,
           field.name.size(), kMostName);
    if (const std::size_t bracket = field.type.find('['); bracket != std::string::npos) {
      field.is_array = true;
      const std::string length = field.type.substr(bracket + 1);
      if (length != "]") {
        const std::int64_t count = parse_integer(length.substr(0, length.find(']')), name_);
        if (count < 1 || count > static_cast<std::int64_t>(kMostLength))
          fail(ErrorKind::Input, "{}: a definition has an array of {}", name_, count);
        field.length = static_cast<std::size_t>(count);
      }
      field.type.resize(bracket);
    }
    list.push_back(std::move(field));
  }
  if (list.empty() || list.size() > kMostFields)
    fail(ErrorKind::Input, "{}: the definition of \"{}\" has {} fields", name_,
         core::first_letters(type, 60), list.size());
  types_[type] = std::move(list);
  if (types_.size() > kMostTypes)
    fail(ErrorKind::Input, "{}: a definition of more than {} types", name_, kMostTypes);
}

int RosDefinition::depth_of(const std::string& type, std::map<std::string, int>& depths) const {
  constexpr int kMostDepth = 6;
  constexpr int kAbove = -1;  // a type that this one is a part of
  const auto found = types_.find(type);
  const auto [known, is_new] = depths.emplace(type, kAbove);
  if (found == types_.end() || (!is_new && known->second == kAbove))
    fail(ErrorKind::Input, "{}: the definition of {} is missing, or is made of itself", name_,
         core::first_letters(type, 60));
  if (!is_new) return known->second;
  int depth = 0;
  for (const Field& field : found->second)
    if (size_of_number(field.type) == 0 && field.type != "string")
      depth = std::max(depth, 1 + depth_of(field.type, depths));
  if (depth > kMostDepth)
    fail(ErrorKind::Input, "{}: a definition of types within types, more than {} deep", name_,
         kMostDepth);
  depths[type] = depth;
  return depth;
}

/// Takes values from a message, never beyond its end.
class RosDefinition::Decoder {
 public:
  Decoder(const RosDefinition& definition, std::span<const std::byte> bytes,
          std::uint64_t num_bytes)
      : definition_(definition), bytes_(bytes), num_bytes_(num_bytes) {
    constexpr std::byte kHead[] = {std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0}};
    if (bytes.size() < kHeadBytes || std::memcmp(bytes.data(), kHead, kHeadBytes) != 0)
      fail(ErrorKind::Input, "{}: a message that does not begin as CDR does (00 01 00 00)",
           definition.name_);
  }

  RosValue message() {
    RosValue value = of_type("");
    if (at_ != num_bytes_)
      fail(ErrorKind::Input, "{}: a message of {} bytes, of which its definition tells {}",
           definition_.name_, num_bytes_, at_);
    return value;
  }

 private:
  static constexpr std::size_t kHeadBytes = 4;

  void need(std::uint64_t count) const {
    if (count > num_bytes_ - at_)
      fail(ErrorKind::Input, "{}: a message of {} bytes ends within a field", definition_.name_,
           num_bytes_);
  }
  /// throws   Input: beyond the end of the message, or of its start that is here
  const std::byte* take(std::size_t size) {
    need(size);
    if (at_ + size > bytes_.size())
      fail(ErrorKind::Input, "{}: numbers behind an image's", definition_.name_);
    at_ += size;
    return bytes_.data() + (at_ - size);
  }
  void align(std::size_t size) {
    const std::size_t over = (at_ - kHeadBytes) % size;
    if (over > 0) take(size - over);
  }
  double number(std::string_view type) {
    const std::size_t size = size_of_number(type);
    align(size);
    return number_of(type, take(size));
  }

  /// Before values are made.
  void count(std::size_t values) {
    num_values_ += values;
    if (num_values_ > kMostValues)
      fail(ErrorKind::Input, "{}: a message of more than {} values, not counting arrays of numbers",
           definition_.name_, kMostValues);
  }

  RosValue of_type(const std::string& type) {
    const std::vector<Field>& fields = definition_.types_.at(type);
    count(fields.size());
    RosValue value;
    value.fields.reserve(fields.size());
    for (const Field& field : fields)
      value.fields.emplace_back(field.name, field.is_array ? array(field) : one(field.type));
    return value;
  }
  RosValue one(const std::string& type) {
    RosValue value;
    if (size_of_number(type) > 0) {
      value.number = number(type);
    } else if (type == "string") {
      const auto length = static_cast<std::size_t>(number("uint32"));
      const std::byte* words = take(length);
      if (length == 0 || words[length - 1] != std::byte{0})
        fail(ErrorKind::Input, "{}: a text that does not end with a zero", definition_.name_);
      value.text.assign(reinterpret_cast<const char*>(words), length - 1);
    } else {
      value = of_type(type);
    }
    return value;
  }
  RosValue array(const Field& field) {
    RosValue value;
    const auto length =
        field.length > 0 ? field.length : static_cast<std::size_t>(number("uint32"));
    const std::size_t size = size_of_number(field.type);
    need(length);  // each takes a byte at least
    if (size == 1) {
      value.bytes_at = at_;
      value.num_bytes = length;
      at_ += length;
    } else if (size > 0) {
      if (length > 0) align(size);
      need(length * size);
      num_numbers_ += length;
      if (num_numbers_ > kMostNumbers)
        fail(ErrorKind::Input, "{}: a message of more than {} numbers in arrays", definition_.name_,
             kMostNumbers);
      value.numbers.reserve(length);
      for (std::size_t i = 0; i < length; ++i) value.numbers.push_back(number(field.type));
    } else {
      count(length);
      value.items.reserve(length);
      for (std::size_t i = 0; i < length; ++i) value.items.push_back(one(field.type));
    }
    return value;
  }

  const RosDefinition& definition_;
  std::span<const std::byte> bytes_;
  std::uint64_t num_bytes_;
  std::size_t at_ = kHeadBytes;
  std::size_t num_values_ = 0, num_numbers_ = 0;
};

RosValue RosDefinition::read(std::span<const std::byte> message, std::uint64_t num_bytes) const {
  return Decoder(*this, message, num_bytes).message();
}

}  // namespace terracast::validate
