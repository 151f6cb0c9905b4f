#pragma once

#include <Eigen/Core>

/// The validator's own standard atmosphere and magnetic field.
namespace terracast::validate {

/// Pressure of ISO 2533, of a day's pressure at sea level and a day's warmth, Pa.
/// altitude_msl_m   above mean sea level
/// accuracy         1e-12 of the pressure; Navigation.…
double standard_pressure_pa(double altitude_msl_m, double sea_level_pressure_pa, double warmer_k);

/// The year with the share of it that has passed.
/// unix_s   UTC in seconds since 1970
double decimal_year(double unix_s);

/// Field of the World Magnetic Model along the Earth's axes, nT; NaN in years that it does not have.
/// accuracy   1e-3 nT of the model's published values; Navigation.…
Eigen::Vector3d magnetic_field_ecef_nt(const Eigen::Vector3d& point_ecef, double year);

}  // namespace terracast::validate
