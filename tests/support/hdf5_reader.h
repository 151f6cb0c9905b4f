#pragma once

#include <filesystem>

#include "core/json.h"

namespace terracast::test {

/// Datasets of a file of HDF5 as jsfive reads them (tests/hdf5/read_h5.mjs): by their paths, an object each of `shape`,
/// `dtype`, `filters`, `chunks` and `value`; NaN is null.
/// throws   Input: the reader refuses the file; in its words
core::Json read_hdf5(const std::filesystem::path& file);

}  // namespace terracast::test
