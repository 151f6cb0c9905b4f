#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace terracast::sensors {

/// Side of the pixel blocks in whose order an image is traced: rays of a block travel together.
inline constexpr int kBlockSide = 4;

/// A rectangle of pixels that is one unit of parallel work; units tile the image row by row.
struct PixelUnit {
  int x0 = 0;
  int y0 = 0;
  int x1 = 0;  ///< one past
  int y1 = 0;

  int num_pixels() const { return (x1 - x0) * (y1 - y0); }
};

/// How an image is cut into units of `unit_width_px` x `unit_height_px` pixels.
struct PixelGrid {
  int width_px;
  int height_px;
  int unit_width_px;
  int unit_height_px;

  /// side   a multiple of kBlockSide
  static PixelGrid of_squares(int width_px, int height_px, int side) {
    return {width_px, height_px, side, side};
  }

  int columns() const { return (width_px + unit_width_px - 1) / unit_width_px; }
  int num_units() const { return columns() * ((height_px + unit_height_px - 1) / unit_height_px); }
  PixelUnit unit(std::int64_t index) const {
    const int x0 = static_cast<int>(index % columns()) * unit_width_px;
    const int y0 = static_cast<int>(index / columns()) * unit_height_px;
    return {x0, y0, std::min(x0 + unit_width_px, width_px),
            std::min(y0 + unit_height_px, height_px)};
  }

  /// All units along a Z curve: those that follow each other lie near each other, and see the same tiles.
  std::vector<int> units_by_place() const {
    const auto spread = [](std::uint64_t bits) {  // to every second bit
      bits = (bits | bits << 16) & 0x0000ffff0000ffffU;
      bits = (bits | bits << 8) & 0x00ff00ff00ff00ffU;
      bits = (bits | bits << 4) & 0x0f0f0f0f0f0f0f0fU;
      bits = (bits | bits << 2) & 0x3333333333333333U;
      return (bits | bits << 1) & 0x5555555555555555U;
    };
    const auto place = [&](int unit) {
      return spread(static_cast<std::uint64_t>(unit % columns())) |
             spread(static_cast<std::uint64_t>(unit / columns())) << 1;
    };
    std::vector<int> units(static_cast<std::size_t>(num_units()));
    std::iota(units.begin(), units.end(), 0);
    std::sort(units.begin(), units.end(), [&](int a, int b) { return place(a) < place(b); });
    return units;
  }
};

/// Calls visit(x, y) for a unit's pixels block by block: the same order whatever the threads and
/// shards.
template <class Visit>
void for_each_pixel(const PixelUnit& unit, const Visit& visit) {
  for (int by = unit.y0; by < unit.y1; by += kBlockSide)
    for (int bx = unit.x0; bx < unit.x1; bx += kBlockSide)
      for (int y = by; y < std::min(by + kBlockSide, unit.y1); ++y)
        for (int x = bx; x < std::min(bx + kBlockSide, unit.x1); ++x) visit(x, y);
}

}  // namespace terracast::sensors
