#include "batch/dataset/plot_style.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/printable.h"

namespace terracast::batch::plot {

using tiler::Canvas;
using tiler::Colour;

Colour colour_of(Split split) {
  static constexpr std::array<Colour, 3> kColours = {{{0, 114, 178}, {230, 159, 0}, {0, 158, 115}}};
  return kColours[static_cast<std::size_t>(split)];
}

Colour tint_of(Split split) {
  Colour colour = colour_of(split);
  for (std::uint8_t& value : colour) value = static_cast<std::uint8_t>(255 - (255 - value) / 4);
  return colour;
}

std::string angle_text(double angle_deg, double step_deg, char positive, char negative) {
  const int digits = std::max(0, static_cast<int>(std::ceil(-std::log10(step_deg) - 1e-9)));
  const std::string number = fmt::format("{:.{}f}", std::abs(angle_deg), digits);
  const bool is_zero = number.find_first_not_of("0.") == std::string::npos;
  return is_zero ? number : fmt::format("{} {}", number, angle_deg < 0.0 ? negative : positive);
}

std::string metres_text(double distance_m) {
  return distance_m >= 1000.0 ? fmt::format("{:g} km", distance_m / 1000.0)
                              : fmt::format("{:g} m", distance_m);
}

std::string fitting(std::string_view text, int width_px, int scale) {
  const auto most =
      static_cast<std::size_t>(std::max(1, width_px / Canvas::text_width_px("0", scale)));
  const std::string shown = core::printable(text);
  if (shown.size() <= most) return shown;
  return std::string(core::first_letters(shown, std::max<std::size_t>(most, 3) - 2)) + "..";
}

}  // namespace terracast::batch::plot
