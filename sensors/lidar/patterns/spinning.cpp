#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/error.h"
#include "sensors/lidar/pattern.h"

/// Lasers one above the other on a head that turns about the sensor's z axis, once a scan. They fire in cycles, one after
/// the other or all at once.
namespace terracast::sensors::lidar {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;

class Spinning : public ScanPattern {
 public:
  void describe(core::SchemaVisitor& visit) override {
    visit.key("elevation_deg", elevation_deg_,
              "Of each laser above the sensor's horizon; laser i is ring i.");
    visit.key("azimuth_deg", azimuth_deg_,
              "Of each laser to the left of where the head looks; empty: 0.");
    visit.key("firing_us", firing_us_,
              "When each laser fires, after its cycle's beginning; empty: all together.");
    visit.key("cycle_us", cycle_us_,
              "From a cycle's beginning to the next one's, whatever the head's rate; 0: `columns` "
              "says.",
              core::between(0.0, 1e6));
    visit.key("columns", columns_, "Cycles a turn, where cycle_us is 0.", core::between(0.0, 1e6));
    visit.key("origin_mm", origin_mm_,
              "From the axis to where the beams begin, the way that the head looks.",
              core::between(-1e3, 1e3));
    visit.key("vertical_mm", vertical_mm_,
              "Of each laser's beginning above the sensor's; empty: 0.");
    visit.key("across_mm", across_mm_,
              "Of each laser's beginning to the left of where the head looks; empty: 0.");
    visit.key("start_deg", start_deg_, "Where the head looks at time 0, to the left of forward.",
              core::between(-360.0, 360.0));
    visit.key("turning", turning_, "Seen from above.",
              core::one_of({"clockwise", "counterclockwise"}));
  }
  void validate() const override;
  std::unique_ptr<ScanPattern> clone() const override { return std::make_unique<Spinning>(*this); }

  std::vector<Pulse> pulses(std::int64_t scan, double rate_hz) const override {
    const double begin_s = static_cast<double>(scan) / rate_hz;
    const double end_s = static_cast<double>(scan + 1) / rate_hz;
    const double cycle_hz = cycles_per_s(rate_hz);
    // A cycle that began in the scan before may reach into this one.
    auto cycle =
        static_cast<std::int64_t>(std::floor((begin_s - last_firing_us() * 1e-6) * cycle_hz)) - 1;
    std::vector<Pulse> pulses;
    for (; time_of_cycle_s(cycle, rate_hz) < end_s; ++cycle)
      for (std::size_t i = 0; i < elevation_deg_.size(); ++i) {
        const double time_s = time_of_cycle_s(cycle, rate_hz) + of_laser(firing_us_, i) * 1e-6;
        if (time_s >= begin_s && time_s < end_s) pulses.push_back(pulse(i, time_s, rate_hz));
      }
    std::stable_sort(pulses.begin(), pulses.end(),
                     [](const Pulse& a, const Pulse& b) { return a.time_s < b.time_s; });
    return pulses;
  }
  double pulses_per_s(double rate_hz) const override {
    return static_cast<double>(elevation_deg_.size()) * cycles_per_s(rate_hz);
  }

 private:
  static double of_laser(const std::vector<double>& values, std::size_t laser) {
    return values.empty() ? 0.0 : values[laser];
  }
  double last_firing_us() const {
    return firing_us_.empty() ? 0.0 : *std::max_element(firing_us_.begin(), firing_us_.end());
  }
  double cycles_per_s(double rate_hz) const {
    return cycle_us_ > 0.0 ? 1e6 / cycle_us_ : rate_hz * static_cast<double>(columns_);
  }
  /// Column 0 of a turn is at the scan's own time, to the bit.
  double time_of_cycle_s(std::int64_t cycle, double rate_hz) const {
    const auto number = static_cast<double>(cycle);
    return cycle_us_ > 0.0 ? number * cycle_us_ * 1e-6
                           : number / static_cast<double>(columns_) / rate_hz;
  }
  Pulse pulse(std::size_t laser, double time_s, double rate_hz) const {
    const double sense = turning_ == "clockwise" ? -1.0 : 1.0;
    const double head_rad =
        start_deg_ * kDegree + sense * 2.0 * std::numbers::pi * phase_of(time_s, rate_hz);
    const Eigen::Vector3d ahead = direction_of(head_rad, 0.0);
    const Eigen::Vector3d left(-ahead.y(), ahead.x(), 0.0);
    return {.time_s = time_s,
            .origin_m = 1e-3 * (origin_mm_ * ahead + of_laser(across_mm_, laser) * left +
                                of_laser(vertical_mm_, laser) * Eigen::Vector3d::UnitZ()),
            .direction = direction_of(head_rad + of_laser(azimuth_deg_, laser) * kDegree,
                                      elevation_deg_[laser] * kDegree),
            .ring = static_cast<std::uint16_t>(laser)};
  }

  std::vector<double> elevation_deg_ = {-15.0, 1.0, -13.0, 3.0,  -11.0, 5.0,  -9.0, 7.0,
                                        -7.0,  9.0, -5.0,  11.0, -3.0,  13.0, -1.0, 15.0};
  std::vector<double> azimuth_deg_;
  std::vector<double> firing_us_;
  double cycle_us_ = 0.0;
  std::int64_t columns_ = 1024;
  double origin_mm_ = 0.0;
  std::vector<double> vertical_mm_;
  std::vector<double> across_mm_;
  double start_deg_ = 0.0;
  std::string turning_ = "clockwise";
};

void Spinning::validate() const {
  using core::ErrorKind;
  using core::fail;
  const std::size_t num_lasers = elevation_deg_.size();
  if (num_lasers == 0 || num_lasers > 4096)
    fail(ErrorKind::Config, "elevation_deg has {} numbers; a head has 1 to 4096 lasers",
         num_lasers);
  for (const double elevation_deg : elevation_deg_)
    if (!(std::abs(elevation_deg) <= 90.0))
      fail(ErrorKind::Config, "elevation_deg = {}; it takes -90 to 90", elevation_deg);
  const auto check = [&](const char* name, const std::vector<double>& values, double lowest,
                         double highest) {
    if (!values.empty() && values.size() != num_lasers)
      fail(ErrorKind::Config, "{} has {} numbers, and elevation_deg {}; it takes as many, or none",
           name, values.size(), num_lasers);
    for (const double value : values)
      if (!(value >= lowest && value <= highest))
        fail(ErrorKind::Config, "{} = {}; it takes {} to {}", name, value, lowest, highest);
  };
  check("azimuth_deg", azimuth_deg_, -180.0, 180.0);
  check("firing_us", firing_us_, 0.0, 1e6);
  check("vertical_mm", vertical_mm_, -1e3, 1e3);
  check("across_mm", across_mm_, -1e3, 1e3);
  if (cycle_us_ > 0.0 && cycle_us_ < 1e-3)
    fail(ErrorKind::Config, "cycle_us = {}; it takes 0.001 or more, or 0", cycle_us_);
  if (cycle_us_ == 0.0 && columns_ == 0)
    fail(ErrorKind::Config, "cycle_us and columns are both 0; one of them says when lasers fire");
}

}  // namespace

ScanPatternInfo spinning_pattern() {
  return {.name = "spinning", .summary = "lasers on a head that turns once a scan", .make = [] {
            return std::unique_ptr<ScanPattern>(std::make_unique<Spinning>());
          }};
}

}  // namespace terracast::sensors::lidar
