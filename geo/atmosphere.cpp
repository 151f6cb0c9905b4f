#include "geo/atmosphere.h"

#include <array>
#include <cmath>

#include "core/error.h"

namespace terracast::geo {

namespace {

// ISO 2533:1975, tables 1 and 4.
constexpr double kStandardGravity_mps2 = 9.80665;
constexpr double kGasConstant_j_per_kg_k = 287.05287;
constexpr double kEarthRadius_m = 6356766.0;
constexpr double kLowest_m = -5000.0, kHighest_m = 80000.0;

struct Layer {
  double base_m;
  double base_temperature_k;
  double gradient_k_per_m;
};
constexpr std::array<Layer, 7> kLayers = {{{0.0, 288.15, -6.5e-3},
                                           {11000.0, 216.65, 0.0},
                                           {20000.0, 216.65, 1.0e-3},
                                           {32000.0, 228.65, 2.8e-3},
                                           {47000.0, 270.65, 0.0},
                                           {51000.0, 270.65, -2.8e-3},
                                           {71000.0, 214.65, -2.0e-3}}};

/// Pressure so high above a layer's base as a share of the pressure there.
double share_of_base(const Layer& layer, double above_base_m, double warmer_k) {
  const double temperature_k = layer.base_temperature_k + warmer_k;
  constexpr double kScale = kStandardGravity_mps2 / kGasConstant_j_per_kg_k;
  if (layer.gradient_k_per_m == 0.0) return std::exp(-kScale * above_base_m / temperature_k);
  return std::pow(1.0 + layer.gradient_k_per_m * above_base_m / temperature_k,
                  -kScale / layer.gradient_k_per_m);
}

void check_height(double geopotential_height_m) {
  if (!(geopotential_height_m >= kLowest_m && geopotential_height_m <= kHighest_m))
    core::fail(core::ErrorKind::Input,
               "the standard atmosphere has no pressure at {:.1f} m: it reaches from {:.0f} to "
               "{:.0f} m above mean sea level",
               geopotential_height_m, kLowest_m, kHighest_m);
}

}  // namespace

double geopotential_height_m(double altitude_msl_m) {
  return kEarthRadius_m * altitude_msl_m / (kEarthRadius_m + altitude_msl_m);
}

double air_pressure_pa(double geopotential_height_m, const Air& air) {
  check_height(geopotential_height_m);
  double pressure_pa = air.sea_level_pressure_pa;
  for (std::size_t i = 0; i < kLayers.size(); ++i) {
    const bool is_last = i + 1 == kLayers.size() || geopotential_height_m <= kLayers[i + 1].base_m;
    const double top_m = is_last ? geopotential_height_m : kLayers[i + 1].base_m;
    pressure_pa *= share_of_base(kLayers[i], top_m - kLayers[i].base_m, air.warmer_k);
    if (is_last) break;
  }
  return pressure_pa;
}

double air_temperature_k(double geopotential_height_m, const Air& air) {
  check_height(geopotential_height_m);
  std::size_t i = 0;
  while (i + 1 < kLayers.size() && geopotential_height_m > kLayers[i + 1].base_m) ++i;
  return kLayers[i].base_temperature_k + air.warmer_k +
         kLayers[i].gradient_k_per_m * (geopotential_height_m - kLayers[i].base_m);
}

double air_density_kg_per_m3(double geopotential_height_m, const Air& air) {
  return air_pressure_pa(geopotential_height_m, air) /
         (kGasConstant_j_per_kg_k * air_temperature_k(geopotential_height_m, air));
}

double impact_pressure_pa(double speed_mps, double pressure_pa, double temperature_k) {
  constexpr double kRatioOfHeats = 1.4;
  const double mach2 =
      speed_mps * speed_mps / (kRatioOfHeats * kGasConstant_j_per_kg_k * temperature_k);
  return pressure_pa * std::expm1(3.5 * std::log1p(0.2 * mach2));
}

}  // namespace terracast::geo
