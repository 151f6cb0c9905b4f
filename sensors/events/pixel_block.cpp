#include "sensors/events/pixel_block.h"

#include <algorithm>
#include <span>

namespace terracast::sensors::events {
namespace {

LightSample light_of(const TimedLook& look) {
  return {.time_s = look.time_s, .log_light = look.look.log_light};
}

}  // namespace

void sort_events(std::span<Event> events) {
  std::stable_sort(events.begin(), events.end(), [](const Event& a, const Event& b) {
    return a.time_ns != b.time_ns ? a.time_ns < b.time_ns : a.pixel < b.pixel;
  });
}

void PixelBlock::start(const Pixels& model, double time_s, const LookAt& look_at) {
  std::vector<LookPlace> places;
  for (const std::uint32_t pixel : pixels_) places.push_back({.pixel = pixel, .time_s = time_s});
  std::vector<Look> looks(places.size());
  look_at(places, looks);
  last_.clear();
  states_.clear();
  before_.assign(pixels_.size(), std::nullopt);
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    last_.push_back({.pixel = pixels_[i], .time_s = time_s, .look = looks[i]});
    states_.push_back(model.start(pixels_[i], looks[i].log_light));
  }
}

std::vector<Event> PixelBlock::advance(const Pixels& model, const StepRule& rule,
                                       const TimeSpan& span, const LookAt& look_at) {
  const std::vector<TimedLook> looks = divide_time(last_, span.end_s, rule, look_at);
  std::vector<Event> events;
  std::vector<LightSample> samples;
  std::vector<Cubic> curve;
  auto look = looks.begin();
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    samples.clear();
    for (; look != looks.end() && look->pixel == pixels_[i]; ++look)
      samples.push_back(light_of(*look));
    join_monotone(samples, before_[i], curve);
    model.advance(pixels_[i], curve, span, states_[i], events);
    before_[i] = samples[samples.size() - 2];
    last_[i] = *(look - 1);
  }
  sort_events(events);
  return events;
}

}  // namespace terracast::sensors::events
