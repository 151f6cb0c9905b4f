#include "validate/checks/sensor_clocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "validate/checks/checker.h"
#include "validate/null_distribution.h"
#include "validate/readers/sensors.h"

namespace terracast::validate {

namespace {

/// No stamp jitters by more deviations, and the variance of what is left is so much less than theirs.
constexpr double kMostDeviations = 4.0;
constexpr double kBoundedVariance = 1.0 - 1.0706e-3;
/// Of rows of a scan those so near its tick tell its jitter, which runs on to the next one's.
constexpr double kNearTick = 0.02;
/// Fewer stamps do not tell a jitter's size.
constexpr std::size_t kFewest = 30;

/// Stamps of a sensor: all of them, or of a scanner one a scan.
struct Stamps {
  std::vector<double> times_s, errors_s;
  double rounding_s = 0.0;
};

class ClockComparison {
 public:
  ClockComparison() {
    const auto name = [](CheckResult& result, const char* what) {
      result.name = what;
      result.bound = 1.0;
      result.unit = "of what the jitter allows";
    };
    name(stamps_, "clocks_stamps");
    name(offset_, "clocks_offset");
    name(drift_, "clocks_drift");
    name(jitter_, "clocks_jitter");
  }

  void compare(const Dataset& dataset, const Sequence& sequence, const SensorRecord& sensor) {
    ++num_sensors_;
    Stamps stamps;
    last_s_ = last_stamp_s_ = -1e300;
    if (!sensor.is_scan)
      for (std::size_t k = 0; k < sensor.times_s.size(); ++k)
        add(sensor, k, sensor.times_s[k], sensor.stamps_s[k], stamps);
    else
      for (int frame = 0; frame < sequence.num_frames; ++frame) {
        const NpyTable table = read_scans(dataset, sensor, frame);
        const std::vector<double> times_s = table.numbers("time_s", sensor.file);
        const std::vector<double> stamps_s = table.numbers("stamp_s", sensor.file);
        for (std::size_t row = 0; row < times_s.size(); ++row)
          add(sensor, row, times_s[row], stamps_s[row], stamps);
      }
    judge(sensor, stamps);
  }

  std::vector<CheckResult> results() {
    const std::string what = fmt::format(
        "{} stamps of {} sensors beside cameras against t + offset_s + drift t of sensors.json",
        num_stamps_, num_sensors_);
    stamps_.summary = what + ", one by one, and their order.";
    stamps_.reason = "No stamp jitters by more than four deviations; doubles' rounding.";
    stamps_.detects = "stamps in another unit, out of order, or of another sensor";
    offset_.summary = what + ": their mean.";
    offset_.reason = drift_.reason = jitter_.reason =
        "How far normal deviates' means, slopes and variances go with a probability of 1e-9.";
    offset_.detects = "another offset than is stated, by a tenth of the jitter of 10 000 stamps";
    drift_.summary = what + ": what they gain.";
    drift_.detects = "another drift than is stated";
    jitter_.summary = what + ": how they scatter.";
    jitter_.detects = "another jitter than is stated";
    std::vector<CheckResult> all;
    const auto add = [&](CheckResult& result, std::size_t num_seen, const char* why_unseen) {
      if (num_seen == 0) {
        all.push_back(unseen_result(result.name, why_unseen));
        return;
      }
      result.ok = result.is_within_bound();
      all.push_back(std::move(result));
    };
    add(stamps_, static_cast<std::size_t>(num_stamps_), "there are no samples");
    add(offset_, num_offsets_, "there are no samples near ticks");
    add(drift_, num_drifts_, "there are no two samples");
    add(jitter_, num_jitters_, "no clock jitters, or of too few samples");
    return all;
  }

 private:
  void add(const SensorRecord& sensor, std::size_t row, double time_s, double stamp_s,
           Stamps& stamps) {
    const SensorClock& clock = *sensor.clock;
    const double error_s = stamp_s - clock.reading_s(time_s);
    const double rounding_s = stamp_rounding_s(time_s, stamp_s);
    const auto where = [&](const char* what) {
      return fmt::format("{}, row {} at {} s: {} {:.3g} s", sensor.file, row, time_s, what,
                         what[0] == 'o' ? error_s : stamp_s - last_stamp_s_);
    };
    ++num_stamps_;
    const double share = std::abs(error_s) / (rounding_s + kMostDeviations * clock.jitter_sd_s);
    if (!(share <= stamps_.value) || stamps_.worst.empty())
      note_worst(stamps_, share, where("off by"));
    // Pulses of one time have one stamp.
    const bool is_in_order =
        time_s > last_s_ ? stamp_s > last_stamp_s_ : stamp_s >= last_stamp_s_ - rounding_s;
    if (!is_in_order && std::abs(time_s - last_s_) > 4.0 * rounding_s)
      note_worst(stamps_, 1e9, where("later than the one before by"));
    last_s_ = time_s;
    last_stamp_s_ = stamp_s;
    double weight = 1.0;
    if (sensor.is_scan) {
      const double ticks = time_s * sensor.rate_hz;
      const double tick = std::floor(ticks + 1e-9), after = std::max(0.0, ticks - tick);
      if (after > kNearTick || tick == last_tick_) return;
      last_tick_ = tick;
      weight = std::hypot(1.0 - after, after);
    }
    stamps.times_s.push_back(time_s);
    stamps.errors_s.push_back(error_s / weight);
    stamps.rounding_s = std::max(stamps.rounding_s, rounding_s);
  }

  void judge(const SensorRecord& sensor, const Stamps& stamps) {
    last_tick_ = -1.0;
    if (stamps.times_s.empty()) return;
    const StampErrors found = stamp_errors_of(stamps.times_s, stamps.errors_s);
    const double sd_s = sensor.clock->jitter_sd_s;
    constexpr double kNormal = 1e12;  // degrees of freedom
    const double far = student_quantile(kFalseVerdict, kNormal);
    const auto count = static_cast<double>(found.count);
    ++num_offsets_;
    note_worst(offset_,
               std::abs(found.mean_s) / (stamps.rounding_s + far * sd_s / std::sqrt(count)),
               fmt::format("{}: {:.6g} s beside what is stated", sensor.file, found.mean_s));
    if (found.count < 2) return;
    ++num_drifts_;
    const double spread_s = std::sqrt(found.spread_s2);
    note_worst(
        drift_,
        std::abs(found.slope) * spread_s / (far * sd_s + std::sqrt(count) * stamps.rounding_s),
        fmt::format("{}: {:.6g} ppm beside what is stated", sensor.file, 1e6 * found.slope));
    if (found.count < kFewest || !(sd_s > kRoundingShare * stamps.rounding_s)) return;
    ++num_jitters_;
    // The sum of squares is a chi-square's; its logarithm's error by Wilson and Hilferty's cube root.
    const double degrees = count - 2.0;
    const double ratio = found.variance_s2 / (sd_s * sd_s * kBoundedVariance);
    const double per_degree = 2.0 / (9.0 * degrees);
    const double deviations = (std::cbrt(ratio) - (1.0 - per_degree)) / std::sqrt(per_degree);
    note_worst(jitter_, std::abs(deviations) / far,
               fmt::format("{}: {:.4g} s, {:.4g} s is stated", sensor.file,
                           std::sqrt(found.variance_s2), sd_s));
  }

  /// A jitter that rounding hides is not looked at.
  static constexpr double kRoundingShare = 1e4;

  CheckResult stamps_, offset_, drift_, jitter_;
  std::int64_t num_stamps_ = 0;
  int num_sensors_ = 0;
  std::size_t num_offsets_ = 0, num_drifts_ = 0, num_jitters_ = 0;
  double last_s_ = 0.0, last_stamp_s_ = 0.0, last_tick_ = -1.0;
};

}  // namespace

double stamp_rounding_s(double time_s, double stamp_s) {
  // A few roundings of sums of such numbers.
  constexpr double kRounding = 1e-15;
  return kRounding * (1.0 + std::abs(time_s) + std::abs(stamp_s));
}

StampErrors stamp_errors_of(const std::vector<double>& times_s,
                            const std::vector<double>& errors_s) {
  StampErrors found{.count = times_s.size()};
  if (found.count == 0) return found;
  const auto count = static_cast<double>(found.count);
  for (std::size_t i = 0; i < found.count; ++i) {
    found.middle_s += times_s[i] / count;
    found.mean_s += errors_s[i] / count;
  }
  double product = 0.0;
  for (std::size_t i = 0; i < found.count; ++i) {
    const double off_s = times_s[i] - found.middle_s;
    found.spread_s2 += off_s * off_s;
    product += off_s * (errors_s[i] - found.mean_s);
  }
  if (found.spread_s2 > 0.0) found.slope = product / found.spread_s2;
  if (found.count < 3) return found;
  for (std::size_t i = 0; i < found.count; ++i) {
    const double left_s = errors_s[i] - found.mean_s - found.slope * (times_s[i] - found.middle_s);
    found.variance_s2 += left_s * left_s / (count - 2.0);
  }
  return found;
}

std::vector<CheckResult> compare_sensor_clocks(const Dataset& dataset, const Sequence& sequence) {
  ClockComparison comparison;
  try {
    std::vector<SensorRecord> sensors = read_sensors(dataset, sequence);
    std::erase_if(sensors, [](const SensorRecord& sensor) { return !sensor.clock; });
    if (sensors.empty()) return {};
    for (const SensorRecord& sensor : sensors) comparison.compare(dataset, sequence, sensor);
  } catch (const core::Error& error) {
    if (error.kind() != core::ErrorKind::Input && error.kind() != core::ErrorKind::Io) throw;
    return {};  // `sensors` and `lidar` tell of it
  }
  return comparison.results();
}

}  // namespace terracast::validate
