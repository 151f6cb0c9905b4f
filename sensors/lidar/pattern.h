#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/schema.h"

/// How scanners lead their beams.
namespace terracast::sensors::lidar {

/// A pulse of light, along the sensor's axes (x forward, y left, z up) at its own time.
struct Pulse {
  double time_s = 0.0;  ///< since the sequence's start
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d direction = Eigen::Vector3d::UnitX();  ///< unit
  std::uint16_t ring = 0;                                ///< the laser, or the line, that it is of
};

/// A kind of pattern with its options. Scan k begins at k / rate_hz and ends before scan k + 1 begins.
///
/// determinism   pulses follow from the options, the rate and the scan's number alone
/// threads       const use is safe
class ScanPattern {
 public:
  virtual ~ScanPattern() = default;
  virtual void describe(core::SchemaVisitor& visit) = 0;
  /// throws   Config: options that contradict each other
  virtual void validate() const {}
  virtual std::unique_ptr<ScanPattern> clone() const = 0;

  /// All of a scan, in the order of their times.
  virtual std::vector<Pulse> pulses(std::int64_t scan, double rate_hz) const = 0;
  /// Mean number.
  virtual double pulses_per_s(double rate_hz) const = 0;
};

struct ScanPatternInfo {
  std::string_view name;
  std::string_view summary;
  std::unique_ptr<ScanPattern> (*make)();
};

/// The table of patterns, alphabetical.
std::span<const ScanPatternInfo> scan_patterns();

/// Of direction `azimuth_rad` to the left of forward and `elevation_rad` up.
Eigen::Vector3d direction_of(double azimuth_rad, double elevation_rad);

/// Times n / pulse_hz from a scan's beginning to before the next one's: pulses that leave at a rate of their own. Each is in
/// one scan; one within 1e-6 of a pulse's time before a border is behind it.
std::vector<double> times_of_pulses(double pulse_hz, std::int64_t scan, double rate_hz);

/// How much of a scan, or of the turn that one lasts, is over at a time: 0 to 1.
double phase_of(double time_s, double rate_hz);

}  // namespace terracast::sensors::lidar
