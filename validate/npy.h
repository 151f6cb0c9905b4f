#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
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

/// All arrays of an npz by name without ".npy".
/// throws  Input: not a zip, damaged (its CRCs are checked), over 256 MiB of arrays
std::map<std::string, NpyArray> parse_npz(std::span<const std::byte> bytes,
                                          const std::string& name);

}  // namespace terracast::validate
