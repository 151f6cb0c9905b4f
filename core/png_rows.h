#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace terracast::core {

/// PNG of one channel of 8 bits whose rows are asked for one by one, the top one first: for images that are not to
/// stand in memory a second time. Same input, same bytes.
/// fill_row   writes all of row y; what it throws is passed on
/// level      1 (fast) to 9 (small), zlib's scale
/// memory     up to three times the file's bytes while it grows, five rows and 2 MiB
std::vector<std::byte> encode_png_rows(
    int width, int height, const std::function<void(int y, std::span<std::uint8_t> row)>& fill_row,
    int level = 6);

}  // namespace terracast::core
