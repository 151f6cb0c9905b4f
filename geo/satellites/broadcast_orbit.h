#pragma once

#include <Eigen/Core>

/// Satellites of GPS as their navigation message describes them.
namespace terracast::geo {

inline constexpr double kLight_mps = 299792458.0;
inline constexpr double kGpsL1_hz = 1575.42e6;
/// As IS-GPS-200 has them, for its orbits alone.
inline constexpr double kGpsGravity_m3ps2 = 3.986005e14;
inline constexpr double kGpsEarthRate_radps = 7.2921151467e-5;
inline constexpr double kGpsWeek_s = 604800.0;

/// A satellite's orbit and clock about one time: the elements of subframes 1 to 3, by the names of IS-GPS-200.
struct BroadcastOrbit {
  int prn = 0;
  double toe_gps_s = 0.0;  ///< time of the elements and of the clock, seconds since 1980-01-06
  double sqrt_a = 0.0;     ///< of the semi-major axis, sqrt(m)
  double eccentricity = 0.0;
  double i0_rad = 0.0;
  double idot_radps = 0.0;
  double omega0_rad = 0.0;  ///< longitude of the ascending node at the start of the week
  double omega_rad = 0.0;   ///< argument of perigee
  double omega_dot_radps = 0.0;
  double m0_rad = 0.0;
  double delta_n_radps = 0.0;
  double cuc_rad = 0.0, cus_rad = 0.0, crc_m = 0.0, crs_m = 0.0, cic_rad = 0.0, cis_rad = 0.0;
  double af0_s = 0.0, af1 = 0.0, af2_per_s = 0.0;
};

/// Where a satellite is on the turning Earth, and how far its clock is ahead of GPS time.
struct SatelliteState {
  Eigen::Vector3d place_ecef_m;
  Eigen::Vector3d velocity_ecef_mps;  ///< against the Earth
  double clock_s = 0.0;               ///< with the relativistic term of an eccentric orbit
  double clock_rate = 0.0;
};

/// since_toe_s   GPS time since the time of the elements: times of 1980 would leave it no more than 2.4e-7 s
/// accuracy      of the algorithm of IS-GPS-200: to rounding (1e-6 m); velocities are its derivative
/// source        IS-GPS-200, 20.3.3.3.3.1 and 20.3.3.4.3
SatelliteState satellite_state(const BroadcastOrbit& orbit, double since_toe_s);

/// A satellite as a place on Earth receives it.
struct ReceivedSatellite {
  SatelliteState sent;           ///< at the time of transmission, in the Earth's frame at that time
  Eigen::Vector3d place_ecef_m;  ///< the same place in the Earth's frame at the time of reception
  Eigen::Vector3d direction_ecef;  ///< from the receiver to that place, unit
  double range_m = 0.0;            ///< the way of the signal
  double range_rate_mps = 0.0;
};

/// The signal that arrives at a place at a time.
/// velocity_mps   of the place against the Earth
/// accuracy       range_m solves the light time to 1e-6 m; range_rate_mps is its derivative, to 1e-6 m/s
ReceivedSatellite received(const BroadcastOrbit& orbit, double since_toe_s,
                           const Eigen::Vector3d& place_ecef_m,
                           const Eigen::Vector3d& velocity_mps);

}  // namespace terracast::geo
