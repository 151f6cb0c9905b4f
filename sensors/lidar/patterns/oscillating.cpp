#include <cmath>
#include <numbers>
#include <string>

#include "sensors/lidar/pattern.h"

/// A mirror that swings: the beam goes to the left, to the right and back once a scan.
namespace terracast::sensors::lidar {
namespace {

class Oscillating : public ScanPattern {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("pulse_hz", pulse_hz_, "Pulses a second.", core::between(1.0, 1e7));
    visit.key("field_deg", field_deg_,
              "Angle of the beam (not of the mirror) from its rightmost to its leftmost.",
              core::between(0.0, 180.0));
    visit.key("swing", swing_, "sine: fast in the middle and slow at the sides. triangle: evenly.",
              core::one_of({"sine", "triangle"}));
  }
  std::unique_ptr<ScanPattern> clone() const override {
    return std::make_unique<Oscillating>(*this);
  }

  std::vector<Pulse> pulses(std::int64_t scan, double rate_hz) const override {
    const double half_rad = 0.5 * field_deg_ * std::numbers::pi / 180.0;
    std::vector<Pulse> pulses;
    for (const double time_s : times_of_pulses(pulse_hz_, scan, rate_hz)) {
      const double phase = phase_of(time_s, rate_hz);
      const double share =
          swing_ == "sine" ? std::sin(2.0 * std::numbers::pi * phase) : triangle(phase);
      pulses.push_back({.time_s = time_s, .direction = direction_of(half_rad * share, 0.0)});
    }
    return pulses;
  }
  double pulses_per_s(double /*rate_hz*/) const override { return pulse_hz_; }

 private:
  /// -1 to 1, as the sine goes.
  static double triangle(double phase) {
    if (phase < 0.25) return 4.0 * phase;
    return phase < 0.75 ? 2.0 - 4.0 * phase : 4.0 * phase - 4.0;
  }

  double pulse_hz_ = 100e3;
  double field_deg_ = 40.0;
  std::string swing_ = "sine";
};

}  // namespace

ScanPatternInfo oscillating_pattern() {
  return {.name = "oscillating",
          .summary = "left, right and back in the plane of forward and left, once a scan",
          .make = [] { return std::unique_ptr<ScanPattern>(std::make_unique<Oscillating>()); }};
}

}  // namespace terracast::sensors::lidar
