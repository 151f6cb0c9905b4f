#include <numbers>

#include "sensors/lidar/pattern.h"

/// Rows and columns over a rectangle of angles: one pulse after the other, as micromirrors lead it, or all at once, as a
/// flash lights the field of a sensor of pixels.
namespace terracast::sensors::lidar {
namespace {

class Raster : public ScanPattern {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("width_deg", width_deg_, "Field of view from left to right.",
              core::between(0.0, 360.0));
    visit.key("height_deg", height_deg_, "Field of view from top to bottom.",
              core::between(0.0, 180.0));
    visit.key("columns", columns_,
              "Directions of a row, equal angles apart; the first is leftmost.",
              core::between(1.0, 65536.0));
    visit.key("rows", rows_, "Rows, equal angles apart; the first is on top, and is ring 0.",
              core::between(1.0, 65536.0));
    visit.key("is_flash", is_flash_, "All at the scan's time; else row by row over all of it.");
  }
  std::unique_ptr<ScanPattern> clone() const override { return std::make_unique<Raster>(*this); }

  std::vector<Pulse> pulses(std::int64_t scan, double rate_hz) const override {
    constexpr double kDegree = std::numbers::pi / 180.0;
    const double num_pulses = static_cast<double>(rows_ * columns_);
    std::vector<Pulse> pulses;
    pulses.reserve(static_cast<std::size_t>(rows_ * columns_));
    for (std::int64_t row = 0; row < rows_; ++row)
      for (std::int64_t column = 0; column < columns_; ++column) {
        const double over = is_flash_ ? 0.0 : static_cast<double>(row * columns_ + column);
        const double azimuth_deg = width_deg_ * (0.5 - (static_cast<double>(column) + 0.5) /
                                                           static_cast<double>(columns_));
        const double elevation_deg =
            height_deg_ * (0.5 - (static_cast<double>(row) + 0.5) / static_cast<double>(rows_));
        pulses.push_back({.time_s = (static_cast<double>(scan) + over / num_pulses) / rate_hz,
                          .direction = direction_of(azimuth_deg * kDegree, elevation_deg * kDegree),
                          .ring = static_cast<std::uint16_t>(row)});
      }
    return pulses;
  }
  double pulses_per_s(double rate_hz) const override {
    return rate_hz * static_cast<double>(rows_ * columns_);
  }

 private:
  double width_deg_ = 60.0;
  double height_deg_ = 30.0;
  std::int64_t columns_ = 320;
  std::int64_t rows_ = 160;
  bool is_flash_ = false;
};

}  // namespace

ScanPatternInfo raster_pattern() {
  return {.name = "raster",
          .summary = "rows and columns over a rectangle of angles, in turn or in a flash",
          .make = [] { return std::unique_ptr<ScanPattern>(std::make_unique<Raster>()); }};
}

}  // namespace terracast::sensors::lidar
