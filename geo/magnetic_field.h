#pragma once

#include <Eigen/Core>

/// The Earth's magnetic field.
namespace terracast::geo {

/// The year of a time with the share of it that has passed: 2025.5 is in the middle of 2025.
/// unix_s   UTC in seconds since 1970
double decimal_year(double unix_s);

/// Field of the World Magnetic Model, of the years that the latest of its editions has, along the Earth's axes, nT.
/// point_ecef   between 1 km below the ellipsoid and 850 km above it, as the model is made for
/// accuracy     of the model: 0.001 nT (MagneticField.…). Of the Earth's own field: the model states 130 nT along each
///              axis and 0.4 degrees of declination away from the poles; ore, steel and storms are not in it.
/// throws       Config: no edition has that year; the years there are are named
/// source       NOAA/NCEI, The US/UK World Magnetic Model for 2025-2030
/// threads      safe
Eigen::Vector3d magnetic_field_ecef_nt(const Eigen::Vector3d& point_ecef, double year);

/// throws   Config: as magnetic_field_ecef_nt()
void check_magnetic_year(double year);

}  // namespace terracast::geo
