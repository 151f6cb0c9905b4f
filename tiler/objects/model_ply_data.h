#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace terracast::tiler {

/// A type of a PLY's values.
struct PlyType {
  std::string_view name, other_name;
  std::size_t num_bytes;
  bool is_whole, is_signed;
};

struct PlyProperty {
  std::string name;
  const PlyType* count = nullptr;  ///< of a list; null: one value
  const PlyType* value = nullptr;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;

  /// The property of a name, of several the first; -1: there is none.
  int find(std::string_view property) const;
};

/// A PLY's head and rows. What it states is compared with its bytes before room is made for it: a damaged or hostile file
/// of some hundred bytes may state lists of a billion values.
class PlyData {
 public:
  /// Reads the head.
  /// name     begins the errors
  /// throws   Input: no PLY, a type that there is none of, more elements than bytes
  PlyData(std::span<const std::byte> bytes, const std::string& name);

  const std::vector<PlyElement>& elements() const { return elements_; }
  /// Lines of the head that are neither format, element nor property, whole.
  const std::vector<std::string>& other_lines() const { return other_lines_; }

  /// Rows of an element, one after the other; elements are read in their order, each once.
  /// take     is called with the row's number and each property's values
  /// throws   Input: rows that the file has not, values that are no numbers
  using Row = std::span<const std::vector<double>>;
  void read(const PlyElement& element, const std::function<void(std::uint64_t, Row)>& take);

  /// After all elements were read.
  std::size_t num_bytes_left() const;

 private:
  enum class Form { Text, LittleEndian, BigEndian };

  void take_line(const std::string& line);
  void read_property(const PlyElement& element, std::uint64_t row, const PlyProperty& property,
                     std::vector<double>& values);
  std::uint64_t list_size(const PlyElement& element, std::uint64_t row, const PlyType& type);
  double value(const PlyElement& element, std::uint64_t row, const PlyProperty& property);
  std::uint64_t bits(std::size_t num_bytes);
  std::string_view next_word(const PlyElement& element, std::uint64_t row);
  [[noreturn]] void fail_short(const PlyElement& element, std::uint64_t row,
                               std::uint64_t count) const;

  std::string_view text_;
  std::string name_;
  std::size_t at_ = 0;
  Form form_ = Form::Text;
  std::vector<PlyElement> elements_;
  std::vector<std::string> other_lines_;
};

}  // namespace terracast::tiler
