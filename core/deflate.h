#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace terracast::core {

/// Bytes as a zlib stream (RFC 1950), which browsers and Python unpack by themselves. Same input,
/// same bytes.
/// level   1 (fast) to 12 (small), libdeflate's scale
std::vector<std::byte> zlib_deflated(std::span<const std::byte> bytes, int level = 6);

}  // namespace terracast::core
