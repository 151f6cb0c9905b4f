#include "core/srgb.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace terracast::core {
namespace {

float linear_of(double encoded) {
  return static_cast<float>(encoded <= 0.04045 ? encoded / 12.92
                                               : std::pow((encoded + 0.055) / 1.055, 2.4));
}

struct Tables {
  static constexpr std::size_t kCells = 4096;
  std::array<float, 256> linear;
  std::array<float, 256> ends;                 ///< of each code's values; the last has none
  std::array<std::uint8_t, kCells + 1> first;  ///< code of each cell's lowest value

  Tables() {
    for (std::size_t code = 0; code < 256; ++code) {
      linear[code] = linear_of(static_cast<double>(code) / 255.0);
      ends[code] = linear_of((static_cast<double>(code) + 0.5) / 255.0);
    }
    ends[255] = 2.0f;
    std::uint8_t code = 0;
    for (std::size_t cell = 0; cell <= kCells; ++cell) {
      const float lowest = static_cast<float>(cell) / static_cast<float>(kCells);
      while (ends[code] <= lowest) ++code;
      first[cell] = code;
    }
  }
};

const Tables& tables() {
  static const Tables all;
  return all;
}

}  // namespace

float linear_from_srgb8(std::uint8_t code) { return tables().linear[code]; }

std::uint8_t srgb8_from_linear(float linear) {
  if (!(linear > 0.0f)) return 0;
  if (linear >= 1.0f) return 255;
  const Tables& all = tables();
  std::uint8_t code =
      all.first[static_cast<std::size_t>(linear * static_cast<float>(Tables::kCells))];
  while (all.ends[code] <= linear) ++code;
  return code;
}

}  // namespace terracast::core
