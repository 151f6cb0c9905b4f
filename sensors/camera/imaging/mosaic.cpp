#include "sensors/camera/imaging/mosaic.h"

#include <algorithm>
#include <array>
#include <cstdlib>

#include "core/parallel.h"

namespace terracast::sensors {
namespace {

constexpr int kRowsAtOnce = 16;
/// Factors on the values of 5 x 5 pixels, 16 together.
using Filter = std::array<std::array<int, 5>, 5>;

/// Green at red or blue.
constexpr Filter kGreen = {{{0, 0, -2, 0, 0},  //
                            {0, 0, 4, 0, 0},
                            {-2, 4, 8, 4, -2},
                            {0, 0, 4, 0, 0},
                            {0, 0, -2, 0, 0}}};
/// At green the colour of its neighbours in the row; turned by 90 degrees that of those in the column.
constexpr Filter kInRow = {{{0, 0, 1, 0, 0},  //
                            {0, -2, 0, -2, 0},
                            {-2, 8, 10, 8, -2},
                            {0, -2, 0, -2, 0},
                            {0, 0, 1, 0, 0}}};
/// Blue at red, red at blue.
constexpr Filter kAcross = {{{0, 0, -3, 0, 0},  //
                             {0, 4, 0, 4, 0},
                             {-3, 0, 12, 0, -3},
                             {0, 4, 0, 4, 0},
                             {0, 0, -3, 0, 0}}};

constexpr Filter turned(const Filter& filter) {
  Filter other{};
  for (std::size_t j = 0; j < 5; ++j)
    for (std::size_t i = 0; i < 5; ++i) other[i][j] = filter[j][i];
  return other;
}
constexpr Filter kInColumn = turned(kInRow);

/// Mirrored about the outermost pixels, which keeps colours in their places.
int mirrored(int place, int count) {
  if (place < 0) place = -place;
  if (place >= count) place = 2 * (count - 1) - place;
  return std::clamp(place, 0, count - 1);
}

float filtered(const core::ImageF& seen, int x, int y, const Filter& filter) {
  float sum = 0.0f;
  const bool is_inside = x >= 2 && y >= 2 && x + 2 < seen.width() && y + 2 < seen.height();
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 5; ++i) {
      const int factor = filter[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)];
      if (factor == 0) continue;
      const int from_x = is_inside ? x + i - 2 : mirrored(x + i - 2, seen.width());
      const int from_y = is_inside ? y + j - 2 : mirrored(y + j - 2, seen.height());
      sum += static_cast<float>(factor) * seen(from_x, from_y);
    }
  return sum / 16.0f;
}

}  // namespace

core::ImageF Mosaic::demosaiced(const core::ImageF& seen) const {
  core::ImageF image(seen.width(), seen.height(), 3);
  core::parallel_for_blocks(seen.height(), kRowsAtOnce, [&](std::int64_t begin, std::int64_t end) {
    for (auto y = static_cast<int>(begin); y < end; ++y)
      for (int x = 0; x < seen.width(); ++x) {
        const int own = channel_at(x, y);
        image(x, y, own) = seen(x, y);
        if (own == 1) {
          image(x, y, channel_at(x + 1, y)) = filtered(seen, x, y, kInRow);
          image(x, y, channel_at(x, y + 1)) = filtered(seen, x, y, kInColumn);
        } else {
          image(x, y, 1) = filtered(seen, x, y, kGreen);
          image(x, y, 2 - own) = filtered(seen, x, y, kAcross);
        }
      }
  });
  return image;
}

}  // namespace terracast::sensors
