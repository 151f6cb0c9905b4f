#pragma once

#include <Eigen/Core>

/// The validator's own reckoning of GPS's broadcast orbits.
namespace terracast::validate {

/// A record of a navigation file, in its own units; angles in radians.
struct NavigationRecord {
  int prn = 0;
  double week = 0.0, toe_s = 0.0;  ///< toe of the week
  double af0 = 0.0, af1 = 0.0, af2 = 0.0;
  double crs = 0.0, delta_n = 0.0, m0 = 0.0;
  double cuc = 0.0, e = 0.0, cus = 0.0, sqrt_a = 0.0;
  double cic = 0.0, omega0 = 0.0, cis = 0.0;
  double i0 = 0.0, crc = 0.0, omega = 0.0, omega_dot = 0.0, idot = 0.0;

  double toe_gps_s() const;
};

struct SentSignal {
  Eigen::Vector3d
      place_ecef;  ///< of the satellite when it sent, in the Earth's frame when it is received
  double clock_s = 0.0;  ///< of the satellite ahead of GPS time
};

/// Of a signal that travelled so far and is received so long after the record's time.
/// accuracy   1e-6 m; Signals.…
/// source     IS-GPS-200, 20.3.3.3.3.1 and 20.3.3.4.3
SentSignal sent_signal(const NavigationRecord& record, double received_since_toe_s, double range_m);

}  // namespace terracast::validate
