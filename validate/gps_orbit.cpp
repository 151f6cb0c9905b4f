#include "validate/gps_orbit.h"

#include <Eigen/Geometry>
#include <cmath>
#include <complex>

namespace terracast::validate {
namespace {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

constexpr double kLight_mps = 299792458.0;
constexpr double kMu = 3.986005e14;
constexpr double kEarth_radps = 7.2921151467e-5;
constexpr double kWeek_s = 604800.0;

}  // namespace

double NavigationRecord::toe_gps_s() const { return week * kWeek_s + toe_s; }

SentSignal sent_signal(const NavigationRecord& record, double received_since_toe_s,
                       double range_m) {
  const double light_s = range_m / kLight_mps;
  const double t = received_since_toe_s - light_s;
  const double a = record.sqrt_a * record.sqrt_a;
  const double mean = record.m0 + t * (std::sqrt(kMu / a) / a + record.delta_n);
  // Kepler's equation by fixed points: e is small, each step gains a factor of it.
  double anomaly = mean;
  for (int i = 0; i < 60; ++i) anomaly = mean + record.e * std::sin(anomaly);

  // From the focus, as a complex number along perigee.
  const std::complex<double> at(a * (std::cos(anomaly) - record.e),
                                a * std::sqrt(1.0 - record.e * record.e) * std::sin(anomaly));
  const double phi = std::arg(at) + record.omega;
  const double c = std::cos(2.0 * phi), s = std::sin(2.0 * phi);
  const double u = phi + record.cus * s + record.cuc * c;
  const double r = std::abs(at) + record.crs * s + record.crc * c;
  const double tilt = record.i0 + record.idot * t + record.cis * s + record.cic * c;
  const double node = record.omega0 + record.omega_dot * t - kEarth_radps * (t + record.toe_s) -
                      kEarth_radps * light_s;  // into the Earth's frame at reception
  SentSignal signal;
  signal.place_ecef = AngleAxisd(node, Vector3d::UnitZ()) *
                      (AngleAxisd(tilt, Vector3d::UnitX()) *
                       (AngleAxisd(u, Vector3d::UnitZ()) * Vector3d(r, 0.0, 0.0)));
  signal.clock_s = record.af0 + record.af1 * t + record.af2 * t * t -
                   2.0 * std::sqrt(kMu) * record.e * record.sqrt_a * std::sin(anomaly) /
                       (kLight_mps * kLight_mps);
  return signal;
}

}  // namespace terracast::validate
