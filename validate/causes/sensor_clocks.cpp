#include "validate/checks/sensor_clocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "validate/causes/sensor_trial.h"
#include "validate/null_distribution.h"

/// Stamps of another offset, drift, unit, sample or sensor, and out of order.
namespace terracast::validate {

namespace {

/// A sensor's times with its stamps, of all rows.
struct TimesAndStamps {
  std::vector<double> times_s, stamps_s;
};

TimesAndStamps stamps_of(const SensorSymptoms& symptoms) {
  const SensorRecord& sensor = symptoms.sensor;
  if (!sensor.is_scan) return {sensor.times_s, sensor.stamps_s};
  TimesAndStamps all;
  for (int frame = 0; frame < symptoms.sequence.num_frames; ++frame) {
    const NpyTable table = read_scans(symptoms.dataset, sensor, frame);
    const auto append = [&](const char* column, std::vector<double>& to) {
      const std::vector<double> more = table.numbers(column, sensor.file);
      to.insert(to.end(), more.begin(), more.end());
    };
    append("time_s", all.times_s);
    append("stamp_s", all.stamps_s);
  }
  return all;
}

/// Changes each stamp, by its time.
void change_stamps(SensorRecord& sensor,
                   const std::function<double(double stamp_s, double time_s)>& change) {
  for (std::size_t k = 0; k < sensor.stamps_s.size(); ++k)
    sensor.stamps_s[k] = change(sensor.stamps_s[k], sensor.times_s[k]);
  if (!sensor.is_scan) return;
  const auto before = sensor.change_scans;
  sensor.change_scans = [=, file = sensor.file](NpyTable& scans, int frame) {
    if (before) before(scans, frame);
    const NpyTable::Column stamp = scans.column("stamp_s", file),
                           time = scans.column("time_s", file);
    for (std::size_t row = 0; row < scans.num_rows; ++row)
      scans.set_number(stamp, row, change(scans.number(stamp, row), scans.number(time, row)));
  };
}

void add_units(std::vector<SensorHypothesis>& hypotheses) {
  for (const auto& [factor, words] : {std::pair{1e3, "ms"}, std::pair{1e6, "us"},
                                      std::pair{1e9, "ns"}, std::pair{1.0 / 60.0, "minutes"}})
    hypotheses.push_back(simple_cause(
        "clock_unit", fmt::format("stamps are in {} where seconds are meant", words), 1,
        [factor = factor](SensorRecord& sensor) {
          change_stamps(sensor, [=](double stamp_s, double) { return stamp_s / factor; });
          return true;
        }));
}

/// What an offset is known for.
struct KnownOffset {
  double offset_s;
  const char* words;
};
constexpr std::array kKnownOffsets = {
    KnownOffset{18.0, "GPS time, which is 18 s ahead of UTC since 2017, for UTC"},
    KnownOffset{-18.0, "UTC for GPS time, which is 18 s ahead of it since 2017"},
    KnownOffset{37.0, "TAI, which is 37 s ahead of UTC since 2017, for UTC"}};

Cause cause_of_offset(const SensorRecord& sensor, double offset_s, double error_s) {
  Cause cause;
  cause.size = offset_s;
  cause.unit = "s";
  for (const KnownOffset& known : kKnownOffsets)
    if (std::abs(offset_s - known.offset_s) <= error_s) {
      cause.name = "clock_time_scale";
      cause.words =
          fmt::format("stamps are {:+.6g} s off the stated clock: {}", offset_s, known.words);
      return cause;
    }
  constexpr double kHour_s = 3600.0, kMostHours = 14.0;
  const double hours = std::round(4.0 * offset_s / kHour_s) / 4.0;
  if (hours != 0.0 && std::abs(hours) <= kMostHours &&
      std::abs(offset_s - hours * kHour_s) <= error_s) {
    cause.name = "clock_zone";
    cause.words = fmt::format("stamps are {:+g} h off the stated clock: local time for UTC", hours);
    return cause;
  }
  const double samples = -offset_s * sensor.rate_hz;
  constexpr double kMostSamples = 100.0;
  if (std::round(samples) != 0.0 && std::abs(samples) <= kMostSamples &&
      std::abs(samples - std::round(samples)) <= error_s * sensor.rate_hz) {
    cause.name = "clock_late";
    cause.size = std::round(samples);
    cause.unit = "samples";
    cause.words =
        fmt::format("stamps are those of {:g} sample{} {}", std::abs(cause.size),
                    std::abs(cause.size) == 1.0 ? "" : "s", cause.size > 0.0 ? "before" : "after");
    return cause;
  }
  cause.name = "clock_offset";
  cause.words = fmt::format("stamps are {:+.6g} s off the stated clock", offset_s);
  return cause;
}

/// Offset alone, and with a drift, by least squares.
void add_fitted(const SensorSymptoms& symptoms, const TimesAndStamps& stamps,
                std::vector<SensorHypothesis>& hypotheses) {
  const SensorClock clock = *symptoms.sensor.clock;
  std::vector<double> errors_s;
  double rounding_s = 0.0;
  for (std::size_t i = 0; i < stamps.times_s.size(); ++i) {
    errors_s.push_back(stamps.stamps_s[i] - clock.reading_s(stamps.times_s[i]));
    rounding_s = std::max(rounding_s, stamp_rounding_s(stamps.times_s[i], stamps.stamps_s[i]));
  }
  const StampErrors found = stamp_errors_of(stamps.times_s, errors_s);
  if (found.count < 2) return;
  constexpr double kNormal = 1e12;  // degrees of freedom
  const double error_s = student_quantile(kFalseVerdict, kNormal) * clock.jitter_sd_s /
                             std::sqrt(static_cast<double>(found.count)) +
                         rounding_s;
  SensorHypothesis offset;
  offset.rank = 2;
  offset.undo = [=](SensorRecord& sensor, Cause& cause) {
    change_stamps(sensor, [=](double stamp_s, double) { return stamp_s - found.mean_s; });
    cause = cause_of_offset(sensor, found.mean_s, error_s);
    return true;
  };
  hypotheses.push_back(std::move(offset));
  SensorHypothesis drift;
  drift.rank = 3;
  drift.undo = [=](SensorRecord& sensor, Cause& cause) {
    change_stamps(sensor, [=](double stamp_s, double time_s) {
      return stamp_s - found.mean_s - found.slope * (time_s - found.middle_s);
    });
    const double start_s = found.mean_s - found.slope * found.middle_s;
    cause.name = "clock_drift";
    cause.size = 1e6 * found.slope;
    cause.unit = "ppm";
    cause.words = fmt::format(
        "stamps gain {:+.6g} ppm on the stated clock, and are {:+.6g} s off it at the start",
        1e6 * found.slope, start_s);
    return true;
  };
  hypotheses.push_back(std::move(drift));
}

void add_order(const TimesAndStamps& stamps, std::vector<SensorHypothesis>& hypotheses) {
  std::size_t num_early = 0;
  for (std::size_t i = 1; i < stamps.stamps_s.size(); ++i)
    num_early += stamps.stamps_s[i] < stamps.stamps_s[i - 1] ? 1 : 0;
  if (num_early == 0) return;
  hypotheses.push_back(simple_cause(
      "clock_order",
      fmt::format("stamps are out of order: {} are earlier than the one before", num_early), 1,
      [](SensorRecord& sensor) {
        if (sensor.is_scan) return false;
        std::sort(sensor.stamps_s.begin(), sensor.stamps_s.end());
        return true;
      }));
}

/// Stamps that fit what is stated of another sensor's clock.
void add_others(const SensorSymptoms& symptoms, std::vector<SensorHypothesis>& hypotheses) {
  for (const SensorRecord& other : symptoms.all) {
    const SensorRecord& own = symptoms.sensor;
    if (!other.clock || (other.rig == own.rig && other.name == own.name)) continue;
    hypotheses.push_back(simple_cause(
        "clock_of_other", fmt::format("stamps are by the clock of {}/{}", other.rig, other.name), 1,
        [clock = other.clock](SensorRecord& sensor) {
          sensor.clock = clock;
          return true;
        }));
  }
}

void add_jitter(const SensorSymptoms& symptoms, const TimesAndStamps& stamps,
                std::vector<SensorHypothesis>& hypotheses) {
  if (symptoms.sensor.is_scan) return;
  const SensorClock clock = *symptoms.sensor.clock;
  std::vector<double> errors_s;
  for (std::size_t i = 0; i < stamps.times_s.size(); ++i)
    errors_s.push_back(stamps.stamps_s[i] - clock.reading_s(stamps.times_s[i]));
  const double sd_s = std::sqrt(stamp_errors_of(stamps.times_s, errors_s).variance_s2);
  SensorHypothesis h;
  h.rank = 4;
  h.undo = [=](SensorRecord& sensor, Cause& cause) {
    sensor.clock->jitter_sd_s = sd_s;
    cause.name = "clock_jitter";
    cause.size = sd_s;
    cause.unit = "s";
    cause.words =
        fmt::format("stamps jitter by {:.4g} s where {:.4g} s is stated", sd_s, clock.jitter_sd_s);
    return true;
  };
  hypotheses.push_back(std::move(h));
}

}  // namespace

void make_sensor_clocks_causes(const SensorSymptoms& symptoms,
                               std::vector<SensorHypothesis>& hypotheses) {
  if (!symptoms.sensor.clock || !symptoms.fails("clocks")) return;
  const TimesAndStamps stamps = stamps_of(symptoms);
  add_units(hypotheses);
  add_order(stamps, hypotheses);
  add_others(symptoms, hypotheses);
  add_fitted(symptoms, stamps, hypotheses);
  add_jitter(symptoms, stamps, hypotheses);
}

}  // namespace terracast::validate
