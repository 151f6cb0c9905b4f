#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace terracast::core {

/// An array of an npz file.
struct NpzArray {
  std::string name;            ///< as numpy.load names it, without ".npy"
  std::vector<std::byte> npy;  ///< the whole npy file
  bool is_deflated = false;    ///< stored otherwise
};

/// NumPy's archive of arrays: a zip of npy files, all dated 1980-01-01. Same input, same bytes.
std::vector<std::byte> npz_bytes(const std::vector<NpzArray>& arrays);

}  // namespace terracast::core
