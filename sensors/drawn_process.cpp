#include "sensors/drawn_process.h"

#include <cmath>

#include "core/random.h"
#include "sensors/deviates.h"

namespace terracast::sensors {

double DrawnProcess::deviate(std::int64_t tick) const {
  return normal_deviate(
      open_unit(core::random_bits(seed_, stream_, static_cast<std::uint64_t>(tick))));
}

DrawnProcess DrawnProcess::walk(double step, std::uint64_t seed, std::uint64_t stream) {
  DrawnProcess process(seed, stream);
  for (int depth = 0; depth < Values::kDepth; ++depth) {
    const double half = Values::half_ticks(depth);
    // Between ends that are known the middle scatters by a quarter of what the whole interval gains.
    process.halvings_[static_cast<std::size_t>(depth)] = {0.5, step * std::sqrt(0.5 * half)};
  }
  const double whole = step * std::sqrt(std::ldexp(1.0, Values::kDepth));
  process.values_ = Values(0.0, whole * process.deviate(Values::kEnd));
  return process;
}

DrawnProcess DrawnProcess::markov(double deviation, double ticks, std::uint64_t seed,
                                  std::uint64_t stream) {
  DrawnProcess process(seed, stream);
  for (int depth = 0; depth < Values::kDepth; ++depth) {
    const double half = Values::half_ticks(depth);
    const double kept = std::exp(-half / ticks);
    // 1 - kept^2, exactly for short intervals too.
    const double lost = -std::expm1(-2.0 * half / ticks);
    process.halvings_[static_cast<std::size_t>(depth)] = {
        kept / (1.0 + kept * kept), deviation * std::sqrt(lost / (1.0 + kept * kept))};
  }
  const double whole = std::ldexp(1.0, Values::kDepth) / ticks;
  const double first = deviation * process.deviate(0);
  process.values_ =
      Values(first, std::exp(-whole) * first + deviation * std::sqrt(-std::expm1(-2.0 * whole)) *
                                                   process.deviate(Values::kEnd));
  return process;
}

double DrawnProcess::at(std::int64_t tick) {
  return values_.at(tick, [&](int depth, double first, double end, std::int64_t middle) {
    const Halving& halving = halvings_[static_cast<std::size_t>(depth)];
    return halving.weight * (first + end) + halving.deviation * deviate(middle);
  });
}

DrawnSwitch::DrawnSwitch(double mean_on_ticks, double mean_off_ticks, std::uint64_t seed,
                         std::uint64_t stream)
    : share_on_(mean_on_ticks / (mean_on_ticks + mean_off_ticks)),
      rate_(1.0 / mean_on_ticks + 1.0 / mean_off_ticks),
      seed_(seed),
      stream_(stream),
      values_(false, false) {
  const bool first = drawn(0, share_on_);
  const double whole = std::ldexp(1.0, Values::kDepth);
  values_ = Values(first, drawn(Values::kEnd, probability(first, true, whole)));
}

double DrawnSwitch::probability(bool from, bool to, double ticks) const {
  const double share = to ? share_on_ : 1.0 - share_on_;
  const double forgotten = -std::expm1(-rate_ * ticks);
  return from == to ? 1.0 - forgotten * (1.0 - share) : forgotten * share;
}

bool DrawnSwitch::drawn(std::int64_t tick, double share_on) const {
  return open_unit(core::random_bits(seed_, stream_, static_cast<std::uint64_t>(tick))) < share_on;
}

bool DrawnSwitch::is_on(std::int64_t tick) {
  return values_.at(tick, [&](int depth, bool first, bool end, std::int64_t middle) {
    // It forgets all but its state: the middle is bound to each end by itself.
    const double half = Values::half_ticks(depth);
    const double on = probability(first, true, half) * probability(true, end, half);
    const double off = probability(first, false, half) * probability(false, end, half);
    return drawn(middle, on / (on + off));
  });
}

}  // namespace terracast::sensors
