#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// NumPy's .npy (NEP 1, versions 1 to 3) and .npz (a zip of them).
namespace terracast::validate {

struct NpyArray {
  char kind = 'f';            ///< f float, i integer, u unsigned, b bool
  std::size_t item_size = 4;  ///< bytes a value
  std::vector<std::size_t> shape;
  std::vector<std::byte> bytes;  ///< little-endian, C order

  std::size_t num_values() const;
  /// throws  Input: not float32
  std::vector<float> floats(const std::string& name) const;
  /// Any bool or unsigned byte: 0 or not.
  /// throws  Input: another type
  std::vector<std::uint8_t> flags(const std::string& name) const;
};

/// throws  Input: not an npy, another byte order or Fortran order, more or fewer bytes than the
///         shape says
NpyArray parse_npy(std::span<const std::byte> bytes, const std::string& name);

/// A structured array: columns by name.
struct NpyTable {
  struct Column {
    std::string name;
    char kind = 'f';  ///< as NpyArray has it
    std::size_t item_size = 8;
    std::size_t offset = 0;  ///< within a row
  };
  std::vector<Column> columns;
  std::size_t num_rows = 0;
  std::size_t row_bytes = 0;
  std::vector<std::byte> bytes;  ///< row by row

  /// throws  Input: no such column
  const Column& column(std::string_view name, const std::string& file) const;
  /// As a double, which holds it exactly.
  double number(const Column& of, std::size_t row) const;
  /// Rounded to the column's type; a count is cut to what it holds.
  void set_number(const Column& of, std::size_t row, double value);
  /// Those of all rows.
  /// throws  Input: no such column
  std::vector<double> numbers(std::string_view column, const std::string& file) const;
};

/// throws  Input: as parse_npy, or not an array of one dimension whose rows are floating-point numbers of 4 and 8 bytes
///         and unsigned integers of 1, 2 and 4
NpyTable parse_npy_table(std::span<const std::byte> bytes, const std::string& name);

/// All arrays of an npz by name without ".npy".
/// throws  Input: not a zip, damaged (its CRCs are checked), over 256 MiB of arrays
std::map<std::string, NpyArray> parse_npz(std::span<const std::byte> bytes,
                                          const std::string& name);

}  // namespace terracast::validate
