#include "sensors/events/pixel.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/error.h"
#include "core/random.h"
#include "sensors/deviates.h"

namespace terracast::sensors::events {
namespace {

using core::ErrorKind;
using core::fail;

/// A pixel is dead for this long at least, so that its events have times of their own once they are rounded.
constexpr double kLeastDead_s = 2e-9;
constexpr double kNever_s = std::numeric_limits<double>::infinity();

/// What random numbers of a pixel are for.
enum Purpose : std::uint64_t { kThresholdOn, kThresholdOff, kReference, kWait, kThin, kSign };

/// The light of a cubic without the leak that was laid over it.
Cubic with_leak(const Cubic& light, double leak_per_s) {
  Cubic sum = light;
  sum.coefficients[0] += leak_per_s * light.start_s;
  sum.coefficients[1] += leak_per_s;
  return sum;
}

}  // namespace

void PixelOptions::describe(core::SchemaVisitor& visit) {
  visit.key("contrast_on", contrast_on,
            "Change of ln luminance that makes an event where it becomes brighter.",
            core::between(kLeastContrast, 10.0));
  visit.key("contrast_off", contrast_off, "The same where it becomes darker.",
            core::between(kLeastContrast, 10.0));
  visit.key("contrast_sd", contrast_sd,
            "Standard deviation of both from pixel to pixel, drawn once a pixel and sign; none is "
            "below 0.01.",
            core::between(0.0, 1.0));
  visit.key("refractory_us", refractory_us, "A pixel makes no further event for so long.",
            core::between(0.0, 1e6));
  visit.key("in_refractory", in_refractory,
            "What happens to changes meanwhile: they are `kept` and make events when the pixel "
            "wakes, or are `lost`.",
            core::one_of({"kept", "lost"}));
  visit.key("cutoff_hz", cutoff_hz,
            "Cutoff of the photoreceptor's low-pass, of first order; 0: it has none.",
            core::between(0.0, 1e6));
  visit.key("cutoff_least_share", cutoff_least_share,
            "In light below bright_cd_per_m2 the cutoff falls with it, to this share; 1: it does "
            "not.",
            core::between(1e-3, 1.0));
  visit.key("leak_hz", leak_hz,
            "Rate of a pixel's brighter events that come without any change, by leak.",
            core::between(0.0, 1e3));
  visit.key("shot_noise_hz", shot_noise_hz,
            "Rate of a pixel's events of either sign by noise, in the dark.",
            core::between(0.0, 1e4));
  visit.key("shot_noise_in_light", shot_noise_in_light,
            "Share of that rate that is left in light of bright_cd_per_m2.",
            core::between(0.0, 1.0));
  visit.key("bright_cd_per_m2", bright_cd_per_m2,
            "Luminance from which on the pixel is at its best; grey in the sun has some 5000.",
            core::between(1e-3, 1e6));
  visit.key("dark_cd_per_m2", dark_cd_per_m2,
            "Dark current, as the luminance that brings as much: below it contrasts fade.",
            core::between(1e-9, 1e5));
  visit.key("first_reference", first_reference,
            "A pixel's reference at the beginning: the `light` that it sees, or `drawn` evenly "
            "between its thresholds about that.",
            core::one_of({"light", "drawn"}));
}

void PixelOptions::validate() const {
  const double lower = std::min(contrast_on, contrast_off);
  if (!(3.0 * contrast_sd <= lower))
    fail(ErrorKind::Config,
         "contrast_sd = {} is more than a third of the contrast {}: many pixels would have none; "
         "take {:.3g} or less",
         contrast_sd, lower, lower / 3.0);
  if (cutoff_hz == 0.0 && cutoff_least_share != 1.0)
    fail(ErrorKind::Config,
         "cutoff_least_share = {} without cutoff_hz: there is no low-pass; give cutoff_hz",
         cutoff_least_share);
}

double PixelOptions::log_light(double luminance_cd_per_m2) const {
  return std::log(std::max(luminance_cd_per_m2, 0.0) + dark_cd_per_m2);
}

std::int64_t TimeSpan::first_ns() const {
  auto n = static_cast<std::int64_t>(std::floor(start_s * 1e9)) - 2;
  while (static_cast<double>(n) / 1e9 < start_s) ++n;
  return n;
}

std::int64_t TimeSpan::last_ns() const {
  auto n = static_cast<std::int64_t>(std::ceil(end_s * 1e9)) + 2;
  while (static_cast<double>(n) / 1e9 >= end_s) --n;
  return n;
}

/// The way of one pixel through one curve.
struct Pixels::Run {
  std::uint32_t pixel;
  Thresholds thresholds;
  std::int64_t first_ns;
  std::int64_t last_ns;
  double dead_s;
  bool is_change_lost;
  PixelState& state;
  std::vector<Event>& events;

  void emit(double time_s, bool is_on, bool is_noise) {
    const auto floor_ns = static_cast<std::int64_t>(std::floor(time_s * 1e9));
    const std::int64_t time_ns =
        std::min(std::max({floor_ns, first_ns, state.last_event_ns + 1}), last_ns);
    events.push_back({.time_ns = time_ns,
                      .pixel = pixel,
                      .is_on = is_on,
                      .is_noise = is_noise,
                      .contrast = static_cast<float>(is_on ? thresholds.on : thresholds.off)});
    state.last_event_ns = time_ns;
    state.dead_until_s = time_s + dead_s;
    // Noise leaves the reference where it is.
    if (!is_noise) state.is_held = is_change_lost;
  }
};

Pixels::Pixels(const PixelOptions& options, std::uint64_t seed)
    : options_(options),
      seed_(seed),
      dead_s_(std::max(1e-6 * options.refractory_us, kLeastDead_s)) {}

double Pixels::draw(std::uint32_t pixel, std::uint64_t purpose, std::uint64_t index) const {
  return open_unit(core::random_bits(seed_, core::stream_of(purpose, pixel), index));
}

Thresholds Pixels::thresholds(std::uint32_t pixel) const {
  const auto drawn = [&](double mean, Purpose sign) {
    if (options_.contrast_sd == 0.0) return mean;
    return std::max(PixelOptions::kLeastContrast,
                    mean + options_.contrast_sd * normal_deviate(draw(pixel, sign, 0)));
  };
  return {.on = drawn(options_.contrast_on, kThresholdOn),
          .off = drawn(options_.contrast_off, kThresholdOff)};
}

PixelState Pixels::start(std::uint32_t pixel, double log_light) const {
  PixelState state{.reference = log_light, .level = log_light};
  if (options_.first_reference == "drawn") {
    const auto [on, off] = thresholds(pixel);
    state.reference += off - (on + off) * draw(pixel, kReference, 0);
  }
  if (options_.shot_noise_hz > 0.0) state.next_noise_s = noise_wait_s(pixel, 0);
  return state;
}

double Pixels::brightness(double log_light) const {
  return std::min(1.0, std::exp(log_light) / options_.bright_cd_per_m2);
}

double Pixels::cutoff_per_s(double log_light) const {
  const double share = options_.cutoff_least_share == 1.0
                           ? 1.0
                           : std::max(options_.cutoff_least_share, brightness(log_light));
  return 2.0 * std::numbers::pi * options_.cutoff_hz * share;
}

double Pixels::noise_wait_s(std::uint32_t pixel, std::uint64_t index) const {
  return -std::log(draw(pixel, kWait, index)) / options_.shot_noise_hz;
}

bool Pixels::is_noise_kept(std::uint32_t pixel, std::uint64_t index, double log_light) const {
  const double kept = 1.0 - (1.0 - options_.shot_noise_in_light) * brightness(log_light);
  return draw(pixel, kThin, index) < kept;
}

void Pixels::make_noise(Run& run, double log_light) const {
  PixelState& state = run.state;
  const std::uint64_t index = state.num_noise_draws++;
  const double time_s = state.next_noise_s;
  state.next_noise_s = time_s + noise_wait_s(run.pixel, state.num_noise_draws);
  if (time_s >= state.dead_until_s && is_noise_kept(run.pixel, index, log_light))
    run.emit(time_s, draw(run.pixel, kSign, index) < 0.5, true);
}

void Pixels::cross(Run& run, const Filtered& signal, double start_s, double from, double to,
                   const Cubic& light) const {
  PixelState& state = run.state;
  const auto level = [&](double x) { return signal.at(x); };
  const double level_to = level(to);
  for (double here = from;;) {
    // The pixel sleeps, unless noise comes before the part's end.
    const double awake = std::max(here, state.dead_until_s - start_s);
    double next = kNever_s;
    bool is_on = false;
    if (awake <= to) {
      const double level_here = level(awake);
      if (state.is_held) state.reference = level_here;
      state.is_held = false;
      const double up = state.reference + run.thresholds.on;
      const double down = state.reference - run.thresholds.off;
      if (level_here >= up || level_here <= down) {
        next = awake;
        is_on = level_here >= up;
      } else if (level_to >= up || level_to <= down) {
        is_on = level_to >= up;
        next = first_place_of(level, is_on ? up : down, awake, to);
      }
    }
    const double noise = state.next_noise_s - start_s;
    if (noise <= std::min(next, to)) {
      make_noise(run, light.at(std::clamp(noise, 0.0, light.length_s)));
      here = std::max(here, noise);
      continue;
    }
    if (next == kNever_s) return;
    state.reference += is_on ? run.thresholds.on : -run.thresholds.off;
    run.emit(start_s + next, is_on, false);
    here = next;
  }
}

void Pixels::advance(std::uint32_t pixel, std::span<const Cubic> curve, const TimeSpan& span,
                     PixelState& state, std::vector<Event>& events) const {
  Run run{.pixel = pixel,
          .thresholds = thresholds(pixel),
          .first_ns = span.first_ns(),
          .last_ns = span.last_ns(),
          .dead_s = dead_s_,
          .is_change_lost = options_.in_refractory == "lost",
          .state = state,
          .events = events};
  const double leak_per_s = options_.leak_hz * run.thresholds.on;
  for (const Cubic& light : curve) {
    const Cubic leaking = with_leak(light, leak_per_s);
    const Filtered signal(leaking, cutoff_per_s(light.at(0.5 * light.length_s)), state.level);
    signal.for_each_monotone_part(
        [&](double from, double to) { cross(run, signal, light.start_s, from, to, light); });
    state.level = signal.at(light.length_s);
  }
}

}  // namespace terracast::sensors::events
