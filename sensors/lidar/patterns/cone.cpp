#include <cmath>
#include <numbers>

#include "sensors/lidar/pattern.h"

/// A mirror that turns about the forward axis and is tilted against it: the beam goes round on a cone (Palmer's scan).
namespace terracast::sensors::lidar {
namespace {

class Cone : public ScanPattern {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("pulse_hz", pulse_hz_, "Pulses a second.", core::between(1.0, 1e7));
    visit.key("half_angle_deg", half_angle_deg_,
              "Between the beam and the forward axis, about which it goes once a scan.",
              core::between(0.0, 90.0));
  }
  std::unique_ptr<ScanPattern> clone() const override { return std::make_unique<Cone>(*this); }

  std::vector<Pulse> pulses(std::int64_t scan, double rate_hz) const override {
    const double half_rad = half_angle_deg_ * std::numbers::pi / 180.0;
    std::vector<Pulse> pulses;
    for (const double time_s : times_of_pulses(pulse_hz_, scan, rate_hz)) {
      const double round_rad = 2.0 * std::numbers::pi * phase_of(time_s, rate_hz);
      pulses.push_back({.time_s = time_s,
                        .direction = {std::cos(half_rad), std::sin(half_rad) * std::cos(round_rad),
                                      std::sin(half_rad) * std::sin(round_rad)}});
    }
    return pulses;
  }
  double pulses_per_s(double /*rate_hz*/) const override { return pulse_hz_; }

 private:
  double pulse_hz_ = 100e3;
  double half_angle_deg_ = 20.0;
};

}  // namespace

ScanPatternInfo cone_pattern() {
  return {.name = "cone",
          .summary = "round on a cone about the forward axis, once a scan",
          .make = [] { return std::unique_ptr<ScanPattern>(std::make_unique<Cone>()); }};
}

}  // namespace terracast::sensors::lidar
