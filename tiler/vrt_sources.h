#pragma once

#include <string>
#include <vector>

namespace terracast::tiler {

/// Files that the text of a VRT names, those that it states relative to itself as paths from here. None of them is
/// opened; of a VRT that cannot be parsed there are none.
/// vrt      as GDAL knows it
/// throws   Input: longer than kMostVrtBytes
std::vector<std::string> files_named_by_vrt(const std::string& vrt);

/// GDAL takes twenty times the memory: 1.3 GB. A hundred thousand files are named in half of it.
inline constexpr long long kMostVrtBytes = 1LL << 26;

/// VRTs in VRTs are followed so far; one that names itself ends earlier.
inline constexpr int kDeepestVrt = 16;

}  // namespace terracast::tiler
