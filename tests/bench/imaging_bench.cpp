// What a camera's imaging takes of a 1280 x 720 frame, part by part, on one thread.
//
//     terracast_bench --benchmark_filter=^imaging --benchmark_repetitions=5
//
// The light is noise about a slope; what it is does not change what is done.

#include <benchmark/benchmark.h>

#include "core/parallel.h"
#include "core/random.h"
#include "sensors/camera/imaging/imager.h"

namespace {

using namespace terracast;

constexpr int kWidth = 1280;
constexpr int kHeight = 720;

core::ImageF make_light() {
  core::ImageF light(kWidth, kHeight, 3);
  for (std::size_t i = 0; i < light.data().size(); ++i)
    light.data()[i] = static_cast<float>(static_cast<double>(i) / (4.0 * kWidth * kHeight) *
                                         core::random_unit(1, 2, i));
  return light;
}

void photograph(benchmark::State& state, const sensors::ImagingOptions& options) {
  const core::ThreadLimit one(1);
  const capture::CameraCalibration camera{
      .rig = "rig",
      .name = "camera",
      .intrinsics = {.width_px = kWidth,
                     .height_px = kHeight,
                     .parameters = {1000.0, 1000.0, 0.5 * kWidth, 0.5 * kHeight}},
      .rig_from_camera = {},
      .body_from_rig = {}};
  const auto model = geo::make_camera(camera.intrinsics);
  const sensors::Imager imager(options, camera, *model, 1, "P000", 1.0f, scene::Color::Ones());
  const core::ImageF light = make_light();
  int frame = 0;
  for (auto _ : state)
    benchmark::DoNotOptimize(imager.photograph(light, frame++, 0.0, scene::Color::Ones()));
}

sensors::ImagingOptions idle() {
  sensors::ImagingOptions options;
  options.color.gamma = 2.0;
  return options;
}

void imaging_idle(benchmark::State& state) { photograph(state, idle()); }
BENCHMARK(imaging_idle)->Unit(benchmark::kMillisecond);

void imaging_vignetting(benchmark::State& state) {
  sensors::ImagingOptions options = idle();
  options.lens.vignetting_exponent = 4.0;
  photograph(state, options);
}
BENCHMARK(imaging_vignetting)->Unit(benchmark::kMillisecond);

void imaging_chromatic(benchmark::State& state) {
  sensors::ImagingOptions options = idle();
  options.lens.red_scale_permille = 1.0;
  options.lens.blue_scale_permille = -1.0;
  photograph(state, options);
}
BENCHMARK(imaging_chromatic)->Unit(benchmark::kMillisecond);

void imaging_bloom(benchmark::State& state) {
  sensors::ImagingOptions options = idle();
  options.lens.veiling_glare = 0.02;
  options.lens.bloom = 0.05;
  photograph(state, options);
}
BENCHMARK(imaging_bloom)->Unit(benchmark::kMillisecond);

void imaging_soiling(benchmark::State& state) {
  sensors::ImagingOptions options = idle();
  options.soiling.smudges = 3;
  options.soiling.dirt_spots = 20;
  photograph(state, options);
}
BENCHMARK(imaging_soiling)->Unit(benchmark::kMillisecond);

/// With shot and reading noise.
void imaging_sensor(benchmark::State& state, bool has_fixed_pattern, const char* mosaic) {
  sensors::ImagingOptions options = idle();
  options.sensor = {.bits = 12, .full_well_e = 10000.0, .read_noise_e = 3.0};
  if (has_fixed_pattern) {
    options.sensor.prnu_percent = 1.0;
    options.sensor.dsnu_e = 2.0;
    options.sensor.hot_share = 1e-5;
  }
  options.sensor.mosaic = mosaic;
  photograph(state, options);
}
BENCHMARK_CAPTURE(imaging_sensor, three_colors, false, "")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(imaging_sensor, with_fixed_patterns, true, "")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(imaging_sensor, mosaic, true, "rggb")->Unit(benchmark::kMillisecond);

}  // namespace
