#pragma once

/// Pressure, temperature and density of the air by height.
namespace terracast::geo {

/// How a day's air differs from the standard atmosphere.
struct Air {
  double sea_level_pressure_pa = 101325.0;
  double warmer_k = 0.0;  ///< at all heights
};

/// Height in a field of gravity that is everywhere that of sea level: r h / (r + h).
/// altitude_msl_m   above mean sea level
/// source           ISO 2533:1975, section 2.3, with its r = 6 356 766 m
double geopotential_height_m(double altitude_msl_m);

/// Pressure, Pa, of a standard atmosphere that has the day's pressure at sea level and is as much warmer at all heights.
/// geopotential_height_m   -5000 to 80 000
/// accuracy                of ISO 2533: rounding of double; Atmosphere.…
/// throws                  Input: another height
/// source                  ISO 2533:1975, sections 2.1 to 2.7: layers of constant gradients of temperature
/// threads                 safe
double air_pressure_pa(double geopotential_height_m, const Air& air);

/// Temperature of that air, K.
/// geopotential_height_m, throws, source   as air_pressure_pa()
double air_temperature_k(double geopotential_height_m, const Air& air);

/// Density of that air, kg/m^3: p / (R T) with ISO 2533's R = 287.05287 J/(kg K).
/// geopotential_height_m, throws, source   as air_pressure_pa()
double air_density_kg_per_m3(double geopotential_height_m, const Air& air);

/// Of ISO 2533's air at mean sea level.
inline constexpr double kSeaLevelDensity_kg_per_m3 = 1.225;

/// Pressure that air builds up in a tube that it flows into, over its own: p ((1 + M^2 / 5)^3.5 - 1).
/// speed_mps   of the flow, below that of sound
/// accuracy    rounding of double, at any low speed
/// source      isentropic flow of a gas with a ratio of heats of 1.4 (Anderson, Modern Compressible Flow, section 3.4)
double impact_pressure_pa(double speed_mps, double pressure_pa, double temperature_k);

}  // namespace terracast::geo
