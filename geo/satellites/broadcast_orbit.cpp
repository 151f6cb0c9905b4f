#include "geo/satellites/broadcast_orbit.h"

#include <Eigen/Geometry>
#include <cmath>

namespace terracast::geo {
namespace {

using Eigen::Vector3d;

double eccentric_anomaly(double mean_rad, double eccentricity) {
  double anomaly = mean_rad;
  for (int i = 0; i < 20; ++i) {
    const double step = (anomaly - eccentricity * std::sin(anomaly) - mean_rad) /
                        (1.0 - eccentricity * std::cos(anomaly));
    anomaly -= step;
    if (std::abs(step) < 1e-15) break;
  }
  return anomaly;
}

/// A value and its derivative by time.
struct Rated {
  double value = 0.0;
  double rate = 0.0;
};

/// a + b cos 2u + c sin 2u.
Rated corrected(const Rated& base, double cosine_part, double sine_part, const Rated& u) {
  const double c = std::cos(2.0 * u.value), s = std::sin(2.0 * u.value);
  return {.value = base.value + cosine_part * c + sine_part * s,
          .rate = base.rate + 2.0 * u.rate * (sine_part * c - cosine_part * s)};
}

}  // namespace

SatelliteState satellite_state(const BroadcastOrbit& orbit, double time_s) {
  const double a = orbit.sqrt_a * orbit.sqrt_a, e = orbit.eccentricity;
  const double motion_radps = std::sqrt(kGpsGravity_m3ps2 / (a * a * a)) + orbit.delta_n_radps;
  const double anomaly = eccentric_anomaly(orbit.m0_rad + motion_radps * time_s, e);
  const double cos_e = std::cos(anomaly), sin_e = std::sin(anomaly);
  const double anomaly_rate = motion_radps / (1.0 - e * cos_e);
  const double root = std::sqrt(1.0 - e * e);

  const Rated latitude{.value = std::atan2(root * sin_e, cos_e - e) + orbit.omega_rad,
                       .rate = root * anomaly_rate / (1.0 - e * cos_e)};
  const Rated u = corrected(latitude, orbit.cuc_rad, orbit.cus_rad, latitude);
  const Rated r = corrected({a * (1.0 - e * cos_e), a * e * sin_e * anomaly_rate}, orbit.crc_m,
                            orbit.crs_m, latitude);
  const Rated i = corrected({orbit.i0_rad + orbit.idot_radps * time_s, orbit.idot_radps},
                            orbit.cic_rad, orbit.cis_rad, latitude);
  const double node_rate = orbit.omega_dot_radps - kGpsEarthRate_radps;
  const double node = orbit.omega0_rad + node_rate * time_s -
                      kGpsEarthRate_radps * std::fmod(orbit.toe_gps_s, kGpsWeek_s);

  const Eigen::Vector2d plane(r.value * std::cos(u.value), r.value * std::sin(u.value));
  const Eigen::Vector2d plane_rate(r.rate * std::cos(u.value) - plane.y() * u.rate,
                                   r.rate * std::sin(u.value) + plane.x() * u.rate);
  const double cos_i = std::cos(i.value), sin_i = std::sin(i.value);
  const double cos_n = std::cos(node), sin_n = std::sin(node);
  const Vector3d along_node(cos_n, sin_n, 0.0);
  const Vector3d across(-cos_i * sin_n, cos_i * cos_n, sin_i);
  const Vector3d across_by_tilt(sin_i * sin_n, -sin_i * cos_n, cos_i);

  SatelliteState state;
  state.place_ecef_m = plane.x() * along_node + plane.y() * across;
  state.velocity_ecef_mps = plane_rate.x() * along_node + plane_rate.y() * across +
                            plane.y() * i.rate * across_by_tilt +
                            node_rate * Vector3d::UnitZ().cross(state.place_ecef_m);
  const double relativistic_s =
      -2.0 * std::sqrt(kGpsGravity_m3ps2) / (kLight_mps * kLight_mps) * e * orbit.sqrt_a;
  state.clock_s =
      orbit.af0_s + time_s * (orbit.af1 + time_s * orbit.af2_per_s) + relativistic_s * sin_e;
  state.clock_rate =
      orbit.af1 + 2.0 * time_s * orbit.af2_per_s + relativistic_s * cos_e * anomaly_rate;
  return state;
}

ReceivedSatellite received(const BroadcastOrbit& orbit, double since_toe_s,
                           const Vector3d& place_ecef_m, const Vector3d& velocity_mps) {
  ReceivedSatellite signal;
  double light_s = 0.07;
  // The light time changes by 4 km/s over c at each step: by a factor of 1e-5.
  for (int step = 0; step < 5; ++step) {
    signal.sent = satellite_state(orbit, since_toe_s - light_s);
    const Eigen::AngleAxisd turn(-kGpsEarthRate_radps * light_s, Vector3d::UnitZ());
    signal.place_ecef_m = turn * signal.sent.place_ecef_m;
    signal.range_m = (signal.place_ecef_m - place_ecef_m).norm();
    light_s = signal.range_m / kLight_mps;
  }
  signal.direction_ecef = (signal.place_ecef_m - place_ecef_m) / signal.range_m;
  // The place that was sent from moves, in the frame at reception, with its velocity over the time of transmission and
  // with the Earth's turning over the light time; both depend on the range's own rate.
  const Eigen::AngleAxisd turn(-kGpsEarthRate_radps * light_s, Vector3d::UnitZ());
  const double from_motion = signal.direction_ecef.dot(turn * signal.sent.velocity_ecef_mps);
  const double from_turn =
      signal.direction_ecef.dot(kGpsEarthRate_radps * Vector3d::UnitZ().cross(signal.place_ecef_m));
  // r' = d.(v_sat (1 - r'/c) - w x p r'/c - v)
  signal.range_rate_mps = (from_motion - signal.direction_ecef.dot(velocity_mps)) /
                          (1.0 + (from_motion + from_turn) / kLight_mps);
  return signal;
}

}  // namespace terracast::geo
