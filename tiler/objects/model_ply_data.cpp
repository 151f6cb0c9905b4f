#include "tiler/objects/model_ply_data.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <sstream>

#include "core/error.h"
#include "core/printable.h"
#include "core/stop.h"
#include "tiler/objects/model_file.h"
#include "tiler/objects/model_statements.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostHeader_bytes = 65536;
/// Between two looks at whether a stop is asked for.
constexpr std::uint64_t kRowsAtOnce = 65536;
/// No list of a mesh has more: a strip of as many triangles as a model may have takes two values more.
constexpr std::uint64_t kMostListValues = kMostModelTriangles + 2;

constexpr std::array<PlyType, 8> kTypes = {{{"char", "int8", 1, true, true},
                                            {"uchar", "uint8", 1, true, false},
                                            {"short", "int16", 2, true, true},
                                            {"ushort", "uint16", 2, true, false},
                                            {"int", "int32", 4, true, true},
                                            {"uint", "uint32", 4, true, false},
                                            {"float", "float32", 4, false, true},
                                            {"double", "float64", 8, false, true}}};

const PlyType* type_of(std::string_view name) {
  const auto found = std::find_if(kTypes.begin(), kTypes.end(), [&](const PlyType& type) {
    return type.name == name || type.other_name == name;
  });
  return found == kTypes.end() ? nullptr : &*found;
}

double value_of(std::uint64_t bits, const PlyType& type) {
  switch (type.num_bytes) {
    case 1:
      return type.is_signed ? static_cast<std::int8_t>(bits) : static_cast<double>(bits);
    case 2:
      return type.is_signed ? static_cast<std::int16_t>(bits) : static_cast<double>(bits);
    case 4:
      if (type.is_whole)
        return type.is_signed ? static_cast<std::int32_t>(bits) : static_cast<double>(bits);
      {
        const auto half = static_cast<std::uint32_t>(bits);
        float value = 0.0F;
        std::memcpy(&value, &half, sizeof value);
        return static_cast<double>(value);
      }
    default:
      double value = 0.0;
      std::memcpy(&value, &bits, sizeof value);
      return value;
  }
}

}  // namespace

int PlyElement::find(std::string_view property) const {
  for (std::size_t i = 0; i < properties.size(); ++i)
    if (properties[i].name == property) return static_cast<int>(i);
  return -1;
}

PlyData::PlyData(std::span<const std::byte> bytes, const std::string& name)
    : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name_(name) {
  if (!text_.starts_with("ply")) fail(ErrorKind::Input, "{}: no PLY: it does not begin so", name_);
  for (std::string line; line != "end_header";) {
    const std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos || end > kMostHeader_bytes)
      fail(ErrorKind::Input, "{}: its header does not end", name_);
    line = text_.substr(at_, end - at_);
    while (line.ends_with('\r') || line.ends_with(' ') || line.ends_with('\t')) line.pop_back();
    at_ = end + 1;
    take_line(line);
  }
}

void PlyData::take_line(const std::string& line) {
  std::istringstream words(line);
  std::string word;
  words >> word;
  bool is_right = true;
  if (word == "format") {
    words >> word;
    form_ = word == "ascii"                  ? Form::Text
            : word == "binary_little_endian" ? Form::LittleEndian
                                             : Form::BigEndian;
    is_right = form_ != Form::BigEndian || word == "binary_big_endian";
  } else if (word == "element") {
    // Each takes a byte at the least.
    double count = -1.0;
    PlyElement element;
    words >> element.name >> count;
    is_right = count >= 0.0 && count <= static_cast<double>(text_.size());
    for (const PlyElement& other : elements_)
      if (other.name == element.name)
        fail(ErrorKind::Input, "{}: its header has two elements called {}", name_,
             core::printable(core::first_letters(element.name, 40)));
    element.count = is_right ? static_cast<std::uint64_t>(count) : 0;
    elements_.push_back(std::move(element));
  } else if (word == "property") {
    PlyProperty property;
    words >> word;
    if (word == "list") {
      words >> word;
      property.count = type_of(word);
      is_right = property.count != nullptr && property.count->is_whole;
      words >> word;
    }
    property.value = type_of(word);
    words >> property.name;
    is_right = is_right && property.value != nullptr && !elements_.empty();
    if (is_right) elements_.back().properties.push_back(std::move(property));
  } else if (!word.empty() && word != "ply" && word != "end_header") {
    other_lines_.push_back(line);
  }
  if (!is_right)
    fail(ErrorKind::Input, "{}: \"{}\", and the file has {} bytes", name_, line, text_.size());
}

void PlyData::read(const PlyElement& element, const std::function<void(std::uint64_t, Row)>& take) {
  // Rows without properties take no bytes, however many are stated.
  if (element.properties.empty()) return;
  std::vector<std::vector<double>> values(element.properties.size());
  for (std::uint64_t row = 0; row < element.count; ++row) {
    if (row % kRowsAtOnce == 0) core::throw_if_stop_asked();
    for (std::size_t k = 0; k < values.size(); ++k)
      read_property(element, row, element.properties[k], values[k]);
    take(row, values);
  }
}

void PlyData::read_property(const PlyElement& element, std::uint64_t row,
                            const PlyProperty& property, std::vector<double>& values) {
  std::uint64_t count = 1;
  if (property.count != nullptr) count = list_size(element, row, *property.count);
  // A value of text is a digit and what parts it from the next.
  const std::uint64_t least = form_ == Form::Text ? count : count * property.value->num_bytes;
  if (least > text_.size() - at_) fail_short(element, row, count);
  if (count > kMostListValues)
    fail(ErrorKind::Input, "{}: {} {} has a list of {} values, and a list has at most {}", name_,
         element.name, row, count, kMostListValues);
  values.clear();
  for (; count > 0; --count) values.push_back(value(element, row, property));
}

double PlyData::value(const PlyElement& element, std::uint64_t row, const PlyProperty& property) {
  if (form_ != Form::Text) return value_of(bits(property.value->num_bytes), *property.value);
  const std::string_view word = next_word(element, row);
  const auto value = number_of(word);
  if (!value)
    fail(ErrorKind::Input, "{}: {} {}: {} = \"{}\" is no number", name_, element.name, row,
         property.name, word.substr(0, 40));
  return *value;
}

std::uint64_t PlyData::bits(std::size_t num_bytes) {
  std::uint64_t bits = 0;
  for (std::size_t k = 0; k < num_bytes; ++k) {
    const auto byte = static_cast<unsigned char>(text_[at_ + k]);
    bits |= static_cast<std::uint64_t>(byte)
            << 8 * (form_ == Form::LittleEndian ? k : num_bytes - 1 - k);
  }
  at_ += num_bytes;
  return bits;
}

std::uint64_t PlyData::list_size(const PlyElement& element, std::uint64_t row,
                                 const PlyType& type) {
  std::int64_t size = 0;
  if (form_ == Form::Text) {
    const std::string_view word = next_word(element, row);
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), size);
    if (error != std::errc() || end != word.data() + word.size()) size = -1;
  } else {
    if (type.num_bytes > text_.size() - at_) fail_short(element, row, 1);
    const std::uint64_t own = bits(type.num_bytes);
    size = static_cast<std::int64_t>(own);
    if (type.is_signed && own >> (8 * type.num_bytes - 1) != 0) size = -1;
  }
  if (size < 0) fail(ErrorKind::Input, "{}: {} {} has a list of no size", name_, element.name, row);
  return static_cast<std::uint64_t>(size);
}

std::string_view PlyData::next_word(const PlyElement& element, std::uint64_t row) {
  constexpr std::string_view kSpace = " \t\r\n";
  const std::size_t begin = text_.find_first_not_of(kSpace, at_);
  if (begin == std::string_view::npos) fail_short(element, row, 1);
  at_ = std::min(text_.find_first_of(kSpace, begin), text_.size());
  return text_.substr(begin, at_ - begin);
}

std::size_t PlyData::num_bytes_left() const {
  if (form_ != Form::Text) return text_.size() - at_;
  const std::size_t begin = text_.find_first_not_of(" \t\r\n", at_);
  return begin == std::string_view::npos ? 0 : text_.size() - begin;
}

void PlyData::fail_short(const PlyElement& element, std::uint64_t row, std::uint64_t count) const {
  fail(ErrorKind::Input, "{}: {} {} has {} values more, and {} bytes are left; is it cut off?",
       name_, element.name, row, count, text_.size() - at_);
}

}  // namespace terracast::tiler
