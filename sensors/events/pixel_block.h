#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sensors/events/adaptive_steps.h"
#include "sensors/events/light_curve.h"
#include "sensors/events/pixel.h"

namespace terracast::sensors::events {

/// Some pixels of a sensor on their way through time: looked at, and their events made. How pixels are dealt to blocks does
/// not matter to any of them.
class PixelBlock {
 public:
  explicit PixelBlock(std::vector<std::uint32_t> pixels) : pixels_(std::move(pixels)) {}

  /// At the sequence's start.
  void start(const Pixels& model, double time_s, const LookAt& look_at);
  /// Goes on over a span of time, which begins where the last one ended.
  /// returns   the events, in the order of time, pixel and number
  std::vector<Event> advance(const Pixels& model, const StepRule& rule, const TimeSpan& span,
                             const LookAt& look_at);

  const std::vector<std::uint32_t>& pixels() const { return pixels_; }
  const std::vector<PixelState>& states() const { return states_; }

 private:
  std::vector<std::uint32_t> pixels_;
  std::vector<TimedLook> last_;                     ///< of each pixel
  std::vector<std::optional<LightSample>> before_;  ///< the look before that
  std::vector<PixelState> states_;
};

/// The order of events in a stream.
void sort_events(std::span<Event> events);

}  // namespace terracast::sensors::events
