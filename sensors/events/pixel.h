#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/schema.h"
#include "sensors/events/light_curve.h"

/// A pixel of an event camera: from the light that it sees to its events.
namespace terracast::sensors::events {

/// Keys of a sensor's pixels. L is the natural logarithm of luminance and dark current together.
struct PixelOptions {
  double contrast_on = 0.2;
  double contrast_off = 0.2;
  double contrast_sd = 0.0;
  double refractory_us = 0.0;
  std::string in_refractory = "kept";
  double cutoff_hz = 0.0;
  double cutoff_least_share = 1.0;
  double leak_hz = 0.0;
  double shot_noise_hz = 0.0;
  double shot_noise_in_light = 0.25;
  double bright_cd_per_m2 = 5000.0;
  double dark_cd_per_m2 = 1.0;
  std::string first_reference = "light";

  /// No threshold that is drawn is lower.
  static constexpr double kLeastContrast = 0.01;

  void describe(core::SchemaVisitor& visit);
  /// throws   Config: keys that contradict each other
  void validate() const;

  double log_light(double luminance_cd_per_m2) const;
};

/// A pixel's own thresholds, one for each sign, the same for all time.
struct Thresholds {
  double on = 0.0;
  double off = 0.0;
};

struct Event {
  std::int64_t time_ns = 0;  ///< since the sequence's start, rounded down
  std::uint32_t pixel = 0;   ///< row by row
  bool is_on = false;        ///< it became brighter
  bool is_noise = false;     ///< shot noise; no change of light
  float contrast = 0.0f;     ///< the pixel's threshold of the sign
  bool operator==(const Event&) const = default;
};

/// What a pixel remembers.
struct PixelState {
  double reference = 0.0;  ///< L at the last event
  double level = 0.0;      ///< the photoreceptor's answer: L behind its low-pass
  double dead_until_s = -std::numeric_limits<double>::infinity();
  double next_noise_s = std::numeric_limits<double>::infinity();
  std::int64_t last_event_ns = std::numeric_limits<std::int64_t>::min();
  std::uint64_t num_noise_draws = 0;
  bool is_held = false;  ///< it takes the level for its reference when it wakes
};

/// Nanoseconds that lie in a span of time: from `first`, before `end`.
struct TimeSpan {
  double start_s = 0.0;
  double end_s = 0.0;

  /// The first and the last n for which start_s <= n / 1e9 < end_s, as doubles round it.
  std::int64_t first_ns() const;
  std::int64_t last_ns() const;
};

/// All pixels of a sensor; each depends on its own light, its own random numbers and nothing else.
///
/// An event is made when the photoreceptor's answer u has changed by the pixel's threshold since its reference, which
/// then moves by the threshold. u follows L by a low-pass of first order, and rises by the leak beside. While a pixel is
/// dead (refractory) it makes no event: what changed meanwhile is kept, and makes events when it wakes, or is lost.
/// Shot noise makes events of either sign at the times of a Poisson process and leaves the reference where it is.
///
/// accuracy      crossings of the curve to 1e-11 s; times are then rounded down to the nanosecond, and held within the
///               span of time. Two events of a pixel are 2 ns apart at least
/// determinism   a pixel's events follow from its curve from time 0 on
class Pixels {
 public:
  /// seed   of the sensor's stream
  Pixels(const PixelOptions& options, std::uint64_t seed);

  Thresholds thresholds(std::uint32_t pixel) const;
  /// At the sequence's start.
  PixelState start(std::uint32_t pixel, double log_light) const;
  /// Appends the events of a pixel over a curve, in their order.
  /// curve   follows on from the last one; within `span`
  void advance(std::uint32_t pixel, std::span<const Cubic> curve, const TimeSpan& span,
               PixelState& state, std::vector<Event>& events) const;

 private:
  struct Run;
  double cutoff_per_s(double log_light) const;
  double brightness(double log_light) const;
  double noise_wait_s(std::uint32_t pixel, std::uint64_t draw) const;
  double draw(std::uint32_t pixel, std::uint64_t purpose, std::uint64_t index) const;
  bool is_noise_kept(std::uint32_t pixel, std::uint64_t draw, double log_light) const;
  void make_noise(Run& run, double log_light) const;
  void cross(Run& run, const Filtered& signal, double start_s, double from, double to,
             const Cubic& light) const;

  PixelOptions options_;
  std::uint64_t seed_;
  double dead_s_;
};

}  // namespace terracast::sensors::events
