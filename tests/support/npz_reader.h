#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

/// A reader of NumPy's files that shares no code with the program.
namespace terracast::test {

/// An npy array of float32, float64, int32, uint32, bool or bytes, in C order.
struct Array {
  std::string type;  ///< as numpy's dtype.str: "<f4"
  std::vector<int> shape;
  std::vector<float> values;    ///< of float32, bool and bytes; else empty
  std::vector<double> numbers;  ///< of any type

  /// An element, by its place along each axis.
  double at(const std::vector<int>& place) const;
};

/// throws   std::runtime_error: not such a file
Array parse_npy(const std::string& bytes);

/// By name, without ".npy".
std::map<std::string, Array> read_npz(const std::filesystem::path& file);

}  // namespace terracast::test
