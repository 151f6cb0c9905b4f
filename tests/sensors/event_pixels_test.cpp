// Pixels of event cameras, against closed forms: each event of known light at the time that a formula says.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <vector>

#include "sensors/events/pixel_block.h"
#include "tests/support/expect_error.h"

namespace terracast::test {
namespace {

using namespace sensors::events;

constexpr double kPi = std::numbers::pi;
constexpr double kMicrosecond = 1e-6;
constexpr double kTick_s = 0.01;

/// Light of a pixel at a time, and the speed of its image.
using LightOf = std::function<Look(std::uint32_t pixel, double time_s)>;

struct Scene {
  LightOf light;
  double duration_s = 0.5;
  std::uint32_t num_pixels = 100;
  StepRule rule = {.brightness_step = 0.04, .flow_step_px = 0.5, .finest_s = 1e-7};
  std::uint64_t seed = 3;
};

/// The events of a scene, by blocks of so many pixels, the last block first.
std::vector<Event> events_of(const Scene& scene, const Pixels& model, std::uint32_t block_pixels,
                             std::vector<PixelState>* states = nullptr) {
  const LookAt look_at = [&](std::span<const LookPlace> places, std::span<Look> looks) {
    for (std::size_t i = 0; i < places.size(); ++i)
      looks[i] = scene.light(places[i].pixel, places[i].time_s);
  };
  std::vector<PixelBlock> blocks;
  for (std::uint32_t first = 0; first < scene.num_pixels; first += block_pixels) {
    std::vector<std::uint32_t> pixels;
    for (std::uint32_t p = first; p < std::min(first + block_pixels, scene.num_pixels); ++p)
      pixels.push_back(p);
    blocks.emplace_back(std::move(pixels));
  }
  std::vector<Event> events;
  for (auto block = blocks.rbegin(); block != blocks.rend(); ++block) {
    block->start(model, 0.0, look_at);
    for (int tick = 0; tick < std::lround(scene.duration_s / kTick_s); ++tick) {
      const TimeSpan span{.start_s = tick * kTick_s, .end_s = (tick + 1) * kTick_s};
      const std::vector<Event> more = block->advance(model, scene.rule, span, look_at);
      events.insert(events.end(), more.begin(), more.end());
    }
  }
  if (states != nullptr)
    for (const PixelBlock& block : blocks)
      states->insert(states->end(), block.states().begin(), block.states().end());
  sort_events(events);
  return events;
}
std::vector<Event> events_of(const Scene& scene, const PixelOptions& options) {
  return events_of(scene, Pixels(options, scene.seed), scene.num_pixels);
}

std::map<std::uint32_t, std::vector<Event>> by_pixel(const std::vector<Event>& events) {
  std::map<std::uint32_t, std::vector<Event>> pixels;
  for (const Event& event : events) pixels[event.pixel].push_back(event);
  return pixels;
}

double seconds(const Event& event) { return static_cast<double>(event.time_ns) * 1e-9; }

TEST(EventPixels, EachEventOfARampComesWhenTheFormulaSays) {
  // An edge of 2 in ln E, 0.25 a pixel, that moves by 400 pixels a second from pixel to pixel: brighter at even pixels and
  // darker at odd ones. Event k of pixel x at x / u + k C / (g u), with the pixel's own C.
  constexpr double kSpeed_pxps = 400.0;
  constexpr double kSlope = 0.25;
  constexpr double kRise = 2.0;
  Scene scene{.light =
                  [&](std::uint32_t pixel, double t) {
                    const double rise =
                        std::clamp(kSlope * (kSpeed_pxps * t - (1.0 + 0.0125 * pixel)), 0.0, kRise);
                    return Look{.log_light = 3.0 + (pixel % 2 == 0 ? rise : -rise),
                                .flow_pxps = kSpeed_pxps};
                  },
              .duration_s = 0.4,
              .num_pixels = 10400};
  // A step is an eighth of the threshold: its first crossing is clear of the edge's corner.
  scene.rule = {.brightness_step = 0.02, .flow_step_px = 0.5, .finest_s = 1e-7};
  const PixelOptions options{.contrast_on = 0.19, .contrast_off = 0.21, .contrast_sd = 0.01};
  const Pixels model(options, scene.seed);
  const std::vector<Event> events = events_of(scene, model, scene.num_pixels);
  const auto pixels = by_pixel(events);
  double worst_s = 0.0;
  std::size_t num_right = 0;
  for (std::uint32_t pixel = 0; pixel < scene.num_pixels; ++pixel) {
    const bool is_on = pixel % 2 == 0;
    const Thresholds own = model.thresholds(pixel);
    const double contrast = is_on ? own.on : own.off;
    const auto count = static_cast<std::size_t>(std::floor(kRise / contrast));
    // The edge's end is a corner too: what the last threshold leaves must not be next to nothing.
    if (kRise / contrast - static_cast<double>(count) < 0.3) continue;
    ASSERT_TRUE(pixels.contains(pixel)) << pixel;
    const std::vector<Event>& own_events = pixels.at(pixel);
    ASSERT_EQ(own_events.size(), count) << pixel;
    for (std::size_t k = 0; k < count; ++k, ++num_right) {
      EXPECT_EQ(own_events[k].is_on, is_on);
      EXPECT_EQ(own_events[k].contrast, static_cast<float>(contrast));
      const double time_s = (1.0 + 0.0125 * pixel) / kSpeed_pxps +
                            static_cast<double>(k + 1) * contrast / (kSlope * kSpeed_pxps);
      worst_s = std::max(worst_s, std::abs(seconds(own_events[k]) - time_s));
    }
  }
  EXPECT_GT(num_right, 40'000U);
  EXPECT_LT(worst_s, kMicrosecond);
}

TEST(EventPixels, AHundredThousandEventsOfAnEndlessRampAreAllThere) {
  Scene scene{.light =
                  [](std::uint32_t pixel, double t) {
                    return Look{.log_light = (1.0 + 0.001 * pixel) * 20.03 * t, .flow_pxps = 100.0};
                  },
              .duration_s = 0.5,
              .num_pixels = 2000};
  const auto pixels = by_pixel(events_of(scene, PixelOptions{.contrast_on = 0.2}));
  std::size_t num_events = 0;
  double worst_s = 0.0;
  for (std::uint32_t pixel = 0; pixel < scene.num_pixels; ++pixel) {
    const double rate = (1.0 + 0.001 * pixel) * 20.03;
    const auto count = static_cast<std::size_t>(std::floor(0.5 * rate / 0.2));
    const std::vector<Event>& own = pixels.at(pixel);
    ASSERT_EQ(own.size(), count) << pixel;
    for (std::size_t k = 0; k < own.size(); ++k)
      worst_s =
          std::max(worst_s, std::abs(seconds(own[k]) - static_cast<double>(k + 1) * 0.2 / rate));
    num_events += own.size();
  }
  EXPECT_GT(num_events, 100'000U);
  EXPECT_LT(worst_s, kMicrosecond);
}

/// The crossings of A sin(w t + phase) from time 0 to the end, each by an arcsine on the half wave on which it lies.
struct Crossing {
  double time_s;
  bool is_on;
};
std::vector<Crossing> crossings_of_sine(double amplitude, double rate, double phase, double end_s,
                                        double contrast, double* least_margin) {
  std::vector<Crossing> all;
  double reference = amplitude * std::sin(phase);
  double from = phase;  // of the angle
  const double last = phase + rate * end_s;
  *least_margin = contrast;
  while (from < last) {
    // The half wave to the next crest or trough.
    const double half = std::floor((from - 0.5 * kPi) / kPi + 1e-12) + 1.0;
    const double turn = 0.5 * kPi + kPi * half;
    const bool is_rising = std::fmod(std::abs(half), 2.0) < 0.5;
    const double peak = is_rising ? amplitude : -amplitude;
    while (true) {
      const double level = reference + (is_rising ? contrast : -contrast);
      const double beyond = is_rising ? peak - level : level - peak;
      *least_margin = std::min(*least_margin, std::abs(beyond));
      if (beyond < 0.0) break;
      // On a rising half wave that ends at `turn` the angle is turn - pi / 2 + asin.
      const double angle = turn - 0.5 * kPi + std::asin((is_rising ? level : -level) / amplitude);
      if (angle > last) break;
      all.push_back({(angle - phase) / rate, is_rising});
      reference = level;
    }
    from = turn;
  }
  return all;
}

TEST(EventPixels, EachEventOfAGratingComesAtItsArcsine) {
  constexpr double kAmplitude = 0.83;
  constexpr double kSpeed_pxps = 120.0;
  constexpr double kPeriod_px = 9.0;
  constexpr double kContrast = 0.11;
  const double rate = 2.0 * kPi * kSpeed_pxps / kPeriod_px;
  const auto phase = [](std::uint32_t pixel) { return -2.0 * kPi * pixel / kPeriod_px * 1.0137; };
  Scene scene{.light =
                  [&](std::uint32_t pixel, double t) {
                    return Look{.log_light = kAmplitude * std::sin(rate * t + phase(pixel)),
                                .flow_pxps = kSpeed_pxps};
                  },
              .duration_s = 0.5,
              .num_pixels = 1000};
  scene.rule = {.brightness_step = 0.01, .flow_step_px = 0.02, .finest_s = 1e-7};
  const auto pixels =
      by_pixel(events_of(scene, PixelOptions{.contrast_on = kContrast, .contrast_off = kContrast}));
  double worst_s = 0.0;
  std::size_t num_events = 0;
  int num_judged = 0;
  for (std::uint32_t pixel = 0; pixel < scene.num_pixels; ++pixel) {
    double margin = 0.0;
    const std::vector<Crossing> expected =
        crossings_of_sine(kAmplitude, rate, phase(pixel), scene.duration_s, kContrast, &margin);
    // A level that a crest just touches is crossed at any time near it.
    if (margin < 0.02 * kContrast) continue;
    ++num_judged;
    const std::vector<Event>& own = pixels.at(pixel);
    ASSERT_EQ(own.size(), expected.size()) << pixel;
    for (std::size_t k = 0; k < own.size(); ++k) {
      EXPECT_EQ(own[k].is_on, expected[k].is_on);
      worst_s = std::max(worst_s, std::abs(seconds(own[k]) - expected[k].time_s));
    }
    num_events += own.size();
  }
  EXPECT_GT(num_judged, 850);
  EXPECT_GT(num_events, 100'000U);
  EXPECT_LT(worst_s, kMicrosecond);
}

TEST(EventPixels, MotionThereAndBackReturnsAllReferences) {
  // Up by something else in each pixel, and back to half a threshold below the start.
  constexpr double kContrast = 0.2;
  const Scene scene{.light =
                        [](std::uint32_t pixel, double t) {
                          const double top = 0.05 + 0.013 * pixel;
                          const double way = std::sin(kPi * t / 0.5);
                          return Look{.log_light = top * way * way - 0.5 * kContrast * t / 0.5,
                                      .flow_pxps = 50.0};
                        },
                    .duration_s = 0.5,
                    .num_pixels = 200};
  std::map<std::uint32_t, int> sums;
  std::size_t num_events = 0;
  for (const Event& event :
       events_of(scene, PixelOptions{.contrast_on = kContrast, .contrast_off = kContrast})) {
    sums[event.pixel] += event.is_on ? 1 : -1;
    ++num_events;
  }
  EXPECT_GT(num_events, 2000U);
  for (const auto& [pixel, sum] : sums) EXPECT_EQ(sum, 0) << pixel;
}

Look wavy(std::uint32_t pixel, double t) {
  const double p = 0.37 * pixel;
  return {.log_light = 2.0 + 0.9 * std::sin(23.0 * t + p) + 0.5 * std::sin(61.0 * t + 2.0 * p) +
                       0.2 * std::sin(140.0 * t + 3.0 * p),
          .flow_pxps = 100.0};
}

TEST(EventPixels, SumsOfEventsFollowTheLightWithinAThreshold) {
  for (const char* first : {"light", "drawn"}) {
    Scene scene{.light = wavy, .duration_s = 0.5, .num_pixels = 60};
    // Its largest curvature is 6300 / s^2: a crest lies 3e-5 above the samples at most.
    scene.rule.longest_s = 2e-4;
    const PixelOptions options{
        .contrast_on = 0.15, .contrast_off = 0.22, .contrast_sd = 0.02, .first_reference = first};
    const Pixels model(options, scene.seed);
    const auto pixels = by_pixel(events_of(scene, model, 60));
    for (std::uint32_t pixel = 0; pixel < scene.num_pixels; ++pixel) {
      const Thresholds own = model.thresholds(pixel);
      double reference = model.start(pixel, wavy(pixel, 0.0).log_light).reference;
      auto next = pixels.at(pixel).begin();
      for (int i = 0; i <= 5000; ++i) {
        const double t = 1e-4 * i;
        for (; next != pixels.at(pixel).end() && seconds(*next) <= t; ++next)
          reference += next->is_on ? own.on : -own.off;
        const double change = wavy(pixel, t).log_light - reference;
        EXPECT_LT(change, own.on + 1e-4) << pixel << " at " << t;
        EXPECT_GT(change, -own.off - 1e-4) << pixel << " at " << t;
      }
    }
  }
}

TEST(EventPixels, ThresholdsAreDrawnOnceAPixelAndSign) {
  const PixelOptions options{.contrast_on = 0.3, .contrast_off = 0.2, .contrast_sd = 0.03};
  const Pixels model(options, 5);
  constexpr int kNumPixels = 40'000;
  double sum_on = 0.0, sum_off = 0.0, squares_on = 0.0, both = 0.0;
  for (std::uint32_t pixel = 0; pixel < kNumPixels; ++pixel) {
    const Thresholds own = model.thresholds(pixel);
    EXPECT_EQ(own.on, model.thresholds(pixel).on);
    const double on = (own.on - 0.3) / 0.03;
    const double off = (own.off - 0.2) / 0.03;
    sum_on += on;
    sum_off += off;
    squares_on += on * on;
    both += on * off;
  }
  // Means of 40 000 standard normal numbers, of their squares and of products: 4.5 standard errors.
  const double error = 4.5 / std::sqrt(kNumPixels);
  EXPECT_NEAR(sum_on / kNumPixels, 0.0, error);
  EXPECT_NEAR(sum_off / kNumPixels, 0.0, error);
  EXPECT_NEAR(squares_on / kNumPixels, 1.0, std::sqrt(2.0) * error);
  EXPECT_NEAR(both / kNumPixels, 0.0, error);
}

TEST(EventPixels, NoiseInTheDarkIsAPoissonProcess) {
  const Scene scene{.light = [](std::uint32_t, double) { return Look{.log_light = -20.0}; },
                    .duration_s = 2.0,
                    .num_pixels = 4000};
  const std::vector<Event> events = events_of(scene, PixelOptions{.shot_noise_hz = 3.0});
  // 6 a pixel: the sum scatters by its root, and the sum of squared deviations over the mean is chi-squared.
  constexpr double kMean = 6.0;
  const double expected = kMean * scene.num_pixels;
  EXPECT_NEAR(static_cast<double>(events.size()), expected, 4.5 * std::sqrt(expected));
  const auto pixels = by_pixel(events);
  double chi_squared = 0.0;
  int num_on = 0;
  for (std::uint32_t pixel = 0; pixel < scene.num_pixels; ++pixel) {
    const double count =
        pixels.contains(pixel) ? static_cast<double>(pixels.at(pixel).size()) : 0.0;
    chi_squared += (count - kMean) * (count - kMean) / kMean;
  }
  for (const Event& event : events) {
    EXPECT_TRUE(event.is_noise);
    num_on += event.is_on ? 1 : 0;
  }
  // A Poisson count's squared deviation over its mean scatters by sqrt(2 + 1 / mean).
  EXPECT_NEAR(chi_squared, scene.num_pixels,
              4.5 * std::sqrt((2.0 + 1.0 / kMean) * scene.num_pixels));
  EXPECT_NEAR(num_on, 0.5 * static_cast<double>(events.size()),
              4.5 * 0.5 * std::sqrt(static_cast<double>(events.size())));
}

TEST(EventPixels, LightLeavesItsShareOfTheNoise) {
  const PixelOptions options{
      .shot_noise_hz = 4.0, .shot_noise_in_light = 0.25, .bright_cd_per_m2 = 1000.0};
  const auto count = [&](double luminance) {
    const Scene scene{
        .light = [&](std::uint32_t, double) { return Look{.log_light = std::log(luminance)}; },
        .duration_s = 2.0,
        .num_pixels = 4000};
    return static_cast<double>(events_of(scene, options).size());
  };
  const auto expect_rate = [&](double luminance, double share) {
    const double expected = share * 4.0 * 2.0 * 4000.0;
    EXPECT_NEAR(count(luminance), expected, 4.5 * std::sqrt(expected)) << luminance;
  };
  expect_rate(1000.0, 0.25);
  expect_rate(5000.0, 0.25);
  expect_rate(500.0, 1.0 - 0.75 * 0.5);
}

TEST(EventPixels, LeakMakesEventsAtItsRate) {
  const Scene scene{.light = [](std::uint32_t, double) { return Look{.log_light = 1.0}; },
                    .duration_s = 2.0,
                    .num_pixels = 50};
  // Whatever the threshold, for that is what leaks.
  const auto pixels = by_pixel(
      events_of(scene, PixelOptions{.contrast_on = 0.3, .contrast_sd = 0.02, .leak_hz = 7.0}));
  for (const auto& [pixel, own] : pixels) {
    // The fourteenth comes at the end, to a rounding.
    ASSERT_GE(own.size(), 13U) << pixel;
    ASSERT_LE(own.size(), 14U) << pixel;
    for (std::size_t k = 0; k < own.size(); ++k) {
      EXPECT_TRUE(own[k].is_on);
      EXPECT_NEAR(seconds(own[k]), static_cast<double>(k + 1) / 7.0, 2e-9);
    }
  }
}

TEST(EventPixels, DeadPixelsKeepOrLoseWhatChanges) {
  // Events would come each 10 ms; a pixel sleeps for 25.
  const Scene scene{.light = [](std::uint32_t, double t) { return Look{.log_light = 20.0 * t}; },
                    .duration_s = 0.4,
                    .num_pixels = 1};
  const auto times = [&](const std::string& in_refractory) {
    std::vector<double> all;
    for (const Event& event :
         events_of(scene, PixelOptions{.refractory_us = 25e3, .in_refractory = in_refractory}))
      all.push_back(seconds(event));
    return all;
  };
  const std::vector<double> kept = times("kept");
  ASSERT_EQ(kept.size(), 16U);
  for (std::size_t k = 0; k < kept.size(); ++k)
    EXPECT_NEAR(kept[k], 0.010 + 0.025 * static_cast<double>(k), 2e-9);
  const std::vector<double> lost = times("lost");
  ASSERT_EQ(lost.size(), 12U);
  for (std::size_t k = 0; k < lost.size(); ++k)
    EXPECT_NEAR(lost[k], 0.010 + 0.035 * static_cast<double>(k), 2e-9);
}

TEST(EventPixels, TheLowPassDelaysAFlickeringLamp) {
  constexpr double kAmplitude = 1.3;
  constexpr double kCutoff_hz = 40.0;
  for (const double flicker_hz : {10.0, 40.0, 100.0}) {
    const double rate = 2.0 * kPi * flicker_hz;
    Scene scene{
        .light = [&](std::uint32_t,
                     double t) { return Look{.log_light = 5.0 + kAmplitude * std::sin(rate * t)}; },
        .duration_s = 1.0,
        .num_pixels = 1};
    scene.rule.longest_s = 4e-5;
    // Its gain and its phase: 1 / sqrt(1 + w^2) and -atan w, w = f / cutoff; and from rest a part that dies away.
    const double w = flicker_hz / kCutoff_hz;
    const double gain = 1.0 / std::sqrt(1.0 + w * w);
    const double a = 2.0 * kPi * kCutoff_hz;
    const auto answer = [&](double t) {
      return kAmplitude * gain *
             (std::sin(rate * t - std::atan(w)) + std::sin(std::atan(w)) * std::exp(-a * t));
    };
    double reference = 0.0;
    double worst_s = 0.0;
    int num_judged = 0;
    const std::vector<Event> events = events_of(
        scene, PixelOptions{.contrast_on = 0.11, .contrast_off = 0.11, .cutoff_hz = kCutoff_hz});
    for (const Event& event : events) {
      reference += event.is_on ? 0.11 : -0.11;
      const double t = seconds(event);
      const double speed = std::abs(answer(t + 1e-7) - answer(t - 1e-7)) / 2e-7;
      // Near a crest a level is crossed at any time.
      if (speed < 0.2 * kAmplitude * gain * rate) continue;
      ++num_judged;
      worst_s = std::max(worst_s, std::abs(answer(t) - reference) / speed);
    }
    EXPECT_GT(num_judged, 100) << flicker_hz;
    EXPECT_LT(worst_s, kMicrosecond) << flicker_hz;
  }
}

TEST(EventPixels, TheCutoffFallsWithTheLight) {
  // A step of 1e-6 of light shows its time constant by when the answer has gone half of its way: ln 2 / (2 pi cutoff).
  const auto half_time_s = [](double luminance) {
    const PixelOptions options{.contrast_on = 0.01,
                               .cutoff_hz = 200.0,
                               .cutoff_least_share = 0.1,
                               .bright_cd_per_m2 = 1000.0};
    const Pixels model(options, 1);
    PixelState state = model.start(0, std::log(luminance) - 0.02);
    std::vector<Event> events;
    const Cubic light{
        .start_s = 0.0, .length_s = 0.1, .coefficients = {std::log(luminance), 0, 0, 0}};
    model.advance(0, {&light, 1}, {.start_s = 0.0, .end_s = 0.1}, state, events);
    return events.empty() ? 0.0 : seconds(events.front());
  };
  for (const auto& [luminance, share] :
       {std::pair{1000.0, 1.0}, {5000.0, 1.0}, {500.0, 0.5}, {10.0, 0.1}})
    EXPECT_NEAR(half_time_s(luminance), std::log(2.0) / (2.0 * kPi * 200.0 * share), 1e-6)
        << luminance;
}

TEST(EventPixels, AnyBlocksGiveTheSameEventsInStrictOrder) {
  const Scene scene{.light = wavy, .duration_s = 0.3, .num_pixels = 97};
  const Pixels model({.contrast_sd = 0.03,
                      .refractory_us = 500.0,
                      .cutoff_hz = 300.0,
                      .cutoff_least_share = 0.1,
                      .leak_hz = 0.1,
                      .shot_noise_hz = 5.0,
                      .first_reference = "drawn"},
                     7);
  const std::vector<Event> whole = events_of(scene, model, 97);
  EXPECT_GT(whole.size(), 1000U);
  for (const std::uint32_t block_pixels : {1U, 7U, 16U})
    EXPECT_EQ(events_of(scene, model, block_pixels), whole) << block_pixels;
  std::map<std::uint32_t, std::int64_t> last;
  for (std::size_t i = 0; i < whole.size(); ++i) {
    if (i > 0) {
      EXPECT_GE(whole[i].time_ns, whole[i - 1].time_ns);
    }
    if (last.contains(whole[i].pixel)) {
      EXPECT_GE(whole[i].time_ns - last[whole[i].pixel], 500'000 - 1);
    }
    last[whole[i].pixel] = whole[i].time_ns;
  }
}

TEST(EventPixels, ALeapMakesAllItsEventsWithTimesOfTheirOwn) {
  Scene scene{
      .light = [](std::uint32_t, double t) { return Look{.log_light = t < 0.005 ? 0.0 : 5.0}; },
      .duration_s = 0.02,
      .num_pixels = 1};
  scene.rule = {.brightness_step = 0.1, .flow_step_px = 0.5, .finest_s = 1e-7};
  const std::vector<Event> events = events_of(scene, PixelOptions{.contrast_on = 0.0101});
  ASSERT_EQ(events.size(), 495U);
  for (std::size_t i = 1; i < events.size(); ++i)
    EXPECT_GT(events[i].time_ns, events[i - 1].time_ns);
}

TEST(LightCurve, TheFilterIsItsDifferentialEquation) {
  const Cubic cubic{.start_s = 1.0, .length_s = 0.01, .coefficients = {2.0, -30.0, 4e3, 9e5}};
  for (const double rate : {1e-3, 0.5, 20.0, 99.0, 101.0, 3e3, 1e6}) {
    const Filtered filtered(cubic, rate, 1.7);
    // Runge and Kutta's rule in steps far below both the filter's time and the cubic's.
    constexpr int kSteps = 40'000;
    const double h = cubic.length_s / kSteps;
    double u = 1.7;
    const auto slope = [&](double x, double value) { return rate * (cubic.at(x) - value); };
    for (int i = 0; i < kSteps; ++i) {
      const double x = h * i;
      const double k1 = slope(x, u);
      const double k2 = slope(x + 0.5 * h, u + 0.5 * h * k1);
      const double k3 = slope(x + 0.5 * h, u + 0.5 * h * k2);
      const double k4 = slope(x + h, u + h * k3);
      u += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
    }
    // The rule's own error is (rate h)^4 / 120 of the answer's change; 2e-5 at the highest rate only while it settles.
    EXPECT_NEAR(filtered.at(cubic.length_s), u, 1e-10) << rate;
    EXPECT_EQ(filtered.at(0.0), 1.7);
  }
}

TEST(LightCurve, StaysBetweenItsSamplesAndKeepsARamp) {
  std::vector<Cubic> curve;
  const std::vector<LightSample> samples = {
      {0.0, 0.0}, {0.1, 0.0}, {0.15, 3.0}, {0.4, 3.1}, {0.5, -2.0}};
  join_monotone(samples, std::nullopt, curve);
  ASSERT_EQ(curve.size(), 4U);
  for (std::size_t i = 0; i < curve.size(); ++i) {
    const double low = std::min(samples[i].log_light, samples[i + 1].log_light);
    const double high = std::max(samples[i].log_light, samples[i + 1].log_light);
    double last = curve[i].at(0.0);
    const double sign = samples[i + 1].log_light >= samples[i].log_light ? 1.0 : -1.0;
    for (int k = 0; k <= 100; ++k) {
      const double value = curve[i].at(curve[i].length_s * k / 100.0);
      EXPECT_GE(value, low - 1e-12);
      EXPECT_LE(value, high + 1e-12);
      EXPECT_GE(sign * (value - last), -1e-12);
      last = value;
    }
  }
  const std::vector<LightSample> ramp = {{1.0, 2.0}, {1.1, 2.5}, {1.4, 4.0}};
  join_monotone(ramp, LightSample{0.9, 1.5}, curve);
  EXPECT_NEAR(curve[1].at(0.123), 2.5 + 5.0 * 0.123, 1e-12);
}

TEST(AdaptiveSteps, EveryStepKeepsTheRule) {
  const StepRule rule{.brightness_step = 0.05, .flow_step_px = 0.5, .finest_s = 1e-5};
  const auto light = [](double t) {
    return Look{.log_light = 2.0 * std::tanh(300.0 * (t - 0.03)),
                .flow_pxps = t < 0.05 ? 20.0 : 400.0};
  };
  const LookAt look_at = [&](std::span<const LookPlace> places, std::span<Look> looks) {
    for (std::size_t i = 0; i < places.size(); ++i) looks[i] = light(places[i].time_s);
  };
  const TimedLook begin{.pixel = 4, .time_s = 0.0, .look = light(0.0)};
  const std::vector<TimedLook> looks = divide_time({&begin, 1}, 0.1, rule, look_at);
  ASSERT_GT(looks.size(), 50U);
  EXPECT_EQ(looks.back().time_s, 0.1);
  for (std::size_t i = 1; i < looks.size(); ++i) {
    const double length_s = looks[i].time_s - looks[i - 1].time_s;
    EXPECT_GT(length_s, 0.0);
    EXPECT_LE(std::abs(looks[i].look.log_light - looks[i - 1].look.log_light), 0.05);
    EXPECT_LE(length_s * std::max(looks[i].look.flow_pxps, looks[i - 1].look.flow_pxps), 0.5);
  }
}

}  // namespace
}  // namespace terracast::test
