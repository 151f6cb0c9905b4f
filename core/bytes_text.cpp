#include "core/bytes_text.h"

#include <fmt/format.h>

#include <iterator>

namespace terracast::core {

std::string bytes_text(double bytes) {
  static constexpr const char* kUnits[] = {"B", "kB", "MB", "GB", "TB"};
  std::size_t unit = 0;
  for (; bytes >= 999.5 && unit + 1 < std::size(kUnits); ++unit) bytes /= 1000.0;
  return bytes < 999.5 ? fmt::format("{:.3g} {}", bytes, kUnits[unit])
                       : fmt::format("{:.0f} {}", bytes, kUnits[unit]);
}

}  // namespace terracast::core
