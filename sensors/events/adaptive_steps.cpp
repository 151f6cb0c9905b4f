#include "sensors/events/adaptive_steps.h"

#include <algorithm>
#include <cmath>

namespace terracast::sensors::events {
namespace {

struct Step {
  std::size_t pixel;  ///< place in `begin`
  TimedLook from;
  TimedLook to;
  double bend = 0.0;  ///< by which its middle is expected to lie beside the straight line
};

/// The share of a brightness step that a middle may lie beside the line between the ends of its step.
constexpr double kMostBend = 0.25;
/// A parabola over half a step bends by this share of what it does over the whole one.
constexpr double kBendOfHalf = 0.25;

bool is_to_be_divided(const Step& step, const StepRule& rule) {
  const double length_s = step.to.time_s - step.from.time_s;
  if (!(length_s > rule.finest_s)) return false;
  if (length_s > rule.longest_s) return true;
  const double moved_px = length_s * std::max(step.from.look.flow_pxps, step.to.look.flow_pxps);
  if (moved_px > rule.flow_step_px) return true;
  if (rule.finest_px > 0.0 && moved_px < rule.finest_px) return false;
  return step.bend > kMostBend * rule.brightness_step ||
         std::abs(step.to.look.log_light - step.from.look.log_light) > rule.brightness_step;
}

std::vector<TimedLook> look(std::span<const LookPlace> places, const LookAt& look_at) {
  std::vector<Look> looks(places.size());
  look_at(places, looks);
  std::vector<TimedLook> timed;
  for (std::size_t i = 0; i < places.size(); ++i)
    timed.push_back({.pixel = places[i].pixel, .time_s = places[i].time_s, .look = looks[i]});
  return timed;
}

}  // namespace

std::vector<TimedLook> divide_time(std::span<const TimedLook> begin, double end_s,
                                   const StepRule& rule, const LookAt& look_at) {
  struct Kept {
    std::size_t pixel;
    TimedLook look;
  };
  std::vector<Kept> kept;
  std::vector<LookPlace> places;
  for (std::size_t i = 0; i < begin.size(); ++i) {
    kept.push_back({i, begin[i]});
    places.push_back({.pixel = begin[i].pixel, .time_s = end_s});
  }
  std::vector<TimedLook> looks = look(places, look_at);
  std::vector<Step> steps;
  for (std::size_t i = 0; i < begin.size(); ++i) {
    kept.push_back({i, looks[i]});
    steps.push_back({.pixel = i, .from = begin[i], .to = looks[i]});
  }
  while (true) {
    std::erase_if(steps, [&](const Step& step) { return !is_to_be_divided(step, rule); });
    if (steps.empty()) break;
    places.clear();
    for (const Step& step : steps)
      places.push_back(
          {.pixel = step.from.pixel, .time_s = 0.5 * (step.from.time_s + step.to.time_s)});
    looks = look(places, look_at);
    std::vector<Step> halves;
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const Step& step = steps[i];
      kept.push_back({step.pixel, looks[i]});
      const double bend =
          kBendOfHalf * std::abs(looks[i].look.log_light -
                                 0.5 * (step.from.look.log_light + step.to.look.log_light));
      halves.push_back({.pixel = step.pixel, .from = step.from, .to = looks[i], .bend = bend});
      halves.push_back({.pixel = step.pixel, .from = looks[i], .to = step.to, .bend = bend});
    }
    steps = std::move(halves);
  }
  std::sort(kept.begin(), kept.end(), [](const Kept& a, const Kept& b) {
    return a.pixel != b.pixel ? a.pixel < b.pixel : a.look.time_s < b.look.time_s;
  });
  std::vector<TimedLook> result;
  for (const Kept& one : kept) result.push_back(one.look);
  return result;
}

}  // namespace terracast::sensors::events
