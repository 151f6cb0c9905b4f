#include <cmath>
#include <numbers>

#include "sensors/lidar/pattern.h"

/// A polygon of mirrors that turns: parallel lines, each from right to left, one a scan.
namespace terracast::sensors::lidar {
namespace {

class Polygon : public ScanPattern {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("pulse_hz", pulse_hz_, "Pulses a second.", core::between(1.0, 1e7));
    visit.key("field_deg", field_deg_, "Angle from a line's beginning to its end.",
              core::between(0.0, 360.0));
    visit.key("line_share", line_share_,
              "Share of a scan's time that its line takes; meanwhile the edge to the next mirror "
              "passes, and no pulse leaves.",
              core::between(1e-3, 1.0));
  }
  std::unique_ptr<ScanPattern> clone() const override { return std::make_unique<Polygon>(*this); }

  std::vector<Pulse> pulses(std::int64_t scan, double rate_hz) const override {
    const double field_rad = field_deg_ * std::numbers::pi / 180.0;
    std::vector<Pulse> pulses;
    for (const double time_s : times_of_pulses(pulse_hz_, scan, rate_hz)) {
      // Counted from this scan's beginning, which rounding puts nowhere else.
      const double along = (time_s - static_cast<double>(scan) / rate_hz) * rate_hz / line_share_;
      constexpr double kRounding = 1e-9;
      if (along >= 1.0 - kRounding) break;
      pulses.push_back(
          {.time_s = time_s, .direction = direction_of(field_rad * (along - 0.5), 0.0)});
    }
    return pulses;
  }
  double pulses_per_s(double /*rate_hz*/) const override { return pulse_hz_ * line_share_; }

 private:
  double pulse_hz_ = 100e3;
  double field_deg_ = 60.0;
  double line_share_ = 1.0;
};

}  // namespace

ScanPatternInfo polygon_pattern() {
  return {.name = "polygon",
          .summary = "parallel lines from right to left, one a scan",
          .make = [] { return std::unique_ptr<ScanPattern>(std::make_unique<Polygon>()); }};
}

}  // namespace terracast::sensors::lidar
