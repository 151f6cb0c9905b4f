#include "sensors/camera/imaging/development.h"

#include <algorithm>
#include <cmath>

#include "scene/light/shading.h"

namespace terracast::sensors {

scene::Color gains_of_temperature(double temperature_k) {
  const double u = 1e3 / temperature_k;
  const double x = temperature_k <= 4000.0
                       ? ((-0.2661239 * u - 0.2343589) * u + 0.8776956) * u + 0.179910
                       : ((-3.0258469 * u + 2.1070379) * u + 0.2226347) * u + 0.240390;
  double y = ((3.0817580 * x - 5.87338670) * x + 3.75112997) * x - 0.37001483;
  if (temperature_k <= 2222.0)
    y = ((-1.1063814 * x - 1.34811020) * x + 2.18555832) * x - 0.20219683;
  else if (temperature_k <= 4000.0)
    y = ((-0.9549476 * x - 1.37418593) * x + 2.09137015) * x - 0.16748867;
  const double tall_x = x / y;
  const double tall_z = (1.0 - x - y) / y;
  const double red = 3.2404542 * tall_x - 1.5371385 - 0.4985314 * tall_z;
  const double green = -0.9692660 * tall_x + 1.8760108 + 0.0415560 * tall_z;
  const double blue = 0.0556434 * tall_x - 0.2040259 + 1.0572252 * tall_z;
  const scene::Color light = Eigen::Array3d(red, green, std::max(blue, 1e-3 * green)).cast<float>();
  return scene::luminance_of(light) / light;
}

float Development::curve(float exposed) const {
  if (options_.curve == "film") return scene::srgb_from_linear(scene::film_curve(exposed));
  const float within = std::clamp(exposed, 0.0f, 1.0f);
  if (options_.curve == "srgb") return scene::srgb_from_linear(within);
  if (options_.curve == "gamma") return std::pow(within, static_cast<float>(1.0 / options_.gamma));
  return within;
}

void Development::develop(const scene::Color& exposed, std::uint8_t* rgb) const {
  scene::Color color = exposed;
  if (options_.saturation != 1.0) {
    const float grey = scene::luminance_of(color);
    color = grey + static_cast<float>(options_.saturation) * (color - grey);
  }
  for (int k = 0; k < 3; ++k)
    rgb[k] = static_cast<std::uint8_t>(std::clamp(255.0f * curve(color[k]) + 0.5f, 0.0f, 255.0f));
}

}  // namespace terracast::sensors
