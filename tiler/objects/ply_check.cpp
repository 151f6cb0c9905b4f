#include "tiler/objects/ply_check.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <string_view>
#include <vector>

#include "core/error.h"

namespace terracast::tiler {
namespace {

using core::ErrorKind;
using core::fail;

constexpr std::size_t kMostHeader_bytes = 65536;

struct Type {
  std::string_view name, other_name;
  std::size_t num_bytes;
  bool is_whole, is_signed;
};
constexpr std::array<Type, 8> kTypes = {{{"char", "int8", 1, true, true},
                                         {"uchar", "uint8", 1, true, false},
                                         {"short", "int16", 2, true, true},
                                         {"ushort", "uint16", 2, true, false},
                                         {"int", "int32", 4, true, true},
                                         {"uint", "uint32", 4, true, false},
                                         {"float", "float32", 4, false, true},
                                         {"double", "float64", 8, false, true}}};

struct Property {
  const Type* count = nullptr;  ///< of a list; null: one value
  const Type* value = nullptr;
};
struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};
enum class Form { Text, LittleEndian, BigEndian };

class PlyCheck {
 public:
  PlyCheck(std::span<const std::byte> bytes, const std::string& name)
      : text_(reinterpret_cast<const char*>(bytes.data()), bytes.size()), name_(name) {}

  void run() {
    read_header();
    for (const Element& element : elements_)
      for (std::uint64_t row = 0; row < element.count; ++row)
        for (const Property& property : element.properties) pass(element, row, property);
  }

 private:
  void read_header() {
    if (!text_.starts_with("ply"))
      fail(ErrorKind::Input, "{}: no PLY: it does not begin so", name_);
    for (std::string line; line != "end_header";) {
      const std::size_t end = text_.find('\n', at_);
      if (end == std::string_view::npos || end > kMostHeader_bytes)
        fail(ErrorKind::Input, "{}: its header does not end", name_);
      line = text_.substr(at_, end - at_);
      if (line.ends_with('\r')) line.pop_back();
      at_ = end + 1;
      take(line);
    }
  }

  void take(const std::string& line) {
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
      Element element;
      words >> element.name >> count;
      is_right = count >= 0.0 && count <= static_cast<double>(text_.size());
      element.count = is_right ? static_cast<std::uint64_t>(count) : 0;
      elements_.push_back(std::move(element));
    } else if (word == "property") {
      Property property;
      words >> word;
      if (word == "list") {
        words >> word;
        property.count = type_of(word);
        is_right = property.count != nullptr && property.count->is_whole;
        words >> word;
      }
      property.value = type_of(word);
      is_right = is_right && property.value != nullptr && !elements_.empty();
      if (is_right) elements_.back().properties.push_back(property);
    }
    if (!is_right)
      fail(ErrorKind::Input, "{}: \"{}\", and the file has {} bytes", name_, line, text_.size());
  }

  static const Type* type_of(std::string_view name) {
    const auto found = std::find_if(kTypes.begin(), kTypes.end(), [&](const Type& type) {
      return type.name == name || type.other_name == name;
    });
    return found == kTypes.end() ? nullptr : &*found;
  }

  void pass(const Element& element, std::uint64_t row, const Property& property) {
    std::uint64_t count = 1;
    if (property.count != nullptr) count = list_size(element, row, *property.count);
    // A value of text is a digit and what parts it from the next.
    const std::uint64_t least = form_ == Form::Text ? count : count * property.value->num_bytes;
    if (least > text_.size() - at_) fail_short(element, row, count);
    if (form_ == Form::Text)
      for (; count > 0; --count) next_word(element, row);
    else
      at_ += least;
  }

  std::uint64_t list_size(const Element& element, std::uint64_t row, const Type& type) {
    std::int64_t size = 0;
    if (form_ == Form::Text) {
      const std::string_view word = next_word(element, row);
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), size);
      if (error != std::errc() || end != word.data() + word.size()) size = -1;
    } else {
      if (type.num_bytes > text_.size() - at_) fail_short(element, row, 1);
      std::uint64_t bits = 0;
      for (std::size_t k = 0; k < type.num_bytes; ++k) {
        const auto byte = static_cast<unsigned char>(text_[at_ + k]);
        bits |= static_cast<std::uint64_t>(byte)
                << 8 * (form_ == Form::LittleEndian ? k : type.num_bytes - 1 - k);
      }
      at_ += type.num_bytes;
      size = static_cast<std::int64_t>(bits);
      if (type.is_signed && bits >> (8 * type.num_bytes - 1) != 0) size = -1;
    }
    if (size < 0)
      fail(ErrorKind::Input, "{}: {} {} has a list of no size", name_, element.name, row);
    return static_cast<std::uint64_t>(size);
  }

  std::string_view next_word(const Element& element, std::uint64_t row) {
    constexpr std::string_view kSpace = " \t\r\n";
    const std::size_t begin = text_.find_first_not_of(kSpace, at_);
    if (begin == std::string_view::npos) fail_short(element, row, 1);
    at_ = std::min(text_.find_first_of(kSpace, begin), text_.size());
    return text_.substr(begin, at_ - begin);
  }

  [[noreturn]] void fail_short(const Element& element, std::uint64_t row,
                               std::uint64_t count) const {
    fail(ErrorKind::Input, "{}: {} {} has {} values more, and {} bytes are left; is it cut off?",
         name_, element.name, row, count, text_.size() - at_);
  }

  std::string_view text_;
  const std::string& name_;
  std::size_t at_ = 0;
  Form form_ = Form::Text;
  std::vector<Element> elements_;
};

}  // namespace

void check_ply(std::span<const std::byte> bytes, const std::string& name) {
  PlyCheck(bytes, name).run();
}

}  // namespace terracast::tiler
